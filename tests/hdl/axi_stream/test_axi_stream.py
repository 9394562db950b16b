# amaranth: UnusedElaboratable=no
"""The output buffer's contract, and where fields lie on the bus."""

import random
from fractions import Fraction
from typing import Any

import pytest
from amaranth.hdl import Const, Shape
from amaranth.sim import Simulator

from sosmith.hdl.axi_stream import StreamBuffer, extended
from sosmith.hdl.plan.streams import fields, width
from sosmith.model.port import Port


@pytest.mark.sweep(6)
@pytest.mark.parametrize("ready", [0.0, 0.2, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("valid", [0.3, 1.0])
def test_nothing_is_lost_and_payload_is_stable(valid: float, ready: float) -> None:
    dut: Any = StreamBuffer(8)
    pace = random.Random(f"{valid} {ready}")
    sent: list[int] = []
    received: list[int] = []
    stalled: list[int] = []

    async def bench(ctx: Any) -> None:
        for n in range(600):
            advance = ctx.get(dut.advance)
            word, have = n % 251, pace.random() < valid
            ctx.set(dut.i_data, word)
            ctx.set(dut.i_valid, have)
            for level in (1, 0, 1):  # the pipeline's enable must not follow the sink within a clock
                ctx.set(dut.o_ready, level)
                ctx.set(dut.i_valid, have ^ level)
                assert ctx.get(dut.advance) == advance
            ctx.set(dut.i_valid, have)
            take = pace.random() < ready
            ctx.set(dut.o_ready, take)
            if advance and have:
                sent.append(word)
            if stalled:
                assert ctx.get(dut.o_valid)
                assert ctx.get(dut.o_data) == stalled.pop()
            if ctx.get(dut.o_valid):
                if take:
                    received.append(ctx.get(dut.o_data))
                else:
                    stalled.append(ctx.get(dut.o_data))
            await ctx.tick()

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    assert received == sent[: len(received)]
    assert len(sent) - len(received) <= 2
    if ready == 0:
        assert len(sent) == 2  # it does not wait for the sink to be ready
    if valid == ready == 1:
        assert len(sent) == 600  # a word at every clock


def test_fields_are_whole_bytes_with_the_first_lowest() -> None:
    ports = [
        Port.from_range("a", 12, Fraction(0), Fraction(1)),
        Port.from_range("b", 16, Fraction(0), Fraction(1)),
        Port.from_range("c", 17, Fraction(0), Fraction(1)),
    ]
    assert [(field.offset, field.padded) for field in fields(ports)] == [(0, 16), (16, 16), (32, 24)]
    assert width(ports) == 56


def test_the_members_of_the_buffer_have_the_width_of_what_they_say() -> None:
    widths = {name: Shape.cast(member.shape).width for name, member in StreamBuffer(8).signature.members.items()}
    assert widths == {name: 8 if name.endswith(("data", "next")) else 1 for name in widths}


@pytest.mark.parametrize(("code", "signed", "word"), [(-3, True, 0xFD), (3, True, 0x03), (5, False, 0x05)])
def test_a_code_is_extended_by_its_sign(code: int, signed: bool, word: int) -> None:
    made = Const.cast(extended(Const(code, Shape(3, signed=signed)), 8))
    assert made.value & 0xFF == word
