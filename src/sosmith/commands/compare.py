"""The command `compare`: accuracy reports side by side."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.model.text_files import write_files
from sosmith.terminal import JSON_OPTION, note, output_option, print_json


@click.command("compare")
@click.argument("reports", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="REPORT REPORT...")
@JSON_OPTION
@output_option("HTML file to write the comparison to as well.")
def compare_command(reports: tuple[Path, ...], as_json: bool, output: Path | None) -> None:
    """Compare accuracy reports side by side.

    Each REPORT is a report.json file or the folder that contains it.

    \b
        sosmith compare build/clearance build/ramp -o comparison.html
    """
    from sosmith.interface.comparison import compare

    comparison = compare(reports)
    if output is not None:
        write_files(output.parent, {output.name: comparison.page()})
        note(f"wrote {output}")
    if as_json:
        print_json(comparison.as_dict())
    else:
        from sosmith.commands.tables.comparison import print_comparison

        print_comparison(comparison)
