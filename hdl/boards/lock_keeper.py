"""Keeps the lock of a core closed while sessions of the link reset the core.

::

    link                                   LockKeeper                               core
      awaddr ----> a set is loaded there? ---- & ----> ID, where nothing is written ----> awaddr
                                               |
      bvalid, bready, bresp, awaddr ------> [shut]
                                               |
      rdata <----------------- | LOCKED <----- & <---- STATUS is read <------------------ rdata

A link that feeds a core resets it with every session, which opens the lock of the core: whoever opens a session could
load a set. `shut` is not reset by that, only by `rst`, the board's own reset, and when the FPGA is configured.
"""

from __future__ import annotations

from amaranth.hdl import ClockDomain, ClockSignal, Module, Mux, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.model.reload.registers import BITS, CRC, DATA, ID, LOCKING_STATUS, STATUS, VERSION


class LockKeeper(wiring.Component):
    """Between a link and the registers of a core with a lock; combinational but for `shut`.

    Once the core has taken a write of ``STATUS``, writes of ``VERSION``, ``DATA`` and ``CRC`` go to ``ID``, which
    refuses them, and ``LOCKED`` reads 1, until `rst`.

    Parameters
    ----------
    address_bits : int
        Address lines of the registers.

    Members
    -------
    clk, rst : In(1)
        Clock, rising edge; reset, synchronous, active high.
    i_target, o_target : In(address_bits), Out(address_bits)
        Address of an access, from the link and to the core. The link holds it from the request to the response.
    i_answered, i_response : In(1), In(2)
        Whether a write is answered at this clock; how, as ``bresp`` says it.
    i_data, o_data : In(32), Out(32)
        What is read, from the core and to the link.
    """

    def __init__(self, address_bits: int) -> None:
        super().__init__(
            {
                "clk": In(1),
                "rst": In(1),
                "i_target": In(address_bits),
                "o_target": Out(address_bits),
                "i_answered": In(1),
                "i_response": In(2),
                "i_data": In(BITS),
                "o_data": Out(BITS),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the register and what it switches."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.clk), ResetSignal("sync").eq(self.rst)]
        shut = Signal()
        index = self.i_target[2:]
        at_status, loads = index == STATUS.index, index.matches(VERSION.index, DATA.index, CRC.index)
        with m.If(self.i_answered & ~self.i_response[1] & at_status):
            m.d.sync += shut.eq(1)
        locked = Mux(shut & at_status, LOCKING_STATUS.field("LOCKED").mask, 0)
        m.d.comb += [
            self.o_target.eq(Mux(shut & loads, ID.address, self.i_target)),
            self.o_data.eq(self.i_data | locked),
        ]
        return m
