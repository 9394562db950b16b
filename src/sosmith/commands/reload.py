"""The command `reload`: prove a set of constants for a core that runs."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.commands.options import BOARD, CORE, REALIZATION, SPEC, WIDTHS_OF, default_folder
from sosmith.model.text_files import to_json, write_files
from sosmith.terminal import JSON_OPTION, note, output_option, print_json, show_progress


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
    help="Specification of the set that the core runs when it is loaded.  [default: SPEC]",
)
@click.option(
    "--reset",
    is_flag=True,
    help="The core will be reset between the swap and its next sample: no transient then, and more sets fit.",
)
@click.option(
    "--version",
    type=click.IntRange(0, (1 << 32) - 1),
    default=1,
    show_default=True,
    help="What the register VERSION is to read once the set is active.",
)
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
    as_json: bool,
    output: Path | None,
) -> None:
    """Prove a set of constants for a core that runs, and write what loads it.

    SPEC is what the core was generated from, with `reload = true` under [hardware], and with the same options. OTHER is
    a specification with another [calibration], [filter] or max_error, all else as in SPEC; its [hardware] does not
    count.

    The hardware keeps its word lengths, so not every set fits. This proves that the new set keeps its error within
    OTHER's max_error, and that nothing inside can wrap while the filter still remembers the set before. The table says
    after how many samples the bound holds again; no other swap may follow before. Exits with 1 and the reason if the
    set is refused: then do not load it.

    The file's `writes` are pairs of a byte address and a word for the AXI4-Lite port, in order. Before, compare
    `design` with the register DESIGN. docs/registers.md has the registers.

    \b
        sosmith reload my.toml recalibrated.toml
    """
    from sosmith.interface.specification import Specification

    asked, wanted = Specification.load(spec), Specification.load(other).checked
    running = None if active is None else Specification.load(active).checked
    with show_progress() as step:
        from sosmith.gen.reload.register_writes import reload_json
        from sosmith.gen.reload.reload import check_swap, own_set, set_for
        from sosmith.interface.design import design

        made = design(asked, core=core, realization=realization, widths_of=widths_of, board=board, progress=step).core
        step("set")
        new = set_for(made, wanted)
        before = own_set(made) if running is None else set_for(made, running)
        step("swap")
        swap = check_swap(made, None if reset else before, new)
    tree = reload_json(made, swap, version)
    path = output or default_folder(asked.name) / f"{other.stem}.reload.json"
    write_files(path.parent, {path.name: to_json(tree)})
    if as_json:
        print_json(tree)
    else:
        from sosmith.commands.tables.reload import print_swap

        print_swap(made, wanted, swap, tree)
    note(f"wrote {path}")
