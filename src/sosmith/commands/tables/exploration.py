"""The tables of an exploration's front."""

from __future__ import annotations

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.gen.quantity import number, quantity
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
                    number(point["cycles_per_sample"]),
                )
        console.print(table)
    designs = [point for point in found.points if point["refused"] is None]
    passed = sum(bool(point["passed"]) for point in designs)
    jobs = len({point["reference_sha256"] for point in designs})
    if jobs > 1:
        console.print(
            f"The designs do {jobs:,} different jobs (other filters, inputs, ranges or channels): each bound is "
            "against its own exact calculation.",
            highlight=False,
        )
    console.print(
        f"{_counted(len(found.points), 'combination')}: {_counted(len(designs), 'design')}, of which {passed:,} "
        f"{'passes' if passed == 1 else 'pass'} and {len(front):,} {'is' if len(front) == 1 else 'are'} on the front",
        highlight=False,
    )


def _counted(number: int, thing: str) -> str:
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def _plain(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
