"""The tables of accuracy reports side by side."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

from rich.cells import cell_len
from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.interface.comparison import Comparison, Difference, Judgement

_HEADER_LINES = 3
_MAX_WIDTH = 24
"""Of a column; longer texts are broken."""
_MORE = ", continued"


def print_comparison(comparison: Comparison) -> None:
    """Print what differs, the figures by group, and the verdict last, where it is seen."""
    console, choice = TableConsole(), comparison.choice
    marks = ["▸ " if choice.taken == k and not comparison.judgements else "" for k in range(len(comparison.names))]
    names = [mark + name for mark, name in zip(marks, comparison.names, strict=True)]
    _print_differences(console, comparison.differences, names)
    for group in comparison.groups:
        _print_columns(console, group.title, [_Column(row.title, row.cells, row.best) for row in group.rows], names)
        if group.unfair:
            console.print(f"  [yellow]no winner:[/] {escape(group.unfair)}\n", highlight=False)
    for judgement in comparison.judgements:
        _print_judgement(console, judgement)
    if not comparison.judgements:
        verdict = "No recommendation." if choice.taken is None else f"Take {comparison.names[choice.taken]}."
        console.print(f"[bold]{escape(verdict)}[/] {escape(choice.reason)}", highlight=False)


class _Column(NamedTuple):
    title: str
    cells: Sequence[str]
    best: Sequence[int] = ()

    @property
    def width(self) -> int:
        """No word is broken, and the title takes few lines."""
        longest = max(map(cell_len, (*self.title.split(), *self.cells)))
        return min(max(longest, -(-cell_len(self.title) // _HEADER_LINES)), _MAX_WIDTH)


def _print_differences(console: TableConsole, differences: Sequence[Difference], names: Sequence[str]) -> None:
    if not differences:
        console.print("Specification, trace, datapath and tools are the same.\n", highlight=False)
        return
    columns = [_Column(f"{one.group}: {one.title}", one.cells) for one in differences]
    _print_columns(console, "What differs", columns, names)


def _print_columns(console: TableConsole, title: str, columns: Sequence[_Column], names: Sequence[str]) -> None:
    """Print a table with a line for each name; what does not fit beside the names follows below, with them again."""
    of_names = min(max(map(cell_len, names)), _MAX_WIDTH)
    rest = list(columns)
    while rest:
        fits = max(
            1, sum(used <= console.width for used in accumulate((c.width + 3 for c in rest), initial=of_names + 4)) - 1
        )
        shown, rest = rest[:fits], rest[fits:]
        table = new_table(title, ["", *(escape(column.title) for column in shown)])
        for column, width in zip(table.columns, (of_names, *(column.width for column in shown)), strict=True):
            column.width = width
        for k, name in enumerate(names):
            cells = [f"[bold green]{escape(c.cells[k])}[/]" if k in c.best else escape(c.cells[k]) for c in shown]
            table.add_row(escape(name), *cells)
        console.print(table)
        title = f"{title.removesuffix(_MORE)}{_MORE}"


def _print_judgement(console: TableConsole, judgement: Judgement) -> None:
    verdict = "[bold green]not worse[/]" if judgement.passed else "[bold red]falls short[/]"
    title = f"{escape(judgement.name)} beside the baseline: {verdict}"
    table = new_table(title, ["figure", "baseline", "candidate", "change", "allowed", "verdict"])
    for one in judgement.judged:
        colour = "green" if one.passed else "red"
        table.add_row(
            one.title, *map(escape, one.cells), one.change, one.tolerance.text(), f"[{colour}]{one.verdict}[/]"
        )
    console.print(table)
    for reason in judgement.reasons:
        console.print(f"  [red]short:[/] {escape(reason)}", highlight=False)
