"""The generated core: a datapath's stages in a pipeline between two AXI4-Stream faces."""

from __future__ import annotations

from amaranth.hdl import ClockDomain, ClockSignal, Module, ResetSignal, Value
from amaranth.lib import wiring

from sosmith.hdl.axi_stream import OutputBuffer, core_members, extended, fields, width
from sosmith.hdl.stage import PipelineStage, rank_count
from sosmith.model.datapath import Datapath


def latency_cycles(datapath: Datapath) -> int:
    """Clocks from the edge that accepts a sample to the edge that can hand it on: all stages' ranks, and the buffer."""
    return sum(rank_count(stage.graph) for stage in datapath.stages) + 1


class Core(wiring.Component):
    """A datapath in the parallel architecture: every operation has its own hardware.

    Latency: `latency_cycles` of the datapath, with no stall. Throughput: one sample per clock.

    Parameters
    ----------
    datapath : Datapath
        What it computes.

    Members
    -------
    aclk : In(1)
        Clock, rising edge.
    aresetn : In(1)
        Synchronous reset, active low.
    s_axis_tdata, s_axis_tvalid, s_axis_tready
        Input samples: one field per input port, each extended to whole bytes, the first one lowest.
    m_axis_tdata, m_axis_tvalid, m_axis_tready
        Output samples: one field, extended likewise.
    """

    def __init__(self, datapath: Datapath) -> None:
        self.datapath = datapath
        super().__init__(core_members(datapath.inputs, datapath.output))

    def elaborate(self, platform: object) -> Module:
        """Build the pipeline."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.aclk), ResetSignal("sync").eq(~self.aresetn)]
        buffer = m.submodules.output_buffer = OutputBuffer(width([self.datapath.output]))
        m.d.comb += self.s_axis_tready.eq(buffer.advance)
        valid: Value = self.s_axis_tvalid
        codes: list[Value] = [self._code(field.offset, field.port.bits) for field in fields(self.datapath.inputs)]
        for stage in self.datapath.stages:
            component = PipelineStage(stage)
            m.submodules[stage.name] = component
            m.d.comb += [component.i_valid.eq(valid), component.advance.eq(buffer.advance)]
            m.d.comb += [getattr(component, f"i{k}").eq(code) for k, code in enumerate(codes)]
            valid = component.o_valid
            codes = [getattr(component, f"o{k}") for k in range(len(stage.graph.outputs))]
        m.d.comb += [
            buffer.i_valid.eq(valid),
            buffer.i_data.eq(extended(codes[0], self.datapath.output.bytes * 8)),
            self.m_axis_tvalid.eq(buffer.o_valid),
            self.m_axis_tdata.eq(buffer.o_data),
            buffer.o_ready.eq(self.m_axis_tready),
        ]
        return m

    def _code(self, offset: int, bits: int) -> Value:
        return self.s_axis_tdata[offset : offset + bits]
