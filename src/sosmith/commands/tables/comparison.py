"""The tables of accuracy reports side by side."""

from __future__ import annotations

from collections.abc import Sequence

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.gen.report.comparison.baseline import Judgement
from sosmith.gen.report.comparison.differences import Difference
from sosmith.interface.comparison import Comparison


def print_comparison(comparison: Comparison) -> None:
    """Print what differs, the figures by group, and the verdict last, where it is seen."""
    console, names = TableConsole(), comparison.names
    _print_differences(console, comparison.differences, names)
    for group in comparison.groups:
        table = new_table(group.title, ["", *map(escape, (row.title for row in group.rows))])
        for k, name in enumerate(names):
            cells = [
                f"[bold green]{escape(row.cells[k])}[/]" if k in row.best else escape(row.cells[k])
                for row in group.rows
            ]
            table.add_row(escape(name), *cells)
        console.print(table)
        if group.unfair:
            console.print(f"  [yellow]no winner:[/] {escape(group.unfair)}\n", highlight=False)
    for judgement in comparison.judgements:
        _print_judgement(console, judgement)
    if not comparison.judgements:
        console.print(f"[bold]{escape(comparison.choice.reason)}[/]", highlight=False)


def _print_differences(console: TableConsole, found: Sequence[Difference], names: Sequence[str]) -> None:
    if not found:
        console.print("Specification, trace, datapath and tools are the same.\n", highlight=False)
        return
    table = new_table("What differs", ["", *(escape(f"{one.group}: {one.title}") for one in found)])
    for k, name in enumerate(names):
        table.add_row(escape(name), *(escape(one.cells[k]) for one in found))
    console.print(table)


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
