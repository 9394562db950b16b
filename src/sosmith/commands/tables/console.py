"""The console on stdout, and the table style of all commands."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table


class TableConsole(Console):
    """A console that leaves a closed pipe to `sosmith.terminal.reader_may_leave`."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def new_table(title: str, columns: list[str]) -> Table:
    """Make an empty table; it has no header if all column names are empty."""
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", title_style="bold", show_header=any(columns))
    for column in columns:
        table.add_column(column, overflow="fold")
    return table
