"""The figures of a report: what is drawn, and the words around it, as plain text."""

from __future__ import annotations

import math

import numpy as np

from sosmith.gen.filter.response import FilterFacts, poles
from sosmith.gen.filter.step_response import SETTLED, StepResponse
from sosmith.gen.output.core_facts import CoreFacts
from sosmith.gen.output.decimation_facts import DecimationFacts
from sosmith.gen.quantity import count, full_scale_level, plain_number, quantity
from sosmith.gen.report.behaviour import Behaviour
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.figures import filter_plots, painting, run_plots
from sosmith.gen.report.figures.diagram import diagram
from sosmith.gen.report.figures.figure import Figure, Figures, Realized, amount, error_unit
from sosmith.gen.report.figures.spectrum_plot import LEAST_SPECTRUM, spectrum_figure
from sosmith.gen.report.figures.step_plot import step_figure
from sosmith.gen.report.headlines import unbroken
from sosmith.gen.report.largest_error import Limit, close_up, error_limits
from sosmith.gen.report.recursion import Recursion
from sosmith.model.full_scale import peak_dbfs


def figures_of(shown: Evidence, measured: Behaviour, *, sound: bool) -> Figures:
    """Draw all figures of a report.

    Parameters
    ----------
    shown : Evidence
        What the report shows, of one channel.
    measured : Behaviour
        What all channels say about the core.
    sound : bool
        Whether it is a run of sound, which has a spectrum.
    """
    facts, run = shown.facts, shown.run
    figures: dict[str, Figure | None] = {}
    if shown.rivals:
        figures["alternatives"] = _alternatives_figure(shown)
    if facts.filter is not None:
        figures |= _filter_figures(facts, facts.filter, facts.decimation)
        figures["step"] = None if measured.step is None else _step_figure(measured.step)
    if sound and len(run) - (0 if run.tone is None else run.tone.settled) >= LEAST_SPECTRUM:
        figures["spectrum"] = _spectrum_figure(shown)
    figures["trace"] = _trace_figure(shown, measured.transient)
    figures["close_up"] = _close_up_figure(shown)
    figures["error"] = _error_figure(shown)
    figures["histogram"] = _histogram_figure(shown)
    return Figures(figures, [_realized(recursion) for recursion in shown.recursions])


def _trace_figure(evidence: Evidence, transient: int) -> Figure:
    legend = [("golden", "broad", "exact calculation"), ("hardware", "dashed", "hardware")]
    if evidence.run.truth is not None:
        legend.append(("truth", "broad", "true value"))
    if evidence.run.before is not None:
        legend.append(("unfiltered", "", "without the filter"))
    if evidence.facts.settling is not None:
        legend.append(
            ("muted", "area", f"settling from the start at zero, {quantity(evidence.facts.settling.seconds, 's')}")
        )
    caption = (
        "The hardware, in blue, should lie on the orange line of the exact calculation "
        "(double precision, unrounded coefficients, the same input codes)."
    )
    if evidence.run.truth is not None and evidence.facts.filter is not None:
        caption += (
            " Below, hardware minus true value: the noise that the filter lets through, and its delay. "
            "Rounding has next to no part in it."
        )
    if evidence.run.shown_channel is not None:
        caption += (
            f" All pictures show channel {evidence.run.shown_channel:,}, the one of {evidence.run.channels:,} "
            "with the largest error; the figures above are of all channels."
        )
    return Figure(
        drawing=run_plots.trace_figure(evidence, transient, painting.WIDE),
        narrow=run_plots.trace_figure(evidence, transient, painting.NARROW),
        caption=caption,
        legend=legend,
    )


def _close_up_figure(evidence: Evidence) -> Figure:
    near = close_up(evidence)
    return Figure(
        title="Around the largest error",
        drawing=run_plots.close_up_figure(evidence, painting.WIDE),
        narrow=run_plots.close_up_figure(evidence, painting.NARROW),
        caption=f"{count(near.stop - near.start, 'sample')} of the same curves; the dotted line marks the largest "
        f"error. The output moves in steps of {amount(evidence.facts.lsb, evidence.facts.unit)}.",
        legend=[("golden", "broad", "exact calculation"), ("hardware", "dot", "hardware")],
    )


def _spectrum_figure(evidence: Evidence) -> Figure:
    return Figure(
        title="Spectrum",
        drawing=spectrum_figure(evidence, painting.WIDE),
        narrow=spectrum_figure(evidence, painting.NARROW),
        caption="Mean over the run, by Welch's method: a sine over the whole scale reaches 0 dBFS. The level of noise "
        "goes with the width of a line; compare its shapes, and the curves with each other.",
        legend=[("hardware", "", "hardware"), ("golden", "", "hardware minus exact calculation")],
    )


def _limit_words(evidence: Evidence, limit: Limit) -> str:
    level = f", {unbroken(full_scale_level(peak_dbfs(limit.value)))}" if evidence.facts.is_sound else ""
    return f"{limit.words} ±{error_unit(evidence).amount(limit.value)}{level}"


def _error_figure(evidence: Evidence) -> Figure:
    inside, outside = error_limits(evidence)
    legend = [("hardware", "", "hardware minus exact calculation")]
    legend += [
        (
            limit.role,
            "dashed" if limit.dashes == "--" else "dotted",
            _limit_words(evidence, limit),
        )
        for limit in inside
    ]
    caption = "The curve must stay between the limits."
    if len(evidence.run) > painting.WIDE // 2:
        caption = "Smallest and largest error of each stretch of time; both must stay between the limits."
    if outside:
        names = " and ".join(_limit_words(evidence, limit) for limit in outside)
        caption += f" Too far out to draw: {names}."
    if evidence.run.first_mismatch is not None:
        caption += (
            f" The upright line marks sample {evidence.run.first_mismatch:,}, "
            "the first at which hardware and integer model differ."
        )
    return Figure(
        title="Over time",
        drawing=run_plots.error_figure(evidence, painting.WIDE),
        narrow=run_plots.error_figure(evidence, painting.NARROW),
        caption=caption,
        legend=legend,
    )


def histogram_caption(evidence: Evidence) -> str:
    """Say how many errors the rounding of the output alone could explain."""
    inside = float(np.mean(np.abs(evidence.run.error) <= evidence.facts.lsb / 2))
    if inside == 1:
        sentence = (
            "All samples lie between the dotted lines at ±½\u00a0LSB, where rounding the output alone leaves them."
        )
    else:
        share = f"{100 * inside:.3g}" if inside < 0.995 else "More than 99"
        sentence = (
            f"{share} % of the samples lie between the dotted lines at ±½\u00a0LSB, as far as rounding the output "
            "alone reaches; to the others, errors from before the output have added."
        )
    return f"One LSB is {amount(evidence.facts.lsb, evidence.facts.unit)}. {sentence}"


def _histogram_figure(evidence: Evidence) -> Figure:
    return Figure(
        title="How often each error occurs",
        drawing=run_plots.histogram_figure(evidence),
        caption=histogram_caption(evidence),
    )


def _alternatives_figure(evidence: Evidence) -> Figure:
    return Figure(
        title="What the realization is worth",
        drawing=run_plots.alternatives_figure(evidence),
        caption="Same word lengths, same inputs; only what becomes of the rounding errors inside the sections "
        "differs. Mind the scale: each grid line is a step by the same factor.",
        legend=[("muted", "dotted", "one LSB"), ("asked", "dotted", "allowed by the specification")],
    )


def _least_gain(core: CoreFacts) -> float:
    """Return the gain in dB with which the largest input, or result of a calibration, leaves half an LSB of output."""
    low, high = core.range
    (reach, *_) = [float(each.port.lsb * (1 << each.port.bits)) / 2 for each in core.interface.inputs.fields]
    return 20 * math.log10(core.lsb / 2 / (reach if core.core == "filter" else (high - low) / 2))


def _filter_figures(core: CoreFacts, facts: FilterFacts, decimation: DecimationFacts | None) -> dict[str, Figure]:
    least = _least_gain(core)
    legend = [("golden", "broad", "ideal filter"), ("hardware", "dashed", "integer coefficients")]
    masked = (facts.passband_edge and facts.passband_loss) or (facts.stopband_edge and facts.stopband_loss)
    mask = [("limit", "area", "forbidden by the specification")] if masked else []
    drawn = least > filter_plots.lowest_gain_db(facts, least)
    below = [("asked", "dotted", "the largest input leaves half an LSB")] if drawn else []
    alone = "" if decimation is None else " Of the filter alone, behind the decimator."
    later = "" if decimation is None else f" That adds {amount(decimation.own_delay, 's')}."
    return {
        "gain": Figure(
            title="Gain",
            drawing=filter_plots.magnitude_figure(facts, least),
            caption=f"Rounding the coefficients bends the ideal curve by the difference drawn below it.{alone}",
            legend=legend + mask + below,
        ),
        "phase": Figure(
            title="Phase",
            drawing=filter_plots.phase_figure(facts, least),
            caption=f"Where the gain is drawn. At a zero on the unit circle the phase jumps by 180°.{alone}",
            legend=legend,
        ),
        "delay": Figure(
            title="Group delay",
            drawing=filter_plots.delay_figure(facts),
            caption=f"How much later a slow change of each frequency appears at the output.{alone}{later}",
            legend=legend,
        ),
        "plane": Figure(
            title="Poles and zeros",
            drawing=filter_plots.pole_zero_figure(facts),
            caption=f"{_marks(facts)} Where blue covers orange, rounding has not moved it.",
            legend=[("golden", "", "ideal filter"), ("hardware", "", "integer coefficients")],
        ),
    }


def _marks(facts: FilterFacts) -> str:
    """Return what the marks in the z plane are."""
    if len(poles(facts.quantized_sos)):
        return "Crosses are poles, rings are zeros; inside the unit circle a pole is stable."
    return "Rings are zeros. All poles are at 0, where they are stable, and are not drawn."


def _step_figure(step: StepResponse) -> Figure:
    legend = [
        ("hardware", "", "integer coefficients"),
        ("truth", "area", f"within {100 * SETTLED:g} % of the {'end' if step.passes_constants else 'peak'}"),
        ("limit", "dashed", f"settled after {amount(step.samples_to(SETTLED) / step.sample_rate, 's')}"),
    ]
    if step.overshoot:
        legend.append(("asked", "dot", f"overshoot {plain_number(100 * step.overshoot)} %"))
    return Figure(
        title="Step response",
        drawing=step_figure(step),
        caption="How the output follows a sudden change, from rest.",
        legend=legend,
    )


def _realized(recursion: Recursion) -> Realized:
    return Realized(
        section=recursion.section,
        diagram=diagram(recursion),
        equations=[equation.words for equation in recursion.equations],
        coefficients=[f"{each.name} = {each.words}" for each in recursion.coefficients],
    )
