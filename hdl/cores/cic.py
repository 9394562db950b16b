r"""A CIC filter of adders alone: an FIR filter of moving sums that hands on every R-th result, a sample at each clock.

N integrators and N combs of `width` bits, one adder each, with a register behind every one of them::

    s_axis_tdata --> [+ sum1] --> .. N .. --> [+ sumN] --> [- difference1] --> .. N .. --> [- differenceN] --+
        bits     |     width                    width         width   ^                        width         |
                 |                                                    +--- [comb1]                           |
                 +--> at_rail --> [rail], of any sample since the last result --> [rail1] --> .. -----+      |
                                                                                                      |      |
    m_axis_tdata, m_axis_tuser <-- output_buffer <-- code, flags <-- [limited] <-- [rounded] <--------+------+

    clock of the edge    0    1    ..   N-1      N       ..     2N-1        2N       2N+1    2N+2
    register           sum1  sum2  ..  sumN  difference1 .. differenceN  rounded  [limited]  output_buffer

What may be limited takes the clock of [limited]. Entrance and output are those of
`sosmith.hdl.cores.decimating.DecimatingCore`. Each integrator moves with its sample, each comb with every R-th. All
sums are modulo ``2**width``, which holds every result, so that the last difference is exact
(`sosmith.model.dataflow.decimator`). The rounding adds half a step of the output to what is above it.

With a steady start, the first sample goes in N R times before it is accepted: from then on, nothing counts that sums
and combs held before. With a start from zero, a reset clears sums and combs instead.
"""

from __future__ import annotations

from amaranth.hdl import Module, Signal, Value

from sosmith.hdl.axi_stream import extended
from sosmith.hdl.cores.decimating import DecimatingCore, Entered, Summed
from sosmith.hdl.plan.decimating.cic import CicPlan, cic_plan
from sosmith.hdl.plan.rounded_sum import rounding
from sosmith.model.dataflow.datapath import Datapath


class CicCore(DecimatingCore):
    """A CIC filter of adders, for one channel.

    Latency: `latency_cycles` of `sosmith.hdl.plan.decimating.cic.CicPlan`, without a stall. Throughput: one sample a
    clock.

    Parameters
    ----------
    datapath : Datapath
        What it computes: one FIR section of moving sums, the output stage, and a downsampler.
    copies : int
        Times that each result is handed out.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(self, datapath: Datapath, copies: int = 1) -> None:
        self._plan = cic_plan(datapath)
        super().__init__(datapath, self._plan, copies)

    def sums(self, m: Module, sample: Entered) -> Summed:
        """Build integrators, combs, and the rounding."""
        plan = self._plan
        advance, valid, completes = sample.advance, sample.valid, sample.completes
        value: Value = Signal(plan.width, name="sample")
        m.d.comb += value.eq(extended(sample.code, plan.width))
        for k in range(1, plan.order + 1):
            total = Signal(plan.width, name=f"sum{k}", reset_less=plan.filled)
            with m.If(advance & valid):
                m.d.sync += total.eq(total + value)
            value = total
            valid = self.later(m, advance, valid, f"valid{k}")
            completes = self.later(m, advance, completes, f"completes{k}", reset_less=True)
        moves = valid & completes
        for k in range(1, plan.order + 1):
            before = Signal(plan.width, name=f"comb{k}", reset_less=plan.filled)
            difference = Signal(plan.width, name=f"difference{k}", reset_less=True)
            with m.If(advance & moves):
                m.d.sync += [difference.eq(value - before), before.eq(value)]
            value = difference
            moves = self.later(m, advance, moves, f"moved{k}")
        rounded = self.rounded()
        with m.If(advance):
            m.d.sync += rounded.eq(with_half(self.datapath, plan, value))
        return Summed(rounded, moves)


def with_half(datapath: Datapath, plan: CicPlan, value: Value) -> Value:
    """Add to the last difference what rounds it, above the bits that stay as they are, and leave out the rest."""
    (port,) = datapath.inputs
    whole = value.as_signed() if port.signed else value
    grid, begin = rounding([datapath])
    places = grid - plan.frac
    zeros = min((begin & -begin).bit_length() - 1, max(grid, 0)) if begin else 0
    if zeros > places:
        whole, places, begin, grid = whole >> (zeros - places), 0, begin >> zeros, grid - zeros
    total = (whole << places) + begin
    return total >> grid if grid > 0 else total << -grid
