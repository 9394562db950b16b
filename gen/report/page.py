"""The report as one HTML page that stands alone: no script, no font, no picture from elsewhere.

This module says what stands on the page, as plain text; the templates make markup of it, and escape it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.quantity import count, decibels, duration, plain_number, quantity, scale, unit_symbol
from sosmith.gen.report import plots
from sosmith.gen.report.evidence import Evidence
from sosmith.model.templates import render

Summary = Mapping[str, Any]


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


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of plain text.

    Attributes
    ----------
    head : sequence of str
        Titles of the columns.
    rows : sequence of sequence of str
        Cells of the rows; the first is the row's title, empty where it is that of the row above.
    numbers, code : collection of int
        Columns set flush right, and columns set in monospace.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Collection[int] = ()
    code: Collection[int] = ()


@dataclass(frozen=True)
class Tile:
    """A headline figure: its name, its value, lines below it, and the share of its limit if it has one."""

    name: str
    value: str
    asides: Sequence[str]
    share: float | None = None


def amount(value: float | None, unit: str) -> str:
    """Return a quantity that is not broken across lines."""
    return quantity(value, unit).replace(" ", "\u00a0")


def _percent(value: float) -> str:
    return f"{value:.3f}\u00a0%".replace("-", "−")


def _lsb(steps: float) -> str:
    return f"{plain_number(steps)} LSB"


def _error_tile(evidence: Evidence, summary: Summary) -> Tile:
    error = summary["error"]
    share = error["max_abs"] / evidence.bound
    limit = f"{100 * share:.0f} % of the limit {amount(evidence.bound, evidence.unit)}"
    aside = f"{_lsb(error['max_lsb'])} · {limit}"
    return Tile("Largest error", amount(error["max_abs"], evidence.unit), [aside], share)


def _accuracy_tile(summary: Summary) -> Tile | None:
    """Tile of the paper's accuracy; where no truth is known, of the filter's."""
    accuracy = summary["accuracy_percent"]
    if accuracy["hardware"] is not None:
        apart = amount(abs(accuracy["hardware"] - accuracy["golden"]), "")
        asides = [f"exact calculation {_percent(accuracy['golden'])}, {apart} points apart"]
        if accuracy["unfiltered"] is not None:
            asides.append(f"without the filter {_percent(accuracy['unfiltered'])}")
        return Tile("Accuracy against the true value", _percent(accuracy["hardware"]), asides)
    deviation = summary["frequency_response"]["max_deviation_db_passband"]
    if deviation is None:
        return None
    return Tile("Change of the gain in the passband", decibels(deviation), ["by rounding the coefficients"])


def _tiles(evidence: Evidence, summary: Summary) -> list[Tile]:
    error = summary["error"]
    compared = "bit for bit" if summary["bit_exact"] else f"of {count(evidence.samples, 'sample')}"
    if evidence.channels > 1:
        compared += f", {count(evidence.channels, 'channel')}"
    gate_by_gate = "" if evidence.gates is None else ", gate by gate"
    tiles = [
        _error_tile(evidence, summary),
        Tile(
            "Typical error (RMS)",
            amount(error["rms"], evidence.unit),
            [f"{_lsb(error['rms'] / evidence.lsb)} · mean {amount(error['mean'], evidence.unit)}"],
        ),
        _accuracy_tile(summary),
        Tile(
            "Samples equal to the integer model",
            f"all {evidence.samples:,}" if summary["bit_exact"] else f"all but {evidence.mismatches:,}",
            [compared],
        ),
        Tile(
            "Signal to error",
            decibels(summary["sqnr_db"]) if error["rms"] else "no error at all",
            [f"one LSB is {amount(evidence.lsb, evidence.unit)}"],
        ),
        Tile(
            "Simulation",
            f"{amount(evidence.cycles_per_second, '')} cycles/s",
            [
                f"{count(evidence.cycles, 'clock cycle')} in {duration(evidence.wall_seconds)} "
                f"with {evidence.simulator}{gate_by_gate}"
            ],
        ),
    ]
    return [tile for tile in tiles if tile is not None]


def _reasons(evidence: Evidence, summary: Summary) -> list[str]:
    """Sentences of the verdict."""
    if not summary["passed"]:
        return list(summary["shortfalls"])
    error, bound = (quantity(value, evidence.unit) for value in (summary["error"]["max_abs"], evidence.bound))
    ran = "hardware" if evidence.gates is None else f"netlist for the {evidence.gates.board.title}"
    return [
        f"The simulated {ran} agrees with its integer model bit for bit, and stays within {error} "
        f"of the exact calculation; the limit is {bound}."
    ]


def _trace_figure(evidence: Evidence) -> Figure:
    legend = [("golden", "broad", "exact calculation"), ("hardware", "dashed", "hardware")]
    if evidence.truth is not None:
        legend.append(("truth", "broad", "true value"))
    if evidence.unfiltered is not None:
        legend.append(("unfiltered", "", "without the filter"))
    caption = (
        "The hardware, in blue, should lie on the orange line of the exact calculation "
        "(double precision, unrounded coefficients, the same input codes)."
    )
    if evidence.truth is not None and evidence.filter is not None:
        caption += " Their distance from the true value is the noise the filter lets through, and its delay."
    if evidence.shown_channel is not None:
        caption += (
            f" All pictures show channel {evidence.shown_channel:,}, the one of {evidence.channels:,} "
            "with the largest error; the figures above are of all channels."
        )
    return Figure(
        drawing=plots.trace_figure(evidence, plots.WIDE),
        narrow=plots.trace_figure(evidence, plots.NARROW),
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
        f"error. The output moves in steps of {amount(evidence.lsb, evidence.unit)}.",
        legend=[("golden", "broad", "exact calculation"), ("hardware", "dot", "hardware")],
    )


def _error_figure(evidence: Evidence) -> Figure:
    inside, outside = plots.error_limits(evidence)
    legend = [("hardware", "", "hardware minus exact calculation")]
    legend += [
        (
            limit.role,
            "dashed" if limit.dashes == "--" else "dotted",
            f"{limit.words} ±{quantity(limit.value, evidence.unit)}",
        )
        for limit in inside
    ]
    caption = "The curve must stay between the limits."
    if outside:
        names = " and ".join(f"{limit.words} ±{amount(limit.value, evidence.unit)}" for limit in outside)
        caption += f" Too far out to draw: {names}."
    if evidence.first_mismatch is not None:
        caption += (
            f" The upright line marks sample {evidence.first_mismatch:,}, "
            "the first at which hardware and integer model differ."
        )
    return Figure(
        title="Over time",
        drawing=plots.error_figure(evidence, plots.WIDE),
        narrow=plots.error_figure(evidence, plots.NARROW),
        caption=caption,
        legend=legend,
    )


def _histogram_figure(evidence: Evidence) -> Figure:
    return Figure(
        title="How often each error occurs",
        drawing=plots.histogram_figure(evidence),
        caption=f"One LSB is {amount(evidence.lsb, evidence.unit)}. Rounding the output spreads the error evenly "
        "between the dotted lines at ±½\u00a0LSB; what lies beyond them comes from inside.",
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
    found = [(f"{evidence.realization} (this design)", summary["error"]["max_abs"], summary["error"]["rms"])]
    found += [(other.name, other.max_abs, other.rms) for other in evidence.rivals]
    rows = [
        (name, amount(largest, evidence.unit), plain_number(largest / evidence.lsb), amount(rms, evidence.unit))
        for name, largest, rms in found
    ]
    return Table(head=("realization", "largest error", "in LSB", "RMS"), rows=rows, numbers=(1, 2, 3))


def _budget_table(evidence: Evidence) -> Table:
    parts = [(name.replace("_", " "), value) for name, value in evidence.bound_parts.items()]
    parts += [("limit", evidence.bound), ("allowed by the specification", evidence.max_error)]
    rows = [(name, amount(value, evidence.unit), _lsb(value / evidence.lsb)) for name, value in parts]
    return Table(head=("contribution", "at most", ""), rows=rows, numbers=(1, 2))


def _limit_cycles_table(evidence: Evidence) -> Table:
    """Tell what each section's rounding can sustain by itself, at the section's own output."""
    rows = []
    for found in evidence.limit_cycles:
        weights = [f"{float(weight):.4g}" for weight in found.lyapunov or ()]
        rows.append(
            (
                found.section,
                "none, proven" if found.none else amount(found.largest, evidence.unit),
                "" if found.none else _lsb(found.largest / evidence.lsb),
                amount(found.dead_band, evidence.unit) if found.dead_band else "none",
                _lsb(found.dead_band / evidence.lsb) if found.dead_band else "",
                ", ".join(weights) or "not needed",
            )
        )
    head = ("section", "without input, at most", "", "dead band", "", "Lyapunov weights")
    return Table(head=head, rows=rows, numbers=range(1, 6))


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
    return Table(head=("with the integer coefficients", ""), rows=rows, numbers=(1,))


def _filter_figures(facts: FilterFacts) -> dict[str, Figure]:
    legend = [("golden", "broad", "ideal filter"), ("hardware", "dashed", "integer coefficients")]
    masked = (facts.passband_edge and facts.passband_loss) or (facts.stopband_edge and facts.stopband_loss)
    mask = [("limit", "area", "forbidden by the specification")] if masked else []
    return {
        "gain": Figure(
            title="Gain",
            drawing=plots.magnitude_figure(facts),
            caption="Rounding the coefficients bends the ideal curve by the difference drawn below it.",
            legend=legend + mask,
        ),
        "delay": Figure(
            title="Group delay",
            drawing=plots.delay_figure(facts),
            caption="How much later a slow change of each frequency appears at the output.",
            legend=legend,
        ),
        "plane": Figure(
            title="Poles and zeros",
            drawing=plots.pole_zero_figure(facts),
            caption="Crosses are poles, rings are zeros; inside the unit circle a pole is stable. "
            "Where blue covers orange, rounding has not moved it.",
            legend=[("golden", "", "ideal filter"), ("hardware", "", "integer coefficients")],
        ),
    }


def _coefficient_table(evidence: Evidence) -> Table:
    rows = []
    for section in evidence.sections:
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
    return Table(head=head, rows=rows, numbers=(2, 3, 4), code=(1, 2, 4))


def _format_table(evidence: Evidence) -> Table:
    """List the formats by stage."""
    rows, previous = [], ""
    for row in evidence.formats:
        title = "" if row.stage == previous else row.stage
        rows.append((title, row.node, row.format, amount(row.low, row.unit), amount(row.high, row.unit)))
        previous = row.stage
    return Table(head=("stage", "signal", "format", "from", "to"), rows=rows, numbers=(3, 4), code=(2,))


def _netlist_in_words(netlist: Netlist) -> str:
    cells = ", ".join(f"{number:,} {kind}" for kind, number in netlist.cells.items())
    return f"the netlist for the {netlist.board.title}, {netlist.board.device.title}: {cells}"


def _run_facts(evidence: Evidence) -> list[tuple[str, str]]:
    span = float(evidence.time[-1] - evidence.time[0])
    return [
        ("trace", f"{evidence.scenario}, {duration(span)}"),
        ("samples", f"{evidence.samples:,}"),
        ("channels", f"{evidence.channels:,}"),
        ("clock cycles", f"{evidence.cycles:,}"),
        ("latency", count(evidence.latency_cycles, "cycle")),
        ("realization", evidence.realization),
        ("architecture", evidence.architecture),
        (
            "output range",
            f"{plain_number(evidence.low)} to {plain_number(evidence.high)} {unit_symbol(evidence.unit)}".rstrip(),
        ),
        ("simulator", evidence.simulator),
        *([] if evidence.gates is None else [("what ran", _netlist_in_words(evidence.gates))]),
        ("seed", str(evidence.seed)),
        *evidence.tools.items(),
    ]


def render_page(evidence: Evidence, summary: Summary) -> str:
    """Whole report page; `summary` is what `sosmith.gen.report.report.summarise` makes of `evidence`."""
    shown = evidence.of_channel(evidence.worst_channel)
    parts: dict[str, Any] = {}
    if shown.rivals:
        parts["alternatives"] = _alternatives_figure(shown)
        parts["alternatives_table"] = _alternatives_table(shown, summary)
    if shown.filter is not None:
        parts |= _filter_figures(shown.filter)
        parts["response"] = _response_table(shown.filter, summary["frequency_response"])
    return render(
        "sosmith.gen.report",
        "report.html.jinja",
        evidence=shown,
        summary=summary,
        reasons=_reasons(evidence, summary),
        tiles=_tiles(evidence, summary),
        trace=_trace_figure(shown),
        close_up=_close_up_figure(shown),
        error=_error_figure(shown),
        histogram=_histogram_figure(shown),
        budget=_budget_table(shown),
        limit_cycles=_limit_cycles_table(shown),
        coefficients=_coefficient_table(shown),
        formats=_format_table(shown),
        facts=_run_facts(shown),
        count=count,
        **parts,
    )
