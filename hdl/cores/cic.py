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

What may be limited takes the clock of [limited]. All registers move at the clocks at which `advance`, which comes from
a register of the output buffer, is high. Each integrator moves with its sample, each comb with every R-th. All sums are
modulo ``2**width``, which holds every result, so that the last difference is exact
(`sosmith.model.dataflow.decimator`). The rounding adds half a step of the output to what is above it.

With a steady start, the first sample goes in N R times before it is accepted, and the N results that it has by then do
not count: `left` counts them. From then on, nothing counts that sums and combs held before. With a start from zero, a
reset clears sums and combs instead, and `left` counts the results that are flagged as settling.
"""

from __future__ import annotations

from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed

from sosmith.hdl.axi_stream import extended
from sosmith.hdl.pipelined_logic import limits
from sosmith.hdl.plan.cic import cic_plan
from sosmith.hdl.plan.rounded_sum import last_node, rounding
from sosmith.hdl.shell.pipeline import delayed
from sosmith.hdl.shell.shell import Shell
from sosmith.hdl.status import at_rail, status_of_result
from sosmith.model.dataflow.datapath import Datapath


class _Result(NamedTuple):
    """A result on its way to the output: whether there is one, its code, and flags of it."""

    valid: Value
    code: Value
    saturated: Value
    settling: Value


class CicCore(Shell):
    """A CIC filter of adders, for one channel.

    Latency: `latency_cycles` of `sosmith.hdl.plan.cic.CicPlan`, without a stall. Throughput: one sample a clock.

    Parameters
    ----------
    datapath : Datapath
        What it computes: one FIR section of moving sums, the output stage, and a downsampler.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(self, datapath: Datapath) -> None:
        self._plan = cic_plan(datapath)
        super().__init__(datapath)

    def fill(self, m: Module) -> None:
        """Build control, integrators, combs, and what rounds."""
        plan = self._plan
        buffer = self.output_buffer(m)
        advance = Signal(name="advance")
        enters, completes, filling = Signal(name="enters"), Signal(name="completes"), Const(0, 1)
        phase = Signal(range(plan.factor), name="phase")
        last = phase == plan.factor - 1
        if plan.filled:
            filling = self._fill(m, enters & last)
        m.d.comb += [
            advance.eq(buffer.advance),
            self.s_axis_tready.eq(advance & ~filling),
            enters.eq(self.s_axis_tvalid & advance),
            completes.eq(~phase.any()),
        ]
        with m.If(enters):
            m.d.sync += phase.eq(Mux(last, 0, phase + 1))
        rail, rail_now = Signal(name="rail"), Signal(name="rail_now")
        m.d.comb += rail_now.eq(rail | at_rail(self.datapath.inputs, self.s_axis_tdata))
        with m.If(enters & ~filling):
            m.d.sync += rail.eq(rail_now & ~completes)
        value, moved = self._filter(m, advance, completes)
        result = self._rounded(m, advance, value, moved)
        clocks = 2 * plan.order + 1 + plan.limits
        flags = status_of_result(
            m,
            self.datapath,
            result.code,
            inputs=Cat(delayed(m, advance, rail_now, clocks, "rail"), Const(0, 1)),
            saturated=result.saturated,
            settling=result.settling,
        ).flags
        self.hand_out(m, buffer, result.valid, [(result.code, flags)])

    def _fill(self, m: Module, ends: Value) -> Signal:
        """Return whether the first sample still fills the filter, from the last of each R times that it goes in."""
        plan = self._plan
        filling = Signal(init=1, name="filling")
        filled = Signal(range(plan.order), name="filled")
        with m.If(filling & ends):
            m.d.sync += filled.eq(filled + 1)
            with m.If(filled == plan.order - 1):
                m.d.sync += filling.eq(0)
        return filling

    def _filter(self, m: Module, advance: Value, completes: Value) -> tuple[Value, Value]:
        """Integrate and comb; return the last difference, and whether it is new."""
        plan = self._plan
        (code,) = self.codes(self.s_axis_tdata)
        value: Value = Signal(plan.width, name="sample")
        m.d.comb += value.eq(extended(code, plan.width))
        valid: Value = self.s_axis_tvalid
        for k in range(1, plan.order + 1):
            total = Signal(plan.width, name=f"sum{k}", reset_less=plan.filled)
            with m.If(advance & valid):
                m.d.sync += total.eq(total + value)
            value = total
            valid = self._later(m, advance, valid, f"valid{k}")
            completes = self._later(m, advance, completes, f"completes{k}", reset_less=True)
        moves = valid & completes
        for k in range(1, plan.order + 1):
            before = Signal(plan.width, name=f"comb{k}", reset_less=plan.filled)
            difference = Signal(plan.width, name=f"difference{k}", reset_less=True)
            with m.If(advance & moves):
                m.d.sync += [difference.eq(value - before), before.eq(value)]
            value = difference
            moves = self._later(m, advance, moves, f"moved{k}")
        return value, moves

    def _rounded(self, m: Module, advance: Value, value: Value, moved: Value) -> _Result:
        """Round the last difference, and limit it where it may be outside; count results that do not count fully."""
        plan, (port,) = self._plan, self.datapath.inputs
        whole = value.as_signed() if port.signed else value
        grid, begin = rounding([self.datapath])
        places = grid - plan.frac
        added = (begin & -begin).bit_length() - 1 if begin else 0
        if begin and added > places:  # what is below stays as it is
            whole, places, begin = whole >> (added - places), 0, begin >> added
            grid -= added
        total = (whole << places) + begin
        code: Value = total >> grid if grid > 0 else total << -grid
        node, output = last_node(self.datapath), self.datapath.output
        shape = signed(output.bits) if output.signed else output.bits
        rounded = Signal(code.shape() if plan.limits else shape, name="rounded", reset_less=True)
        with m.If(advance):
            m.d.sync += rounded.eq(code)
        counts, settling = self._left(m, advance, moved)
        valid = self._later(m, advance, moved & counts, "rounded_valid")
        settling = self._later(m, advance, settling, "settling", reset_less=True)
        if not plan.limits:
            return _Result(valid, rounded, Const(0, 1), settling)
        below, above = (Signal(name=name) for name in ("below", "above"))
        m.d.comb += [net.eq(outside) for net, outside in zip((below, above), limits(node, rounded), strict=True)]
        limited = Signal(shape, name="limited", reset_less=True)
        with m.If(advance):
            m.d.sync += limited.eq(Mux(below, Const(node.low), Mux(above, Const(node.high), rounded)))
        return _Result(
            self._later(m, advance, valid, "limited_valid"),
            limited,
            self._later(m, advance, below | above, "saturated", reset_less=True),
            self._later(m, advance, settling, "settling_limited", reset_less=True),
        )

    def _left(self, m: Module, advance: Value, moved: Value) -> tuple[Value, Value]:
        """Return whether a result counts, and whether it is flagged as settling, from how many such are left."""
        plan = self._plan
        most = plan.skipped or plan.settling
        if not most:
            return Const(1, 1), Const(0, int(self.datapath.settles))
        left = Signal(range(most + 1), init=most, name="left")
        any_left = Signal(name="any_left")
        m.d.comb += any_left.eq(left.any())
        with m.If(advance & moved & any_left):
            m.d.sync += left.eq(left - 1)
        return (~any_left, Const(0, 0)) if plan.filled else (Const(1, 1), any_left)

    def _later(self, m: Module, advance: Value, value: Value, name: str, *, reset_less: bool = False) -> Signal:
        """Return a bit a clock of the pipeline later: 0 from a reset on, unless that leaves it as it is."""
        register = Signal(len(value), name=name, reset_less=reset_less)
        with m.If(advance):
            m.d.sync += register.eq(value)
        return register
