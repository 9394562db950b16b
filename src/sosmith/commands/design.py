"""Commands from the example to the files: `init`, `design`, `generate`."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.commands.options import BOARD, CORE, REALIZATION, SPEC, WIDTHS_OF, default_folder
from sosmith.gen.fpga.boards import BUILDABLE
from sosmith.gen.picture import format_of
from sosmith.model.errors import SpecificationError
from sosmith.model.text_files import write_files
from sosmith.terminal import JSON_OPTION, note, output_option, print_json, show_progress


@click.command()
@click.argument("file", type=click.Path(path_type=Path), default=Path("flange_wear.toml"))
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def init(file: Path, force: bool) -> None:
    """Write a commented example specification to FILE (default: flange_wear.toml).

    \b
        sosmith init my.toml
    """
    if file.exists() and not force:
        raise SpecificationError(f"{file}: the file must not exist yet; use --force to overwrite it")
    from sosmith.gen.specification.specification import example

    write_files(file.parent, {file.name: example()})
    note(f"wrote {file}; next: sosmith design {file}")


@click.command("design")
@SPEC
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@click.option("--details", is_flag=True, help="Also show sections, limit cycles and schedule.")
@click.option(
    "--plot", type=click.Path(path_type=Path), help="SVG or PNG file for a plot of gain, delay and calibration."
)
@JSON_OPTION
def design_command(
    spec: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    details: bool,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Show the design of SPEC: order, realization, architecture, cost and error budget.

    With --board, it is built for that board as `sosmith build` does, which takes some tens of seconds the first time,
    and the cells are those that it takes there, with the serial link.

    \b
        sosmith design my.toml
        sosmith design my.toml --details --plot my.svg
        sosmith design my.toml --board icebreaker --json
    """
    from sosmith.interface.specification import Specification

    if plot is not None:
        format_of(plot)
    asked = Specification.load(spec)
    if asked.checked.filter.origin:
        note(asked.checked.filter.origin)
    with show_progress() as step:
        from sosmith.interface.design import design

        made = design(asked, core=core, realization=realization, widths_of=widths_of, board=board, progress=step)
        cost = None if board not in BUILDABLE else made.cost_on(board, step)
        if plot is not None:
            step("drawing")
            made.plot(plot)
    if plot is not None:
        note(f"wrote {plot}")
    if as_json:
        print_json(made.manifest if cost is None else made.manifest | {"board": cost})
    else:
        from sosmith.commands.tables.design import print_design

        print_design(made, details=details)
        if cost is not None:
            from sosmith.commands.tables.build import print_build

            print_build(cost)


@click.command("generate")
@SPEC
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@output_option("Folder for the files.  [default: build/<name>]")
def generate_command(
    spec: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    output: Path | None,
) -> None:
    """Write SystemVerilog, RTLIL, a manifest, a certificate and a bit-true C model for SPEC.

    Prints the paths of the files to stdout, one per line. Two runs write identical files.

    \b
        sosmith generate my.toml -o my_core
    """
    from sosmith.interface.specification import Specification

    asked = Specification.load(spec)
    with show_progress() as step:
        from sosmith.interface.design import design

        made = design(asked, core=core, realization=realization, widths_of=widths_of, board=board, progress=step)
        paths = made.generate(output or default_folder(asked.name), step)
    for path in paths:
        click.echo(path)
