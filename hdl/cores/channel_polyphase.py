r"""An FIR filter that decimates several channels, with a sample at each clock, and a multiplier for every R products.

What one channel has in registers, the line of its last samples and the total of the result that they make up, is in
memories with a word for each channel::

    [sample] ---+-----> [line0] ----> places, chosen by phase --> .. P multipliers .. --> + --[total]--> [limited]
                |       [line1] ..       as for one channel                               ^ |
                v         ^                                                               | v
               line memory                                                             total memory
      bits (L - 1) x channels                                                        width x channels

    clock of the edge     0       1     2       3     4     ..   5 + levels     ..
    register           sample  line  places   pair  product       total      limited, output_buffer

The multipliers, and which of them takes which product, are those of `sosmith.hdl.cores.polyphase`; what is in front,
and what goes along with samples, those of `sosmith.hdl.cores.channel_decimating`. For the first sample of a channel
from zero, the line counts as 0, and the total as half a step of the output.
"""

from __future__ import annotations

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed

from sosmith.hdl.cores.channel_decimating import ChannelDecimatingCore
from sosmith.hdl.cores.decimating import Entered, Summed
from sosmith.hdl.cores.polyphase import Multipliers
from sosmith.hdl.plan.decimating.polyphase import polyphase_plan
from sosmith.hdl.plan.rounded_sum import finest, rounding, sum_bits
from sosmith.model.dataflow.datapath import Datapath


class ChannelPolyphaseCore(ChannelDecimatingCore, Multipliers):
    """An FIR filter that decimates, for several channels.

    Latency: `latency_cycles` of `sosmith.hdl.plan.decimating.polyphase.PolyphasePlan`, without a stall. Throughput: one
    sample a clock, of any channel but that of the sample before; of that one, a sample every second clock. A sample of
    a channel that does not exist is accepted and dropped.

    Parameters
    ----------
    datapath : Datapath
        What it computes: one FIR section that keeps samples, the output stage, and a downsampler.
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
        self.products = polyphase_plan(datapath, channels)
        super().__init__(datapath, self.products, copies)

    def sums(self, m: Module, sample: Entered) -> Summed:
        """Build the line, the multipliers and the total."""
        advance = sample.advance
        valid, phase = [sample.valid], [self.later(m, advance, sample.phase, "phase1", reset_less=True)]
        for k in range(2, self.products.clocks):
            valid.append(self.later(m, advance, valid[-1], f"valid{k}"))
            phase.append(self.later(m, advance, phase[-1], f"phase{k}", reset_less=True))
        added = self.multiplied(m, advance, self._line(m, sample), (phase[0], phase[1]))
        return self._totalled(m, advance, added, valid[-1], phase[-1])

    def _line(self, m: Module, sample: Entered) -> list[Signal]:
        """Take the last samples of a channel from memory, and keep them with the new one."""
        count, bits, fresh = self.products.length, len(sample.code), self.along.fresh
        shape, places = sample.code.shape(), list[Value]([sample.code])
        if count > 1:
            written = Signal((count - 1) * bits, name="line_next")
            word = self.of_channel(m, "line", 0, sample.advance, (sample.enters, written))
            own = Signal(len(word), name="line_of_channel")
            m.d.comb += [own.eq(Mux(fresh[0], 0, word) if fresh else word)]
            places += [own[k * bits : (k + 1) * bits] for k in range(count - 1)]
            m.d.comb += written.eq(Cat(places[: count - 1]))
        line = list[Signal]()
        for k, value in enumerate(places):
            place = Signal(shape, name=f"line{k}", reset_less=True)
            with m.If(sample.advance):
                m.d.sync += place.eq(value)
            line.append(place)
        return line

    def _totalled(self, m: Module, advance: Value, added: Value, valid: Value, phase: Value) -> Summed:
        """Add up the sums of all phases of a result, from the first of them on, and leave out what rounds it."""
        grid, begin = rounding([self.datapath])
        shape, last = signed(sum_bits([self.datapath], grid)), self.products.clocks - 1
        total, begins = Signal(shape, name="total", reset_less=True), Signal(name="begins")
        following, rounded = Signal(shape, name="total_next"), self.rounded()
        before = self.of_channel(m, "total", last, advance, (advance & valid, following)).as_signed()
        # The first sample from zero brings a result by itself: it finds what the samples before would have left.
        fresh = self.along.fresh[last] if self.along.fresh else Const(0, 1)
        m.d.comb += [
            begins.eq((phase == 1) | fresh),
            following.eq(Mux(begins, Const(begin, shape), before) + (added << grid - finest([self.datapath]))),
            rounded.eq(total >> grid if grid > 0 else total << -grid),
        ]
        with m.If(advance):
            m.d.sync += total.eq(following)
        return Summed(rounded, valid & ~phase.any())
