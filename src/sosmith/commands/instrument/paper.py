"""The command `sosmith paper`: the paper's equations and tables recomputed and compared with the printed figures."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.interface.files import write_files
from sosmith.terminal import JSON_OPTION, note, output_option, print_json, show_progress


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
    from sosmith.instrument.paper.comparison import LABELS
    from sosmith.instrument.paper.document import paper_files, paper_json, summary_rows
    from sosmith.instrument.paper.figures import read_paper_figures

    with show_progress() as step:
        figures = read_paper_figures()
        step("computing")
        rows = summary_rows(figures)
        if output is not None:
            step("drawing")
            files = paper_files(figures)
            write_files(output.parent, {output.name: files.pop("paper.md")})
            write_files(output.parent / "images", {name.removeprefix("images/"): text for name, text in files.items()})
    if as_json:
        print_json(paper_json(figures))
    elif output is None:
        from sosmith.commands.tables.console import TableConsole, new_table

        listing = new_table("The paper's figures compared with ours", ["", *LABELS])
        for row in rows:
            listing.add_row(*row[:-1])
        TableConsole().print(listing)
    if output is not None:
        note(f"wrote {output} and its pictures in {output.parent / 'images'}")
