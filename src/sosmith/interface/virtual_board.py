"""The board of a design in this computer, at a pseudo-terminal."""

from __future__ import annotations

import socket
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sosmith.gen.chain.board import chain_item
from sosmith.gen.core import CoreDesign
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.output.board_top import wiring_of
from sosmith.gen.output.identity import BoardItem
from sosmith.instrument.scenarios.traces import default_scenario, traces_for
from sosmith.interface.certificate import Progress
from sosmith.interface.chain.design import Chain
from sosmith.interface.design import Design
from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.port import Port
from sosmith.model.text_files import write_file
from sosmith.model.traces.wav_file import check_rate, wav_bytes
from sosmith.sim.converters.values import fed_codes
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
        design: Design | Chain,
        folder: Path,
        *,
        clock: float | None,
        baud: int,
        board: str | None = None,
        trace: str | None,
        seed: int,
        progress: Progress,
    ) -> None:
        from sosmith.sim.virtual_board.netlist import build

        core: CoreDesign | BoardItem
        core = chain_item(design.core) if isinstance(design, Chain) else design.core
        self._measures = bool(core.spec.converters)
        self._codes: Codes | None = None
        if self._measures and isinstance(core, CoreDesign):
            traces = traces_for(core, trace or default_scenario(core), seed=seed)
            self._codes = np.stack([each.codes for each in traces], axis=1)
        self._core = core
        rate = core.spec.hardware.clock if clock is None else Fraction(clock)
        if board is not None:
            target = find_board(board)
            rate = wiring_of(core, target).clock(target)
        self._netlist: Netlist = build(core, folder, clock=rate, baud=baud, progress=lambda step: progress(step, 0, 0))

    def play(self, heard: Path) -> tuple[int, int]:
        """Run without a host until the converters gave the whole trace; write what the DACs got of it.

        Parameters
        ----------
        heard : Path
            WAV file for the results, from the first one on, a channel for each of the core.

        Returns
        -------
        tuple of int
            Frames, and words that differ from those of the integer model.

        Raises
        ------
        ToolError
            If the simulation fails, or the disk is full.
        SpecificationError
            If the board has no DAC, the sample rate is none of a WAV file, or the file cannot be written.
        """
        schedule, spec = self._netlist.schedule, self._core.spec
        if schedule is None or schedule.writing is None or self._codes is None or isinstance(self._core, BoardItem):
            raise SpecificationError("the board must have a converter of the output to be heard, not results only")
        check_rate(heard, spec.sample_rate)
        words = self._netlist.play(self._codes)
        wanted = schedule.writing.words(self._core.datapath.compute(fed_codes(schedule, self._codes)))
        silent = np.zeros((schedule.silent, words.shape[1]), np.int64)
        wrong = int(np.count_nonzero(words != np.concatenate([silent, wanted])))
        dac = schedule.writing.converter
        port = Port(name="heard", bits=dac.width, signed=dac.lowest < 0, lsb=Fraction(1), zero=Fraction(0), unit="")
        write_file(heard, wav_bytes(words[schedule.silent :], port, spec.sample_rate))
        return len(wanted), wrong

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
