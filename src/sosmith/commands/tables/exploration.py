"""The tables of an exploration's front."""

from __future__ import annotations

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.gen.quantity import quantity
from sosmith.interface.exploration import Exploration


def print_exploration(found: Exploration) -> None:
    """Print the front, a table for each kind of cost, and how many designs there are behind it."""
    console, front = TableConsole(), found.front
    keys = [key for key in found.outcome.parameters if key not in {"hardware.realization", "hardware.architecture"}]
    for unit in dict.fromkeys(point["cost"]["unit"] for point in front):
        table = new_table(
            f"{found.outcome.name}: the front, cost in {unit}",
            [
                "realization",
                "architecture",
                *(escape(key.rpartition(".")[2]) for key in keys),
                "bound",
                "cost",
                "clocks",
            ],
        )
        for point in front:
            if point["cost"]["unit"] == unit:
                error = point["error"]
                table.add_row(
                    point["realization"],
                    point["architecture"],
                    *(escape(_plain(point["changes"][key])) for key in keys),
                    quantity(error["bound"], error["unit"]),
                    f"{point['cost']['value']:,.0f}",
                    f"{point['cycles_per_sample']:,}",
                )
        console.print(table)
    designs = [point for point in found.points if point["refused"] is None]
    passed = sum(bool(point["passed"]) for point in designs)
    console.print(
        f"{len(found.points):,} combinations: {len(designs):,} designs, of which {passed:,} pass and {len(front):,} "
        "are on the front",
        highlight=False,
    )


def _plain(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
