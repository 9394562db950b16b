"""From a specification to an FPGA: `build`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.commands.chain import refuse
from sosmith.commands.options import CORE, REALIZATION, SPEC, completed_by, print_tables
from sosmith.interface.choices import BUILDABLE, PROJECTS, board_named
from sosmith.interface.files import default_folder
from sosmith.model.errors import SpecificationError
from sosmith.output_paths import folder_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress

if TYPE_CHECKING:
    from sosmith.interface.chain.design import Chain
    from sosmith.interface.design import Design


@click.command("build")
@SPEC
@CORE
@REALIZATION
@click.option(
    "--board",
    required=True,
    metavar="BOARD",
    callback=lambda ctx, parameter, name: board_named(name, (*BUILDABLE, *PROJECTS)),
    shell_complete=completed_by((*BUILDABLE, *PROJECTS)),
    help=f"Target board: {', '.join(BUILDABLE)}; project files only: {', '.join(PROJECTS)}.",
)
@click.option(
    "--baud",
    type=click.IntRange(min=1),
    default=1_000_000,
    show_default=True,
    help="Rate of the serial line, at most a fourth of the board's clock.",
)
@click.option("--program", is_flag=True, help="Load the bitstream into the board, with openFPGALoader.")
@JSON_OPTION
@folder_option("Folder for the files.  [default: build/<name>/<board>]")
def build_command(
    spec: Path,
    core: str | None,
    realization: str | None,
    board: str,
    baud: int,
    program: bool,
    as_json: bool,
    output: Path | None,
) -> None:
    """Build a bitstream with the core of SPEC and the serial link of docs/protocol.md for a board.

    Writes the bitstream, build.json with utilisation and timing, build.log, and the files of `sosmith generate`. Exits
    with 1 if the design does not fit or timing does not close, and names the path that does not. Programs are
    those of the system or, where these are missing or too old, the ones of `pip install 'sosmith[boards]'`. The same
    programs give the same bitstream. With [converter.NAME] tables in SPEC, the board reads its inputs from these
    converters, instead of over the link.

    Of a chain of stages, the board has all cores behind one link. Where the chain decimates, a result is repeated until
    the next one, so that each sample has one.

    For a board with a Xilinx FPGA it writes the files of a Vivado project: Verilog, constraints (XDC), the script
    (Tcl), and build.json. No bitstream is made: only Vivado tells whether the design fits and meets its timing.

    \b
        sosmith build my.toml --board icebreaker
        sosmith build my.toml --board ulx3s_25f --baud 3000000 --program
    """
    from sosmith.interface.chain.specification import ChainSpecification, specification_in

    if program and board in PROJECTS:
        raise SpecificationError(f"--program must be left out for {board}: no bitstream is made for it")
    asked = specification_in(spec)
    folder = output or default_folder(asked.name) / board
    if isinstance(asked, ChainSpecification):
        refuse(core=core, realization=realization)
    with show_progress() as step:
        designed: Chain | Design
        if isinstance(asked, ChainSpecification):
            from sosmith.interface.chain.design import design_chain

            designed = design_chain(asked, board=board, progress=step)
        else:
            from sosmith.interface.design import design

            designed = design(asked, core=core, realization=realization, board=board, progress=step)
        designed.generate(folder, step)
        if board in PROJECTS:
            _show_project(designed.project(board, folder=folder, rate=baud, progress=step), folder, as_json=as_json)
            return
        built = designed.build(board, folder=folder, rate=baud, progress=step)
        if program and built.passed:
            step("programming")
            built.program()
    if as_json:
        print_json(built.summary)
    else:
        print_tables([built.table])
    most, wanted = built.summary["samples_per_second"], asked.sample_rate
    if most < wanted:
        note(f"note: at the board's clock the core takes {most:,.0f} samples a second per channel, not {wanted:,.0f}")
    if built.shortfall is not None:
        note(f"error: {built.shortfall}")
        sys.exit(1)
    note(f"bitstream: {built.bitstream}")


def _show_project(summary: dict[str, Any], folder: Path, *, as_json: bool) -> None:
    """Print what a project is, and that nothing was built."""
    project = summary["project"]
    if as_json:
        print_json(summary)
    else:
        from sosmith.interface.build import build_table

        print_tables([build_table(summary)])
    files = ", ".join(project["files"])
    note(f"project for {project['tool']} in {folder}: {files}")
    note(f"no flow was run and no bitstream written; in that folder, {project['command']} makes one")
