"""The command that packs a core for other tools: `package`."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.commands.chain import pack_chain, refuse
from sosmith.commands.options import BOARD, CORE, REALIZATION, SPEC, WIDTHS_OF
from sosmith.interface.files import default_folder
from sosmith.output_paths import folder_option
from sosmith.terminal import show_progress


@click.command("package")
@SPEC
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@click.option(
    "--vlnv",
    metavar="VENDOR:LIBRARY:NAME:VERSION",
    help="Name of the package for FuseSoC and IP-XACT.  [default: user:sosmith:<name>:1.0]",
)
@folder_option("Folder of the package.  [default: build/<name>/package]")
def package_command(
    spec: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    vlnv: str | None,
    output: Path | None,
) -> None:
    """Pack the core of SPEC for other tools, with a bench that needs none of ours.

    The folder core/ has what `sosmith generate` writes. In bench/ are a self-checking bench in plain SystemVerilog, one
    of the C model in C, their vectors and a Makefile; they need neither sosmith nor Python. Beside them are a core file
    for FuseSoC, an IP-XACT component, scripts for Vivado and Quartus, VHDL, wrappers for Amaranth and LiteX, a driver
    for cocotb, and for a reloadable core one in C. README.md says how each is used. Of a chain of stages there are the
    bench, the core file for FuseSoC and the scripts.

    Prints the paths of the files to stdout, one per line. Two runs write identical files.

    \b
        sosmith package my.toml -o my_core
        make -C my_core/bench icarus
    """
    from sosmith.interface.chain.specification import ChainSpecification, specification_in
    from sosmith.interface.choices import check_vlnv

    if vlnv is not None:
        check_vlnv(vlnv)
    asked = specification_in(spec)
    folder = output or default_folder(asked.name) / "package"
    if isinstance(asked, ChainSpecification):
        refuse(core=core, realization=realization, widths_of=widths_of)
        pack_chain(asked, board, folder, vlnv)
        return
    with show_progress() as step:
        from sosmith.interface.design import design

        designed = design(asked, core=core, realization=realization, widths_of=widths_of, board=board, progress=step)
        paths = designed.package(folder, vlnv=vlnv, progress=step)
    for path in paths:
        click.echo(path)
