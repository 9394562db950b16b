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
from typing import TypeVar

from amaranth.hdl import Cat, Const, Module, Value

from sosmith.hdl.plan.look_ahead import Products, plans
from sosmith.hdl.plan.parallel_clocks import block_depths
from sosmith.hdl.plan.unfolding import unfolded_stages
from sosmith.hdl.shell.pipeline import Sample, delayed, through
from sosmith.hdl.shell.shell import Shell
from sosmith.hdl.stages.look_ahead import LookAheadStage
from sosmith.hdl.stages.pipelined import PipelinedStage
from sosmith.hdl.status import OF_INPUT, status_of_result
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Op
from sosmith.model.dataflow.status import Flag

_Whole = TypeVar("_Whole", Value, list[Value])


class BlockCore(Shell):
    """A datapath for one channel whose beats hold several samples, or whose loops are pipelined with look-ahead.

    Latency: `block_latency_cycles` of the datapath, without a stall. Throughput: one beat per clock. It is ready right
    after a reset.

    Parameters
    ----------
    datapath : Datapath
        What it computes.
    lanes : int
        Samples of a beat.
    products : Products or None
        With look-ahead, how products by constants are made: loops that go back several samples are pipelined through
        the samples between. None without.
    adders : sequence of collection of int
        Without look-ahead: products by constants that are made of adders, by unfolded stage and node.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(
        self,
        datapath: Datapath,
        lanes: int = 1,
        *,
        products: Products | None = None,
        adders: Sequence[Collection[int]] = (),
    ) -> None:
        self.products = products
        self.stages = unfolded_stages(datapath, lanes)
        self.adders = adders or [()] * len(self.stages)
        super().__init__(datapath, lanes=lanes)

    def fill(self, m: Module) -> None:
        """Build the pipeline."""
        buffer = self.output_buffer(m)
        advance = buffer.advance
        m.d.comb += self.s_axis_tready.eq(advance)
        size = len(self.s_axis_tdata) // self.lanes
        samples = [self.s_axis_tdata[size * k : size * (k + 1)] for k in range(self.lanes)]
        stages = self._components(m, advance)
        codes = [code for tdata in samples for code in self.codes(tdata)]
        beat, codes = through(m, stages, Sample(self.s_axis_tvalid), codes)
        depth = sum(block_depths(self.datapath, self.lanes, self.products))
        status = delayed(m, advance, Cat(self.status_of_inputs(tdata) for tdata in samples), depth, "status")
        results = []
        for k in range(self.lanes):
            code, *settling = _share(codes, k, self.lanes)
            inputs = _share(status, k, self.lanes)
            result_status = status_of_result(
                m,
                self.datapath,
                code,
                inputs=Cat(inputs, Const(0, OF_INPUT - len(inputs))),
                saturated=stages[-1].o_saturated[k] if Flag.OUTPUT_SATURATED in self.live_flags else Const(0, 1),
                settling=settling[0][-1] if settling else Const(0, 0),
            )
            results.append((code, result_status.flags))
        self.hand_out(m, buffer, beat.valid, results)

    @property
    def live_flags(self) -> Sequence[int]:
        """Bits of the status that a sample may set, by the datapath: the others have no registers."""
        inputs = zip(self.datapath.inputs, self.datapath.calibrated, strict=True)
        never = set()
        if all(ends == (port.lowest, port.highest) for port, ends in inputs):
            never.add(Flag.OUTSIDE_CALIBRATION)
        last = self.datapath.stages[-1].graph
        if last.nodes[last.outputs[0]].op is not Op.CLAMP:
            never.add(Flag.OUTPUT_SATURATED)
        if not self.datapath.wear:
            never |= {Flag.WEAR_WARNING, Flag.WEAR_CRITICAL}
        return [bit for bit in super().live_flags if bit not in never]

    def status_of_inputs(self, tdata: Value, given: Value | None = None) -> Value:
        """Return the flags that are known with a sample as it comes in; not the second if it is never set."""
        return super().status_of_inputs(tdata, given)[: 1 + (Flag.OUTSIDE_CALIBRATION in self.live_flags)]

    def _components(self, m: Module, advance: Value) -> list[LookAheadStage | PipelinedStage]:
        """Make the hardware of the stages."""
        components: list[LookAheadStage | PipelinedStage]
        if self.products is not None:
            planned = plans(self.stages, self.products)
            components = [LookAheadStage(stage.name, plan) for stage, plan in zip(self.stages, planned, strict=True)]
        else:
            components = [
                PipelinedStage(stage, adders=adders) for stage, adders in zip(self.stages, self.adders, strict=True)
            ]
        for stage, component in zip(self.stages, components, strict=True):
            m.submodules[stage.name] = component
            m.d.comb += component.advance.eq(advance)
        return components


def _share(whole: _Whole, lane: int, lanes: int) -> _Whole:
    """Return a lane's part of what holds all lanes, side by side."""
    size = len(whole) // lanes
    return whole[size * lane : size * (lane + 1)]
