"""Counters of faults in a memory: one adder for all of them.

::

    i_events 8 --> [pending] 8 --> first one --> address 3 --+--> memory, 8 x 8 --> + 1 --+
                      ^                                      |                            |
                      +--- clears it, with the write --------+<---------------------------+
    i_address 3 -------------------------------------------->+--> o_data 8

Latency: an event is counted 2 clocks later, and for each other one that is pending 2 clocks more. An event that comes
while the same one is pending is not counted: 16 clocks apart they all are.
"""

from __future__ import annotations

from amaranth.hdl import Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.frame_receiver import BLOCK_RAM
from sosmith.model.link.protocol import Counter

COUNT = len(Counter)


class FaultCounters(wiring.Component):
    """One counter of 8 bits for each member of `sosmith.model.link.protocol.Counter`, all 0 after configuration.

    Members
    -------
    i_events : In(8)
        For each counter, high for one clock to count one.
    i_address : In(3)
        Counter to be read.
    o_data : Out(8)
        The value of the counter that was asked for one clock before, if `o_settled` is high.
    o_settled : Out(1)
        Whether that is so: low while events are counted.
    """

    def __init__(self) -> None:
        super().__init__({"i_events": In(COUNT), "i_address": In(range(COUNT)), "o_data": Out(8), "o_settled": Out(1)})

    def elaborate(self, platform: object) -> Module:
        """Build the memory and its updater."""
        m = Module()
        m.submodules.counts = counts = Memory(shape=8, depth=COUNT, init=[], attrs=BLOCK_RAM)
        store = counts.write_port()
        fetch = counts.read_port()
        pending = Signal(COUNT)
        writes = Signal()
        chosen: Value = Const(0, range(COUNT))
        for k in reversed(range(COUNT)):
            chosen = Mux(pending[k], k, chosen)
        address = Signal(range(COUNT))
        done = Signal(COUNT)
        m.d.comb += [
            fetch.addr.eq(Mux(pending.any(), chosen, self.i_address)),
            store.addr.eq(address),
            store.data.eq(fetch.data + 1),
            store.en.eq(writes),
            self.o_data.eq(fetch.data),
        ]
        m.d.sync += [self.o_settled.eq(~pending.any()), address.eq(chosen), writes.eq(pending.any() & ~writes)]
        with m.If(writes):
            m.d.comb += done.eq(1 << address)
        m.d.sync += pending.eq((pending & ~done) | self.i_events)
        return m
