"""The report as one HTML page that stands alone: nothing from elsewhere, and all but the zoom without its script.

This module says what stands on the page, as plain text; the templates make markup of it, and escape it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sosmith.gen.facts.design_tables import ErrorUnit, budget_table, limit_cycles_table, uncertainty_table
from sosmith.gen.facts.table import Table
from sosmith.gen.filter.decimation import SAMPLED
from sosmith.gen.filter.response import FilterFacts, poles
from sosmith.gen.filter.step_response import SETTLED, StepResponse
from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.output.core_facts import CoreFacts
from sosmith.gen.output.decimation_facts import DecimationFacts
from sosmith.gen.quantity import count, decibels, duration, full_scale_level, plain_number, quantity, scale, unit_symbol
from sosmith.gen.report import plots
from sosmith.gen.report.behaviour import behaviour
from sosmith.gen.report.diagram import diagram
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.headlines import SIMULATION, Summary, unbroken
from sosmith.gen.report.recursion import Recursion
from sosmith.gen.report.samples import MAX_POINTS, viewer_data
from sosmith.gen.report.spectrum_plot import LEAST_SPECTRUM, spectrum_figure
from sosmith.gen.report.step_plot import step_figure
from sosmith.gen.specification.values import listed
from sosmith.gen.version import __version__
from sosmith.model.full_scale import peak_dbfs
from sosmith.model.templates import render


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A drawing with title, legend and caption.

    Attributes
    ----------
    title, caption : str
        Plain text; the title may be empty.
    drawing : str
        SVG.
    narrow : str
        The same drawing for narrow pages, or ``""`` if one fits all.
    legend : sequence of (str, str, str)
        Role (a colour of the style sheet), shape of the key (a class of it), and words of each entry.
    """

    title: str = ""
    drawing: str
    narrow: str = ""
    caption: str
    legend: Sequence[tuple[str, str, str]] = ()


def _unit(evidence: Evidence) -> ErrorUnit:
    return ErrorUnit.of(evidence.facts, "\u00a0")


def _amount(value: float | None, unit: str) -> str:
    return unbroken(quantity(value, unit))


def _reasons(evidence: Evidence, summary: Summary) -> list[str]:
    """Sentences of the verdict."""
    if not summary["passed"]:
        return list(summary["shortfalls"])
    unit = _unit(evidence)
    error, bound = (unit.amount(value) for value in (summary["error"]["max_abs"], evidence.facts.error_bound))
    ran = "hardware" if evidence.gates is None else f"netlist for the {evidence.gates.board.title}"
    arithmetic = (
        f"The simulated {ran} agrees with its integer model bit for bit, and stays within {error} "
        f"of the exact calculation; the proven limit is {bound}."
    )
    return [f"{arithmetic}{_of_the_signal(evidence, summary, bound)}{_of_the_sound(summary)}"]


def _of_the_signal(evidence: Evidence, summary: Summary, bound: str) -> str:
    """Tell the error of the signal from that of the arithmetic, which alone decides; empty without a true value."""
    if summary["true_error"] is None:
        return ""
    off = _amount(summary["true_error"]["max_abs"], evidence.facts.unit)
    causes = [] if evidence.facts.core == "filter" else ["the sensor", "its calibration"]
    causes += [] if evidence.facts.filter is None else ["the delay of the filter", "the noise that passes it"]
    return (
        f" This is about the arithmetic. The output is off by up to {off} from the true value, and the hardware adds "
        f"at most {bound} of that: the rest is in the exact calculation as well, from {listed(causes)}."
    )


def _of_the_sound(summary: Summary) -> str:
    """Say the same in dB of full scale, and what becomes of a tone; empty for what is not sound."""
    sound = summary["sound"]
    if sound is None:
        return ""
    most, mean = (unbroken(full_scale_level(sound[key])) for key in ("error_peak_dbfs", "error_rms_dbfs"))
    text = f" In dB of full scale, the error is at most {most}, and {mean} RMS."
    tone = sound["tone"]
    if tone is None or tone["thd_n_db"] is None:
        return text
    exact = "nothing" if tone["exact_thd_n_db"] is None else unbroken(decibels(tone["exact_thd_n_db"]))
    return (
        f"{text} Beside the tone of {_amount(tone['frequency'], 'Hz')}, distortion and noise are at "
        f"{unbroken(decibels(tone['thd_n_db']))} of it; rounding the input alone leaves {exact}."
    )


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
        drawing=plots.trace_figure(evidence, transient, plots.WIDE),
        narrow=plots.trace_figure(evidence, transient, plots.NARROW),
        caption=caption,
        legend=legend,
    )


def _close_up_figure(evidence: Evidence) -> Figure:
    near = plots.close_up(evidence)
    return Figure(
        title="Around the largest error",
        drawing=plots.close_up_figure(evidence, plots.WIDE),
        narrow=plots.close_up_figure(evidence, plots.NARROW),
        caption=f"{count(near.stop - near.start, 'sample')} of the same curves; the dotted line marks the largest "
        f"error. The output moves in steps of {_amount(evidence.facts.lsb, evidence.facts.unit)}.",
        legend=[("golden", "broad", "exact calculation"), ("hardware", "dot", "hardware")],
    )


def _looks(evidence: Evidence) -> Figure:
    """Legend and caption of the viewer, which has no drawing of its own."""
    known = [("golden", "broad", "exact calculation", True), ("hardware", "", "hardware", True)]
    known.append(("truth", "broad", "true value", evidence.run.truth is not None))
    known.append(("unfiltered", "", "without the filter", evidence.run.before is not None))
    stride = -(-len(evidence.run) // MAX_POINTS)
    thinned = "" if stride == 1 else f" Of each {stride} samples, the one with the largest error is held here."
    return Figure(
        drawing="",
        caption="Point at a sample to read it out; drag over a part to zoom into it, double-click for all. Keys: "
        f"arrows, plus and minus, 0 for all, Home for the largest error.{thinned}",
        legend=[(role, shape, words) for role, shape, words, shown in known if shown],
    )


def _spectrum_figure(evidence: Evidence) -> Figure:
    return Figure(
        title="Spectrum",
        drawing=spectrum_figure(evidence, plots.WIDE),
        narrow=spectrum_figure(evidence, plots.NARROW),
        caption="Mean over the run, by Welch's method: a sine over the whole scale reaches 0 dBFS. The level of noise "
        "goes with the width of a line; compare its shapes, and the curves with each other.",
        legend=[("hardware", "", "hardware"), ("golden", "", "hardware minus exact calculation")],
    )


def _limit_words(evidence: Evidence, limit: plots.Limit) -> str:
    level = f", {unbroken(full_scale_level(peak_dbfs(limit.value)))}" if evidence.facts.is_sound else ""
    return f"{limit.words} ±{_unit(evidence).amount(limit.value)}{level}"


def _error_figure(evidence: Evidence) -> Figure:
    inside, outside = plots.error_limits(evidence)
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
    if len(evidence.run) > plots.WIDE // 2:
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
        drawing=plots.error_figure(evidence, plots.WIDE),
        narrow=plots.error_figure(evidence, plots.NARROW),
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
    return f"One LSB is {_amount(evidence.facts.lsb, evidence.facts.unit)}. {sentence}"


def _histogram_figure(evidence: Evidence) -> Figure:
    return Figure(
        title="How often each error occurs",
        drawing=plots.histogram_figure(evidence),
        caption=histogram_caption(evidence),
    )


def _alternatives_figure(evidence: Evidence) -> Figure:
    return Figure(
        title="What the realization is worth",
        drawing=plots.alternatives_figure(evidence),
        caption="Same word lengths, same inputs; only what becomes of the rounding errors inside the sections "
        "differs. Mind the scale: each grid line is a step by the same factor.",
        legend=[("muted", "dotted", "one LSB"), ("asked", "dotted", "allowed by the specification")],
    )


def _alternatives_table(evidence: Evidence, summary: Summary) -> Table:
    errors = [(f"{evidence.realization} (this design)", summary["error"]["max_abs"], summary["error"]["rms"])]
    errors += [(other.name, other.max_abs, other.rms) for other in evidence.rivals]
    unit = _unit(evidence)
    rows = [
        (name, unit.number(largest), plain_number(largest / evidence.facts.lsb), unit.number(rms))
        for name, largest, rms in errors
    ]
    head = ("realization", unit.titled("largest error"), "in LSB", unit.titled("RMS"))
    return Table("", rows, head, numbers=(1, 2, 3))


def _uncertainty_caption(budget: Mapping[str, Any]) -> str:
    at, unit = budget["at"], budget["unit"]
    smallest, largest = (plain_number(budget["expanded"][key]) for key in ("smallest", "largest"))
    text = (
        f"{100 * budget['probability']:g} % of readings are within ±{smallest} to ±{largest} {unit} of the true value. "
        f"The table is for {plain_number(at['clearance'])} {unit}, at {plain_number(at['voltage_V'])} V and "
        f"{plain_number(at['temperature_C'])} °C, where it is largest."
    )
    return text + (f" Not stated: {', '.join(budget['not_stated'])}." if budget["not_stated"] else "")


_BANDS = 8
"""Bands of a decimator that are listed one by one; the gain falls from band to band."""


def _decimation_table(decimation: DecimationFacts) -> Table:
    """Tell what folds from each band around a multiple of the lower rate, into the pass band and anywhere."""
    shown, others = decimation.aliasing[:_BANDS], decimation.aliasing[_BANDS:]
    rows = [
        (
            f"{_hertz((band.whole_low,))} to {_hertz((band.whole_high,))}",
            decibels(band.largest_db),
            _amount(band.largest_at, "Hz"),
            f"{_hertz((band.low,))} to {_hertz((band.high,))}",
            decibels(band.passing_db),
        )
        for band in shown
    ]
    if others:
        whole, part = (max(levels) for levels in zip(*((b.largest_db, b.passing_db) for b in others), strict=True))
        end = _hertz((others[-1].high,))
        rows.append((f"{len(others)} more, up to {end}", decibels(whole), "", f"up to {end}", decibels(part)))
    head = ("from", "gain at most", "comes out at", "into the pass band from", "gain into it at most")
    return Table("", rows, head, numbers=(1, 2, 4))


def _decimation_caption(decimation: DecimationFacts, unit: str) -> str:
    worst, rate = _amount(decimation.worst_aliasing, unit), _hertz((decimation.sample_rate,))
    repeated = ", which leaves as many times" if decimation.held else ""
    before = decimation.calibration
    calibrated = "" if before is None else f"Every sample is calibrated first, within {_amount(before.error, unit)}. "
    what = "the input" if before is None else "the calibration's result"
    return (
        f"{calibrated}{decimation.factor} samples make one result{repeated}, by {count(decimation.stages, 'stage')} of "
        f"integrators and combs of {decimation.width} bits, and the filter works at {rate}. A sine over the whole "
        f"range of {what} in one of the bands on the right leaves the filter in the pass band with an amplitude of "
        f"at most {worst}; one at any frequency from half that rate on leaves the filter, wherever it folds, with at "
        f"most {_amount(decimation.largest, unit)} ({decibels(decimation.largest_db)}), where a filter without a "
        f"decimator has {decibels(decimation.direct_largest_db)}. At {SAMPLED} frequencies in the pass band the gain "
        f"is within {plain_number(decimation.deviation_db)} dB of that without a decimator, and decimator and "
        f"filter together delay by {_amount(decimation.delay, 's')}."
    )


def _hertz(edges: Sequence[float]) -> str:
    """Frequencies as they were asked for, to seven digits, without trailing zeros."""
    scaled = [(edge, *scale(edge, "Hz")) for edge in edges]
    return " and ".join(f"{edge * factor:.7g} {unit}" for edge, factor, unit in scaled)


def _response_table(facts: FilterFacts, measures: Mapping[str, float | None]) -> Table:
    rows = [
        ("largest deviation in the passband", decibels(measures["max_deviation_db_passband"])),
        ("largest loss in the passband", decibels(measures["passband_loss_db"])),
    ]
    if facts.passband_edge and facts.passband_loss is not None:
        rows.append((f"allowed up to {_hertz(facts.passband_edge)}", f"{facts.passband_loss:g} dB"))
    rows.append(("smallest loss in the stopband", decibels(measures["stopband_attenuation_db"])))
    if facts.stopband_edge and facts.stopband_loss is not None:
        rows.append((f"asked for from {_hertz(facts.stopband_edge)}", f"{facts.stopband_loss:g} dB"))
    if facts.cutoff:
        rows.append(("cut-off", _hertz(facts.cutoff)))
    radius = measures["largest_pole_radius"]
    rows.append(("sampling frequency", _hertz((facts.sample_rate,))))
    rows.append(("largest pole radius", "—" if radius is None else f"{radius:.7f}"))
    return Table("", rows, ("with the integer coefficients", ""), numbers=(1,))


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
    drawn = least > plots.lowest_gain_db(facts, least)
    below = [("asked", "dotted", "the largest input leaves half an LSB")] if drawn else []
    alone = "" if decimation is None else " Of the filter alone, behind the decimator."
    later = "" if decimation is None else f" That adds {_amount(decimation.own_delay, 's')}."
    return {
        "gain": Figure(
            title="Gain",
            drawing=plots.magnitude_figure(facts, least),
            caption=f"Rounding the coefficients bends the ideal curve by the difference drawn below it.{alone}",
            legend=legend + mask + below,
        ),
        "phase": Figure(
            title="Phase",
            drawing=plots.phase_figure(facts, least),
            caption=f"Where the gain is drawn. At a zero on the unit circle the phase jumps by 180°.{alone}",
            legend=legend,
        ),
        "delay": Figure(
            title="Group delay",
            drawing=plots.delay_figure(facts),
            caption=f"How much later a slow change of each frequency appears at the output.{alone}{later}",
            legend=legend,
        ),
        "plane": Figure(
            title="Poles and zeros",
            drawing=plots.pole_zero_figure(facts),
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
        ("limit", "dashed", f"settled after {_amount(step.samples_to(SETTLED) / step.sample_rate, 's')}"),
    ]
    if step.overshoot:
        legend.append(("asked", "dot", f"overshoot {plain_number(100 * step.overshoot)} %"))
    return Figure(
        title="Step response",
        drawing=step_figure(step),
        caption="How the output follows a sudden change, from rest.",
        legend=legend,
    )


@dataclass(frozen=True)
class Realized:
    """A section as it is realized: its block diagram, its equations and its coefficients, in lines."""

    section: str
    diagram: str
    equations: Sequence[str]
    coefficients: Sequence[str]


def _realized(recursion: Recursion) -> Realized:
    return Realized(
        section=recursion.section,
        diagram=diagram(recursion),
        equations=[equation.words for equation in recursion.equations],
        coefficients=[f"{each.name} = {each.words}" for each in recursion.coefficients],
    )


def _coefficient_table(evidence: Evidence) -> Table:
    rows = []
    for section in evidence.facts.sections:
        for index, coefficient in enumerate(section.coefficients):
            rows.append(
                (
                    section.name if index == 0 else "",
                    coefficient.name,
                    format(coefficient.integer, ",").replace("-", "−"),
                    str(coefficient.frac),
                    format(coefficient.value, ".10g").replace("-", "−"),
                )
            )
    head = ("section", "", "integer", "fractional bits", "value")
    return Table("", rows, head, numbers=(2, 3, 4), code=(1, 2, 4))


def _format_table(evidence: Evidence) -> Table:
    """List the formats by stage."""
    rows, previous = [], ""
    for row in evidence.facts.formats:
        title = "" if row.stage == previous else row.stage
        rows.append((title, row.node, row.format, _amount(row.low, row.unit), _amount(row.high, row.unit)))
        previous = row.stage
    return Table("", rows, ("stage", "signal", "format", "from", "to"), numbers=(3, 4), code=(2,))


def _netlist_in_words(netlist: Netlist) -> str:
    cells = ", ".join(f"{number:,} {kind}" for kind, number in netlist.cells.items())
    return f"the netlist for the {netlist.board.title}, {netlist.board.device.title}: {cells}"


def _evidence_tables(evidence: Evidence) -> tuple[Table, Table]:
    """List with their SHA-256 what the run is given, and what else was made or derived for it."""
    given, derived = [], []
    known = evidence.provenance
    if known is not None:
        given.append(("specification", evidence.specification or "given as values", known.specification_sha256))
        derived = [
            ("exact calculation", "inputs, polynomial, ideal sections, output", known.reference_sha256),
            ("datapath", "integer model", known.datapath_sha256),
        ]
    certificate = [name for name in evidence.files if name.endswith(".certificate.json")]
    given += [("certificate", name, evidence.files[name]) for name in certificate]
    given += [] if known is None else [("trace", evidence.run.scenario, known.trace_sha256)]
    others = [name for name in evidence.files if name not in certificate]
    derived += [("" if k else "generated files", name, evidence.files[name]) for k, name in enumerate(others)]
    head = ("", "", "SHA-256")
    return Table("", given, head, code=(2,)), Table("", derived, head, code=(2,))


def _evidence_facts(evidence: Evidence) -> list[tuple[str, str]]:
    tools = [(name, version) for name, version in evidence.tools.items()]
    return [("date", evidence.date or "not given"), ("sosmith", __version__), *tools, ("seed", str(evidence.seed))]


def _run_facts(evidence: Evidence) -> list[tuple[str, str]]:
    span = evidence.run.at(-1) - evidence.run.at(0)
    return [
        ("trace", f"{evidence.run.scenario}, {duration(span)}"),
        ("samples", f"{evidence.run.samples:,}"),
        ("channels", f"{evidence.run.channels:,}"),
        ("clock cycles", f"{evidence.run.cycles:,}"),
        ("latency", count(evidence.facts.interface.latency_cycles, "cycle")),
        ("realization", evidence.realization),
        ("architecture", evidence.facts.architecture),
        (
            "output range",
            f"{' to '.join(map(plain_number, evidence.facts.range))} {unit_symbol(evidence.facts.unit)}".rstrip(),
        ),
        ("simulator", evidence.simulator),
        *([] if evidence.gates is None else [("what ran", _netlist_in_words(evidence.gates))]),
    ]


def render_page(evidence: Evidence, summary: Summary) -> str:
    """Return the whole page; `summary` is what `sosmith.gen.report.report.summarise` makes of `evidence`."""
    shown, facts = evidence.shown, evidence.facts
    measured = behaviour(evidence)
    given, derived = _evidence_tables(shown)
    parts: dict[str, Any] = {}
    if shown.uncertainty is not None:
        parts["uncertainty"] = uncertainty_table(shown.uncertainty)
        parts["uncertainty_caption"] = _uncertainty_caption(shown.uncertainty)
    if shown.rivals:
        parts["alternatives"] = _alternatives_figure(shown)
        parts["alternatives_table"] = _alternatives_table(shown, summary)
    if shown.facts.filter is not None:
        parts |= _filter_figures(shown.facts, shown.facts.filter, evidence.facts.decimation)
        parts["step"] = None if measured.step is None else _step_figure(measured.step)
        parts["response"] = _response_table(shown.facts.filter, summary["frequency_response"])
    if (
        summary["sound"] is not None
        and len(shown.run) - (0 if shown.run.tone is None else shown.run.tone.settled) >= LEAST_SPECTRUM
    ):
        parts["spectrum"] = _spectrum_figure(shown)
    if evidence.facts.decimation is not None:
        parts["decimation"] = _decimation_table(evidence.facts.decimation)
        parts["decimation_caption"] = _decimation_caption(evidence.facts.decimation, evidence.facts.unit)
    return render(
        "sosmith.gen.report",
        "report.html.jinja",
        evidence=shown,
        summary=summary,
        reasons=_reasons(evidence, summary),
        unbroken=unbroken,
        given=given,
        derived=derived,
        given_facts=_evidence_facts(shown),
        trace=_trace_figure(shown, measured.transient),
        close_up=_close_up_figure(shown),
        looks=_looks(shown),
        samples=viewer_data(shown, measured.transient),
        error=_error_figure(shown),
        histogram=_histogram_figure(shown),
        budget=budget_table(facts.error_parts, facts.max_error, facts.lsb, facts.unit),
        limit_cycles=limit_cycles_table(facts.limit_cycles, facts),
        realized=[_realized(recursion) for recursion in shown.recursions],
        coefficients=_coefficient_table(shown),
        formats=_format_table(shown),
        facts=_run_facts(shown),
        simulation=[
            (fact["name"].lower(), f"{fact['text']}; {fact['sentence']}")
            for group in summary["facts"]
            if group["title"] == SIMULATION
            for fact in group["facts"]
        ],
        shown_groups=[group for group in summary["facts"] if group["title"] != SIMULATION],
        count=count,
        **parts,
    )
