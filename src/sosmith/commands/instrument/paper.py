"""The command `sosmith paper`: the paper's equations and tables recomputed and compared with the printed figures."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.commands.options import print_tables
from sosmith.interface.files import write_file, write_files
from sosmith.output_paths import output_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress


@click.command("paper")
@output_option("Markdown file to write; its pictures go into images/ next to it.")
@JSON_OPTION
def paper(output: Path | None, as_json: bool) -> None:
    """Recompute the paper's equations and tables, and compare them with the printed figures.

    Prints how many figures of each are reproduced, near, different or not comparable. With -o, writes the complete
    comparison with explanations and pictures; --json prints all figures.

    \b
        sosmith paper -o paper/paper.md
    """
    from sosmith.interface.instrument.paper import Paper

    with show_progress() as step:
        made = Paper()
        step("computing")
        tables = made.tables()
        if output is not None:
            step("drawing")
            files = made.files()
            write_file(output, files.pop("paper.md"))
            write_files(output.parent / "images", {name.removeprefix("images/"): text for name, text in files.items()})
    if as_json:
        print_json(made.figures())
    elif output is None:
        print_tables(tables)
    if output is not None:
        note(f"wrote {output} and its pictures in {output.parent / 'images'}")
