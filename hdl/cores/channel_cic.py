r"""A CIC filter of adders alone for several channels, whose sums and combs are memories with a word for each of them.

Integrators and combs are a pipeline, each with a memory that is read a clock before it is written::

    [sample] --> + --[sum1]--> + --> .. N .. --[sumN]--> - --> .. N .. --[differenceN]--> [rounded] --> [limited]
                 ^ |           ^ |                     | ^                   width
                 | v           | v                     v |
                sum1 memory   sum2 memory ..       comb1 memory ..
                   width x channels

    clock of the edge    0       1    ..   N      N+1      ..     2N          2N+1      2N+2     2N+3
    register           sample  sum1  ..  sumN  difference1 .. differenceN  rounded  [limited]  output_buffer

Each integrator moves with its sample, each comb with every R-th one of a channel. All is modulo ``2**width``, as for
one channel (`sosmith.hdl.cores.cic`). What is in front, what goes along with samples, and why no word is used that is
read while it is written, says `sosmith.hdl.cores.channel_decimating`.
"""

from __future__ import annotations

from amaranth.hdl import Module, Mux, Signal, Value

from sosmith.hdl.axi_stream import extended
from sosmith.hdl.cores.channel_decimating import ChannelDecimatingCore
from sosmith.hdl.cores.cic import with_half
from sosmith.hdl.cores.decimating import Entered, Summed
from sosmith.hdl.plan.decimating.cic import cic_plan
from sosmith.model.dataflow.datapath import Datapath


class ChannelCicCore(ChannelDecimatingCore):
    """A CIC filter of adders, for several channels.

    Latency: `latency_cycles` of `sosmith.hdl.plan.decimating.cic.CicPlan`, without a stall. Throughput: one sample a
    clock, of any channel but that of the sample before; of that one, a sample every second clock. A sample of a channel
    that does not exist is accepted and dropped.

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
        self._plan = cic_plan(datapath, channels)
        super().__init__(datapath, self._plan, copies)

    def sums(self, m: Module, sample: Entered) -> Summed:
        """Build integrators, combs, and the rounding."""
        plan, advance = self._plan, sample.advance
        value: Value = Signal(plan.width, name="value")
        m.d.comb += value.eq(extended(sample.code, plan.width))
        valid, completes, moves = sample.valid, sample.completes, sample.enters
        for k in range(1, plan.order + 1):
            total = Signal(plan.width, name=f"total{k}")
            m.d.comb += total.eq(value + self._before(m, f"sum{k}", k - 1, advance, (moves, total)))
            value = self.later(m, advance, total, f"sum{k}", reset_less=True)
            valid = valid if k == 1 else self.later(m, advance, valid, f"valid{k}")
            completes = self.later(m, advance, completes, f"completes{k}", reset_less=True)
            moves = advance & valid
        moved = valid & completes
        for k in range(1, plan.order + 1):
            before = self._before(m, f"comb{k}", plan.order + k - 1, advance, (advance & moved, value))
            difference = (value - before)[: plan.width]
            value = self.later(m, advance, difference, f"difference{k}", reset_less=True)
            moved = self.later(m, advance, moved, f"moved{k}")
        rounded = self.rounded()
        with m.If(advance):
            m.d.sync += rounded.eq(with_half(self.datapath, plan, value))
        return Summed(rounded, moved)

    def _before(self, m: Module, name: str, position: int, advance: Value, left: tuple[Value, Value]) -> Value:
        """Return what a sum or a comb of a sample's channel holds, which counts as 0 for its first sample."""
        word, fresh = self.of_channel(m, name, position, advance, left), self.along.fresh
        if not fresh:
            return word
        own = Signal(len(word), name=f"{name}_of_channel")
        m.d.comb += own.eq(Mux(fresh[position], 0, word))
        return own
