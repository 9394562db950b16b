"""A result for each sample behind something that decimates several channels, whose samples come one at a time.

::

    s_dest ------> [words: result, left] of the channel --> [word] ------------------> m_data
                                                              ^                         m_dest <-- [dest]
    s_valid --> o_valid ===> what decimates ===> i_data ------'  only if left is 0
    s_ready <-- o_ready

    left 0: the sample brings a result, which is kept for the next `copies` - 1 samples of its channel; else one less is
    left, and the result that is kept leaves again.

A sample is let in once the result of the one before has left: a link that feeds one at a time loses nothing by that,
and the results leave in the order of the samples, whatever the order of their channels.
"""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, ClockDomain, ClockSignal, DomainRenamer, Module, Mux, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.bus.axi_lite import forward_slave
from sosmith.hdl.memory_ports import read_port, write_port

CLOCKS = 4
"""Clocks from a sample to its result beside those of what decimates."""


class ChannelHolder(wiring.Component):
    """Hands out the last result of a channel for each of its samples.

    Latency: `CLOCKS`, and what decimates. Throughput: one sample in that time. After a reset, as many clocks as there
    are channels pass before a sample, in which what was left of each becomes 0.

    Parameters
    ----------
    width : int
        Width of a result, in bits.
    copies : int
        Samples of a channel for each result, at least 2.
    channels : int
        Number of channels, at least 2.
    dest_width : int
        Bits of the number of a channel.

    Members
    -------
    s_valid, s_ready, s_dest
        Handshake and channel of a sample, which stays until `s_ready`; its data goes past.
    o_valid, o_ready
        The same handshake with what decimates.
    i_data, i_valid, i_ready
        Its results.
    m_data, m_dest, m_valid, m_ready
        A result for each sample, by the rules of AXI4-Stream.
    """

    def __init__(self, width: int, copies: int, channels: int, dest_width: int) -> None:
        self.copies, self.channels = copies, channels
        super().__init__(
            {
                "s_valid": In(1),
                "s_ready": Out(1),
                "s_dest": In(dest_width),
                "o_valid": Out(1),
                "o_ready": In(1),
                "i_data": In(width),
                "i_valid": In(1),
                "i_ready": Out(1),
                "m_data": Out(width),
                "m_dest": Out(dest_width),
                "m_valid": Out(1),
                "m_ready": In(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the memory, and the steps that each sample takes."""
        m = Module()
        width = len(self.m_data)
        left = Signal(range(self.copies))
        word, dest = Signal(width), Signal(len(self.m_dest))
        waits, taken = Signal(), Signal()
        m.submodules.words = words = Memory(shape=width + len(left), depth=self.channels, init=[])
        read, write = read_port(words, "words"), write_port(words, "words")
        m.d.comb += [read.addr.eq(self.s_dest), read.en.eq(1), self.m_data.eq(word), self.m_dest.eq(dest)]
        with m.FSM():
            with m.State("clear"):
                m.d.comb += [write.addr.eq(dest), write.en.eq(1)]
                m.d.sync += dest.eq(dest + 1)
                with m.If(dest == self.channels - 1):
                    m.next = "idle"
            with m.State("idle"):
                m.d.sync += dest.eq(self.s_dest)
                with m.If(self.s_valid):
                    m.next = "look"
            with m.State("look"):
                m.d.sync += [Cat(word, left).eq(read.data), taken.eq(0), waits.eq(~read.data[width:].any())]
                m.next = "offer"
            with m.State("offer"):
                passes, comes = self.o_valid & self.o_ready, self.i_valid & waits
                m.d.comb += [self.o_valid.eq(~taken), self.s_ready.eq(passes), self.i_ready.eq(waits)]
                m.d.sync += taken.eq(taken | passes)
                with m.If(comes):
                    m.d.sync += [word.eq(self.i_data), waits.eq(0)]
                with m.If((taken | passes) & (~waits | comes)):
                    m.next = "answer"
            with m.State("answer"):
                m.d.comb += [
                    self.m_valid.eq(1),
                    write.addr.eq(dest),
                    write.data.eq(Cat(word, Mux(left.any(), left - 1, self.copies - 1)[: len(left)])),
                    write.en.eq(self.m_ready),
                ]
                with m.If(self.m_ready):
                    m.next = "idle"
        return m


class HeldChannels(wiring.Component):
    """A core, or a chain, that decimates several channels, with a result for each sample.

    Latency and throughput: those of a `ChannelHolder`.

    Parameters
    ----------
    core : Component
        With the members of `sosmith.hdl.axi_stream.core_members`, and with ``s_axil_*`` or without.
    copies, channels : int
        Samples of a channel for each result, and channels; at least 2.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*, s_axil_*
        As those of the core.

    Attributes
    ----------
    lock : bool
        Whether the registers of the core have a lock.
    """

    def __init__(self, core: wiring.Component, copies: int, channels: int) -> None:
        self.core, self.copies, self.channels = core, copies, channels
        self.lock = bool(getattr(core, "lock", False))
        super().__init__(dict(core.signature.members))

    def elaborate(self, platform: object) -> Module:
        """Put the holder on both sides of the core."""
        m = Module()
        core: Any = self.core
        m.domains.held = ClockDomain(local=True)
        m.d.comb += [ClockSignal("held").eq(self.aclk), ResetSignal("held").eq(~self.aresetn)]
        result, word = Cat(core.m_axis_tdata, core.m_axis_tuser), Cat(self.m_axis_tdata, self.m_axis_tuser)
        holder = ChannelHolder(len(word), self.copies, self.channels, len(self.s_axis_tdest))
        m.submodules.holder = DomainRenamer("held")(holder)
        m.submodules.core = core
        forward_slave(m, self, core)
        m.d.comb += [
            core.aclk.eq(self.aclk),
            core.aresetn.eq(self.aresetn),
            core.s_axis_tdata.eq(self.s_axis_tdata),
            core.s_axis_tdest.eq(self.s_axis_tdest),
            core.s_axis_tvalid.eq(holder.o_valid),
            holder.o_ready.eq(core.s_axis_tready),
            holder.s_valid.eq(self.s_axis_tvalid),
            holder.s_dest.eq(self.s_axis_tdest),
            self.s_axis_tready.eq(holder.s_ready),
            holder.i_data.eq(result),
            holder.i_valid.eq(core.m_axis_tvalid),
            core.m_axis_tready.eq(holder.i_ready),
            word.eq(holder.m_data),
            self.m_axis_tdest.eq(holder.m_dest),
            self.m_axis_tvalid.eq(holder.m_valid),
            holder.m_ready.eq(self.m_axis_tready),
        ]
        return m
