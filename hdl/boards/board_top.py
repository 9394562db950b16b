"""The top of every board: a core, fed over a serial line or from converters.

::

                 +------+  s_axis_*, s_axil_*, aresetn   +------+
    rx --------->|      |------------------------------->|      |
    tx <---------| link |                                | core |
    leds 3 <-----|      |<-------------------------------|      |
                 +------+          m_axis_*              +------+
                    ^                                       ^ aclk
    clk, rst -------+---------------------------------------+

A core with a lock, fed over the line, has a `LockKeeper` between its registers and the link.

With converters, a front-end feeds the core, and the link fetches what it keeps::

                 +------+  o_result, ..   +-----------+  s_axis_*, aresetn   +------+
    rx --------->|      |<----------------| FrontEnd  |--------------------->|      |
    tx <---------| link |---------------->|           |<---------------------| core |
    leds 3 <-----|      |  i_take, ..     +-----------+       m_axis_*       |      |
                 |      |                    ^    |                          |      |
                 |      |------------------- | -- | ----- s_axil_* --------->|      |
                 +------+                 miso    +--> sck, mosi, cs_n n     +------+
                                          din n        mclk, bclk, lrck, dout n

One clock for all. Latency: that of the link, `sosmith.hdl.bus.link`, of the front-end,
`sosmith.hdl.converters.front_end`, and of the core.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.boards.lock_keeper import LockKeeper
from sosmith.hdl.bus.command_engine import Face, core_side
from sosmith.hdl.bus.link import LEDS, Link
from sosmith.hdl.converters.front_end import FrontEnd
from sosmith.hdl.converters.pins import converter_pins
from sosmith.model.converters.schedule import Schedule
from sosmith.model.link.packing import Packing


class BoardTop(wiring.Component):
    """A core behind the serial link of docs/protocol.md.

    Parameters
    ----------
    core : Component
        A core, with the members of `sosmith.hdl.axi_stream.core_members`, and with ``s_axil_*`` or without.
    memory : bytes
        The identity, as `sosmith.hdl.bus.command_engine.CommandEngine` takes it.
    ratio : Fraction
        Clocks per bit of the line, at least `sosmith.hdl.bus.uart.MIN_CLOCKS`.
    channels : int
        Channels of the core, 1 to 256.
    schedule : Schedule or None
        When the front-end reads which converter; None for a core that is fed over the link.
    packing : Packing or None
        The form of packed results; None for a link without them.
    results : int
        Results of each sample.
    waits : bool
        Whether `rst` is high until the clock has its frequency, and nothing may come over the line before.

    Members
    -------
    clk : In(1)
        Clock, rising edge.
    rst : In(1)
        Reset of the core, and with `waits` of the link, synchronous, active high. It may be tied to 0: registers have
        initial values, and the first request resets the core, or the front-end does at the beginning.
    rx : In(1)
        Line from the host, 8N1; asynchronous.
    tx : Out(1)
        Line to the host, 8N1, from a register.
    leds : Out(3)
        High for a LED that is lit. 0: changes with each request that is carried out. 1: a byte or a frame was
        damaged, since the last session began. 2: the last result has a flag `wear_critical` or `fault`.
    sck, mosi, miso, cs_n, mclk, bclk, lrck, din, dout
        With converters, their SPI and I2S, as in `sosmith.hdl.converters.pins`.
    """

    def __init__(
        self,
        core: wiring.Component,
        memory: bytes,
        *,
        ratio: Fraction,
        channels: int = 1,
        schedule: Schedule | None = None,
        packing: Packing | None = None,
        results: int = 1,
        waits: bool = False,
    ) -> None:
        self.core, self.memory, self.ratio, self.schedule, self.waits = core, memory, ratio, schedule, waits
        self.face = Face(
            sample_bytes=len(core.s_axis_tdata) // 8,
            result_bytes=len(core.m_axis_tdata) // 8,
            channels=channels,
            address_bits=len(core.s_axil_awaddr) if hasattr(core, "s_axil_awaddr") else 0,
            readings=0 if schedule is None else channels * len(schedule.readings),
            packing=packing,
            results=results,
        )
        members: dict[str, In | Out] = {"clk": In(1), "rst": In(1), "rx": In(1), "tx": Out(1), "leds": Out(LEDS)}
        if schedule is not None:
            members |= converter_pins(schedule)
        super().__init__(members)

    def elaborate(self, platform: object) -> Module:
        """Connect the link and the core."""
        m = Module()
        m.submodules.core = core = self.core
        m.submodules.link = link = Link(self.face, self.memory, ratio=self.ratio, waits=self.waits)
        m.d.comb += [
            link.clk.eq(self.clk),
            link.rst.eq(self.rst),
            link.rx.eq(self.rx),
            self.tx.eq(link.tx),
            self.leds.eq(link.leds),
            core.aclk.eq(self.clk),
        ]
        if self.schedule is None:
            m.d.comb += core.aresetn.eq(link.aresetn)
            self.join(m, core, link, self._feeding(m, core, link))
            return m
        self.join(m, core, link, core_side(self.face))
        m.submodules.front_end = front = FrontEnd(self.schedule, result_bytes=self.face.result_bytes)
        m.d.comb += [
            front.clk.eq(self.clk),
            front.rst.eq(self.rst),
            core.aresetn.eq(front.aresetn),
        ]
        self.join(m, self, front, converter_pins(self.schedule))
        self.join(m, front, link, core_side(self.face))
        self.join(m, core, front, core_side(replace(self.face, readings=0, address_bits=0)))
        return m

    def _feeding(self, m: Module, core: wiring.Component, link: Link) -> dict[str, In | Out]:
        """Return what a link joins to the core that it feeds, but what goes through a `LockKeeper`."""
        members = core_side(self.face)
        if not getattr(core, "lock", False):
            return members
        m.submodules.keeper = keeper = LockKeeper(self.face.address_bits)
        m.d.comb += [
            keeper.clk.eq(self.clk),
            keeper.rst.eq(self.rst),
            keeper.i_target.eq(link.s_axil_awaddr),
            core.s_axil_awaddr.eq(keeper.o_target),
            keeper.i_answered.eq(core.s_axil_bvalid & link.s_axil_bready),
            keeper.i_response.eq(core.s_axil_bresp),
            keeper.i_data.eq(core.s_axil_rdata),
            link.s_axil_rdata.eq(keeper.o_data),
        ]
        return {name: member for name, member in members.items() if name not in {"s_axil_awaddr", "s_axil_rdata"}}

    def join(
        self, m: Module, inner: wiring.Component, outer: wiring.Component, members: Mapping[str, In | Out]
    ) -> None:
        """Connect those of the members of `outer` that `inner` has: a core of one channel has no tdest."""
        for name, member in members.items():
            if hasattr(inner, name):
                to, of = getattr(inner, name), getattr(outer, name)
                m.d.comb += of.eq(to) if member.flow is In else to.eq(of)
