r"""What every FIR filter has that decimates and takes a sample at each clock: its entrance, and the way of its results.

::

    s_axis --> phase, rail --> inside: sums of samples --> value --> [limited] --> output_buffer --> m_axis
                  |                                          ^                          ^ leaves
                  +--> filling, filled                       +--- left                [copies]

A sample with the phase 0 brings a result, which needs no other. All registers move at the clocks at which `advance`,
which comes from a register of the output buffer, is high.

With a steady start, the first sample goes in so many times before it is accepted that nothing is left of what was there
before; the results that it has by then do not count, and `left` says how many they are. With a start from zero, a reset
clears what is remembered, and `left` counts the results that are flagged as settling.

A result that is held stays in the output buffer until it has been handed out R times, as `copies` counts.

Latency: that of the inside, a clock where results are limited, and one of the output buffer.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed

from sosmith.hdl.pipelined_logic import limits
from sosmith.hdl.plan.decimating.plan import DecimatingPlan
from sosmith.hdl.plan.rounded_sum import last_node
from sosmith.hdl.shell.pipeline import delayed
from sosmith.hdl.shell.shell import Shell
from sosmith.hdl.status import at_rail, status_of_result
from sosmith.model.dataflow.datapath import Datapath


class Entered(NamedTuple):
    """A sample that enters, and what is known of it.

    Attributes
    ----------
    advance : Value
        Whether the pipeline moves.
    valid, enters : Value
        Whether there is a sample, and whether it enters at this clock.
    phase : Signal
        Its number since the last one that brought a result, which has 0.
    completes : Value
        Whether it brings one.
    code : Value
    """

    advance: Value
    valid: Value
    enters: Value
    phase: Signal
    completes: Value
    code: Value


class Summed(NamedTuple):
    """What the inside gives: a register of results, rounded but not limited, and whether it takes over one."""

    value: Value
    comes: Value


class DecimatingCore(Shell):
    """An FIR filter that decimates, with a sample at each clock; `fill` makes it for one channel.

    Parameters
    ----------
    datapath : Datapath
        What it computes: one FIR section, the output stage, and a downsampler.
    plan : DecimatingPlan
        How samples become results.
    copies : int
        Times that each result is handed out.
    channels : int
        Number of channels.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(self, datapath: Datapath, plan: DecimatingPlan, copies: int = 1, channels: int = 1) -> None:
        self._pace = plan
        self._copies = copies
        super().__init__(datapath, channels)

    @abstractmethod
    def sums(self, m: Module, sample: Entered) -> Summed:
        """Build the inside."""

    def fill(self, m: Module) -> None:
        """Build entrance, inside, and the way of results."""
        pace = self._pace
        buffer = self.output_buffer(m)
        advance, enters, completes = (Signal(name=name) for name in ("advance", "enters", "completes"))
        phase = Signal(range(pace.factor), name="phase")
        last = phase == pace.factor - 1
        filling = self._fill(m, enters & last) if pace.fills else Const(0, 1)
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
        (code,) = self.codes(self.s_axis_tdata)
        summed = self.sums(m, Entered(advance, self.s_axis_tvalid, enters, phase, completes, code))
        counts, settling = self._left(m, advance, summed.comes)
        result = self.limited(m, advance, summed, counts=counts, settling=settling)
        flags = status_of_result(
            m,
            self.datapath,
            result.code,
            inputs=Cat(delayed(m, advance, rail_now, pace.clocks + pace.limits, "rail"), Const(0, 1)),
            saturated=result.saturated,
            settling=result.settling,
        ).flags
        self.hand_out(m, buffer, result.valid, [(result.code, flags)], leaves=self.leaves(m))

    def leaves(self, m: Module) -> Value | None:
        """Return whether the result at the output leaves, if it is there; None if it does with each handshake."""
        if self._copies == 1:
            return None
        copies, leaves = Signal(range(self._copies), name="copies"), Signal(name="leaves")
        last = copies == self._copies - 1
        m.d.comb += leaves.eq(self.m_axis_tready & last)
        with m.If(self.m_axis_tvalid & self.m_axis_tready):
            m.d.sync += copies.eq(Mux(last, 0, copies + 1))
        return leaves

    def _fill(self, m: Module, ends: Value) -> Signal:
        """Return whether the first sample still fills the filter, from the last of each R times that it goes in."""
        times = self._pace.fills
        filling = Signal(init=1, name="filling")
        filled = Signal(range(times), name="filled")
        with m.If(filling & ends):
            m.d.sync += filled.eq(filled + 1)
            with m.If(filled == times - 1):
                m.d.sync += filling.eq(0)
        return filling

    def limited(self, m: Module, advance: Value, summed: Summed, *, counts: Value, settling: Value) -> _Result:
        """Limit results where they may be outside; let none pass that does not count."""
        valid = self.later(m, advance, summed.comes & counts, "result_valid")
        settling = self.later(m, advance, settling, "settling", reset_less=True)
        if not self._pace.limits:
            return _Result(valid, summed.value, Const(0, 1), settling)
        node, output = last_node(self.datapath), self.datapath.output
        below, above = (Signal(name=name) for name in ("below", "above"))
        outside = limits(node, summed.value)
        m.d.comb += [net.eq(end) for net, end in zip((below, above), outside, strict=True)]
        limited = Signal(signed(output.bits) if output.signed else output.bits, name="limited", reset_less=True)
        with m.If(advance):
            m.d.sync += limited.eq(Mux(below, Const(node.low), Mux(above, Const(node.high), summed.value)))
        return _Result(
            self.later(m, advance, valid, "limited_valid"),
            limited,
            self.later(m, advance, below | above, "saturated", reset_less=True),
            self.later(m, advance, settling, "settling_limited", reset_less=True),
        )

    def _left(self, m: Module, advance: Value, comes: Value) -> tuple[Value, Value]:
        """Return whether a result counts, and whether it is flagged as settling, from how many such are left."""
        pace = self._pace
        most = pace.fills or pace.settling
        if not most:
            return Const(1, 1), Const(0, int(self.datapath.settles))
        left = Signal(range(most + 1), init=most, name="left")
        any_left = Signal(name="any_left")
        m.d.comb += any_left.eq(left.any())
        with m.If(advance & comes & any_left):
            m.d.sync += left.eq(left - 1)
        return (~any_left, Const(0, 0)) if pace.fills else (Const(1, 1), any_left)

    def rounded(self) -> Signal:
        """Return a signal for results before they are limited: as wide as the output where they are not."""
        output, last = self.datapath.output, last_node(self.datapath)
        node = self.datapath.stages[-1].graph.nodes[last.operands[0]] if self._pace.limits else None
        is_signed, bits = (output.signed, output.bits) if node is None else (node.signed, node.width)
        return Signal(signed(bits) if is_signed else bits, name="rounded", reset_less=True)

    def later(self, m: Module, advance: Value, value: Value, name: str, *, reset_less: bool = False) -> Signal:
        """Return a value a clock of the pipeline later: 0 from a reset on, unless that leaves it as it is."""
        register = Signal(value.shape(), name=name, reset_less=reset_less)
        with m.If(advance):
            m.d.sync += register.eq(value)
        return register


class _Result(NamedTuple):
    """A result on its way to the output: whether there is one, its code, and flags of it."""

    valid: Value
    code: Value
    saturated: Value
    settling: Value
