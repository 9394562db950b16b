"""Commands from the example to the files: `init`, `design`, `generate`."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.commands.design_tables import print_design
from sosmith.commands.options import (
    BOARD,
    CORE,
    REALIZATION,
    SPEC,
    WIDTHS_OF,
    board_named,
    default_folder,
)
from sosmith.gen.core import design_core
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.generate import generate as generate_files
from sosmith.gen.output.manifest import manifest
from sosmith.gen.specification.specification import example, load
from sosmith.model.errors import SpecificationError
from sosmith.model.text_files import write_files
from sosmith.terminal import JSON_OPTION, note, output_option, print_json, show_progress


@click.command()
@click.argument("file", type=click.Path(path_type=Path), default=Path("flange_wear.toml"))
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def init(file: Path, force: bool) -> None:
    """Write a commented example specification to FILE (flange_wear.toml if none is given)."""
    if file.exists() and not force:
        raise SpecificationError(f"{file}: the file must not exist yet; use --force to overwrite it")
    write_files(file.parent, {file.name: example()})
    note(f"wrote {file}; next: sosmith design {file}")


@click.command()
@SPEC
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@JSON_OPTION
def design(
    spec: Path, core: str | None, realization: str | None, widths_of: str | None, board: str | None, as_json: bool
) -> None:
    """Show the design of SPEC: order, sections, realization, formats, error budget, cost."""
    target = board_named(board)
    with show_progress() as step:
        made = design_core(
            load(spec), core=core, realization=realization, widths_of=widths_of, board=target, progress=step
        )
    if as_json:
        print_json(manifest(core_facts(made)))
    else:
        print_design(made)


@click.command()
@SPEC
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@output_option("Folder for the files.  [default: build/<name>]")
def generate(
    spec: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    output: Path | None,
) -> None:
    """Write SystemVerilog, RTLIL, manifest, certificate and a bit-true C model of SPEC.

    The paths of the files go to stdout, one a line. Two runs write the same bytes.
    """
    target = board_named(board)
    with show_progress() as step:
        made = design_core(
            load(spec), core=core, realization=realization, widths_of=widths_of, board=target, progress=step
        )
        paths = generate_files(made, output or default_folder(made), step)
    for path in paths:
        click.echo(path)
