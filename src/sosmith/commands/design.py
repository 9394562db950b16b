"""Commands from the example to the files: `init`, `design`, `generate`."""

from __future__ import annotations

from os.path import commonpath
from pathlib import Path

import click

from sosmith.commands.chain import refuse, show_chain, write_chain
from sosmith.commands.options import BOARD, CORE, REALIZATION, SPEC, WIDTHS_OF, OneOf, print_tables
from sosmith.interface.choices import BUILDABLE, LIBRARIES, check_library, picture_format
from sosmith.interface.files import DEFAULT, contents, default_folder, titles, write_contents
from sosmith.model.errors import SpecificationError
from sosmith.output_paths import folder_option, plot_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress


@click.command()
@click.argument("file", required=False, type=click.Path(path_type=Path))
@click.option(
    "--example",
    "named",
    metavar="NAME",
    default=DEFAULT,
    show_default=True,
    shell_complete=lambda ctx, parameter, begun: [name for name in titles() if name.startswith(begun)],
    help="Which example; --list names them.",
)
@click.option("--list", "listed", is_flag=True, help="List the examples, and write nothing.")
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def init(file: Path | None, named: str, listed: bool, force: bool) -> None:
    """Write a commented example specification to FILE (default: flange_wear.toml).

    With --example, the files of that example: a specification with the files that it names, or a folder. The folder
    "all" has everything that the documentation calls examples/.

    \b
        sosmith init my.toml
        sosmith init --list
        sosmith init --example recipes/equalizer
    """
    if listed:
        names = titles()
        width = max(map(len, names))
        for name, title in names.items():
            click.echo(f"{name.ljust(width)}  {title}")
        return
    files = contents(named, file)
    if not force:
        for path in files:
            if path.exists():
                raise SpecificationError(f"{path}: the file must not exist yet; use --force to overwrite it")
    for folder in dict.fromkeys(path.parent for path in files):
        write_contents(folder, {path.name: files[path] for path in files if path.parent == folder})
    written = " and ".join(map(str, files)) if len(files) < 3 else f"{len(files)} files to {commonpath(files)}"
    first = next(iter(files))
    note(f"wrote {written}" + (f"; next: sosmith design {first}" if b"\n[filter]" in files[first] else ""))


@click.command("design")
@SPEC
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@click.option(
    "--silicon",
    type=OneOf(tuple(LIBRARIES)),
    help="Also map it onto standard cells, and show area and clock before layout.",
)
@click.option("--details", is_flag=True, help="Also show the uncertainty budget, sections, limit cycles and schedule.")
@plot_option("SVG or PNG file for a plot of gain, delay and calibration.")
@JSON_OPTION
def design_command(
    spec: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    silicon: str | None,
    details: bool,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Show the design of SPEC: order, realization, architecture, cost and error budget.

    With --board, it is built for that board as `sosmith build` does, which takes some tens of seconds the first time,
    and the cells are those that it takes there, with the serial link.

    With --silicon, Yosys maps it onto standard cells, which takes some seconds. The area is also told in NANDs of two
    inputs, the clock is that of the slowest path by OpenSTA. This is before layout: wires take no area and no time. The
    cells are in Debian's packages qflow-tech-osu018 and qflow-tech-osu035, OpenSTA in opensta.

    For a chain with a stage of the kind auto, the first table has the structures that were looked at, their costs for
    the board or an ECP5, and why they were not taken.

    \b
        sosmith design my.toml
        sosmith design my.toml --details --plot my.svg
        sosmith design my.toml --board icebreaker --json
        sosmith design my.toml --silicon osu018
    """
    from sosmith.interface.chain.specification import ChainSpecification, specification_in

    if plot is not None:
        picture_format(plot)
    if silicon is not None:
        check_library(silicon)
    asked = specification_in(spec)
    if isinstance(asked, ChainSpecification):
        refuse(core=core, realization=realization, widths_of=widths_of, silicon=silicon)
        show_chain(asked, board, plot, details=details, as_json=as_json)
        return
    if asked.checked.filter.origin:
        note(asked.checked.filter.origin)
    with show_progress() as step:
        from sosmith.interface.design import design

        designed = design(asked, core=core, realization=realization, widths_of=widths_of, board=board, progress=step)
        cost = None if board not in BUILDABLE else designed.cost_on(board, step)
        cells = None if silicon is None else designed.silicon(silicon, step)
        if plot is not None:
            step("drawing")
            designed.plot(plot)
    if plot is not None:
        note(f"wrote {plot}")
    if as_json:
        more = {"board": cost, "silicon": cells}
        print_json(designed.as_dict() | {name: each for name, each in more.items() if each is not None})
        return
    tables = designed.tables(details=details)
    if cost is not None or cells is not None:
        from sosmith.interface.build import build_table, silicon_table

        tables += [] if cost is None else [build_table(cost)]
        tables += [] if cells is None else [silicon_table(asked.name, cells)]
    print_tables(tables)


@click.command("generate")
@SPEC
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@folder_option("Folder for the files.  [default: build/<name>]")
def generate_command(
    spec: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    output: Path | None,
) -> None:
    """Write SystemVerilog, RTLIL, a manifest, a certificate and a bit-true C model for SPEC.

    Prints the paths of the files to stdout, one per line. Two runs write identical files. For a chain of stages,
    the files of each stage are written as well, and its specification where the stages were chosen.

    \b
        sosmith generate my.toml -o my_core
    """
    from sosmith.interface.chain.specification import ChainSpecification, specification_in

    asked = specification_in(spec)
    if isinstance(asked, ChainSpecification):
        refuse(core=core, realization=realization, widths_of=widths_of)
        write_chain(asked, board, output)
        return
    with show_progress() as step:
        from sosmith.interface.design import design

        designed = design(asked, core=core, realization=realization, widths_of=widths_of, board=board, progress=step)
        paths = designed.generate(output or default_folder(asked.name), step)
    for path in paths:
        click.echo(path)
