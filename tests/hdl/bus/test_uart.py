# amaranth: UnusedElaboratable=no
"""The UART against bits drawn by hand, at ratios of clock to line rate with and without a fraction."""

import re
from fractions import Fraction
from types import ModuleType
from typing import Any

import pytest
from amaranth.hdl import Module
from amaranth.sim import Simulator
from tests.formal.prover import broken

from sosmith.hdl.bus import uart

BYTES = (0x00, 0xFF, 0x55, 0xAA, 0x01, 0x80, 0x00, 0x07)
RATIOS = (Fraction(4), Fraction(25, 3), Fraction(9), Fraction(625, 6))


def bits_of(byte: int) -> list[int]:
    return [0, *(byte >> k & 1 for k in range(8)), 1]


def simulate(design: Any, bench: Any) -> None:
    m = Module()
    m.submodules.design = design
    simulator = Simulator(m)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()


def received(line: list[int], clocks_per_bit: float, ratio: Fraction, module: ModuleType = uart) -> list[int | None]:
    """Bytes that the receiver makes of bits on the line, which idles before and after; None for an error."""
    receiver = module.UartReceiver(ratio)
    found: list[int | None] = []

    async def bench(ctx: Any) -> None:
        for k in range(int((len(line) + 12) * clocks_per_bit) + 10):
            place = int((k - 10 + 0.37) / clocks_per_bit) if k >= 10 else -1
            ctx.set(receiver.i_rx, line[place] if 0 <= place < len(line) else 1)
            await ctx.tick()
            if ctx.get(receiver.o_valid):
                found.append(ctx.get(receiver.o_data))
            if ctx.get(receiver.o_error):
                found.append(None)

    simulate(receiver, bench)
    return found


def sent(data: tuple[int, ...], ratio: Fraction) -> list[int]:
    """Levels of the line, one a clock, while bytes are sent without a gap; from the first start bit on."""
    transmitter = uart.UartTransmitter(ratio)
    levels: list[int] = []

    async def bench(ctx: Any) -> None:
        waiting = list(data)
        for _ in range(int(10 * len(data) * ratio) + 40):
            ctx.set(transmitter.i_valid, bool(waiting))
            ctx.set(transmitter.i_data, waiting[0] if waiting else 0)
            taken = ctx.get(transmitter.o_ready) and waiting
            await ctx.tick()
            levels.append(ctx.get(transmitter.o_tx))
            if taken:
                waiting.pop(0)

    simulate(transmitter, bench)
    return levels[levels.index(0) :]


@pytest.mark.sweep(4)
@pytest.mark.parametrize("ratio", RATIOS, ids=str)
@pytest.mark.parametrize("drift", [0.99, 1.0, 1.01])
def test_bytes_without_a_gap_are_received(ratio: Fraction, drift: float) -> None:
    data = BYTES[: 3 if ratio > 50 else None]
    line = [bit for byte in data for bit in bits_of(byte)]
    assert received(line, float(ratio) * drift, ratio) == list(data)


@pytest.mark.parametrize("ratio", RATIOS, ids=str)
def test_bits_are_sent_at_their_time(ratio: Fraction) -> None:
    data = BYTES[: 3 if ratio > 50 else None]
    levels = sent(data, ratio)
    length = -(-10 * ratio.numerator // ratio.denominator)  # of a byte, rounded up to clocks
    for number, byte in enumerate(data):
        for place, bit in enumerate(bits_of(byte)):
            middle = number * length + int((place + Fraction(1, 2)) * ratio)
            assert levels[middle] == bit, (number, place)
    assert all(levels[len(data) * length :])


def test_a_low_stop_bit_is_an_error_and_the_next_byte_is_received() -> None:
    line = [*bits_of(0x0F)[:-1], 0, 0, 1, 1, *bits_of(0x3C)]
    assert received(line, 9.0, Fraction(9)) == [None, 0x3C]


def test_a_line_that_is_held_low_is_one_error() -> None:
    assert received([0] * 50, 9.0, Fraction(9)) == [None]


def test_a_short_glitch_is_no_byte() -> None:
    line = [1, *([0] * 3), *([1] * 20), *(bit for bit in bits_of(0x5A) for _ in range(9))]
    assert received(line, 1.0, Fraction(9)) == [0x5A]


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("active.eq(was_high & ~line)", "active.eq(~line)"),  # a line that stays low is one byte after another
        ("(phase.modulus + phase.step) // 2", "0"),  # sampled at the edges of the bits
        ("self.o_valid.eq(line)", "self.o_valid.eq(1)"),  # no stop bit needed
    ],
)
def test_a_broken_receiver_is_found_out(right: str, wrong: str) -> None:
    module = broken(uart, right, wrong)
    back_to_back = [bit for byte in BYTES for bit in bits_of(byte)]
    assert (
        received([0] * 50, 9.0, Fraction(9), module) != [None]
        or received(back_to_back, 8.91, Fraction(9), module) != list(BYTES)
        or received(back_to_back, 9.09, Fraction(9), module) != list(BYTES)
    )


@pytest.mark.parametrize("make", [uart.UartReceiver, uart.UartTransmitter])
def test_a_clock_too_slow_for_the_line_is_refused(make: Any) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape('ratio must be at least 4, not 15/4')}$"):
        make(Fraction(15, 4))
