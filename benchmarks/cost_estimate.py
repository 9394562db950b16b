"""Measures how good the estimate of cost is, and fits it: `python -m benchmarks.cost_estimate`.

Synthesizes designs that seeds draw, one after the other, and records them in benchmarks/cost_estimate.json after each;
it can be stopped at any time, and goes on where it was. Then fits the factors in gen/estimate/fitted.json to some of
them, and writes the errors on the others to docs/cost.md. `--count 0` only fits and writes. `--again` begins anew,
after a change of the hardware: what is the same as recorded is kept, and what it has not come to is recorded no more.
`--cores` adds cores of benchmarks/cost.json whose synthesis is recorded and up to date. `--check` computes the
quantities of all rows anew, writes nothing, and fails if one differs; `--renew` records them, after a change of what is
counted. Needs the packages of the extra "boards".
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

from benchmarks import cost_cores
from benchmarks.cost import mark, source
from benchmarks.cost_cores import CORES, architecture_on, fmax, targets_in
from benchmarks.cost_draws import draw
from benchmarks.cost_estimate_record import Recorded, designed, in_turn, name_of, nine_in_ten, recorded, rows_of, write
from benchmarks.cost_fit import errors, fitted
from benchmarks.cost_page import document
from benchmarks.synthesis import TARGETS

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.estimate.core import quantities_of
from sosmith.gen.estimate.estimate import FITTED, TITLES
from sosmith.gen.fpga.boards import Board, find_board
from sosmith.gen.fpga.synthesis import synthesize
from sosmith.gen.fpga.yosys import yosys_version
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.model.errors import SosmithError

COUNT = 576
"""Seeds that are drawn when the record is complete."""

_LEAST_CORES = 3
"""Placed cores from which on their clocks are told."""


def measured(seed: int, known: Recorded | None = None) -> Recorded:
    """Design what a seed draws, and synthesize it unless it is the same as in the row that is known."""
    try:
        design = designed(seed)
    except SosmithError as error:
        return {"seed": seed, "refused": str(error)}
    board, name = find_board(draw(seed).board), design.datapath.name
    text = to_verilog(to_rtlil(design.architecture.component(), name))
    if known is not None and known.get("source") == mark(text):
        return {**known, **_told(design.architecture, board)}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.sv"
        path.write_text(text, encoding="utf-8")
        cells = synthesize(path, name, board, Path(folder) / "netlist").cells
    device = board.device
    return {
        "seed": seed,
        "source": mark(text),
        **_told(design.architecture, board),
        "luts": device.luts(cells),
        "flip_flops": sum(count for cell, count in cells.items() if cell.startswith(("SB_DFF", "TRELLIS_FF", "DFF"))),
        "multiplier_blocks": cells.get(device.multiplier or "", 0),
    }


def _told(architecture: Architecture, board: Board) -> Recorded:
    found = quantities_of(architecture, board.device)
    quantities = {name: round(amount, 3) for name, amount in sorted(found.items()) if amount}
    return {"board": board.name, "architecture": architecture.name, "quantities": quantities}


def measure(count: int, *, again: bool = False) -> None:
    """Synthesize what is not recorded yet; `again` says to record everything anew."""
    before = {row.get("seed"): row for row in recorded()}
    rows = [row for row in recorded() if not again or "seed" not in row]
    done = {row.get("seed") for row in rows}
    for seed in in_turn(count):
        if seed not in done:
            rows.append(measured(seed, before.get(seed)))
            write(rows)
            print(f"draw {seed}: {rows[-1].get('refused') or rows[-1]['luts']}", file=sys.stderr, flush=True)


def add_cores() -> None:
    """Record cores of benchmarks/cost.json whose synthesis is that of the core as it is."""
    figures = json.loads(cost_cores.RECORD.read_text(encoding="utf-8"))
    rows = [row for row in recorded() if "core" not in row]
    for core in CORES:
        for target, found in targets_in(figures, core).items():
            if found["earlier"] or found["source"] != source(core, target):
                continue
            area = found["area"]
            rows.append(
                {
                    "core": core.key,
                    "target": target,
                    "source": found["source"],
                    **_told(architecture_on(core, target), TARGETS[target]),
                    "luts": area["all_luts"],
                    "flip_flops": area["flip_flops"],
                    "multiplier_blocks": area["multipliers"],
                }
            )
    write(rows)


def clocks() -> dict[str, dict[str, list[float]]]:
    """Return lowest and highest clock of placed cores in MHz, and their number, by architecture and FPGA."""
    figures = json.loads(cost_cores.RECORD.read_text(encoding="utf-8"))
    found: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for core in CORES:
        for target, placed in targets_in(figures, core).items():
            if placed["fmax"]:
                found[core.architecture][TARGETS[target].device.title].append(fmax(placed))
    return {
        architecture: {
            device: [min(reached), max(reached), len(reached)]
            for device, reached in devices.items()
            if len(reached) >= _LEAST_CORES
        }
        for architecture, devices in found.items()
    }


def fit() -> None:
    """Fit the factors to the record, and write them with their errors."""
    rows = rows_of(recorded())
    factors = fitted(rows)
    tested: dict[str, Any] = {}
    for family in TITLES:
        own = [row for row in rows if row.unseen and row.family == family]
        tested[family] = [len(own), nine_in_ten(errors(own, factors))]
    content = {"yosys": yosys_version(), "factors": factors, "tested": tested, "clocks": clocks()}
    FITTED.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def renewed() -> list[Recorded]:
    """Return the record with the quantities that are counted now."""
    return [row if "refused" in row else {**row, **_told_of(row)} for row in recorded()]


def _told_of(row: Recorded) -> Recorded:
    if "seed" in row:
        return _told(designed(row["seed"]).architecture, find_board(row["board"]))
    core = next(core for core in CORES if core.key == row["core"])
    return _told(architecture_on(core, row["target"]), TARGETS[row["target"]])


def changed() -> list[str]:
    """Name the rows whose quantities are not those recorded."""
    rows = zip(recorded(), renewed(), strict=True)
    return [f"{name_of(old)} must have the quantities recorded, not others" for old, new in rows if old != new]


def main() -> None:
    """Measure, fit and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=COUNT, help="seeds to draw, from 1 on")
    parser.add_argument("--again", action="store_true", help="keep only rows that are the same when drawn again")
    parser.add_argument("--cores", action="store_true", help="add the cores of benchmarks/cost.json")
    parser.add_argument("--check", action="store_true", help="only compare the quantities of all rows")
    parser.add_argument("--renew", action="store_true", help="count the quantities of all rows anew")
    options = parser.parse_args()
    if options.check:
        sys.exit("\n".join(changed()) or None)
    if options.renew:
        write(renewed())
    measure(options.count, again=options.again)
    if options.cores:
        add_cores()
    fit()
    for name, text in document(json.loads(cost_cores.RECORD.read_text(encoding="utf-8"))).items():
        (cost_cores.ROOT / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
