"""The latest results of a core, until a ``POLL`` fetches them.

::

    i_result w --i_push--> memory, 256 x w --> o_result w, o_there --i_take-->
                              ^ [newest] 8    ^ [oldest] 8
                              +---- full: the oldest one is given up, o_missed

    [channel] 8 counts with [oldest] --> o_channel

Latency: a result is there 2 clocks after `i_push`, the next one 2 clocks after `i_take`.
"""

from __future__ import annotations

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.frame_receiver import BLOCK_RAM

DEPTH = 256
"""Results that are kept."""


class ResultQueue(wiring.Component):
    """Keeps the latest `DEPTH` - 1 results.

    Parameters
    ----------
    bits : int
        Bits of a result.
    channels : int
        Channels, whose results come in turn.

    Members
    -------
    i_push, i_result : In(1), In(bits)
        A result, while `i_push` is high; not in two clocks in a row.
    o_there : Out(1)
        Whether `o_result` is the oldest result.
    o_result, o_channel : Out(bits), Out(8)
        The oldest result, and its channel, which also holds while there is none.
    i_take : In(1)
        High for one clock to go on to the next one; only while `o_there` is high.
    o_settled : Out(1)
        Whether `o_there` says for sure that there is no result.
    o_missed : Out(1)
        High for one clock for each result that is given up.
    """

    def __init__(self, bits: int, channels: int) -> None:
        self.bits, self.channels = bits, channels
        super().__init__(
            {
                "i_push": In(1),
                "i_result": In(bits),
                "o_there": Out(1),
                "o_result": Out(bits),
                "o_channel": Out(8),
                "i_take": In(1),
                "o_settled": Out(1),
                "o_missed": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the ring."""
        m = Module()
        m.submodules.results = results = Memory(shape=self.bits, depth=DEPTH, init=[], attrs=BLOCK_RAM)
        store = results.write_port()
        fetch = results.read_port()
        newest = Signal(range(DEPTH))
        oldest = Signal(range(DEPTH))
        leaves = Signal()
        m.d.comb += [
            store.addr.eq(newest),
            store.data.eq(self.i_result),
            store.en.eq(self.i_push),
            fetch.addr.eq(oldest),
            self.o_result.eq(fetch.data),
            self.o_there.eq(self.o_settled & (newest != oldest)),
            # A result that is taken at this clock makes room itself.
            self.o_missed.eq(self.i_push & ~self.i_take & ((newest + 1)[: len(oldest)] == oldest)),
            leaves.eq(self.i_take | self.o_missed),
        ]
        m.d.sync += self.o_settled.eq(~(self.i_push | leaves))
        with m.If(self.i_push):
            m.d.sync += newest.eq(newest + 1)
        with m.If(leaves):
            m.d.sync += oldest.eq(oldest + 1)
            if self.channels > 1:
                last = self.o_channel == self.channels - 1
                m.d.sync += self.o_channel.eq(Mux(last, 0, self.o_channel + 1))
        return m
