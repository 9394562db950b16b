"""What commands do with a chain of stages."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.commands.options import print_tables
from sosmith.interface.choices import BUILDABLE
from sosmith.interface.files import default_folder, to_json, write_file
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.terminal import note, print_json, reader_may_leave, show_progress

if TYPE_CHECKING:
    from sosmith.interface.chain.certificate import ChainCertificate
    from sosmith.interface.chain.specification import ChainSpecification
    from sosmith.interface.virtual_board import LineDamage


def refuse(instead: str = "", **options: Any) -> None:
    """Refuse options of a command that a chain does not take, by their names; None and False are not given.

    `instead` says what to do, and begins with a colon.

    Raises
    ------
    SpecificationError
        For the first one that is given.
    """
    for name, value in options.items():
        if value is not None and value is not False:
            raise SpecificationError(
                f"--{name.replace('_', '-')} must be left out with a chain of stages, as it is for a single core only"
                f"{instead}"
            )


def show_chain(
    asked: ChainSpecification, board: str | None, plot: Path | None, *, details: bool, as_json: bool
) -> None:
    """Design a chain, show it, built for a board if there is one, and draw it into the file `plot`."""
    from sosmith.interface.chain.design import design_chain

    with show_progress() as step:
        chain = design_chain(asked, board=board, progress=step)
        step("aliasing", 0, 0)
        tables = [] if as_json else chain.tables(details=details)
        cost = None if board not in BUILDABLE else chain.cost_on(board, step)
        if plot is not None:
            step("drawing", 0, 0)
            chain.plot(plot)
    if plot is not None:
        note(f"wrote {plot}")
    if as_json:
        print_json(chain.as_dict() if cost is None else chain.as_dict() | {"board": cost})
        return
    if cost is not None:
        from sosmith.interface.build import build_table

        tables.append(build_table(cost))
    print_tables(tables)


def write_chain(asked: ChainSpecification, board: str | None, output: Path | None) -> None:
    """Write the files of a chain, and print their paths."""
    from sosmith.interface.chain.design import design_chain

    with show_progress() as step:
        paths = design_chain(asked, board=board, progress=step).generate(output or default_folder(asked.name), step)
    for path in paths:
        click.echo(path)


def pack_chain(asked: ChainSpecification, board: str | None, folder: Path, vlnv: str | None) -> None:
    """Pack a chain for other tools, and print the paths of the files."""
    from sosmith.interface.chain.design import design_chain

    with show_progress() as step:
        paths = design_chain(asked, board=board, progress=step).package(folder, vlnv=vlnv, progress=step)
    for path in paths:
        click.echo(path)


def reload_chain(
    asked: ChainSpecification,
    other: Path,
    board: str | None,
    path: Path,
    *,
    reset: bool,
    version: int,
    as_json: bool,
) -> dict[str, Any]:
    """Prove other coefficients of a stage, write the register writes into the file `path`, and show what is proven."""
    from sosmith.interface.chain.design import design_chain

    with show_progress() as step:
        chain = design_chain(asked, board=board, progress=step)
        proven = chain.reload(other, reset=reset, version=version, progress=step)
    write_file(path, to_json(proven.writes))
    if as_json:
        print_json(proven.writes)
    else:
        print_tables(proven.tables())
    note(f"wrote {path}")
    return proven.writes


def serve_chain(
    asked: ChainSpecification, folder: Path, damage: LineDamage | None, speed: float | None, **options: Any
) -> None:
    """Run the board of a chain behind a pseudo-terminal, whose path is printed first, until interrupted."""
    from sosmith.interface.chain.design import design_chain
    from sosmith.interface.virtual_board import NetlistBoard, Terminal

    with show_progress() as step:
        chain = design_chain(asked, progress=step)
        netlist = NetlistBoard(chain, folder, trace=None, progress=step, **options)
    with Terminal() as terminal:
        click.echo(terminal.path)
        note(f"{asked.name} is at {terminal.path}; Ctrl-C ends it")
        netlist.serve(terminal, damage, speed)


def run_chain(
    asked: ChainSpecification,
    board: str | None,
    source: str | None,
    *,
    as_json: bool,
    output: Path | None,
    **options: Any,
) -> bool:
    """Simulate a chain and show the report; return whether it passed."""
    from sosmith.interface.chain.design import design_chain

    with show_progress() as step:
        chain = design_chain(asked, board=board, progress=step)
        report = chain.simulate(source, folder=output or default_folder(asked.name), progress=step, **options)
    with reader_may_leave():
        if as_json:
            print_json(report.summary)
        else:
            print_tables([report.table])
    note(f"report: {(report.folder / 'report.html').resolve().as_uri()}")
    return report.passed


def prove_chain(
    read: ChainCertificate,
    path: Path,
    *,
    spec: Path | None,
    files: Path | None,
    rocq: bool,
    export: Path | None,
    limit: dict[str, float],
    as_json: bool,
) -> bool:
    """Prove the certificate of a chain and show what is proven; return whether all of it is.

    Raises
    ------
    ShortfallError
        If anything is wrong.
    """
    with show_progress() as step:
        try:
            proof = read.verify(step, spec=spec, files=files, **limit)
            written = [] if export is None else read.export_rocq(export)
            checked = read.check_in_rocq(step, **limit) if rocq else None
        except ShortfallError as error:
            raise ShortfallError(f"{path}: {error}") from None
    if as_json:
        kernel = {} if checked is None else {"rocq": asdict(checked)}
        print_json({"name": read.name, **proof.as_dict(), **kernel})
    else:
        from sosmith.commands.tables.certificate import print_chain_proof
        from sosmith.commands.tables.rocq import print_rocq

        print_chain_proof(read.name, proof)
        print_rocq(checked, written)
    return not proof.missing and (checked is None or not checked.unchecked)
