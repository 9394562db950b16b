"""Compares sums of products by constants with an integer program: `python -m benchmarks.constant_products`.

Writes benchmarks/constant_products.json and the table of docs/hardware.md, in some minutes. `--document` only writes
the table from that record again. The solver stops after a time, so that its figures are not the same on every machine:
it measures `adder_graph`, and takes no part in a design.
"""

from __future__ import annotations

import json
import math
import random
import re
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from benchmarks.adder_program import NODES, SECONDS, fewest_bits

from sosmith.gen.core import design_core
from sosmith.gen.specification.combinations import PARALLEL
from sosmith.gen.specification.specification import load
from sosmith.model.dataflow.adder_graph import Adder, adder_bits, adder_graph, by_operand, odd_part, scalings
from sosmith.model.dataflow.graph import Graph, Op
from sosmith.model.sections.truncated_products import Constant, constants_of

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "constant_products.json"
DOCUMENT = ROOT / "docs" / "hardware.md"
SPECIFICATIONS = ("audio_lowpass", "flange_wear_bench", "flange_wear_locomotive", "recipes/short_taps")
DRAWN = tuple((count, bits) for count in (2, 4, 8) for bits in (8, 12, 16))
"""Constants of a set, and their bits."""
SETS = 2
SEED = 1
OPERAND = (-(1 << 15), (1 << 15) - 1)
"""Range of the operand of drawn constants."""

_TABLE = re.compile(r"(?<=<!-- constant products -->\n).*?(?=<!-- end of constant products -->)", re.DOTALL)


@dataclass(frozen=True)
class Row:
    """Products of one operand: sums and adder bits that are made, that the integer program finds, and its bound.

    Attributes
    ----------
    source : str
        A specification, or how the constants are drawn.
    constants : int
        Different odd parts but 1.
    sums, bits, seconds
        Of `adder_graph`; seconds of processor time.
    dropped : int
        Of these bits, those that lie below all that is kept of what they are in: no truncated sum could save more.
    program_sums, program_bits, bound, program_seconds
        Of the integer program, see `benchmarks.adder_program.Result`.
    """

    source: str
    constants: int
    sums: int
    bits: int
    dropped: int
    seconds: float
    program_sums: int
    program_bits: int
    bound: int
    program_seconds: float


def sets() -> Iterator[tuple[str, dict[int, int], int, int]]:
    """Yield where constants are from, those of each operand with the bits dropped of their products, and its range."""
    for name in SPECIFICATIONS:
        spec = load(ROOT / "examples" / f"{name}.toml")
        hardware = replace(spec.hardware, architecture=PARALLEL.name, multipliers=0)
        for stage in design_core(replace(spec, hardware=hardware)).datapath.stages:
            graph = stage.graph
            made = constants_of(graph)
            for operand, products in by_operand(graph, scalings(graph)):
                node = graph.nodes[operand]
                yield spec.name, _dropped(graph, {index: made[index] for index in products}), node.low, node.high
            for index in made.keys() - scalings(graph):  # whose sums drop bits: as if they did not
                node = graph.nodes[made[index].operand]
                yield spec.name, _dropped(graph, {index: made[index]}), node.low, node.high
    draws = random.Random(SEED)
    for count, bits in DRAWN:
        for _ in range(SETS):
            drawn = tuple(draws.randrange(1 << (bits - 1), 1 << bits) for _ in range(count))
            yield f"{count} of {bits} bits, drawn", dict.fromkeys(drawn, 0), *OPERAND


def _dropped(graph: Graph, products: Mapping[int, Constant]) -> dict[int, int]:
    """Return the constants of products, with the lowest bits that all readers of their product drop."""
    dropped: dict[int, int] = {}
    for index, by in products.items():
        whole = graph.nodes[by.operand].frac + by.frac
        readers = [other for other in graph.nodes if index in other.operands]
        fracs = [other.frac if other.op is Op.FLOOR else graph.nodes[index].frac for other in readers]
        bits = max(0, whole - max(fracs, default=whole))
        dropped[by.integer] = min(bits, dropped.get(by.integer, bits))
    return dropped


def dropped_bits(adders: Sequence[Adder], dropped: Mapping[int, int], low: int, high: int) -> int:
    """Return the adder bits below all that is kept: of a sum, what lies below the bits that a product of it keeps.

    >>> dropped_bits(adder_graph((75,)), {75: 3}, -8, 7)  # 75 = 5 * 16 - 5: three bits of 5x, and of the difference
    5
    """
    first: dict[int, int] = {}
    for constant, bits in dropped.items():
        odd, power = odd_part(constant)
        first[odd] = min(max(bits - power, 0), first.get(odd, bits))
    total = 0
    for index, adder in reversed([*enumerate(adders, start=1)]):
        lowest = first.get(adder.multiple, math.inf)
        for other in adders[index:]:
            for place, shift in (other.left, other.right):
                if place == index:
                    lowest = min(lowest, max(first[other.multiple] - shift, 0))
        first[adder.multiple] = int(lowest)
        bits = adder_bits([adder], low, high)
        width = bits + (adder.right[1] or (0 if adder.subtract else adder.left[1]))
        total += max(0, int(lowest) - (width - bits))
    return total


def measure(source: str, dropped: Mapping[int, int], low: int, high: int) -> Row:
    """Return a row for the products of an operand in low..high."""
    constants = tuple(dropped)
    adder_graph.cache_clear()  # the design has asked for it
    start = time.process_time()
    adders = adder_graph(constants)
    between = time.process_time()
    result = fewest_bits(constants, low, high)
    return Row(
        source=source,
        constants=len({odd_part(constant)[0] for constant in constants} - {1}),
        sums=len(adders),
        bits=adder_bits(adders, low, high),
        dropped=dropped_bits(adders, dropped, low, high),
        seconds=round(between - start, 2),
        program_sums=result.sums,
        program_bits=result.bits,
        bound=result.bound,
        program_seconds=round(time.process_time() - between, 1),
    )


def table(rows: list[Row]) -> str:
    """Return the Markdown table of a record, a row for all operands of the same source."""
    lines = [
        f"By `python -m benchmarks.constant_products`; HiGHS stops after {NODES} nodes or {SECONDS:g} seconds.",
        "",
        "| constants | operands | sums | adder bits | of them dropped | seconds | program: sums | bits | s | bound |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for source in dict.fromkeys(row.source for row in rows):
        of = [row for row in rows if row.source == source]
        lines.append(
            f"| {source} | {len(of)} | {sum(row.sums for row in of)} | {sum(row.bits for row in of)} "
            f"| {sum(row.dropped for row in of)} | {sum(row.seconds for row in of):.1f} "
            f"| {sum(row.program_sums for row in of)} | {sum(row.program_bits for row in of)} "
            f"| {sum(row.program_seconds for row in of):.0f} "
            f"| {sum(row.bound for row in of)} |"
        )
    return "\n".join(lines) + "\n"


def recorded() -> list[Row]:
    """Return the rows of the record."""
    return [Row(**row) for row in json.loads(RECORD.read_text(encoding="utf-8"))]


def with_table(text: str) -> str:
    """Return the document with the table of the record."""
    return _TABLE.sub(lambda _: table(recorded()), text)


def main() -> None:
    """Measure unless asked not to, and write the table."""
    if "--document" not in sys.argv[1:]:
        rows = []
        for source, dropped, low, high in sets():
            if {odd_part(constant)[0] for constant in dropped} - {1}:
                rows.append(measure(source, dropped, low, high))
                print(rows[-1], file=sys.stderr, flush=True)
        RECORD.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")
    DOCUMENT.write_text(with_table(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
