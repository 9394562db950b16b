"""AXI4-Lite: a slave for a few registers, small because it moves data bit by bit.

::

                 awaddr, araddr                                 o_index, o_writes
    s_axil_* ------------------> [index, writes] -------------> o_check -- i_refuse
                 wdata  32                                      o_word  32
             ------------------> [word] >> 1 -----------------> o_bit
                 rdata  32        ^    |                        o_count   5
             <--------------------|----+                        o_shift
                                  +----------------------------- i_bit

    idle --AW--> taking --W--> checking --> shifting, 32 + 1 clocks --> answering --B--> idle
      +---------AR--------------^   +---------- refused ----------------^       --R-->

An access at an address that is no multiple of 4 is one of the word around it, as AXI4-Lite allows. A read then has each
byte on its own lane, as a manager that reads single bytes expects. Of a write, only the strobes tell which bytes it is
for: a whole word is taken, anything less is refused.
"""

from __future__ import annotations

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.model.reload.registers import BITS


def slave_members(address_bits: int) -> dict[str, In | Out]:
    """Return the AXI4-Lite slave members of a component with `address_bits` address lines."""
    return {
        "s_axil_awaddr": In(address_bits),
        "s_axil_awprot": In(3),
        "s_axil_awvalid": In(1),
        "s_axil_awready": Out(1),
        "s_axil_wdata": In(BITS),
        "s_axil_wstrb": In(BITS // 8),
        "s_axil_wvalid": In(1),
        "s_axil_wready": Out(1),
        "s_axil_bresp": Out(2),
        "s_axil_bvalid": Out(1),
        "s_axil_bready": In(1),
        "s_axil_araddr": In(address_bits),
        "s_axil_arprot": In(3),
        "s_axil_arvalid": In(1),
        "s_axil_arready": Out(1),
        "s_axil_rdata": Out(BITS),
        "s_axil_rresp": Out(2),
        "s_axil_rvalid": Out(1),
        "s_axil_rready": In(1),
    }


def forward_slave(m: Module, outer: wiring.Component, inner: wiring.Component) -> None:
    """Connect the AXI4-Lite slave ports of `outer` to those of `inner`, a submodule with as many address lines."""
    for name, member in outer.signature.members.items():
        if name.startswith("s_axil_"):
            outside, inside = getattr(outer, name), getattr(inner, name)
            m.d.comb += outside.eq(inside) if member.flow is Out else inside.eq(outside)


class SerialSlave(wiring.Component):
    """AXI4-Lite slave with one data register, which passes data on bit by bit.

    Reads and writes that wait take turns. The address and the data of a write may come in either order. A write of less
    than all bytes is refused; protection bits and the lowest two address bits are ignored, of reads and of writes. A
    refused access is answered with SLVERR, and a refused read with arbitrary data.

    No combinational path leads from an input of the bus to an output. Latency: a read is answered 35 or 36 clocks after
    its request, a write 36 or 37; a refused access after 2 to 4. Throughput: one access at a time.

    Parameters
    ----------
    address_bits : int
        Address lines, at least 3.

    Members
    -------
    s_axil_awaddr, .., s_axil_rready
        The bus, by the rules of AXI4-Lite.
    o_index : Out(address_bits - 2)
        Index of the register: its address without the lowest two bits. Defined from `o_check` on.
    o_writes : Out(1)
        Whether the access is a write. Defined from `o_check` on.
    o_check : Out(1)
        High for the first clock of an access.
    i_refuse : In(1)
        Whether to refuse the access; sampled with `o_check`.
    o_refused, o_start : Out(1)
        High with `o_check`: the access is refused, or starts.
    o_word : Out(32)
        Data of a write; defined while `o_start` is high.
    o_shift : Out(1)
        High for 32 clocks, one for each bit.
    o_count : Out(5)
        Number of the bit, the lowest first.
    o_bit : Out(1)
        Bit number `o_count` of a write.
    i_bit : In(1)
        Bit number `o_count` of a read, one clock later.
    o_last : Out(1)
        High for one clock after the last bit.
    i_fail : In(1)
        Whether to answer SLVERR after all; sampled with `o_last`.
    """

    def __init__(self, address_bits: int) -> None:
        if address_bits < 3:
            raise ValueError(f"address_bits must be at least 3, not {address_bits!r}")
        self.address_bits = address_bits
        super().__init__(
            {
                **slave_members(address_bits),
                "o_index": Out(address_bits - 2),
                "o_writes": Out(1),
                "o_check": Out(1),
                "i_refuse": In(1),
                "o_refused": Out(1),
                "o_start": Out(1),
                "o_word": Out(BITS),
                "o_shift": Out(1),
                "o_count": Out(range(BITS)),
                "o_bit": Out(1),
                "i_bit": In(1),
                "o_last": Out(1),
                "i_fail": In(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the state machine, with a register for each state."""
        m = Module()
        idle, taking, checking, shifting, answering = (
            Signal(name=name, init=name == "idle") for name in ("idle", "taking", "checking", "shifting", "answering")
        )
        word = Signal(BITS, reset_less=True)
        index = Signal(self.address_bits - 2, reset_less=True)
        count = Signal(range(BITS + 1))
        writes = Signal()
        partial = Signal()
        failed = Signal()
        with m.If(idle):
            # Reads and writes take turns at being ready, so that no ready depends on a valid.
            m.d.sync += [writes.eq(~writes), partial.eq(0), count.eq(0)]
            with m.If(writes & self.s_axil_awvalid):
                m.d.sync += [index.eq(self.s_axil_awaddr[2:]), writes.eq(1), idle.eq(0), taking.eq(1)]
            with m.If(~writes & self.s_axil_arvalid):
                m.d.sync += [index.eq(self.s_axil_araddr[2:]), writes.eq(0), idle.eq(0), checking.eq(1)]
        with m.If(taking):
            m.d.sync += [word.eq(self.s_axil_wdata), partial.eq(~self.s_axil_wstrb.all())]
            with m.If(self.s_axil_wvalid):
                m.d.sync += [taking.eq(0), checking.eq(1)]
        refused = self.i_refuse | partial
        with m.If(checking):
            m.d.comb += [self.o_refused.eq(refused), self.o_start.eq(~refused)]
            m.d.sync += [checking.eq(0), failed.eq(refused), shifting.eq(~refused), answering.eq(refused)]
        with m.If(shifting):
            # One clock more than there are bits: a bit from a memory is a clock late.
            m.d.comb += [self.o_last.eq(count[-1]), self.o_shift.eq(~count[-1])]
            m.d.sync += [word.eq(Cat(word[1:], self.i_bit)), count.eq(count + 1)]
        with m.If(self.o_last):
            m.d.sync += [shifting.eq(0), answering.eq(1), failed.eq(self.i_fail)]
        with m.If(answering & Mux(writes, self.s_axil_bready, self.s_axil_rready)):
            m.d.sync += [answering.eq(0), idle.eq(1)]
        m.d.comb += [
            self.s_axil_awready.eq(idle & writes),
            self.s_axil_arready.eq(idle & ~writes),
            self.s_axil_wready.eq(taking),
            self.s_axil_bvalid.eq(answering & writes),
            self.s_axil_rvalid.eq(answering & ~writes),
            self.s_axil_bresp.eq(Cat(0, failed)),
            self.s_axil_rresp.eq(Cat(0, failed)),
            self.s_axil_rdata.eq(word),
            self.o_check.eq(checking),
            self.o_index.eq(index),
            self.o_writes.eq(writes),
            self.o_word.eq(word),
            self.o_count.eq(count[:-1]),
            self.o_bit.eq(word[0]),
        ]
        return m
