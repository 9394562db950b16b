"""From a design to the top of its board: the core, its identity, and the serial link."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal

from sosmith.gen.core import CoreDesign
from sosmith.gen.fpga.audio_clock import audio_pll
from sosmith.gen.fpga.boards import RATE, Board
from sosmith.gen.fpga.wiring import PLAIN, Wiring
from sosmith.gen.output.identity import BoardItem, identity, item_of
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.hdl.boards.board_top import BoardTop
from sosmith.hdl.bus.command_engine import MAX_CHANNELS, MAX_READINGS, MAX_SAMPLE_BYTES
from sosmith.hdl.bus.uart import MIN_CLOCKS
from sosmith.model.converters.i2s_converter import I2sConverter
from sosmith.model.converters.schedule import Schedule
from sosmith.model.errors import SpecificationError

Design = CoreDesign | BoardItem
"""What stands in a board."""


def top_name(design: Design) -> str:
    """Name of the top module of a design's board."""
    name = design.name if isinstance(design, BoardItem) else design.datapath.name
    return f"{name}_board"


def board_top(
    design: Design, *, clock: Fraction, rate: int = RATE, core: str | None = None, waits: bool = False
) -> BoardTop:
    """Return the top of a board that has the core of a design.

    Parameters
    ----------
    design : CoreDesign or BoardItem
        The core, or what stands for it.
    clock : Fraction
        Clock of the board in Hz.
    rate : int
        Line rate in baud.
    core : str or None
        The core's SystemVerilog, whose digest the identity has; None to make it.
    waits : bool
        Whether the board keeps its reset until its clock has its frequency, as that of a PLL; the link then waits too.

    Raises
    ------
    SpecificationError
        If the line rate is too high for the clock, the core has too many channels or a sample too many bytes for the
        link, names are too long for the identity, or converters too slow for the sample rate.
    ToolError
        If Yosys fails.
    """
    if rate * MIN_CLOCKS > clock:
        raise SpecificationError(
            f"the line rate must be at most {float(clock / MIN_CLOCKS):,.0f} baud at a clock of {float(clock):,.0f} Hz,"
            f" not {rate:,}"
        )
    if design.spec.channels > MAX_CHANNELS:
        raise SpecificationError(f"channels must be at most {MAX_CHANNELS} over a link, not {design.spec.channels:,}")
    item = item_of(design)
    sample_bytes = sum(port.bytes for port in item.inputs)
    if sample_bytes > MAX_SAMPLE_BYTES:
        raise SpecificationError(f"a sample must have at most {MAX_SAMPLE_BYTES} bytes over a link, not {sample_bytes}")
    schedule = schedule_of(item, clock) if design.spec.converters else None
    text = core or item.verilog
    source: Literal["link", "converter"] = "link" if schedule is None else "converter"
    about = identity(item, text, baud=rate, clock=float(clock), source=source)
    return BoardTop(
        item.component(),
        about.memory,
        ratio=clock / rate,
        channels=design.spec.channels,
        schedule=schedule,
        packing=about.packing,
        results=item.results,
        waits=waits,
    )


def schedule_of(design: Design, clock: Fraction) -> Schedule:
    """Return when the board of a design with converters reads which of them.

    Parameters
    ----------
    design : CoreDesign or BoardItem
        The core.
    clock : Fraction
        Clock of the board in Hz.

    Raises
    ------
    SpecificationError
        If the core has other inputs or another output than the converters, more inputs than a message of the link
        holds, or the converters are too slow.
    """
    spec, item = design.spec, item_of(design)
    ports = item.inputs
    if ports != tuple(each.reading.port for each in spec.converters):
        names = " and ".join(port.name for port in ports)
        wanted = " and ".join(each.reading.port.name for each in spec.converters)
        raise SpecificationError(f"the core must have the inputs {wanted} of the converters, not {names}")
    if spec.dac is not None and spec.dac.port != item.output:
        raise SpecificationError(
            f"the core must have the output {spec.dac.port.name} of the converter, not {item.output.name}"
        )
    if spec.channels * len(ports) > MAX_READINGS:
        raise SpecificationError(
            f"inputs of all channels must be at most {MAX_READINGS} with converters, not {spec.channels * len(ports):,}"
        )
    return Schedule.of(
        tuple(each.reading for each in spec.converters),
        tuple(each.timing for each in spec.converters),
        writing=spec.dac,
        channels=spec.channels,
        clock=clock,
        sample_rate=spec.sample_rate,
        latency=max(item.latency_cycles, item.cycles_per_sample),
    )


def wiring_of(design: Design, board: Board) -> Wiring:
    """Return what the top of a design needs of a board: pins for its converters, and a clock that fits them.

    Raises
    ------
    SpecificationError
        As `schedule_of`, or if no clock of the board fits audio converters.
    """
    spec = design.spec
    if not spec.converters:
        return PLAIN
    users = (*(each.reading for each in spec.converters), *([spec.dac] if spec.dac is not None else ()))
    audio = [user.converter for user in users if isinstance(user.converter, I2sConverter)]
    pll = audio_pll(board, audio, spec.sample_rate) if audio else None
    schedule = schedule_of(design, Fraction(board.clock) if pll is None else pll.clock)
    return Wiring(
        selects=sum(schedule.selects),
        audio=bool(audio),
        lines_in=sum(schedule.lines_in),
        lines_out=schedule.lines_out,
        dac_selects=schedule.dac_selects,
        pll=pll,
    )


def board_verilog(
    design: Design, *, clock: Fraction, rate: int = RATE, core: str | None = None, waits: bool = False
) -> str:
    """Return the SystemVerilog of a design's board, with the top module `top_name`.

    Parameters and errors are those of `board_top`.
    """
    item = item_of(design)
    top = to_verilog(to_rtlil(board_top(item, clock=clock, rate=rate, core=core, waits=waits), top_name(item)))
    return top + item.make_modules()
