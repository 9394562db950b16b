"""`sosmith board`: the board of a specification, virtual, at a pseudo-terminal."""

from __future__ import annotations

import socket
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.commands.options import BAUD, CORE, REALIZATION, SEED, SPEC, default_folder
from sosmith.commands.output_paths import folder_option
from sosmith.model.errors import SpecificationError, ToolError
from sosmith.terminal import note, show_progress

if TYPE_CHECKING:
    from sosmith.gen.core import CoreDesign
    from sosmith.model.arrays import Codes


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
@BAUD
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
    baud: int,
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
    --trace, from the moment on at which a host opens the port; the last value stays.

    \b
        sosmith board my.toml --virtual
        sosmith board my.toml --virtual --trace wear_ramp
        sosmith board my.toml --virtual --speed 1 --fault 1000
    """
    if not virtual:
        raise SpecificationError("--virtual must be given: a real board is made by `sosmith build`")
    from sosmith.interface.specification import Specification
    from sosmith.sim.virtual_board.line_damage import LineDamage
    from sosmith.sim.virtual_board.terminal import Terminal

    asked = Specification.load(spec)
    damage = None if fault is None else LineDamage(fault, seed, tuple(fault_kinds.split(",")))
    rate = asked.checked.hardware.clock if clock is None else Fraction(clock)
    measures = bool(asked.checked.converters)
    if trace is not None and not measures:
        raise SpecificationError("--trace must come with [converter.NAME] tables in SPEC, or be given to `monitor`")
    if model and measures:
        raise SpecificationError("--model must be left out for a board with converters")
    with show_progress() as step:
        from sosmith.interface.design import design

        made = design(asked, core=core, realization=realization, progress=step).core
        folder = output or default_folder(asked.name) / "board"
        if model:
            from sosmith.gen.output.generate import generated
            from sosmith.host.model_line import model_of

            step("model of the board")
            device = model_of(made, generated(made)[f"{asked.name}.sv"], baud=baud)
        else:
            from sosmith.sim.virtual_board.netlist import build

            codes = _measured(made, trace, seed) if measures else None
            netlist = build(made, folder, clock=rate, baud=baud, progress=step)
    with Terminal() as terminal:
        click.echo(terminal.path)
        if model:
            from sosmith.sim.virtual_board.serve import serve

            note(f"the model of {asked.name} is at {terminal.path}; Ctrl-C ends it")
            serve(device, terminal.end, damage=damage or (lambda data: data))
            return
        from sosmith.sim.virtual_board.netlist import forward

        note(f"{asked.name} is at {terminal.path}; Ctrl-C ends it")
        ours, theirs = socket.socketpair()
        pace = speed if speed is not None else 1.0 if measures else 0.0
        end = terminal.end if damage is None else theirs.fileno()
        with ours, theirs, netlist.at(end, speed=pace, codes=codes) as process:
            if damage is None:
                process.wait()
            else:
                theirs.close()
                forward(terminal.end, ours, damage, lambda: process.poll() is None)
        raise ToolError(f"the simulation of the board must go on, not end with status {process.returncode}")


def _measured(design: CoreDesign, trace: str | None, seed: int) -> Codes:
    """Return what the converters measure, as codes of the inputs: shape (samples, channels, inputs)."""
    import numpy as np

    from sosmith.instrument.scenarios.traces import default_scenario, traces_for

    traces = traces_for(design, trace or default_scenario(design), seed=seed)
    return np.stack([each.codes for each in traces], axis=1)
