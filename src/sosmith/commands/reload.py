"""The command `reload`: prove new coefficients for a running core."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from sosmith.commands.chain import refuse, reload_chain
from sosmith.commands.options import BAUD, BOARD, CORE, PORT, REALIZATION, SPEC, WIDTHS_OF, print_tables
from sosmith.interface.files import default_folder, to_json, write_file
from sosmith.output_paths import output_option
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress


@click.command("reload")
@SPEC
@click.argument("other", type=click.Path(path_type=Path))
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@click.option(
    "--active",
    type=click.Path(path_type=Path),
    help="Specification of the coefficients that are active before the swap.  [default: SPEC]",
)
@click.option(
    "--reset",
    is_flag=True,
    help="Assume a reset between the swap and the next sample: there is no transient, and more sets fit.",
)
@click.option(
    "--version",
    type=click.IntRange(0, (1 << 32) - 1),
    default=1,
    show_default=True,
    help="Value of the register VERSION once the new set is active.",
)
@click.option(
    "--lock",
    is_flag=True,
    help="With --port, refuse all further loads until the board is reset; needs hardware.reload_lock = true.",
)
@PORT
@BAUD
@JSON_OPTION
@output_option("JSON file for the register writes.  [default: build/<name>/<stem of OTHER>.reload.json]")
def reload_command(
    spec: Path,
    other: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    active: Path | None,
    reset: bool,
    version: int,
    lock: bool,
    port: str | None,
    baud: int,
    as_json: bool,
    output: Path | None,
) -> None:
    """Prove that a running core can load new coefficients, and save the register writes.

    SPEC is the specification that the core was generated from, with `reload = true` under [hardware]; give the same
    options as then. OTHER is a specification with another [calibration], [filter] or max_error and otherwise as SPEC;
    its [hardware] is ignored.

    The word lengths of the hardware are fixed, so not every set of coefficients fits. The proof shows that with the new
    set the error stays within OTHER's max_error, and that nothing can overflow while the filter's states still come
    from the previous set. The table says after how many samples the bound holds again; do not swap again before that.
    A core that judges wear restarts with the new set, as after a reset, and needs no more than the proof of its error.
    Exits with 1 and the reason if the set is refused; do not load it then.

    Of a chain, OTHER has other coefficients of one stage with `reload = true`, and is otherwise as SPEC. The bound of
    the chain is proven anew, and that no port behind the stage limits what passes.

    With --port, the set is loaded into the board there, and what became active is read back.

    `writes` in the JSON file are pairs of a byte address and a data word for the AXI4-Lite port, in order. Check first
    that the register DESIGN equals `design`. docs/registers.md describes the registers.

    \b
        sosmith reload my.toml recalibrated.toml
        sosmith reload my.toml recalibrated.toml --version 2 --port /dev/ttyUSB1
    """
    from sosmith.interface.chain.specification import ChainSpecification, specification_in
    from sosmith.interface.specification import Specification

    if lock and port is None:
        raise click.UsageError("--lock must have --port, the board to lock")
    if isinstance(chain := specification_in(spec), ChainSpecification):
        refuse(core=core, realization=realization, widths_of=widths_of, active=active)
        path = output or default_folder(chain.name) / f"{other.stem}.reload.json"
        writes = reload_chain(chain, other, board, path, reset=reset, version=version, as_json=as_json)
        _load(writes, port, baud, lock=lock)
        return
    asked, wanted = Specification.load(spec), Specification.load(other)
    running = None if active is None else Specification.load(active)
    with show_progress() as step:
        from sosmith.interface.design import design

        designed = design(asked, core=core, realization=realization, widths_of=widths_of, board=board, progress=step)
        proven = designed.reload(wanted, active=running, reset=reset, version=version, progress=step)
    path = output or default_folder(asked.name) / f"{other.stem}.reload.json"
    write_file(path, to_json(proven.writes))
    if as_json:
        print_json(proven.writes)
    else:
        print_tables([proven.table])
    note(f"wrote {path}")
    _load(proven.writes, port, baud, lock=lock)


def _load(writes: dict[str, Any], port: str | None, baud: int, *, lock: bool) -> None:
    """Load a set into the board at a port, if one is given."""
    if port is None:
        return
    from sosmith import Board

    with Board(port, baud=baud) as client:
        loaded = client.load(writes)
        if lock:
            client.lock()
    note(f"active on {port}: version {loaded.version}, CRC {loaded.crc:#010x}, {loaded.words} words")
    if lock:
        note(f"locked on {port}: no set can be loaded until a reset")
