"""The console on stdout, and the table style of all commands."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from sosmith import Table as Facts
from sosmith.terminal import NARROWEST

_VERDICTS = {None: "", True: ": [bold green]passed[/]", False: ": [bold red]fell short[/]"}

_MAX_TITLE = 76
"""Columns that the narrowest terminals have."""


class TableConsole(Console):
    """A console that leaves a closed pipe to `sosmith.terminal.reader_may_leave`, and no blanks at the ends of lines.

    Without a terminal there is nothing that blanks could paint over; a diff or a quotation shows them.
    """

    def __init__(self) -> None:
        super().__init__()
        self.width = max(self.width, NARROWEST)

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError

    def print(self, *objects: Any, **options: Any) -> None:
        """Print as `rich.console.Console.print` does."""
        if self.is_terminal:
            super().print(*objects, **options)
            return
        with self.capture() as captured:
            super().print(*objects, **options)
        self.file.write("".join(f"{line.rstrip()}\n" for line in captured.get().splitlines()))


def new_table(title: str, columns: list[str]) -> Table:
    """Make an empty table; it has no header if all column names are empty."""
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", title_style="bold", show_header=any(columns))
    table.min_width = min(cell_len(Text.from_markup(title).plain), _MAX_TITLE)  # a title is wrapped to its table
    for column in columns:
        table.add_column(column, overflow="fold")
    return table


def print_all(tables: Iterable[Facts]) -> None:
    """Print what the interface says in tables."""
    console = TableConsole()
    for facts in tables:
        table = new_table(f"{escape(facts.title)}{_VERDICTS[facts.passed]}", [escape(name) for name in facts.head])
        for first, *rest in facts.rows:
            style = facts.styles.get(first)
            heading = escape(first) if style is None else f"[{style}]{escape(first)}[/]"
            table.add_row(heading, *map(escape, rest))
        console.print(table)
        for sentence in facts.notes:
            console.print(escape(sentence), highlight=False)
