"""A chain of cores as the core of a board: its top module, and behind it what makes a result of each sample.

::

    s_axis_* ---> +-----------+      +--------+
                  |   chain   |----->| Holder |---> m_axis_*      each result R times,
    s_axil_* <--> +-----------+      +--------+                   for a chain that decimates by R

    s_axis_* --- ChannelHolder ---> chain --- ChannelHolder ---> m_axis_*      the same of several channels

A chain gives a result with the first sample and then with every R-th, and none of them waits for a later sample. So
sample n has copy ``n % R`` of the result that sample ``n - n % R`` has brought, and a link that feeds one sample at a
time never waits for ever: docs/protocol.md, "A result for each sample".

Of several channels, each sample has the copy of its channel, and the next one is taken when that has left.

Latency: that of the chain, and a clock of the holder, or `CLOCKS` with several channels.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from amaranth.hdl import Cat, ClockDomain, ClockSignal, DomainRenamer, Instance, Module, ResetSignal, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.axi_stream import core_members
from sosmith.hdl.boards.channel_holder import ChannelHolder
from sosmith.hdl.bus.axi_lite import slave_members
from sosmith.hdl.decimation.decimator import Holder
from sosmith.model.port import Port


class ChainCore(wiring.Component):
    """The top module of a chain, with a result for each sample.

    Parameters
    ----------
    name : str
        Name of the top module.
    inputs : sequence of Port
        Fields of a sample.
    output : Port
        The field of a result.
    channels : int
        Number of channels.
    factor : int
        Samples for each result of the chain, 1 for one that does not decimate.
    registers : str
        Prefix of the ports of the one stage with registers, such as ``"s_axil_low"``; "" for none.
    address_bits : int
        Address lines of the registers.
    lock : bool
        Whether these have a lock.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*, s_axil_*
        As those of a core, `sosmith.hdl.axi_stream.core_members`.
    """

    def __init__(
        self,
        name: str,
        inputs: Sequence[Port],
        output: Port,
        *,
        channels: int = 1,
        factor: int = 1,
        registers: str = "",
        address_bits: int = 0,
        lock: bool = False,
    ) -> None:
        self.name, self.factor, self.registers, self.lock = name, factor, registers, lock
        self.channels = channels
        self._streams = core_members(inputs, output, channels)
        self._bus = slave_members(address_bits) if registers else {}
        super().__init__(self._streams | self._bus)

    def elaborate(self, platform: object) -> Module:
        """Connect the chain, and the holder."""
        m = Module()
        pins = {f"{_way(member)}_{name}": getattr(self, name) for name, member in self._streams.items()}
        for name, member in self._bus.items():
            pins[f"{_way(member)}_{self.registers}{name.removeprefix('s_axil')}"] = getattr(self, name)
        if self.factor > 1:
            m.domains.held = ClockDomain(local=True)
            m.d.comb += [ClockSignal("held").eq(self.aclk), ResetSignal("held").eq(~self.aresetn)]
            word = Cat(self.m_axis_tdata, self.m_axis_tuser)
            if self.channels == 1:
                m.submodules.holder = holder = DomainRenamer("held")(Holder(len(word), self.factor))
                m.d.comb += [
                    word.eq(holder.o_data),
                    self.m_axis_tvalid.eq(holder.o_valid),
                    holder.o_ready.eq(self.m_axis_tready),
                ]
            else:
                holder = ChannelHolder(len(word), self.factor, self.channels, len(self.s_axis_tdest))
                m.submodules.holder = DomainRenamer("held")(holder)
                self._join_channels(m, holder, word, pins)
            data, user = Signal.like(self.m_axis_tdata, name="data"), Signal.like(self.m_axis_tuser, name="user")
            m.d.comb += holder.i_data.eq(Cat(data, user))
            pins |= {
                "o_m_axis_tdata": data,
                "o_m_axis_tuser": user,
                "o_m_axis_tvalid": holder.i_valid,
                "i_m_axis_tready": holder.i_ready,
            }
        m.submodules.chain = Instance(self.name, **pins)
        return m

    def _join_channels(self, m: Module, holder: ChannelHolder, word: Value, pins: dict[str, Any]) -> None:
        """Put a holder for several channels on both sides of the chain, whose handshake of samples is then its own."""
        m.d.comb += [
            holder.s_valid.eq(self.s_axis_tvalid),
            self.s_axis_tready.eq(holder.s_ready),
            holder.s_dest.eq(self.s_axis_tdest),
            word.eq(holder.m_data),
            self.m_axis_tdest.eq(holder.m_dest),
            self.m_axis_tvalid.eq(holder.m_valid),
            holder.m_ready.eq(self.m_axis_tready),
        ]
        pins |= {"i_s_axis_tvalid": holder.o_valid, "o_s_axis_tready": holder.o_ready}
        pins["o_m_axis_tdest"] = Signal.like(self.m_axis_tdest, name="dest")


def _way(member: In | Out) -> str:
    return "i" if member.flow is In else "o"
