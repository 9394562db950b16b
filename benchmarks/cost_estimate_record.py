"""The record of syntheses that the estimate of cost is fitted to and tested with, and what docs/cost.md says of it."""

from __future__ import annotations

import json
import tomllib
from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.cost_draws import draw
from benchmarks.cost_fit import Row, errors

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.estimate.estimate import FITTED, TITLES
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.specification.specification import from_text

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "cost_estimate.json"

GOAL = 0.15
"""Relative error of LUT4 that nine in ten designs should not exceed."""

FITTED_UP_TO = 396
"""Draws up to this seed are for the fit, and were looked at while quantities were chosen; later ones are for tests."""

Recorded = dict[str, Any]
"""A row of the record: ``seed`` of a draw, or ``core`` and ``target`` of benchmarks/cost.json; ``board``,
``architecture``, ``source``, a mark of what was synthesized, ``quantities``, ``luts``, ``flip_flops``,
``multiplier_blocks``. Of a draw that cannot be met ``seed`` and ``refused`` alone."""


def recorded() -> list[Recorded]:
    """Read the record."""
    if not RECORD.exists():
        return []
    rows: list[Recorded] = json.loads(RECORD.read_text(encoding="utf-8"))
    return rows


def write(rows: Sequence[Recorded]) -> None:
    """Write the record, a row to a line."""
    lines = ",\n".join(json.dumps(row, sort_keys=True) for row in rows)
    RECORD.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def is_unseen(seed: int) -> bool:
    """Say whether a draw is for testing only."""
    return seed > FITTED_UP_TO


def in_turn(count: int) -> list[int]:
    """Return the seeds up to `count` in the order of synthesis, which may end at any of them.

    Architectures and families of FPGA take turns, each with its seeds in their order: two that are for the fit, and
    between them one for testing only.
    """
    groups: defaultdict[tuple[str, str], tuple[list[int], list[int]]] = defaultdict(lambda: ([], []))
    for seed in range(1, count + 1):
        drawn = draw(seed)
        architecture = tomllib.loads(drawn.toml)["hardware"]["architecture"]
        groups[architecture, find_board(drawn.board).device.family][is_unseen(seed)].append(seed)
    rounds = zip_longest(*(_two_to_one(*groups[key]) for key in sorted(groups)))
    return [seed for each in rounds for seed in each if seed is not None]


def _two_to_one(of_fit: Sequence[int], unseen: Sequence[int]) -> Iterator[int]:
    first, second = iter(of_fit), iter(unseen)
    while of_fit and unseen:
        for source in (first, second, first):
            seed = next(source, None)
            if seed is None:
                yield from second if source is first else first
                return
            yield seed
    yield from (*of_fit, *unseen)


def designed(seed: int) -> CoreDesign:
    """Design what a seed draws.

    Raises
    ------
    SpecificationError, ShortfallError
        If it cannot be met.
    """
    drawn = draw(seed)
    return design_core(from_text(drawn.toml, Path(f"draw{seed}.toml")), board=find_board(drawn.board))


def name_of(row: Recorded) -> str:
    """Return the name of a row."""
    return f"draw {row['seed']}" if "seed" in row else f"{row['core']} on {row['target']}"


def rows_of(record: Sequence[Recorded]) -> list[Row]:
    """Return the rows that have been synthesized."""
    return [
        Row(
            name=name_of(row),
            architecture=row["architecture"],
            family=find_board(row["board"]).device.family,
            unseen="seed" in row and is_unseen(row["seed"]),
            quantities=row["quantities"],
            luts=row["luts"],
            flip_flops=row["flip_flops"],
        )
        for row in record
        if "refused" not in row
    ]


def nine_in_ten(found: Sequence[float]) -> float:
    """Return the relative error that nine in ten do not exceed, in whole percent upwards."""
    return float(np.ceil(100 * np.sort(np.abs(found))[int(np.ceil(0.9 * len(found))) - 1]) / 100)


def _drawn(record: Sequence[Recorded]) -> str:
    """Say how many of the seeds are recorded, and in which order they were taken."""
    seeds = [row for row in record if "seed" in row]
    refused = sum("refused" in row for row in seeds)
    return (
        f"Recorded are {len(seeds)} draws of the hardware as it is, of which {refused} cannot be met.\n"
        "Architectures and families take turns, each with its seeds in their order."
    )


def section(record: Sequence[Recorded]) -> str:
    """Return the section of docs/cost.md."""
    rows, factors = rows_of(record), json.loads(FITTED.read_text(encoding="utf-8"))["factors"]
    unseen = [row for row in rows if row.unseen]
    names = dict.fromkeys(row.architecture for row in sorted(rows, key=lambda row: row.architecture))
    groups = [
        *((title, {id(row) for row in rows if row.family == family}) for family, title in TITLES.items()),
        *((name, {id(row) for row in rows if row.architecture == name}) for name in names),
        ("all", set(map(id, rows))),
    ]
    lines = [
        "| designs | fitted to | tested with | LUT4 within 15 % | 9 of 10 within | FF, 9 of 10 within |",
        "|---|---|---|---|---|---|",
    ]
    for title, own in groups:
        of_fit = [row for row in rows if id(row) in own and not row.unseen]
        tested = [row for row in unseen if id(row) in own]
        if not tested:
            continue
        luts, flip_flops = errors(tested, factors), errors(tested, factors, "flip_flops")
        share = f"{sum(abs(error) <= GOAL for error in luts)} of {len(luts)}"
        ends = f"{100 * nine_in_ten(luts):.0f} % | {100 * nine_in_ten(flip_flops):.0f} %"
        lines.append(f"| {title} | {len(of_fit)} | {len(tested)} | {share} | {ends} |")
    table = "\n".join(lines)
    of_cores = ", and of cores above" if any("core" in row for row in record) else ""
    drawn = _drawn(record)
    return f"""
## Estimates before synthesis

Written by `python -m benchmarks.cost_estimate` from `benchmarks/cost_estimate.json`. `design`, the report, the studio
and `explore` show estimates of LUT4 and flip-flops. They count bits of sums, products, choices, comparisons and
memories in the plan of the hardware as synthesis makes them, each times a factor for its architecture and family of
FPGA: the bits of each sum that are used, products that several multiplier blocks make, memories in slices, of block RAM
or of LUT4 by what Yosys weighs them with. Factors are fitted to synthesis with Yosys of what seeds up to {FITTED_UP_TO}
draw{of_cores}, and drawn to those of an earlier version of the hardware, as few draws tell of each. Errors are those on
what later seeds draw, which was looked at neither by the fit nor while quantities were chosen, but for how many
multiplier blocks the draws 402 and 405 take.
{drawn}

Drawn are filters of all families, kinds and realizations, orders 1 to 4, some calibrated, with up to 32 channels,
reload, protect, start, decimate, look-ahead, several samples a clock and limits of multipliers, but no parallel cores
with reload on FPGAs without multiplier blocks. iCE40 is the UP5K and the HX8K, ECP5 the LFE5U-25F, Gowin the GW1NR-9C.

{table}
"""
