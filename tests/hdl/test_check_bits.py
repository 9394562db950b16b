"""Check bits of a word: every wrong bit is found, and corrected or told; so are two."""

from itertools import combinations
from typing import Any

import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from sosmith.hdl.check_bits import CheckBits

WIDTHS = {1: 4, 2: 6, 4: 8, 11: 16, 16: 22, 26: 32, 32: 39, 57: 64}
"""Widths of data, and those of their words that can be corrected: the smallest that exist (Hsiao, 1970)."""


class Reader(wiring.Component):
    """Writes data with check bits, spoils the word, and reads it."""

    def __init__(self, bits: int, protect: str) -> None:
        self.check = CheckBits(bits, protect)
        members = {"data": In(bits), "spoilt": In(self.check.width), "word": Out(self.check.width)}
        super().__init__(members | {"read": Out(bits), "corrected": Out(1), "failed": Out(1)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.d.comb += self.word.eq(self.check.written(self.data))
        word = Signal(self.check.width)
        m.d.comb += word.eq(self.word ^ self.spoilt)
        data, corrected, failed = self.check.read(m, word, "it")
        m.d.comb += [self.read.eq(data), self.corrected.eq(corrected), self.failed.eq(failed)]
        return m


def seen(bits: int, protect: str, cases: list[tuple[int, int]]) -> list[tuple[int, int, bool, bool]]:
    """Return the word, the data read, and both findings for each case of data and what is spoilt."""
    reader: Any = Reader(bits, protect)
    found: list[tuple[int, int, bool, bool]] = []

    async def bench(ctx: Any) -> None:
        for data, spoilt in cases:
            ctx.set(reader.data, data)
            ctx.set(reader.spoilt, spoilt)
            outputs = (reader.word, reader.read, reader.corrected, reader.failed)
            word, read, corrected, failed = (ctx.get(signal) for signal in outputs)
            found.append((word, read, bool(corrected), bool(failed)))

    simulator = Simulator(reader)
    simulator.add_testbench(bench)
    simulator.run()
    return found


def samples(bits: int) -> list[int]:
    every = (1 << bits) - 1
    return sorted({0, every, every // 3, 1, 1 << (bits - 1)})


@pytest.mark.parametrize(("bits", "width"), WIDTHS.items())
def test_words_have_the_least_width_that_does(bits: int, width: int) -> None:
    assert [CheckBits(bits, protect).width for protect in ("none", "detect", "correct")] == [bits, bits + 1, width]


@pytest.mark.parametrize("protect", ["none", "detect", "correct"])
@pytest.mark.parametrize("bits", [1, 5, 16])
def test_hardware_and_software_write_the_same_word(bits: int, protect: str) -> None:
    cases = [(data, 0) for data in samples(bits)]
    check = CheckBits(bits, protect)
    assert seen(bits, protect, cases) == [(check.word(data), data, False, False) for data, _ in cases]


@pytest.mark.parametrize("bits", WIDTHS)
def test_one_wrong_bit_is_detected(bits: int) -> None:
    cases = [(data, 1 << bit) for data in samples(bits) for bit in range(bits + 1)]
    assert {(corrected, failed) for _, _, corrected, failed in seen(bits, "detect", cases)} == {(False, True)}


@pytest.mark.parametrize("bits", WIDTHS)
def test_one_wrong_bit_is_corrected(bits: int) -> None:
    cases = [(data, 1 << bit) for data in samples(bits) for bit in range(CheckBits(bits, "correct").width)]
    found = seen(bits, "correct", cases)
    assert [tuple(row[1:]) for row in found] == [(data, True, False) for data, _ in cases]


@pytest.mark.parametrize("bits", [1, 5, 16, 32])
def test_two_wrong_bits_are_told_and_not_called_corrected(bits: int) -> None:
    pairs = combinations(range(CheckBits(bits, "correct").width), 2)
    cases = [(data, 1 << one | 1 << other) for one, other in pairs for data in samples(bits)[-2:]]
    assert {(corrected, failed) for _, _, corrected, failed in seen(bits, "correct", cases)} == {(False, True)}
