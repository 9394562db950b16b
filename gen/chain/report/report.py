"""The report of one co-simulation of a chain: `report.json` for scripts, `report.html` for people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure as Canvas

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.facts import chain_tables, limits
from sosmith.gen.chain.ideal import chain_gain, frequencies, level, stage_gain
from sosmith.gen.chain.report.measures import aliases_entry, delay_entry, in_db, response_entry
from sosmith.gen.chain.report.picture import POINTS, axis_label
from sosmith.gen.chain.report.provenance import chain_provenance, names_of
from sosmith.gen.chain.report.run import ChainRun
from sosmith.gen.chain.top import chain_interface
from sosmith.gen.facts.table import Fact, Table
from sosmith.gen.quantity import decibels, plain_number, quantity
from sosmith.gen.report.curves import error_over_time, error_spectrum
from sosmith.gen.report.figures.figure import Figure
from sosmith.gen.report.figures.painting import COLOUR, NARROW, PANEL_HEIGHT, draw, frequency_axis
from sosmith.gen.report.run import Instants
from sosmith.gen.version import __version__
from sosmith.model.reference.accuracy import error_statistics, sqnr_db
from sosmith.model.templates import render
from sosmith.model.text_files import to_json, write_files
from sosmith.model.traces.trace import Trace


def chain_summary(design: ChainDesign, run: ChainRun, traces: Sequence[Trace]) -> dict[str, Any]:
    """Content of ``report.json``: the keys of a core's report that have a meaning here, and `stages`, `folding`.

    `traces` are what went in, one for each channel.
    """
    output = design.spec.base.output
    error = output.decode(run.received) - run.golden
    statistics = error_statistics(error)
    bound, allowed = float(design.bound), float(design.spec.base.max_error)
    shortfalls = []
    if run.mismatches:
        shortfalls.append(
            f"The hardware differs from the integer models at {run.mismatches:,} of {run.received.size:,} results."
        )
    if statistics.max_abs > bound:
        largest, limit = quantity(statistics.max_abs, output.unit), quantity(bound, output.unit)
        shortfalls.append(f"The largest error is {largest}, over the limit of {limit}.")
    realization, architecture = names_of(design)
    instants = Instants(len(error), float(design.spec.last_rate))
    worst = error[:, int(np.argmax(np.abs(error).max(axis=0)))]
    return {
        "name": design.name,
        "core": "chain",
        "scenario": traces[0].name,
        "passed": not shortfalls,
        "shortfalls": shortfalls,
        "samples": run.received.size,
        "channels": design.spec.base.channels,
        "cycles": run.cycles,
        "cycles_per_sample": run.cycles / (run.codes.shape[0] * run.codes.shape[1]),
        "latency_cycles": chain_interface(design).latency_cycles,
        "simulator": run.simulator,
        "tools": run.tools,
        "sosmith_version": __version__,
        "seed": run.seed,
        "bit_exact": run.mismatches == 0,
        "mismatches": run.mismatches,
        "error": {
            "max_abs": statistics.max_abs,
            "max_lsb": statistics.max_abs / float(output.lsb),
            "rms": statistics.rms,
            "bound": bound,
            "unit": output.unit,
            "parts": {stage.spec.name: float(stage.share) for stage in design.stages},
        },
        "max_error": allowed,
        "lsb": float(output.lsb),
        "delay": delay_entry(design),
        "sqnr_db": sqnr_db(run.golden, error),
        "frequency_response": response_entry(design),
        "aliases": aliases_entry(design),
        "accuracy_percent": dict.fromkeys(("unfiltered", "golden", "hardware")),
        "realization": realization,
        "architecture": architecture,
        "stages": [
            {
                "name": stage.spec.name,
                "kind": stage.spec.kind,
                "architectures": [core.architecture.name for core in stage.cores],
                "interpolate": stage.rate.rise,
                "decimate": stage.rate.factor,
                "output_bits": stage.output.bits,
                "error_bound": float(stage.bound),
                "gain_to_the_end": float(stage.gain),
            }
            for stage in design.stages
        ],
        "folding": [
            {
                "interpolate": each.segment.rise,
                "decimate": each.segment.factor,
                "anywhere_db": in_db(each.anywhere.gain),
                "passband_edge": None if each.edge is None or design.spec.edge is None else float(design.spec.edge),
                "into_passband_db": None if each.passing is None else in_db(each.passing.gain),
            }
            for each in design.foldings
        ],
        "cycles_per_second": run.cycles_per_second,
        "wall_seconds": run.wall_seconds,
        "provenance": asdict(chain_provenance(design, traces)),
        "curves": {
            "error": error_over_time(error, instants),
            "spectrum": error_spectrum(worst, instants),
            "filter": None,
        },
    }


def write_chain_report(design: ChainDesign, run: ChainRun, traces: Sequence[Trace], directory: Path) -> dict[str, Any]:
    """Write ``report.json`` and ``report.html``; return the content of the first, see `chain_summary`."""
    summary = chain_summary(design, run, traces)
    page = render(
        ("sosmith.gen.chain.report", "sosmith.gen.report"),
        "chain.html.jinja",
        summary=summary,
        figures=[_response_figure(design), _stages_figure(design)] if design.parts else [],
        result=report_table(summary),
        tables=chain_tables(design),
    )
    write_files(directory, {"report.json": to_json(summary), "report.html": page})
    return summary


def report_table(summary: dict[str, Any]) -> Table:
    """Say the verdict, the arithmetic and the speed; `summary` is the content of ``report.json``."""
    error, unit = summary["error"], summary["error"]["unit"]
    exact = "all equal to the integer models" if summary["bit_exact"] else f"{summary['mismatches']:,} differ"
    rows = [
        Fact("Results", f"{summary['samples']:,}", sentence=exact),
        Fact(
            "Largest error",
            error["max_abs"],
            unit,
            f"{plain_number(error['max_lsb'])} LSB; proven limit {quantity(error['bound'], unit)}",
        ),
        Fact("Error RMS", error["rms"], unit),
    ]
    if summary["sqnr_db"] is not None:
        rows.append(Fact("Signal to error", decibels(summary["sqnr_db"])))
    rows += [Fact("Short", reason) for reason in summary["shortfalls"]]
    rows.append(
        Fact(
            "Clocks a sample",
            f"{summary['cycles_per_sample']:.3g}",
            sentence=f"{summary['simulator']}, with idle clocks",
        )
    )
    return Table(summary["name"], rows, styles={"Short": "red"}, passed=summary["passed"])


def _response_figure(design: ChainDesign) -> Figure:
    """Draw the gain of the whole from the input on, and where aliasing begins."""
    frequency = frequencies(design, POINTS)
    whole = level(np.abs(chain_gain(design, frequency)))

    def paint(canvas: Canvas) -> None:
        axes = canvas.subplots()
        axes.plot(frequency, whole, color=COLOUR["hardware"], lw=1.6)
        for edge, end, most, _ in limits(design):
            axes.axvspan(edge, end, facecolor=COLOUR["limit"], alpha=0.12, lw=0)
            axes.plot([edge, end], [most, most], color=COLOUR["limit"], lw=1.4, ls="--")
        axes.set_ylabel("gain in dB")
        axes.set_xlabel(axis_label(design))
        frequency_axis(axes, frequency)

    legend = [("hardware", "", "exact end-to-end response")]
    caption = "Gain from a sine at the input to the sine at the output."
    for _, _, _, name in limits(design):
        legend.append(("limit", "dashed", f"proven {name} limit"))
    if design.rise > 1:
        caption = "Gain from a sine to the output; in the shaded band, to its images, or as an alias of it."
    elif design.foldings:
        caption += " In the shaded band the output is an alias, at a lower frequency."
    return Figure(
        title="Gain of the chain",
        drawing=draw("chain", "Gain against frequency", NARROW, PANEL_HEIGHT, paint),
        caption=caption,
        legend=legend,
    )


def _stages_figure(design: ChainDesign) -> Figure:
    """Draw the gains of the stages, each over the frequencies at the chain's input."""
    frequency = frequencies(design, POINTS)
    filters = [stage for stage in design.stages if stage.parts]

    def paint(canvas: Canvas) -> None:
        axes = canvas.subplots(len(filters), 1, sharex=True, squeeze=False)[:, 0]
        for each, stage in zip(axes, filters, strict=True):
            each.plot(frequency, level(stage_gain(stage, frequency)), color=COLOUR["golden"], lw=1.2)
            each.set_ylabel(f"{stage.spec.name}\ndB")
        axes[-1].set_xlabel(axis_label(design))
        frequency_axis(axes[-1], frequency)

    height = max(PANEL_HEIGHT, 110 * len(filters))
    return Figure(
        title="Gain of each stage",
        drawing=draw("stages", "Gain of each stage against frequency", NARROW, height, paint),
        caption="Gain of each stage for a sine at the input of the chain, aliased by the stages before it."
        if design.rise == 1
        else "Gain of each stage for a sine; of one that interpolates, at its output.",
    )
