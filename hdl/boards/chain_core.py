"""A chain of cores as the core of a board: its top module, and behind it what makes a result of each sample.

::

    s_axis_* ---> +-----------+      +--------+
                  |   chain   |----->| Holder |---> m_axis_*      each result R times,
    s_axil_* <--> +-----------+      +--------+                   for a chain that decimates by R

A chain gives a result with the first sample and then with every R-th, and none of them waits for a later sample. So
sample n has copy ``n % R`` of the result that sample ``n - n % R`` has brought, and a link that feeds one sample at a
time never waits for ever: docs/protocol.md, "A result for each sample". Several channels that are decimated have their
holder around this: `sosmith.hdl.boards.channel_holder`.

Latency: that of the chain, and a clock of the holder.
"""

from __future__ import annotations

from collections.abc import Sequence

from amaranth.hdl import Cat, ClockDomain, ClockSignal, DomainRenamer, Instance, Module, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.axi_stream import core_members
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
        Times that each result leaves; 1 for a chain that does not decimate, or has several channels.
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
            m.submodules.holder = holder = DomainRenamer("held")(Holder(len(word), self.factor))
            m.d.comb += [
                word.eq(holder.o_data),
                self.m_axis_tvalid.eq(holder.o_valid),
                holder.o_ready.eq(self.m_axis_tready),
            ]
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


def _way(member: In | Out) -> str:
    return "i" if member.flow is In else "o"
