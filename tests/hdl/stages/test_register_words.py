"""Two words in registers do what a memory of two words does."""

import random
from typing import Any

from amaranth.hdl import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from sosmith.hdl.stages.register_words import two_words

BITS = {"address": 1, "write": 1, "write_address": 1, "clear": 1, "clear_address": 1}


class Words(wiring.Component):
    """Two words of 9 bits."""

    def __init__(self) -> None:
        super().__init__(
            {**{name: In(bits) for name, bits in BITS.items()}, "data": In(signed(9)), "o": Out(signed(9))}
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        word = two_words(
            m,
            signed(9),
            "x",
            address=self.address,
            write=self.write,
            write_address=self.write_address,
            data=self.data,
            clear=self.clear,
            clear_address=self.clear_address,
        )
        m.d.comb += self.o.eq(word)
        m.d.sync += Signal().eq(0)
        return m


def test_words_are_written_cleared_and_read_as_in_a_memory() -> None:
    words: Any = Words()
    seen: list[int] = []
    wanted: list[int] = []

    async def drive(context: Any) -> None:
        rng, kept = random.Random(4), [0, 0]
        for _ in range(400):
            bits = {name: rng.getrandbits(1) for name in BITS} | {"clear": rng.random() < 0.2}
            data = rng.randrange(-256, 256)
            for name, bit in bits.items():
                context.set(getattr(words, name), bit)
            context.set(words.data, data)
            seen.append(context.get(words.o))
            wanted.append(kept[bits["address"]])
            if bits["clear"]:
                kept[bits["clear_address"]] = 0
            elif bits["write"]:
                kept[bits["write_address"]] = data
            await context.tick()

    simulator = Simulator(words)
    simulator.add_clock(1e-6)
    simulator.add_testbench(drive)
    simulator.run()
    assert seen == wanted
    assert len(set(wanted)) > 100
