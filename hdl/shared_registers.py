"""One set of registers for several cores, which swap their constants together, between two samples.

::

                +------------+   write_address --> - where its bank begins --> o0_address, o0_write, o0_data ..
    s_axil_* <->| ReloadPort |-- bank ----------------------------------------> bank, of all cores
      32        +------------+<- may_swap ------------------------------------- i_between
                              <- shadow_free --- and <------------------------- i0_free, i1_free, ..

The words of a load are those of the banks of the cores, one after the other. So a set for all of them arrives as a
whole, with one CRC, and becomes active for all of them in one clock. Latency: that of `sosmith.hdl.reload.ReloadPort`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import and_, or_

from amaranth.hdl import ClockDomain, ClockSignal, Module, ResetSignal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.axi_lite import forward_slave, slave_members
from sosmith.hdl.reload import ReloadPort
from sosmith.model.reload.registers import ADDRESS_BITS


class SharedRegisters(wiring.Component):
    """The registers of several cores that take every sample together.

    Parameters
    ----------
    banks : sequence of (int, int)
        Words of a bank of each core, and bits of a word.
    design : int
        Fingerprint of all cores together, 32 bits.
    protected : bool
        Whether there is a register ``FAULTS``.
    lock : bool
        Whether loading can be locked until a reset.

    Members
    -------
    aclk, aresetn : In(1)
        Clock, rising edge, and synchronous reset, active low.
    s_axil_*
        AXI4-Lite slave of the `sosmith.hdl.reload.ReloadPort`.
    i_between : In(1)
        Whether, behind this clock, either all cores have chosen the bank of their sample, or none.
    o_bank : Out(1)
        The active bank of all cores.
    o0_write, o0_address, o0_data, .. : Out
        A word for the idle bank of a core, as at its pins.
    i0_free, .. : In(1)
        Whether no sample in a core uses the idle bank.
    i0_corrected, i0_failed, .. : In(1)
        Whether a core found a wrong bit at this clock that it corrected, and one that it could not; only if protected.
    o_acknowledge : Out(1)
        High for one clock when ``FAULTS`` is written; only if protected.
    """

    def __init__(
        self, banks: Sequence[tuple[int, int]], *, design: int, protected: bool = False, lock: bool = False
    ) -> None:
        self.banks = tuple(banks)
        self.design = design
        self.protected = protected
        self.lock = lock
        members = {"aclk": In(1), "aresetn": In(1), **slave_members(ADDRESS_BITS), "i_between": In(1), "o_bank": Out(1)}
        for k, (words, bits) in enumerate(self.banks):
            members |= {
                f"o{k}_write": Out(1),
                f"o{k}_address": Out(max(1, (words - 1).bit_length())),
                f"o{k}_data": Out(bits),
                f"i{k}_free": In(1),
            }
            members |= {f"i{k}_corrected": In(1), f"i{k}_failed": In(1)} if protected else {}
        super().__init__(members | ({"o_acknowledge": Out(1)} if protected else {}))

    def elaborate(self, platform: object) -> Module:
        """Build the registers, and what hands out the words."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.aclk), ResetSignal("sync").eq(~self.aresetn)]
        m.submodules.reload_port = port = ReloadPort(
            sum(words for words, _ in self.banks),
            bits=max(bits for _, bits in self.banks),
            design=self.design,
            protected=self.protected,
            lock=self.lock,
        )
        forward_slave(m, self, port)
        m.d.comb += [
            self.o_bank.eq(port.bank),
            port.may_swap.eq(self.i_between),
            port.shadow_free.eq(reduce(and_, self._of_all("free"))),
        ]
        begin = 0
        for k, (words, _) in enumerate(self.banks):
            end = begin + words
            above = port.write_address >= begin if k else 1
            below = port.write_address < end if k < len(self.banks) - 1 else 1
            m.d.comb += [
                getattr(self, f"o{k}_write").eq(port.write_enable & above & below),
                getattr(self, f"o{k}_address").eq(port.write_address - begin),
                getattr(self, f"o{k}_data").eq(port.write_data),
            ]
            begin = end
        if self.protected:
            m.d.comb += [
                port.corrected.eq(reduce(or_, self._of_all("corrected"))),
                port.failed.eq(reduce(or_, self._of_all("failed"))),
                self.o_acknowledge.eq(port.acknowledge),
            ]
        return m

    def _of_all(self, signal: str) -> list[wiring.Component]:
        return [getattr(self, f"i{k}_{signal}") for k in range(len(self.banks))]
