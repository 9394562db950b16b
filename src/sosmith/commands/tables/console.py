"""The console on stdout, and tables in the one style of all commands."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table


class TableConsole(Console):
    """A console that leaves it to `sosmith.terminal.reader_may_leave` when the reader of its output has gone."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def new_table(title: str, columns: list[str]) -> Table:
    """Make a table without rows; without names of columns it has no header."""
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", title_style="bold", show_header=any(columns))
    for column in columns:
        table.add_column(column, overflow="fold")
    return table
