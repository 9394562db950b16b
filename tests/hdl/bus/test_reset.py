# amaranth: UnusedElaboratable=no
"""The link in reset, as it is until the clock of the board has its frequency."""

from fractions import Fraction

from amaranth.hdl import ClockDomain, ClockSignal, Module
from amaranth.sim import Simulator, SimulatorContext

from sosmith.hdl.bus.command_engine import Face
from sosmith.hdl.bus.link import Link
from sosmith.model.link.frames import Message, Receiver
from sosmith.model.link.protocol import Type

_CLOCKS = 4
"""Clocks per bit."""


def test_in_reset_nothing_is_heard_and_behind_it_the_link_begins_anew() -> None:
    m = Module()
    m.domains.outer = ClockDomain(reset_less=True)
    m.submodules.link = link = Link(
        Face(sample_bytes=2, result_bytes=2), bytes(64), ratio=Fraction(_CLOCKS), waits=True
    )
    m.d.comb += link.clk.eq(ClockSignal("outer"))
    heard: list[list[int]] = []

    async def say(ctx: SimulatorContext, data: bytes) -> list[int]:
        """Send bytes, and then nothing for a while; return the levels of the line back."""
        levels = []
        bits = [bit for byte in data for bit in (0, *(byte >> k & 1 for k in range(8)), 1)] + [1] * 200
        for bit in bits:
            ctx.set(link.rx, bit)
            for _ in range(_CLOCKS):
                await ctx.tick("outer")
                levels.append(ctx.get(link.tx))
        return levels

    async def bench(ctx: SimulatorContext) -> None:
        frame = Message(Type.OPEN, 5).frame
        ctx.set(link.rx, 1)
        ctx.set(link.rst, 1)
        heard.append(await say(ctx, frame))
        ctx.set(link.rst, 0)
        heard.append(await say(ctx, frame[:4]))
        ctx.set(link.rst, 1)
        heard.append(await say(ctx, b""))
        ctx.set(link.rst, 0)
        heard.append(await say(ctx, frame[4:]))
        heard.append(await say(ctx, frame))

    simulator = Simulator(m)
    simulator.add_clock(1e-6, domain="outer")
    simulator.add_testbench(bench)
    simulator.run()
    assert all(level for levels in heard[:4] for level in levels)
    (answer,) = Receiver().feed(_bytes(heard[4]))
    assert answer == Message(Type.OPEN | 0x80, 5, bytes([1, 2, 0]))


def _bytes(levels: list[int]) -> bytes:
    """Return the bytes that a line has carried."""
    found, place = [], 0
    while 0 in levels[place:]:
        place = levels.index(0, place)
        found.append(sum(levels[place + _CLOCKS * (k + 1) + _CLOCKS // 2] << k for k in range(8)))
        place += 10 * _CLOCKS - 1
    return bytes(found)
