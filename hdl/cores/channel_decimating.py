r"""What every FIR filter has that decimates several channels and takes a sample at each clock: what is in front.

A sample waits in front for what is kept of its channel, and goes on with what is known of it::

    s_axis_tdata --> [sample] ------> inside: sums of samples --> value --> [limited] --> output_buffer --> m_axis
    s_axis_tdest --> [channel] -----> [channel1] --> [channel2] --> .. ----------------------^
                        |    ^            |
                        |    +--- near <--+
                        v
                  control memory: started, phase, rail, counted --> completes, rail, counts, settling, fresh

`near` says that the sample behind the one in front has the same channel: then that one waits for a clock, while what
is read for it in front is read again. So two samples of one channel are never in neighbouring places. Inside, a memory
with a word for each channel is read for a sample a clock before it is written: no word is used that is read at the
clock at which it is written. Samples of two channels in turn enter at each clock, those of one at every second::

    clock              0    1    2    3    4    5
    s_axis_tdest       0    1    1    1    0
    s_axis_tready      1    1    1    0    1
    [channel]               0    1    1    1    0
    near                    0    0    1    0    0

A reset clears the control words, a channel at each clock. With a start from zero, what memories hold counts as that of
samples that are 0 for the first sample of a channel, which is `fresh`. With a steady start, that one goes in again and
again, at every second clock, before it leaves its place in front, until nothing else is remembered. The results of that
do not count.

Latency: a clock in front, and that of `sosmith.hdl.cores.decimating`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib.memory import Memory

from sosmith.hdl.cores.decimating import DecimatingCore, Entered
from sosmith.hdl.memory_ports import read_port, write_port
from sosmith.hdl.plan.decimating.plan import DecimatingPlan
from sosmith.hdl.plan.streams import channel_bits
from sosmith.hdl.shell.pipeline import delayed
from sosmith.hdl.status import at_rail, status_of_result
from sosmith.model.dataflow.datapath import Datapath

_NO_COLLISIONS = {"no_rw_check": 1}
"""Attribute of memories: no word is used that is read at the clock at which it is written."""


class Kept(NamedTuple):
    """What is kept of a channel, or the number of bits of each.

    Attributes
    ----------
    started : Value
        Whether the first sample of the channel has entered.
    phase, rail : Value
        As of one channel (`sosmith.hdl.cores.decimating`).
    counted : Value
        How many results were flagged as settling; no bits if none are.
    """

    started: Any
    phase: Any
    rail: Any
    counted: Any


class Along(NamedTuple):
    """What goes along with samples, at each position from the one in front on.

    Attributes
    ----------
    channel : list of Value
    counts, settling : list of Value
        Whether the result counts, and whether it is flagged as settling; empty where that is always the same.
    fresh : list of Value
        Whether it is the first sample of its channel, with a start from zero; empty with a steady start.
    """

    channel: list[Value]
    counts: list[Value]
    settling: list[Value]
    fresh: list[Value]


class ChannelDecimatingCore(DecimatingCore):
    """An FIR filter that decimates, for several channels.

    Parameters
    ----------
    datapath : Datapath
        What it computes: one FIR section, the output stage, and a downsampler.
    plan : DecimatingPlan
        How samples become results.
    copies : int
        Times that each result is handed out.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(self, datapath: Datapath, plan: DecimatingPlan, copies: int = 1) -> None:
        self._front = plan
        super().__init__(datapath, plan, copies, plan.channels)

    def fill(self, m: Module) -> None:
        """Build what is in front, the inside, and the way of results."""
        plan = self._front
        buffer = self.output_buffer(m)
        advance, rail = Signal(name="advance"), Signal(name="rail_now")
        self._address = Signal(channel_bits(self.channels), name="address")
        m.d.comb += advance.eq(buffer.advance)
        self.along = along = Along([], [], [], [])
        sample = self._in_front(m, advance, rail)
        last, behind = plan.clocks - 1, 1 + plan.limits
        for name in along._fields:
            while 0 < len(getattr(along, name)) <= last + behind * (name == "channel"):
                self._pass(m, advance, name)
        summed = self.sums(m, sample)
        result = self.limited(
            m,
            advance,
            summed,
            counts=along.counts[last] if along.counts else Const(1, 1),
            settling=along.settling[last] if along.settling else Const(0, int(self.datapath.settles)),
        )
        flags = status_of_result(
            m,
            self.datapath,
            result.code,
            inputs=Cat(delayed(m, advance, rail, last + behind, "rail"), Const(0, 1)),
            saturated=result.saturated,
            settling=result.settling,
            channel=along.channel[-2],
            enable=advance,
        ).flags
        self.hand_out(m, buffer, result.valid, [(result.code, flags)], along.channel[-1], leaves=self.leaves(m))

    def _pass(self, m: Module, advance: Value, name: str) -> None:
        """Pass on what goes along with samples to the next position."""
        own: list[Value] = getattr(self.along, name)
        own.append(self.later(m, advance, own[-1], f"{name}{len(own)}", reset_less=True))

    # In front.

    def _in_front(self, m: Module, advance: Value, rail_now: Signal) -> Entered:
        """Build the place of the sample in front, and what becomes of the control word of its channel."""
        plan, (port,) = self._front, self.datapath.inputs
        clearing, there, enters = Signal(init=1, name="clearing"), Signal(name="there"), Signal(name="enters")
        channel = Signal(len(self._address), name="channel")
        sample = Signal(signed(port.bits) if port.signed else port.bits, name="sample", reset_less=True)
        before, after = self._control(m, channel, clearing, enters)
        near, filling, completes, last = (Signal(name=name) for name in ("near", "filling", "completes", "last"))
        m.d.comb += [
            enters.eq(there & advance & ~near),
            filling.eq(~before.started if plan.filled else 0),
            completes.eq(~before.phase.any()),
            last.eq(before.phase == plan.factor - 1),
            rail_now.eq(before.rail | at_rail(self.datapath.inputs, sample)),
            self.s_axis_tready.eq(~clearing & (~there | (enters & ~filling))),
            self._address.eq(Mux(self.s_axis_tready, self.s_axis_tdest, channel)),
            after.started.eq(self._started(m, filling, enters & last)),
            after.phase.eq(Mux(last, 0, before.phase + 1)),
            after.rail.eq(rail_now & ~completes & ~filling),
        ]
        with m.If(self.s_axis_tready):
            (code,) = self.codes(self.s_axis_tdata)
            m.d.sync += [there.eq(self.s_axis_tvalid & (self.s_axis_tdest < self.channels)), sample.eq(code)]
        with m.If(clearing | self.s_axis_tready):
            m.d.sync += channel.eq(Mux(clearing, channel + 1, self.s_axis_tdest))
        with m.If(clearing & (channel == self.channels - 1)):
            m.d.sync += clearing.eq(0)
        self.along.channel.append(channel)
        if plan.filled:
            self.along.counts.append(~filling)
        else:
            self.along.fresh.append(~before.started)
        if plan.settling:
            settling = Signal(name="settling_now")
            m.d.comb += [
                settling.eq(before.counted != plan.settling),
                after.counted.eq(before.counted + (completes & settling)),
            ]
            self.along.settling.append(settling)
        self._pass(m, advance, "channel")
        valid = self.later(m, advance, enters, "valid1")
        m.d.comb += near.eq(valid & (self.along.channel[1] == channel))
        return Entered(advance, valid, enters, before.phase, completes, sample)

    def _control(self, m: Module, channel: Signal, clearing: Value, enters: Value) -> tuple[Kept, Kept]:
        """Return what is kept of the channel of the sample in front, and what takes its place when that enters."""
        plan = self._front
        sizes = Kept(1, (plan.factor - 1).bit_length(), 1, plan.settling.bit_length())
        after = Kept(*(Signal(bits, name=f"{name}_after") for name, bits in sizes._asdict().items()))
        written = Mux(clearing, 0, Cat(*after))
        word = self._word(m, "control", (Const(1, 1), self._address), (clearing | enters, channel, written))
        before, low = list[Value](), 0
        for bits in sizes:
            before.append(word[low : low + bits])
            low += bits
        return Kept(*before), after

    def _started(self, m: Module, filling: Value, ends: Value) -> Value:
        """Return whether the channel has started once a sample enters, from the last of each R that do."""
        times = self._front.fills
        if not times:
            return Const(1, 1)
        filled, done = Signal(range(times), name="filled"), Signal(name="done")
        m.d.comb += done.eq(filled == times - 1)
        with m.If(filling & ends):
            m.d.sync += filled.eq(Mux(done, 0, filled + 1))
        return ~filling | (ends & done)

    # Memories.

    def of_channel(self, m: Module, name: str, position: int, advance: Value, left: tuple[Value, Value]) -> Value:
        """Return what a memory has of the channel of the sample at a position; what is written comes last.

        `left` says whether the sample leaves another word there, and which.
        """
        along = self.along
        read = (advance, along.channel[position - 1]) if position else (Const(1, 1), self._address)
        moves, written = left
        return self._word(m, name, read, (moves, along.channel[position], written))

    def _word(self, m: Module, name: str, read: tuple[Value, Value], write: tuple[Value, Value, Value]) -> Value:
        """Make a memory with a word for each channel; return the one that has been read.

        `read` says whether one is read at this clock, and of which channel; `write`, whether, where and what is
        written.
        """
        (reads, address), (writes, place, written) = read, write
        memory = Memory(shape=len(written), depth=self.channels, init=[], attrs=_NO_COLLISIONS)
        m.submodules[f"{name}_memory"] = memory
        reader, writer = read_port(memory, name), write_port(memory, name)
        m.d.comb += [reader.en.eq(reads), reader.addr.eq(address)]
        m.d.comb += [writer.en.eq(writes), writer.addr.eq(place), writer.data.eq(written)]
        return reader.data
