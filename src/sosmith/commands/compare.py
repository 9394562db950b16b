"""The command `compare`: accuracy reports side by side."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.model.text_files import write_files
from sosmith.terminal import JSON_OPTION, note, output_option, print_json


@click.command("compare")
@click.argument("reports", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="REPORT REPORT...")
@JSON_OPTION
@output_option("Write a page with the comparison to this HTML file too.")
def compare_command(reports: tuple[Path, ...], as_json: bool, output: Path | None) -> None:
    """Set accuracy reports side by side; each REPORT is a report.json or the folder that holds it."""
    loaded = [load_report(path) for path in reports]
    if output is not None:
        write_files(output.parent, {output.name: comparison_page(loaded)})
        note(f"wrote {output}")
    if as_json:
        print_json(comparison_json(loaded))
        return
    table = new_table("Accuracy reports", ["", *map(escape, column_names(loaded))])
    for row in compare_reports(loaded):
        cells = [
            f"[bold green]{escape(cell)}[/]" if k in row.best else escape(cell) for k, cell in enumerate(row.cells)
        ]
        table.add_row(escape(row.title), *cells)
    TableConsole().print(table)
