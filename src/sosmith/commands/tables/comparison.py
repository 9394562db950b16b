"""The table of accuracy reports side by side."""

from __future__ import annotations

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.interface.comparison import Comparison


def print_comparison(comparison: Comparison) -> None:
    """Print one row per property, with the best values in green."""
    table = new_table("Accuracy reports", ["", *map(escape, comparison.names)])
    for row in comparison.rows:
        cells = [
            f"[bold green]{escape(cell)}[/]" if k in row.best else escape(cell) for k, cell in enumerate(row.cells)
        ]
        table.add_row(escape(row.title), *cells)
    TableConsole().print(table)
