"""The board of a design in this computer, at a pseudo-terminal."""

from __future__ import annotations

import socket
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sosmith.instrument.scenarios.traces import default_scenario, traces_for
from sosmith.interface.certificate import Progress
from sosmith.interface.design import Design
from sosmith.model.errors import ToolError
from sosmith.sim.virtual_board.line_damage import LineDamage
from sosmith.sim.virtual_board.terminal import Terminal

if TYPE_CHECKING:
    from sosmith.model.arrays import Codes
    from sosmith.model.link.device import Device
    from sosmith.sim.virtual_board.netlist import Netlist

__all__ = ["LineDamage", "ModelBoard", "NetlistBoard", "Terminal"]


class ModelBoard:
    """A model of the link and the integer model of the core."""

    def __init__(self, design: Design, *, baud: int) -> None:
        from sosmith.gen.output.verilog import core_verilog
        from sosmith.host.model_line import model_of

        self._device: Device = model_of(design.core, core_verilog(design.core), baud=baud)

    def serve(self, terminal: Terminal, damage: LineDamage | None) -> None:
        """Answer at the terminal until interrupted."""
        from sosmith.sim.virtual_board.serve import serve

        serve(self._device, terminal.end, damage=damage or (lambda data: data))


class NetlistBoard:
    """The board's top, with link and core, built by Verilator; its converters measure what a trace says.

    Raises
    ------
    SpecificationError
        If the trace does not fit, or the clock is too slow for the line.
    ToolError
        If Verilator is missing or fails.
    """

    def __init__(
        self,
        design: Design,
        folder: Path,
        *,
        clock: float | None,
        baud: int,
        trace: str | None,
        seed: int,
        progress: Progress,
    ) -> None:
        from sosmith.sim.virtual_board.netlist import build

        core = design.core
        self._measures = bool(core.spec.converters)
        self._codes: Codes | None = None
        if self._measures:
            traces = traces_for(core, trace or default_scenario(core), seed=seed)
            self._codes = np.stack([each.codes for each in traces], axis=1)
        rate = core.spec.hardware.clock if clock is None else Fraction(clock)
        self._netlist: Netlist = build(core, folder, clock=rate, baud=baud, progress=lambda step: progress(step, 0, 0))

    def serve(self, terminal: Terminal, damage: LineDamage | None, speed: float | None = None) -> None:
        """Run at the terminal until interrupted, at `speed` times real time; 0 is as fast as it goes.

        Raises
        ------
        ToolError
            If the simulation ends by itself.
        """
        from sosmith.sim.virtual_board.netlist import forward

        ours, theirs = socket.socketpair()
        pace = speed if speed is not None else 1.0 if self._measures else 0.0
        end = terminal.end if damage is None else theirs.fileno()
        with ours, theirs, self._netlist.at(end, speed=pace, codes=self._codes) as process:
            if damage is None:
                process.wait()
            else:
                theirs.close()
                forward(terminal.end, ours, damage, lambda: process.poll() is None)
        raise ToolError(f"the simulation of the board must go on, not end with status {process.returncode}")
