"""The top of every board: a core, fed over a serial line.

::

                 +------+  s_axis_*, s_axil_*, aresetn   +------+
    rx --------->|      |------------------------------->|      |
    tx <---------| link |                                | core |
    leds 3 <-----|      |<-------------------------------|      |
                 +------+          m_axis_*              +------+
                    ^                                       ^ aclk
    clk, rst -------+---------------------------------------+

One clock for all. Latency: that of the link, `sosmith.hdl.bus.link`, and of the core.
"""

from __future__ import annotations

from fractions import Fraction

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.command_engine import Face, core_side
from sosmith.hdl.bus.link import LEDS, Link


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

    Members
    -------
    clk : In(1)
        Clock, rising edge.
    rst : In(1)
        Reset of the core, synchronous, active high. It may be tied to 0: registers have initial values, and the first
        request resets the core.
    rx : In(1)
        Line from the host, 8N1; asynchronous.
    tx : Out(1)
        Line to the host, 8N1, from a register.
    leds : Out(3)
        High for a LED that is lit. 0: changes with each request that is carried out. 1: a byte or a frame was
        damaged, since the last session began. 2: the last result has a flag `wear_critical` or `fault`.
    """

    def __init__(self, core: wiring.Component, memory: bytes, *, ratio: Fraction, channels: int = 1) -> None:
        self.core, self.memory, self.ratio = core, memory, ratio
        self.face = Face(
            sample_bytes=len(core.s_axis_tdata) // 8,
            result_bytes=len(core.m_axis_tdata) // 8,
            channels=channels,
            address_bits=len(core.s_axil_awaddr) if hasattr(core, "s_axil_awaddr") else 0,
        )
        super().__init__({"clk": In(1), "rst": In(1), "rx": In(1), "tx": Out(1), "leds": Out(LEDS)})

    def elaborate(self, platform: object) -> Module:
        """Connect the link and the core."""
        m = Module()
        m.submodules.core = core = self.core
        m.submodules.link = link = Link(self.face, self.memory, ratio=self.ratio)
        m.d.comb += [
            link.clk.eq(self.clk),
            link.rst.eq(self.rst),
            link.rx.eq(self.rx),
            self.tx.eq(link.tx),
            self.leds.eq(link.leds),
            core.aclk.eq(self.clk),
            core.aresetn.eq(link.aresetn),
        ]
        for name, member in core_side(self.face).items():
            if hasattr(core, name):  # a core of one channel has no tdest
                inner, outer = getattr(core, name), getattr(link, name)
                m.d.comb += outer.eq(inner) if member.flow is In else inner.eq(outer)
        return m
