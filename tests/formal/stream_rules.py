"""The rules of the streams, as assertions for a prover."""

from amaranth.hdl import Assert, Assume, Cat, Const, Module, Signal, Value
from amaranth.lib.wiring import Component, Out
from tests.formal.prover import Proof
from tests.formal.small import reference

from sosmith.model.dataflow.datapath import Datapath

DIGIT_BITS = 3


class StreamRules(Proof):
    """What has to hold on the faces of a design.

    - The output is not valid after a reset; once it is valid, it and all that goes with it stay until they are taken.
    - There is no output without an input before it, and never more of them on their way than the design holds.
    - While the sink is ready, an output is not longer away than `patience` clocks.
    - Each output is that of its input: of one input that the solver picks, which stands for any.

    Parameters
    ----------
    design : Component
        An output buffer, or a core.
    capacity : int
        Samples that the design holds at most.
    patience : int or None
        Clocks; None asks for no progress.
    datapath : Datapath or None
        What a core with one channel computes; None does not ask.
    source_waits : bool
        Whether the source keeps its offer until it is taken, as AXI4-Stream asks; else it may do as it likes.
    """

    def __init__(
        self,
        design: Component,
        capacity: int,
        *,
        patience: int | None = None,
        datapath: Datapath | None = None,
        source_waits: bool = False,
    ) -> None:
        super().__init__(design)
        self.capacity, self.patience, self.datapath = capacity, patience, datapath
        self.source_waits = source_waits
        self.excused: Value = Const(0, 1)
        """Whether the output may be any, as a flag beside it says."""
        self.cleared: Value = Const(0, 1)
        """Whether the core begins anew at this clock, but for a reset."""
        self.picks = self.free(1, "picks")

    def state(self, m: Module) -> None:
        """State the rules."""
        d = self.design
        if hasattr(d, "aclk"):
            taken, given = d.s_axis_tvalid & d.s_axis_tready, d.m_axis_tvalid & d.m_axis_tready
            valid, ready = d.m_axis_tvalid, d.m_axis_tready
            names = [name for name, member in d.signature.members.items() if member.flow is Out]
            payload = Cat(getattr(d, name) for name in names if name.startswith("m_axis") and name != "m_axis_tvalid")
            if self.source_waits:
                self._assume_source(m)
            if hasattr(d, "s_axis_tdest"):
                taken &= d.s_axis_tdest < d.channels  # others are dropped
        else:
            taken, given = d.i_valid & d.advance, d.o_valid & d.o_ready
            valid, ready, payload = d.o_valid, d.o_ready, d.o_data
        was_reset, stalled, before = Signal(), Signal(), Signal(len(payload))
        count = Signal(range(self.capacity + 2))
        m.d.proof += [was_reset.eq(self.reset), stalled.eq(valid & ~ready & ~self.reset), before.eq(payload)]
        m.d.proof += count.eq(count + taken - given)
        with m.If(self.reset):
            m.d.proof += count.eq(0)
        with m.If(self.started):
            with m.If(was_reset):
                m.d.comb += Assert(~valid)
            with m.If(stalled):
                m.d.comb += [Assert(valid), Assert(payload == before)]
            with m.If(valid):
                m.d.comb += Assert(count != 0)
            m.d.comb += Assert(count <= self.capacity)
        if self.patience is not None:
            self._state_progress(m, (count != 0) & ready & ~given)
        if not hasattr(d, "aclk"):
            self._state_order(m, (taken, given), count, d.i_data, d.o_data)
        elif hasattr(d, "s_axis_tdest"):
            self._state_order(m, (taken, given), count, d.s_axis_tdest, d.m_axis_tdest)
        elif self.datapath is not None:
            self._state_order(m, (taken, given), count, *self.results(m, self.datapath, taken))

    def results(self, m: Module, datapath: Datapath, taken: Value) -> tuple[Value, Value]:
        """Return what the offered input gives, and where the output shows it."""
        code = self.design.s_axis_tdata[: datapath.inputs[0].bits].as_signed()
        result = reference(m, datapath, code, taken, self.reset | self.cleared)
        return result, self.design.m_axis_tdata.as_signed()

    def _assume_source(self, m: Module) -> None:
        d = self.design
        offer = Cat(d.s_axis_tdata, d.s_axis_tdest if hasattr(d, "s_axis_tdest") else ())
        waits, before = Signal(), Signal(len(offer))
        m.d.proof += [waits.eq(d.s_axis_tvalid & ~d.s_axis_tready & ~self.reset), before.eq(offer)]
        with m.If(waits):
            m.d.comb += Assume(d.s_axis_tvalid & (offer == before))

    def _state_progress(self, m: Module, waits: Value) -> None:
        waited = Signal(range(self.patience + 1))
        m.d.proof += waited.eq(0)
        with m.If(waits & ~self.reset):
            m.d.proof += waited.eq(waited + 1)
        with m.If(self.started):
            m.d.comb += Assert(waited < self.patience)

    def _state_order(self, m: Module, moves: tuple[Value, Value], count: Value, expected: Value, output: Value) -> None:
        """Follow one sample: `ahead` are those to be given before it."""
        taken, given = moves
        follows, ahead, result = Signal(), Signal(range(self.capacity + 1)), Signal(expected.shape())
        with m.If(self.reset):
            m.d.proof += follows.eq(0)
        with m.Elif(follows & given):
            m.d.proof += [ahead.eq(ahead - 1), follows.eq(ahead != 0)]
        with m.Elif(~follows & taken & self.picks):
            m.d.proof += [follows.eq(1), ahead.eq(count - given), result.eq(expected)]
        with m.If(self.started & follows & (ahead == 0) & (count != 0)):
            valid = self.design.m_axis_tvalid if hasattr(self.design, "aclk") else self.design.o_valid
            with m.If(valid):
                m.d.comb += Assert(self.excused | (output == result))
