"""What the examples take of silicon in standard cells, before layout: `python -m benchmarks.silicon`.

Needs Debian's packages qflow-tech-osu018 and opensta. Maps each example in each architecture, which takes some ten
seconds of processor time each, and writes benchmarks/silicon.json; `python -m benchmarks.cost --document` then writes
the table in docs/cost.md.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from typing import Any, NamedTuple

from benchmarks.cost_cores import ARCHITECTURES, EXAMPLES, ROOT

from sosmith.gen.core import design_core
from sosmith.gen.estimate.silicon.libraries import find_library
from sosmith.gen.estimate.silicon.synthesis import mapped
from sosmith.gen.output.verilog import core_verilog
from sosmith.gen.specification.combinations import PARALLEL
from sosmith.gen.specification.specification import load

RECORD = ROOT / "benchmarks" / "silicon.json"
LIBRARY = "osu018"

CASES = tuple(
    (example, architecture, adders)
    for example in EXAMPLES
    for architecture in ARCHITECTURES
    for adders in ((False, True) if architecture == PARALLEL.name else (False,))
)
"""Example, architecture, and whether products by constants are sums, as `hardware.multipliers = 0` makes them."""


class Row(NamedTuple):
    """A core in standard cells; `gates` are NANDs of two inputs, `registers` the part of the area of flip-flops."""

    example: str
    architecture: str
    adders: bool
    realization: str
    cycles: int
    gates: int
    area: float
    registers: float
    clock: float | None


def measured(example: str, architecture: str, *, adders: bool) -> Row:
    """Map a core."""
    spec = load(ROOT / "examples" / f"{example}.toml")
    hardware = replace(spec.hardware, architecture=architecture)
    if adders:
        hardware = replace(hardware, multipliers=0)
    made = design_core(replace(spec, hardware=hardware), core=EXAMPLES[example])
    found = mapped(core_verilog(made), spec.name, find_library(LIBRARY), spec.hardware.clock)
    return Row(
        example=example,
        architecture=architecture,
        adders=adders,
        realization=made.quantized.realization,
        cycles=made.architecture.cycles_per_sample,
        gates=found.gates,
        area=found.area,
        registers=round(found.of_registers / found.area, 3),
        clock=None if found.clock is None else round(found.clock),
    )


def recorded() -> list[Row]:
    """Return what is recorded."""
    rows: list[dict[str, Any]] = json.loads(RECORD.read_text(encoding="utf-8"))
    return [Row(**row) for row in rows]


def table() -> str:
    """Return what is recorded, as a Markdown table."""
    columns = (
        *("core", "architecture", "products by constants", "NAND2", "mm2", "flip-flops, % of it", "clock, MHz"),
        *("clocks per sample", "samples per second"),
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for row in recorded():
        speed = ("-", "-") if row.clock is None else (f"{row.clock / 1e6:.1f}", f"{row.clock / row.cycles:,.0f}")
        cells = (
            row.example,
            row.architecture,
            ("sums" if row.adders else "products") if row.architecture == PARALLEL.name else "",
            f"{row.gates:,}",
            f"{row.area / 1e6:.3f}",
            f"{100 * row.registers:.0f}",
            speed[0],
            f"{row.cycles:,}",
            speed[1],
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Measure everything, and write it."""
    rows = []
    for example, architecture, adders in CASES:
        print(example, architecture, "sums" if adders else "", file=sys.stderr, flush=True)
        rows.append(measured(example, architecture, adders=adders))
    text = ",\n".join(json.dumps(row._asdict()) for row in rows)
    RECORD.write_text(f"[\n{text}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
