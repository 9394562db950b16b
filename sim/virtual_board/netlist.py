"""The netlist of a board's top in Verilator, at the end of a pseudo-terminal.

::

    host <--> pseudo-terminal <--> [damage] <--> board_main.cpp: bits on rx, tx <--> top of the board <--> core
                                                                                     (or the gates of both)
                                                                                     |
                                                                 pins.h: converters -+
"""

from __future__ import annotations

import os
import select
import socket
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from sosmith.gen.fpga.boards import Board
from sosmith.gen.fpga.synthesis import synthesize
from sosmith.gen.output.board_top import Design, board_verilog, schedule_of, top_name
from sosmith.gen.output.identity import item_of
from sosmith.model.arrays import Codes
from sosmith.model.converters.schedule import Schedule
from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.link.protocol import MAX_BODY, WINDOWS
from sosmith.model.text_files import write_files
from sosmith.sim.converters import values
from sosmith.sim.converters.values import MAX_SELECTS, values_text, words_of
from sosmith.sim.gate_level import with_cell_models
from sosmith.sim.simulators import find_simulator
from sosmith.sim.verilated_model import LIBRARY_SECONDS, Builder

_MAIN = Path(__file__).with_name("board_main.cpp")
_PINS = Path(values.__file__).with_name("pins.h")
_ROOM = 1 << 12
_TURN = 0.1  # seconds

Damage = Callable[[bytes], bytes]


@dataclass(frozen=True)
class Netlist:
    """A board's top as a program.

    Attributes
    ----------
    program : Path
        The executable.
    clock : Fraction
        Clock in Hz.
    baud : int
        Bits per second on the line.
    quiet : int
        Clocks without a bit on the line after which the board has nothing left to do; 0 if it measures by itself.
    schedule : Schedule or None
        When it reads which converter; None for a board that is fed over the link.
    """

    program: Path
    clock: Fraction
    baud: int
    quiet: int
    schedule: Schedule | None = None

    @contextmanager
    def at(
        self,
        end: int,
        *,
        speed: float = 0.0,
        wait: int = 0,
        codes: Codes | None = None,
        heard: Path | None = None,
        frames: int = 0,
    ) -> Iterator[subprocess.Popen[str]]:
        """Run the board with a file descriptor at the other end of its line, until the context ends.

        When the other side of the file descriptor is closed, the process prints how many clocks it simulated, and how
        many bytes went to the board and came from it.

        Parameters
        ----------
        end : int
            The file descriptor.
        speed : float
            1 for real time, 2 for twice as fast; 0 for as fast as it can.
        wait : int
            Milliseconds for which the board's time stands still behind each of its frames, unless a byte arrives.
        codes : ndarray of int, shape (samples, channels, inputs), or None
            What the converters of the board measure from its first sample on, as codes of the inputs; the end stays.
            None for a board without converters, or one whose converters are not there.
        heard : Path or None
            Where the words of its DACs are written, with `codes`.
        frames : int
            Words of the DACs after which the board ends; it then begins at once. 0 to go on.
        """
        arguments = (end, float(self.clock / self.baud), float(self.clock) * speed, self.quiet, wait)
        command = [str(self.program), *map(str, arguments)]
        if codes is not None and self.schedule is not None:
            (file,) = write_files(self.program.parent, {"values.txt": values_text(self.schedule, codes)})
            command.append(str(file))
        if heard is not None:
            command += [str(heard), str(frames)]
        with subprocess.Popen(
            command, pass_fds=[end], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
        ) as process:
            try:
                yield process
            finally:
                process.kill()

    def play(self, codes: Codes) -> Codes:
        """Run the board until its DACs got the result of what its ADCs measured; return all words that they got.

        Parameters
        ----------
        codes : ndarray of int, shape (samples, channels, inputs)
            What the converters measure, as codes of the inputs.

        Returns
        -------
        ndarray of int, shape (silent + samples, channels)
            Words of the DACs, from the first one on; `Schedule.silent` come before the results.

        Raises
        ------
        ToolError
            If the program fails.
        """
        assert self.schedule is not None
        heard = self.program.parent / "heard.txt"
        ours, theirs = socket.socketpair()
        with ours, theirs:
            frames = len(codes) + self.schedule.silent
            with self.at(theirs.fileno(), codes=codes, heard=heard, frames=frames) as process:
                process.communicate()
        if process.returncode:
            raise ToolError(f"the simulation of the board must end by itself, not with status {process.returncode}")
        return words_of(heard.read_text(encoding="ascii"), self.schedule)


def build(
    design: Design,
    folder: Path,
    *,
    clock: Fraction | None = None,
    baud: int = 1_000_000,
    gates: Board | None = None,
    progress: Callable[[str], None] = lambda step: None,
) -> Netlist:
    """Build the board's top of a design in Verilator.

    Parameters
    ----------
    design : CoreDesign or BoardItem
        The core, or what stands for it.
    folder : Path
        For ``<name>_board.sv``, the program, and the files in between.
    clock : Fraction or None
        Clock of the board in Hz; None for that of the specification.
    baud : int
        Bits per second on the line.
    gates : Board or None
        Simulate what Yosys makes of the top for this board, in the cells of its FPGA, instead of the SystemVerilog.
    progress : callable
        Called with the name of each step.

    Raises
    ------
    SpecificationError
        If the line is too fast for the clock, converters are too slow or too many, the folder has a blank in its path,
        or cannot be written.
    ToolError
        If a tool is missing or fails.
    """
    rate = design.spec.hardware.clock if clock is None else clock
    top = top_name(design)
    schedule = schedule_of(design, rate) if design.spec.converters else None
    if schedule is not None and sum(schedule.selects) > MAX_SELECTS:
        raise SpecificationError(
            f"a virtual board must have at most {MAX_SELECTS} converters, not {sum(schedule.selects)}"
        )
    progress("SystemVerilog of the board")
    (source,) = write_files(folder, {f"{top}.sv": board_verilog(design, clock=rate, rate=baud)})
    place = folder.resolve()
    if len(str(place).split()) > 1:
        raise SpecificationError(f"the output folder must have no blanks in its path for Verilator, not {place}")
    if gates is not None:
        progress("synthesis")
        # In hardware, flip-flops start as configured: this is all the reset that the top gets on some boards.
        source = with_cell_models(synthesize(source, top, gates, folder / "gates"), scrambled=False)
    tool = find_simulator("verilator", place / "bin")
    program = place / top
    with (place / "build.log").open("w", encoding="utf-8") as log:
        try:
            builder = Builder(tool.version, tool.environment, place / "build", log, alone=True)
            time = "" if builder.has_library() else f", which takes about {LIBRARY_SECONDS} s the first time"
            progress(f"building with {tool.name}{time}")
            (place / "build").mkdir(exist_ok=True)
            builder.build_program(source.resolve(), top, _MAIN, _PINS, program)
        except subprocess.CalledProcessError as error:
            raise ToolError(f"{Path(error.cmd[0]).name} must build the board, not fail: see {log.name}") from None
    # No request keeps the board busier than one whose samples fill a message.
    item = item_of(design)
    quiet = max(WINDOWS) * MAX_BODY * (item.cycles_per_sample + item.latency_cycles + 100)
    return Netlist(program, rate, baud, quiet if schedule is None else 0, schedule)


def forward(end: int, board: socket.socket, damage: Damage, goes_on: Callable[[], bool]) -> None:
    """Pass bytes between a pseudo-terminal and a board, with damage in both directions, until told to stop."""
    board.setblocking(True)
    while goes_on():
        ready, _, _ = select.select([end, board.fileno()], [], [], _TURN)
        if end in ready:
            board.sendall(damage(os.read(end, _ROOM)))
        if board.fileno() in ready:
            data = board.recv(_ROOM)
            if not data:
                return
            rest = damage(data)
            while rest and goes_on():
                _, free, _ = select.select([], [end], [], _TURN)
                if free:
                    rest = rest[os.write(end, rest[:1024]) :]
