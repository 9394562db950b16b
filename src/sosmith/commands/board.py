"""`sosmith board`: the board of a specification, virtual, at a pseudo-terminal."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.commands.chain import refuse, serve_chain
from sosmith.commands.options import BAUD, CORE, REALIZATION, SEED, SPEC, completed_by
from sosmith.interface.choices import BUILDABLE, PROJECTS, board_named
from sosmith.interface.files import default_folder
from sosmith.model.errors import SpecificationError
from sosmith.output_paths import folder_option
from sosmith.terminal import note, show_progress

if TYPE_CHECKING:
    from sosmith.interface.specification import Specification


class _Speed(click.ParamType[float]):
    """A factor of real time, or max, which is 0."""

    name = "speed"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if value in {"max", 0.0}:
            return 0.0
        try:
            factor = float(value)
        except ValueError:
            factor = 0.0
        if not 0 < factor < 1e6:
            self.fail(f"{value!r} is neither max nor a factor of real time, such as 1", param, ctx)
        return factor


@click.command("board")
@SPEC
@click.option("--virtual", is_flag=True, help="Run the board in this computer; required.")
@click.option(
    "--model",
    is_flag=True,
    help="Take the integer model and a model of the link instead of the netlist: faster, and needs no Verilator.",
)
@CORE
@REALIZATION
@click.option(
    "--clock", type=click.FloatRange(min=0, min_open=True), help="Clock in Hz.  [default: that of the specification]"
)
@click.option(
    "--board",
    metavar="BOARD",
    callback=lambda ctx, parameter, name: None if name is None else board_named(name, (*BUILDABLE, *PROJECTS)),
    shell_complete=completed_by((*BUILDABLE, *PROJECTS)),
    help="Run at the clock of this board, as `sosmith build` makes it.",
)
@BAUD
@click.option(
    "--heard",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.wav",
    help="Play --trace once, without a port, and write what the DAC of [converter.output] gets.",
)
@click.option(
    "--trace",
    metavar="FILE|SCENARIO",
    help="What the converters of SPEC measure, as for `sosmith simulate`.  [default: the default scenario]",
)
@click.option(
    "--speed",
    type=_Speed(),
    metavar="FACTOR|max",
    help="Factor of real time.  [default: 1 with converters, max without]",
)
@click.option(
    "--fault",
    type=click.FloatRange(min=1),
    metavar="N",
    help="Damage one in N bytes on the line, on average, in both directions.",
)
@click.option(
    "--fault-kinds",
    default="flip,drop,insert",
    show_default=True,
    help="What damage does to a byte, separated by commas.",
)
@SEED
@folder_option("Folder for the files.  [default: build/<name>/board]")
def board_command(
    spec: Path,
    virtual: bool,
    model: bool,
    core: str | None,
    realization: str | None,
    clock: float | None,
    board: str | None,
    baud: int,
    heard: Path | None,
    trace: str | None,
    speed: float | None,
    fault: float | None,
    fault_kinds: str,
    seed: int,
    output: Path | None,
) -> None:
    """Run the board of SPEC behind a pseudo-terminal, whose path is the first line on stdout.

    The board's top, with link and core, is built by Verilator from the same SystemVerilog as for a real board, so that
    a host cannot tell the difference. It runs until it is interrupted. `sosmith stream`, `monitor`, `reload --port` and
    `simulate --port` take its path as a port.

    With [converter.NAME] tables in SPEC, models of these converters are at the pins of the board, and give what is in
    --trace, from the moment on at which a host opens the port; the last value stays. With --heard, the trace is played
    from its begin to its end instead, and what the DAC gets is compared with the integer model: exits with 1 if one
    bit differs.

    \b
        sosmith board my.toml --virtual
        sosmith board my.toml --virtual --trace wear_ramp
        sosmith board my.toml --virtual --speed 1 --fault 1000
        sosmith board my.toml --virtual --board ulx3s_25f --trace music.wav --heard filtered.wav
    """
    if not virtual:
        raise SpecificationError("--virtual must be given: a real board is made by `sosmith build`")
    from sosmith.interface.chain.specification import ChainSpecification, specification_in
    from sosmith.interface.virtual_board import LineDamage, ModelBoard, NetlistBoard, Terminal

    asked = specification_in(spec)
    damage = None if fault is None else LineDamage(fault, seed, tuple(fault_kinds.split(",")))
    if board is not None and clock is not None:
        raise SpecificationError("--clock must be left out with --board, which has its own")
    if isinstance(asked, ChainSpecification):
        refuse(core=core, realization=realization, model=model, heard=heard, trace=trace)
        options: dict[str, Any] = {"clock": clock, "board": board, "baud": baud, "seed": seed}
        serve_chain(asked, output or default_folder(asked.name) / "board", damage, speed, **options)
        return
    _check(asked, trace, heard, model=model)
    with show_progress() as step:
        from sosmith.interface.design import design

        designed = design(asked, core=core, realization=realization, progress=step)
        folder = output or default_folder(asked.name) / "board"
        if model:
            step("model of the board")
            modelled = ModelBoard(designed, baud=baud)
        else:
            netlist = NetlistBoard(
                designed, folder, clock=clock, board=board, baud=baud, trace=trace, seed=seed, progress=step
            )
        if heard is not None:
            step("playing")
            frames, wrong = netlist.play(heard)
    if heard is not None:
        verdict = "all as in the integer model" if wrong == 0 else f"{wrong:,} words differ from the integer model"
        click.echo(f"{heard}: {frames:,} samples of each channel, {verdict}")
        if wrong:
            sys.exit(1)
        return
    with Terminal() as terminal:
        click.echo(terminal.path)
        if model:
            note(f"the model of {asked.name} is at {terminal.path}; Ctrl-C ends it")
            modelled.serve(terminal, damage)
        else:
            note(f"{asked.name} is at {terminal.path}; Ctrl-C ends it")
            netlist.serve(terminal, damage, speed)


def _check(asked: Specification, trace: str | None, heard: Path | None, *, model: bool) -> None:
    """Check that a specification has the converters that options are about.

    Raises
    ------
    SpecificationError
        If it has none, or those that it has are not in the model.
    """
    measures = bool(asked.checked.converters)
    if trace is not None and not measures:
        raise SpecificationError("--trace must come with [converter.NAME] tables in SPEC, or be given to `monitor`")
    if heard is not None and asked.checked.dac is None:
        raise SpecificationError("--heard must come with a table [converter.output] in SPEC")
    if model and measures:
        raise SpecificationError("--model must be left out for a board with converters")
