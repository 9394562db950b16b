"""What combines in a specification, as a table: architectures, and what each option goes together with."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Console

from sosmith.commands.tables.console import new_table
from sosmith.interface.specification import Combination

_OK = "ok"


def table_rows(pairs: Sequence[Combination]) -> tuple[list[str], list[list[str]]]:
    """Return the heading and the rows of the table: a row for each option, a column for each architecture.

    The last column has the options that it does not go together with.
    """
    options = list(dict.fromkeys(each.option for each in pairs))
    names = [name for name in dict.fromkeys(each.row for each in pairs) if name not in options]
    verdicts = {(each.row, each.option): each.verdict for each in pairs if not each.beside}
    rows = [
        [option, *(verdicts[name, option] for name in names), "; ".join(_not_beside(option, pairs))]
        for option in options
    ]
    return ["", *names, "not together with"], rows


def _not_beside(option: str, pairs: Sequence[Combination]) -> Iterator[str]:
    """List the options that one does not go together with, by the verdict."""
    options = {each.option for each in pairs}
    others: dict[str, list[str]] = {}
    for each in pairs:
        pair = [each.beside or each.row, each.option]
        if option in pair and options.issuperset(pair) and each.verdict != _OK:
            other = pair[pair.index(option) - 1]
            others.setdefault(each.verdict, []).append(f"{other} in {each.row}" if each.beside else other)
    for verdict, names in others.items():
        yield f"{', '.join(names)} ({verdict})"


def reasons(pairs: Sequence[Combination]) -> list[str]:
    """Return why combinations are refused or of no use, one sentence for each reason."""
    subjects: dict[tuple[str, str], list[str]] = {}
    for each in pairs:
        if each.reason:
            row = f"{each.row} and {each.beside}" if each.beside else each.row
            subjects.setdefault((row, each.reason), []).append(each.option)
    return [f"{row} with {' or '.join(options)}: {reason}" for (row, reason), options in subjects.items()]


def print_combinations(console: Console, pairs: Sequence[Combination]) -> None:
    """Print the table, its last column below as a table of its own, and the reasons."""
    heading, rows = table_rows(pairs)
    *names, apart = heading
    table, beside = new_table("What combines", names), new_table("Options of one specification", ["", apart])
    for *verdicts, others in rows:
        table.add_row(*verdicts)
        if others:
            beside.add_row(verdicts[0], others)
    console.print(table)
    console.print(beside)
    for reason in reasons(pairs):
        console.print(reason)


def markdown(pairs: Sequence[Combination]) -> str:
    """Return the table and the reasons in Markdown."""
    heading, rows = table_rows(pairs)
    lines = [heading, ["---"] * len(heading), *rows]
    table = "".join(f"| {' | '.join(line)} |\n" for line in lines)
    return "\n".join([table, *(f"- {reason}" for reason in reasons(pairs)), ""])
