"""The report as one HTML page that stands alone: nothing from elsewhere, and all but the zoom without its script.

This module says what stands on the page, as plain text; the templates make markup of it, and escape it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sosmith.gen.facts.design_tables import budget_table, limit_cycles_table, uncertainty_table
from sosmith.gen.facts.table import Table
from sosmith.gen.filter.decimation import SAMPLED
from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.output.decimation_facts import DecimationFacts
from sosmith.gen.quantity import count, decibels, duration, full_scale_level, plain_number, scale, unit_symbol
from sosmith.gen.report.behaviour import behaviour
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.figures.figure import Figure, amount, error_unit
from sosmith.gen.report.figures.kept import figures_for
from sosmith.gen.report.headlines import SIMULATION, Summary, unbroken
from sosmith.gen.report.samples import MAX_POINTS, viewer_data
from sosmith.gen.specification.values import listed
from sosmith.gen.version import __version__
from sosmith.model.templates import render


def _reasons(evidence: Evidence, summary: Summary) -> list[str]:
    """Sentences of the verdict."""
    if not summary["passed"]:
        return list(summary["shortfalls"])
    unit = error_unit(evidence)
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
    off = amount(summary["true_error"]["max_abs"], evidence.facts.unit)
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
        f"{text} Beside the tone of {amount(tone['frequency'], 'Hz')}, distortion and noise are at "
        f"{unbroken(decibels(tone['thd_n_db']))} of it; rounding the input alone leaves {exact}."
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


def _alternatives_table(evidence: Evidence, summary: Summary) -> Table:
    errors = [(f"{evidence.realization} (this design)", summary["error"]["max_abs"], summary["error"]["rms"])]
    errors += [(other.name, other.max_abs, other.rms) for other in evidence.rivals]
    unit = error_unit(evidence)
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
            amount(band.largest_at, "Hz"),
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
    worst, rate = amount(decimation.worst_aliasing, unit), _hertz((decimation.sample_rate,))
    repeated = ", which leaves as many times" if decimation.held else ""
    before = decimation.calibration
    calibrated = "" if before is None else f"Every sample is calibrated first, within {amount(before.error, unit)}. "
    what = "the input" if before is None else "the calibration's result"
    return (
        f"{calibrated}{decimation.factor} samples make one result{repeated}, by {count(decimation.stages, 'stage')} of "
        f"integrators and combs of {decimation.width} bits, and the filter works at {rate}. A sine over the whole "
        f"range of {what} in one of the bands on the right leaves the filter in the pass band with an amplitude of "
        f"at most {worst}; one at any frequency from half that rate on leaves the filter, wherever it folds, with at "
        f"most {amount(decimation.largest, unit)} ({decibels(decimation.largest_db)}), where a filter without a "
        f"decimator has {decibels(decimation.direct_largest_db)}. At {SAMPLED} frequencies in the pass band the gain "
        f"is within {plain_number(decimation.deviation_db)} dB of that without a decimator, and decimator and "
        f"filter together delay by {amount(decimation.delay, 's')}."
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
        rows.append((title, row.node, row.format, amount(row.low, row.unit), amount(row.high, row.unit)))
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
    figures, realized = figures_for(shown, measured, sound=summary["sound"] is not None)
    parts: dict[str, Any] = {**figures}
    if shown.uncertainty is not None:
        parts["uncertainty"] = uncertainty_table(shown.uncertainty)
        parts["uncertainty_caption"] = _uncertainty_caption(shown.uncertainty)
    if shown.rivals:
        parts["alternatives_table"] = _alternatives_table(shown, summary)
    if shown.facts.filter is not None:
        parts["response"] = _response_table(shown.facts.filter, summary["frequency_response"])
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
        looks=_looks(shown),
        samples=viewer_data(shown, measured.transient),
        budget=budget_table(facts.error_parts, facts.max_error, facts.lsb, facts.unit),
        limit_cycles=limit_cycles_table(facts.limit_cycles, facts),
        realized=realized,
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
