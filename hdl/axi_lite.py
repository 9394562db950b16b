"""AXI4-Lite: a slave for few registers and few gates, which hands data on bit by bit."""

from __future__ import annotations

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

BITS = 32
"""Width of the data bus."""


def slave_members(address_bits: int) -> dict[str, In | Out]:
    """AXI4-Lite slave members of a component, of `address_bits` address lines."""
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
    """Connect the AXI4-Lite slave ports of `outer` to those of `inner`, a submodule of it with as many address lines."""
    for name, member in outer.signature.members.items():
        if name.startswith("s_axil_"):
            outside, inside = getattr(outer, name), getattr(inner, name)
            m.d.comb += outside.eq(inside) if member.flow is Out else inside.eq(outside)


class SerialSlave(wiring.Component):
    """AXI4-Lite slave with one data register, which moves bit by bit between the bus and what is behind.

    It does one access at a time; reads and writes that wait take turns. Addresses and data of writes may come in
    either order. A write of less than all bytes is refused, protection bits are ignored, the lowest two address
    bits too. Refused accesses answer SLVERR, and reads of that kind with arbitrary data.

    No combinational path leads from an input of the bus to an output of it. Latency: a read answers 35 or 36 clocks
    after it is asked for, a write 36 or 37; refused, 2 to 4 clocks. Throughput: one access at a time.

    Parameters
    ----------
    address_bits : int
        Address lines, at least 3.

    Members
    -------
    s_axil_awaddr, .., s_axil_rready
        The bus, by AXI4-Lite's rules.
    o_index : Out(address_bits - 2)
        Register that is accessed: its address without the lowest two bits. Defined from `o_check` on.
    o_writes : Out(1)
        Whether it is written. Defined from `o_check` on.
    o_check : Out(1)
        High for one clock before anything else happens: with `i_refuse` the access is refused.
    i_refuse : In(1)
        Whether to refuse the access. Looked at with `o_check`.
    o_refused, o_start : Out(1)
        High with `o_check`: the access is refused, or goes on.
    o_word : Out(32)
        The whole data of a write, with `o_start` only.
    o_shift : Out(1)
        High for 32 clocks, one for each bit.
    o_count : Out(5)
        Bit that these are about, the lowest first.
    o_bit : Out(1)
        That bit of a write.
    i_bit : In(1)
        That bit of a read, one clock later.
    o_last : Out(1)
        High for one clock after all bits.
    i_fail : In(1)
        Whether to answer SLVERR nevertheless. Looked at with `o_last`.
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
        """Build the one machine, a register for each of its states."""
        m = Module()
        idle, taking, checking, shifting, answering = (
            Signal(name=name, init=name == "idle") for name in ("idle", "taking", "checking", "shifting", "answering")
        )
        word = Signal(BITS, reset_less=True)
        index = Signal(self.address_bits - 2, reset_less=True)
        count = Signal(range(BITS + 1))
        writes, partial, failed = Signal(), Signal(), Signal()
        with m.If(idle):
            # Reads and writes are offered a turn each, so that no ready depends on a valid.
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
            # One clock more than there are bits: what comes back from a memory is a clock late.
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
