"""A CIC filter for many channels: one adder, which takes a clock for each integrator and comb, and states in memories.

::

    i_data, i_dest --> [sample] --> - --> + --> [acc] --> - --> [acc] --> + --> round --> [o_data]
                                    |     |  N times      |  N times     |
                                  first   states: sum k   states: comb k |
                                    |     of the channel, read and written at the same clock
                                    |                                first << growth
                    control: started, phase, flags, first sample of the channel

    clock of the edge     0        1          2       ..    N + 1       N + 2     ..    2N + 1      2N + 2
    what is kept       sample    control     sum 1    ..    sum N       comb 1    ..    comb N      o_data, o_valid

The first sample of a channel is as if it had been there for ever: it is taken off all samples, so that the sums begin
with 0, and added to each result, times ``R**N``. With a start from zero there is none of that: it is not kept. Of a
channel that has not started, states count as 0; so only the control is cleared, a channel a clock after a reset. All
sums are modulo ``2**width``, see `sosmith.model.dataflow.decimator`.

With protection, both memories have check bits. Those of a state are as asked for. The control corrects a wrong bit in
any case, since without the phase nobody knew which samples bring results; with two wrong bits, the channel begins anew.
A wrong bit in a sum or a comb is forgotten: once N combs hold what came after it, no result has it any more. So the
result that meets it and the next N of the channel, which the control counts, have `o_fault`, with which the core behind
restarts::

    state failed, control failed, i_fault ---> [met] ---> the N next ones: control
                                                 |
                     next ones left, of before --+------> [o_fault]

A sample without a result takes N + 2 clocks, one with a result 2N + 3. A sample of a channel that does not exist is
accepted and dropped. `i_ready` comes from registers only.
"""

from __future__ import annotations

from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.axi_stream import codes_of, extended
from sosmith.hdl.check_bits import CheckBits, Read
from sosmith.hdl.memory_ports import read_port, write_port
from sosmith.hdl.plan.streams import channel_bits, dest_width, width
from sosmith.hdl.status import NEVER, RAIL_ALONE, at_rail
from sosmith.model.dataflow.decimator import Decimator


class ChannelDecimator(wiring.Component):
    """A CIC filter between two streams, for several channels.

    Latency and throughput: those of `sosmith.hdl.plan.decimator_clocks` for several channels.

    Parameters
    ----------
    decimator : Decimator
        What it computes for each channel.
    channels : int
        Number of channels, at least 2.
    flags : int
        How many flags come with a sample; 0 to find out whether it is at the end of its range.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.

    Members
    -------
    i_data, i_dest, i_valid, i_ready
        Samples at the higher rate and their channels, by the rules of AXI4-Stream; `i_data` is as wide as on a core's
        stream, or, with flags, as the code.
    i_flags
        Flags of a sample; only if there are any.
    o_data, o_flags, o_dest, o_valid, o_ready
        Results: the code of `decimator.output`, the flags of any sample of the channel since its result before, and the
        channel.
    i_fault, o_fault, corrected
        As those of `sosmith.hdl.decimation.decimator.CicDecimator`; only with protection.
    """

    def __init__(self, decimator: Decimator, channels: int, flags: int = 0, *, protect: str = "none") -> None:
        self.protect = protect
        self.guarded = protect != "none"
        self.decimator = decimator
        self.channels = channels
        self.flags = flags
        super().__init__(
            {
                "i_data": In(decimator.input.bits if flags else width([decimator.input])),
                **({"i_flags": In(flags)} if flags else {}),
                **({"i_fault": In(1)} if flags and self.guarded else {}),
                **({"o_fault": Out(1), "corrected": Out(1)} if self.guarded else {}),
                "i_dest": In(dest_width(channels)),
                "i_valid": In(1),
                "i_ready": Out(1),
                "o_data": Out(decimator.output.bits),
                "o_flags": Out(flags or RAIL_ALONE),
                "o_dest": Out(dest_width(channels)),
                "o_valid": Out(1),
                "o_ready": In(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the sequence, the two memories and the adder."""
        m = Module()
        cic, bits = self.decimator, channel_bits(self.channels)
        channel = Signal(bits)
        sample = Signal(cic.input.bits, reset_less=True)
        gathered = Signal(len(self.o_flags), reset_less=True)
        acc = Signal(cic.width, reset_less=True)
        step = Signal(range(2 * cic.stages))
        clearing = Signal(init=1)
        idle = Signal()
        takes = Signal()
        gives = Signal()
        m.d.comb += self.i_ready.eq(idle)
        (code,) = codes_of([cic.input], self.i_data)
        wrong = Signal() if self.guarded else NEVER
        kept = self._control(m, channel, sample, gathered, wrong)
        adds = Signal()
        total, read = self._states(m, channel, (step, adds), kept.started, acc)
        changed: Value = self._code(sample)
        result: Value = acc
        if cic.steady:
            changed -= self._code(kept.first)
            result = (acc + (extended(self._code(kept.first), cic.width) << cic.growth)[: cic.width])[: cic.width]
        with m.If(self.o_ready):
            m.d.sync += self.o_valid.eq(0)
        # One of these is 1 at each clock.
        m.d.comb += [kept.clears.eq(clearing), kept.reads.eq(idle)]
        with m.If(clearing):
            m.d.sync += channel.eq(channel + 1)
            with m.If(channel == self.channels - 1):
                m.d.sync += [clearing.eq(0), idle.eq(1)]
        with m.If(idle):
            m.d.sync += [
                channel.eq(self.i_dest[:bits]),
                sample.eq(code),
                gathered.eq(self.i_flags if self.flags else at_rail([cic.input], self.i_data)),
            ]
            with m.If(self.i_valid & (self.i_dest < self.channels)):
                m.d.sync += [idle.eq(0), takes.eq(1)]
        if self.guarded:
            self._watch(m, idle, (takes & kept.corrected, takes & kept.failed), (adds & kept.started, read), wrong)
        with m.If(takes):
            m.d.sync += [acc.eq(changed), step.eq(0), takes.eq(0), adds.eq(1)]
        with m.If(adds):
            m.d.sync += [acc.eq(total), step.eq(step + 1)]
            with m.If((step == cic.stages - 1) & ~kept.completes):
                m.d.comb += kept.writes.eq(1)
                m.d.sync += [adds.eq(0), idle.eq(1)]
            with m.If(step == 2 * cic.stages - 1):
                m.d.sync += [adds.eq(0), gives.eq(1)]
        with m.If(gives & (~self.o_valid | self.o_ready)):
            m.d.comb += kept.writes.eq(1)
            m.d.sync += [
                self.o_data.eq((result + (1 << cic.dropped >> 1)) >> cic.dropped),
                self.o_flags.eq(kept.flags | gathered),
                self.o_dest.eq(channel),
                self.o_valid.eq(1),
                gives.eq(0),
                idle.eq(1),
            ]
            if self.guarded:
                m.d.sync += self.o_fault.eq(wrong | kept.marked.any())
        return m

    def _watch(
        self, m: Module, idle: Value, control: tuple[Value, Value], state: tuple[Value, Read], wrong: Value
    ) -> None:
        """Say whether a wrong bit was found for the sample, up to this clock: in its control, in a state, or before."""
        met = Signal(name="met", reset_less=True)
        (corrected, failed), (needed, read) = control, state
        m.d.comb += [
            wrong.eq(met | failed | (needed & read.failed)),
            self.corrected.eq(corrected | (needed & read.corrected)),
        ]
        m.d.sync += met.eq(Mux(idle, self.i_fault if self.flags else NEVER, wrong))

    def _code(self, bits: Value) -> Value:
        """Return a code of the input as a number."""
        return bits.as_signed() if self.decimator.input.signed else bits

    def _control(self, m: Module, channel: Signal, sample: Signal, gathered: Signal, wrong: Value) -> _Kept:
        """Keep of each channel whether it has started, the phase, the flags, marks of results, and the first sample."""
        cic, count = self.decimator, len(self.o_flags)
        phases, marks = cic.factor.bit_length() - 1, cic.stages.bit_length() * self.guarded
        size = 1 + phases + count + marks + (len(sample) if cic.steady else 0)
        check = CheckBits(size, "correct" if self.guarded else "none")
        m.submodules.control = memory = Memory(shape=check.width, depth=self.channels, init=[])
        read, write = read_port(memory, "control"), write_port(memory, "control")
        word = check.read(m, read.data, "control")
        kept = _Kept(
            marked=Signal(marks, name="marked") if marks else Const(0, 0),
            corrected=word.corrected,
            failed=word.failed,
            started=Signal(name="started"),
            first=Signal(len(sample), name="first"),
            flags=Signal(count, name="flags"),
            completes=Signal(name="completes"),
            clears=Signal(name="clears"),
            reads=Signal(name="reads"),
            writes=Signal(name="writes"),
        )
        phase = Signal(phases)
        if cic.steady:
            m.d.comb += kept.first.eq(sample)
        if self.guarded:
            m.d.comb += kept.started.eq(word.data[0] & ~word.failed)
            with m.If(kept.started):
                m.d.comb += Cat(phase, kept.flags, kept.marked, kept.first)[: size - 1].eq(word.data[1:])
        else:
            with m.If(read.data[0]):
                m.d.comb += Cat(kept.started, phase, kept.flags, kept.first)[:size].eq(read.data)
        less = kept.marked - (kept.completes & kept.marked.any())
        marked = [Mux(wrong, cic.stages, less)[:marks]] if marks else []
        flags = Mux(kept.completes, 0, kept.flags | gathered)
        m.d.comb += [
            kept.completes.eq(~phase.any()),
            read.en.eq(kept.reads),
            read.addr.eq(self.i_dest),
            write.en.eq(kept.clears | kept.writes),
            write.addr.eq(channel),
        ]
        with m.If(kept.writes):
            after = Cat(Const(1, 1), (phase + 1)[:phases], flags[:count], *marked, kept.first)[:size]
            m.d.comb += write.data.eq(check.written(after))
        return kept

    def _states(
        self, m: Module, channel: Signal, control: tuple[Signal, Signal], started: Signal, acc: Signal
    ) -> tuple[Value, Read]:
        """Keep of each channel its sums and combs; return what a step makes of the accumulator, and what it reads."""
        cic, (step, adds) = self.decimator, control
        steps = len(step)
        check = CheckBits(cic.width, self.protect)
        m.submodules.states = memory = Memory(shape=check.width, depth=self.channels << steps, init=[])
        read, write = read_port(memory, "states"), write_port(memory, "states")
        word = check.read(m, read.data, "states")
        combing = Signal()
        state = Signal(cic.width)
        total = Signal(cic.width)
        m.d.comb += [
            combing.eq(step >= cic.stages),
            read.addr.eq(Cat(Mux(adds, step + 1, 0)[:steps], channel)),
            read.en.eq(1),
            state.eq(Mux(started, word.data, 0)),
            total.eq(acc + Mux(combing, ~state, state) + combing),
            write.addr.eq(Cat(step, channel)),
            write.data.eq(check.written(Mux(combing, acc, total))),
            write.en.eq(adds),
        ]
        return total, word


class _Kept(NamedTuple):
    """What is kept of a channel: of one that has not started nothing, but its first sample is the one that is there.

    The last three are driven from outside: whether it is cleared, read, and written. `marked` is how many of its next
    results a wrong bit may reach; `corrected` and `failed` say whether its word has one, and whether it has two.
    """

    marked: Value
    corrected: Value
    failed: Value
    started: Signal
    first: Signal
    flags: Signal
    completes: Signal
    clears: Signal
    reads: Signal
    writes: Signal
