"""The parallel architecture for one channel at the highest rates: several samples a clock, or loops with look-ahead.

With four samples a clock, as lanes 0 to 3; the first sample of a beat is lane 0, and the lowest on the bus::

                      section0 .. output_stage             output_buffer
    s_axis_tdata -/--> lane 0 --> .. --> lane 0 ----------> StreamBuffer -/-> m_axis_tdata
                  4    lane 1 -+> .. --> lane 1 ---------->    1 clock    4
                       lane 2 -+> .. --> lane 2 ---------->     |     |
                       lane 3 -+> .. --> lane 3 ---------->     |     +--/--> m_axis_tuser: a byte for each sample
                         |     |                                |        4
                         +-----+ states                         |
    s_axis_tready <---------------------- advance <-------------+

A stage holds all lanes, since a state goes from each lane to the next (`sosmith.hdl.plan.unfolding`). With look-ahead,
it is a `sosmith.hdl.stages.look_ahead.LookAheadStage`, and otherwise a `sosmith.hdl.stages.pipelined.PipelinedStage`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, Module, ResetSignal, Signal, Value
from amaranth.lib import wiring

from sosmith.hdl.axi_stream import StreamBuffer, core_members, extended
from sosmith.hdl.plan.look_ahead import plans
from sosmith.hdl.plan.parallel_clocks import block_depths
from sosmith.hdl.plan.streams import fields, width
from sosmith.hdl.plan.unfolding import unfolded_stages
from sosmith.hdl.stages.look_ahead import LookAheadStage
from sosmith.hdl.stages.pipelined import PipelinedStage
from sosmith.hdl.status import at_rail, flag_count, in_order, outside_calibration, worn
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Op
from sosmith.model.dataflow.status import STATUS_BITS, Flag


class BlockCore(wiring.Component):
    """A datapath for one channel whose beats hold several samples, or whose loops are pipelined with look-ahead.

    Latency: `block_latency_cycles` of the datapath, without a stall. Throughput: one beat per clock. It is ready right
    after a reset.

    Parameters
    ----------
    datapath : Datapath
        What it computes.
    lanes : int
        Samples of a beat.
    look_ahead : bool
        Whether loops that go back several samples are pipelined through the samples between.
    adders : sequence of collection of int
        Without look-ahead: products by constants that are made of adders, by unfolded stage and node.

    Members
    -------
    aclk : In(1)
        Clock, rising edge.
    aresetn : In(1)
        Synchronous reset, active low.
    s_axis_tdata, s_axis_tvalid, s_axis_tready
        Input samples, the first one lowest; in each, one field per input port, extended to whole bytes.
    m_axis_tdata, m_axis_tvalid, m_axis_tready
        Output samples, the first one lowest, each extended likewise.
    m_axis_tuser : Out(8 * lanes)
        Status of each output sample; the bits are those of `sosmith.model.dataflow.status.Flag`.
    """

    def __init__(
        self,
        datapath: Datapath,
        lanes: int = 1,
        *,
        look_ahead: bool = False,
        adders: Sequence[Collection[int]] = (),
    ) -> None:
        self.datapath = datapath
        self.lanes = lanes
        self.look_ahead = look_ahead
        self.stages = unfolded_stages(datapath, lanes)
        self.adders = adders or [()] * len(self.stages)
        super().__init__(core_members(datapath.inputs, datapath.output, lanes=lanes))

    def elaborate(self, platform: object) -> Module:
        """Build the pipeline."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.aclk), ResetSignal("sync").eq(~self.aresetn)]
        live = self._live_flags
        buffer = m.submodules.output_buffer = StreamBuffer((width([self.datapath.output]) + len(live)) * self.lanes)
        m.d.comb += self.s_axis_tready.eq(buffer.advance)
        size = width(self.datapath.inputs)
        samples = [self.s_axis_tdata[size * k : size * (k + 1)] for k in range(self.lanes)]
        place = fields(self.datapath.inputs)
        codes: list[Value] = [data[f.offset : f.offset + f.port.bits] for data in samples for f in place]
        valid: Value = self.s_axis_tvalid
        components = self._components(m, buffer.advance)
        for stage, component in zip(self.stages, components, strict=True):
            m.d.comb += [getattr(component, f"i{k}").eq(code) for k, code in enumerate(codes)]
            m.d.comb += component.i_valid.eq(valid)
            valid = component.o_valid
            codes = [getattr(component, f"o{k}") for k in range(len(stage.graph.outputs))]
        judged: Value = Cat(self._judged(data) for data in samples)
        for k in range(sum(block_depths(self.datapath, self.lanes, look_ahead=self.look_ahead))):
            held = Signal(len(judged), name=f"status{k + 1}", reset_less=True)
            with m.If(buffer.advance):
                m.d.sync += held.eq(judged)
            judged = held
        each, flags_each = len(codes) // self.lanes, len(judged) // self.lanes
        saturated = components[-1].o_saturated
        results, flags = [], []
        for k in range(self.lanes):
            code, *settling = codes[each * k : each * (k + 1)]
            wear = worn(m, self.datapath, code, Const(0, 0), buffer.advance, "none")
            own = Cat(judged[flags_each * k : flags_each * (k + 1)], Const(0, 2 - flags_each))
            settles = settling[0][-1] if settling else Const(0, 0)
            results.append(extended(code, self.datapath.output.bytes * 8))
            limited = saturated[k] if Flag.OUTPUT_SATURATED in live else Const(0, 1)
            found = in_order(self.datapath, own, limited, wear, settles)
            flags += [found[bit] for bit in live]
        m.d.comb += [
            buffer.i_valid.eq(valid),
            buffer.i_data.eq(Cat(*results, *flags)),
            self.m_axis_tvalid.eq(buffer.o_valid),
            buffer.o_ready.eq(self.m_axis_tready),
            self.m_axis_tdata.eq(buffer.o_data[: len(self.m_axis_tdata)]),
        ]
        handed = buffer.o_data[len(self.m_axis_tdata) :]
        for k in range(self.lanes):
            m.d.comb += [
                self.m_axis_tuser[STATUS_BITS * k + bit].eq(handed[len(live) * k + place])
                for place, bit in enumerate(live)
            ]
        return m

    @property
    def _live_flags(self) -> list[int]:
        """Bits of the status that a sample may set: the others have no registers."""
        inputs = zip(self.datapath.inputs, self.datapath.calibrated, strict=True)
        never = set()
        if all(ends == (port.lowest, port.highest) for port, ends in inputs):
            never.add(Flag.OUTSIDE_CALIBRATION)
        last = self.datapath.stages[-1].graph
        if last.nodes[last.outputs[0]].op is not Op.CLAMP:
            never.add(Flag.OUTPUT_SATURATED)
        if not self.datapath.wear:
            never |= {Flag.WEAR_WARNING, Flag.WEAR_CRITICAL}
        return [bit for bit in range(flag_count(self.datapath)) if bit not in never]

    def _judged(self, data: Value) -> Value:
        """Return the flags that are known with a sample as it comes in; not the second if it is never set."""
        rail, outside = at_rail(self.datapath.inputs, data), outside_calibration(self.datapath, data)
        return Cat(rail, outside) if Flag.OUTSIDE_CALIBRATION in self._live_flags else rail

    def _components(self, m: Module, advance: Value) -> list[LookAheadStage | PipelinedStage]:
        """Make the hardware of the stages."""
        made: list[LookAheadStage | PipelinedStage]
        if self.look_ahead:
            made = [
                LookAheadStage(stage.name, plan) for stage, plan in zip(self.stages, plans(self.stages), strict=True)
            ]
        else:
            made = [
                PipelinedStage(stage, adders=adders) for stage, adders in zip(self.stages, self.adders, strict=True)
            ]
        for stage, component in zip(self.stages, made, strict=True):
            m.submodules[stage.name] = component
            m.d.comb += component.advance.eq(advance)
        return made
