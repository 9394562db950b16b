r"""A CIC filter of adders alone for several channels, whose sums and combs are memories with a word for each of them.

A sample waits in front for what is kept of its channel; behind, integrators and combs are a pipeline, each with a
memory that is read at the clock before the one at which it is written::

    s_axis_tdata --> [sample] -------> + --[sum1]--> + --> .. N .. --[sumN]--> - --> .. N .. --[differenceN]--+
    s_axis_tdest --> [channel] ...     ^ |           ^ |                     | ^                   width      |
                        |              | v           | v                     v |                              |
                        |             sum1 memory   sum2 memory ..       comb1 memory ..                      |
                        v              width x channels                                                       |
                  control memory: started, phase, rail, counted --> completes, rail, .. with the sample       |
                                                                                                              |
    m_axis_tdata, m_axis_tuser, m_axis_tdest <-- output_buffer <-- [limited] <-- [rounded] <------------------+

    clock of the edge    0       1    ..   N      N+1      ..     2N          2N+1      2N+2     2N+3
    register           sample  sum1  ..  sumN  difference1 .. differenceN  rounded  [limited]  output_buffer

Each integrator moves with its sample, each comb with every R-th one of a channel. All is modulo ``2**width``, as for
one channel (`sosmith.hdl.cores.cic`).

`near` says that the sample behind the one in front has the same channel: then that one waits for a clock, while what is
read for it in front is read again. So two samples of one channel are never in neighbouring places, and no word is used
that is read at the clock at which it is written. Samples of two channels in turn enter at each clock, those of one at
every second::

    clock              0    1    2    3    4    5
    s_axis_tdest       0    1    1    1    0
    s_axis_tready      1    1    1    0    1
    [channel]               0    1    1    1    0
    near                    0    0    1    0    0

A reset clears the control words, a channel at each clock. With a start from zero, sums and combs count as 0 for the
first sample of a channel. With a steady start, that one goes in N R times, at every second clock, before it leaves its
place in front: from then on nothing counts that sums and combs held before. The results of that do not count.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib.memory import Memory

from sosmith.hdl.axi_stream import extended
from sosmith.hdl.cores.cic import with_half
from sosmith.hdl.cores.decimating import DecimatingCore, Entered, Summed
from sosmith.hdl.memory_ports import read_port, write_port
from sosmith.hdl.plan.decimating.cic import channel_cic_plan
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
    first : list of Value
        Whether sums and combs count as 0, for the first sample of a channel; empty with a steady start.
    """

    channel: list[Value]
    counts: list[Value]
    settling: list[Value]
    first: list[Value]


class ChannelCicCore(DecimatingCore):
    """A CIC filter of adders, for several channels.

    Latency: `latency_cycles` of `sosmith.hdl.plan.decimating.cic.ChannelCicPlan`, without a stall. Throughput: one
    sample a clock, of any channel but that of the sample before; of that one, a sample every second clock. A sample of
    a channel that does not exist is accepted and dropped.

    Parameters
    ----------
    datapath : Datapath
        What it computes: one FIR section of moving sums, the output stage, and a downsampler.
    channels : int
        Number of channels, at least 2.
    copies : int
        Times that each result is handed out.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(self, datapath: Datapath, channels: int, copies: int = 1) -> None:
        self._plan = channel_cic_plan(datapath, channels)
        super().__init__(datapath, self._plan, copies, channels)

    def fill(self, m: Module) -> None:
        """Build what is in front, integrators and combs, and the way of results."""
        plan = self._plan
        buffer = self.output_buffer(m)
        advance, rail = Signal(name="advance"), Signal(name="rail_now")
        self._address = Signal(channel_bits(self.channels), name="address")
        m.d.comb += advance.eq(buffer.advance)
        self._along = along = Along([], [], [], [])
        self._position = 0
        summed = self.sums(m, self._in_front(m, advance, rail))
        result = self.limited(
            m,
            advance,
            summed,
            counts=along.counts[-1] if along.counts else Const(1, 1),
            settling=along.settling[-1] if along.settling else Const(0, int(self.datapath.settles)),
        )
        behind = 1 + plan.limits
        for _ in range(behind):
            self._pass(m, advance, "channel")
        flags = status_of_result(
            m,
            self.datapath,
            result.code,
            inputs=Cat(delayed(m, advance, rail, 2 * plan.order + behind, "rail"), Const(0, 1)),
            saturated=result.saturated,
            settling=result.settling,
            channel=along.channel[-2],
            enable=advance,
        ).flags
        self.hand_out(m, buffer, result.valid, [(result.code, flags)], along.channel[-1], leaves=self.leaves(m))

    def _pass(self, m: Module, advance: Value, name: str) -> None:
        """Pass on what goes along with samples to the next position."""
        own: list[Value] = getattr(self._along, name)
        if own:
            own.append(self.later(m, advance, own[-1], f"{name}{len(own)}", reset_less=True))

    # In front.

    def _in_front(self, m: Module, advance: Value, rail_now: Signal) -> Entered:
        """Build the place of the sample in front, and what becomes of the control word of its channel."""
        plan, (port,) = self._plan, self.datapath.inputs
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
        self._along.channel.append(channel)
        if plan.filled:
            self._along.counts.append(~filling)
        else:
            self._along.first.append(~before.started)
        if plan.settling:
            settling = Signal(name="settling_now")
            m.d.comb += [
                settling.eq(before.counted != plan.settling),
                after.counted.eq(before.counted + (completes & settling)),
            ]
            self._along.settling.append(settling)
        self._pass(m, advance, "channel")
        valid = self.later(m, advance, enters, "valid1")
        m.d.comb += near.eq(valid & (self._along.channel[1] == channel))
        return Entered(advance, valid, enters, before.phase, completes, sample)

    def _control(self, m: Module, channel: Signal, clearing: Value, enters: Value) -> tuple[Kept, Kept]:
        """Return what is kept of the channel of the sample in front, and what takes its place when that enters."""
        plan = self._plan
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
        times = self._plan.fills
        if not times:
            return Const(1, 1)
        filled, done = Signal(range(times), name="filled"), Signal(name="done")
        m.d.comb += done.eq(filled == times - 1)
        with m.If(filling & ends):
            m.d.sync += filled.eq(Mux(done, 0, filled + 1))
        return ~filling | (ends & done)

    # Integrators and combs.

    def sums(self, m: Module, sample: Entered) -> Summed:
        """Build integrators, combs, and the rounding."""
        plan, advance = self._plan, sample.advance
        value: Value = Signal(plan.width, name="value")
        m.d.comb += value.eq(extended(sample.code, plan.width))
        valid, completes, moves = sample.valid, sample.completes, sample.enters
        for k in range(1, plan.order + 1):
            total = Signal(plan.width, name=f"total{k}")
            m.d.comb += total.eq(value + self._of_channel(m, f"sum{k}", k - 1, advance, (moves, total)))
            value = self._next(m, advance, total, f"sum{k}")
            valid = valid if k == 1 else self.later(m, advance, valid, f"valid{k}")
            completes = self.later(m, advance, completes, f"completes{k}", reset_less=True)
            moves = advance & valid
        moved = valid & completes
        for k in range(1, plan.order + 1):
            before = self._of_channel(m, f"comb{k}", plan.order + k - 1, advance, (advance & moved, value))
            value = self._next(m, advance, (value - before)[: plan.width], f"difference{k}")
            moved = self.later(m, advance, moved, f"moved{k}")
        rounded = self.rounded()
        with m.If(advance):
            m.d.sync += rounded.eq(with_half(self.datapath, plan, value))
        return Summed(rounded, moved)

    def _next(self, m: Module, advance: Value, value: Value, name: str) -> Value:
        """Return a value at the next position, with what goes along with it."""
        along, position = self._along, self._position
        self._position += 1
        for other in ("channel", "counts", "settling", "first"):
            if len(getattr(along, other)) == position + 1:  # the first channel is there already
                self._pass(m, advance, other)
        return self.later(m, advance, value, name, reset_less=True)

    def _of_channel(self, m: Module, name: str, position: int, advance: Value, left: tuple[Value, Value]) -> Value:
        """Return what a memory has of the channel of the sample at a position.

        `left` says whether the sample leaves another word there, and which.
        """
        along = self._along
        read = (advance, along.channel[position - 1]) if position else (Const(1, 1), self._address)
        moves, written = left
        word = self._word(m, name, read, (moves, along.channel[position], written))
        if not along.first:
            return word
        own = Signal(len(word), name=f"{name}_of_channel")
        m.d.comb += own.eq(Mux(along.first[position], 0, word))
        return own

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
