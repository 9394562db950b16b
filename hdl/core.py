"""The parallel architecture: a datapath's stages in a pipeline between two AXI4-Stream faces."""

from __future__ import annotations

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, Module, ResetSignal, Signal, Value
from amaranth.lib import wiring

from sosmith.hdl.axi_stream import (
    StreamBuffer,
    at_rail,
    channel_bits,
    core_members,
    extended,
    fields,
    outside_calibration,
    width,
)
from sosmith.hdl.interleaved import InterleavedStage, schedule
from sosmith.hdl.stage import PipelineStage, rank_count
from sosmith.model.datapath import Datapath, Stage
from sosmith.model.status import Flag


def latency_cycles(datapath: Datapath, channels: int = 1) -> int:
    """Clocks from the edge that accepts a sample to the edge that can hand it on: all ranks, and the buffers."""
    return sum(_ranks(datapath, channels)) + 1 + (channels > 1)


def _ranks(datapath: Datapath, channels: int) -> list[int]:
    if channels == 1:
        return [rank_count(stage.graph) for stage in datapath.stages]
    return [schedule(stage.graph, channels).count for stage in datapath.stages]


class Core(wiring.Component):
    """A datapath in the parallel architecture: every operation has its own hardware.

    Latency: `latency_cycles` of the datapath, with no stall. Throughput: one sample per clock. With several channels,
    samples may come in any order; one of a channel that came just before waits until the loop has let that one out,
    for at most as many clocks as there are channels. A sample of a channel that does not exist is taken and dropped.
    After reset, several channels take a clock each to be cleared.

    Parameters
    ----------
    datapath : Datapath
        What it computes.
    channels : int
        Number of channels.

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
    m_axis_tuser : Out(8)
        Status of the output sample, bits as of `sosmith.model.status.Flag`.
    s_axis_tdest, m_axis_tdest
        Number of the sample's channel, in whole bytes; only with several channels.
    """

    def __init__(self, datapath: Datapath, channels: int = 1) -> None:
        self.datapath = datapath
        self.channels = channels
        super().__init__(core_members(datapath.inputs, datapath.output, channels))

    def elaborate(self, platform: object) -> Module:
        """Build the pipeline."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.aclk), ResetSignal("sync").eq(~self.aresetn)]
        live = len(Flag)
        buffer = m.submodules.output_buffer = StreamBuffer(
            width([self.datapath.output]) + live + channel_bits(self.channels)
        )
        stages = [self._stage(m, stage, buffer.advance) for stage in self.datapath.stages]
        valid, channel, data = self._source(m, stages, buffer.advance)
        status: Value = Cat(at_rail(self.datapath.inputs, data), outside_calibration(self.datapath, data))
        codes: list[Value] = [data[f.offset : f.offset + f.port.bits] for f in fields(self.datapath.inputs)]
        for component in stages:
            graph = component.stage.graph
            m.d.comb += [getattr(component, f"i{k}").eq(code) for k, code in enumerate(codes)]
            m.d.comb += component.i_valid.eq(valid)
            if isinstance(component, InterleavedStage):
                m.d.comb += component.i_channel.eq(channel)
                channel = component.o_channel
            valid = component.o_valid
            codes = [getattr(component, f"o{k}") for k in range(len(graph.outputs))]
        for rank in range(sum(_ranks(self.datapath, self.channels))):
            held = Signal(len(status), name=f"status{rank + 1}", reset_less=True)
            with m.If(buffer.advance):
                m.d.sync += held.eq(status)
            status = held
        output = extended(codes[0], self.datapath.output.bytes * 8)
        m.d.comb += [
            buffer.i_valid.eq(valid),
            buffer.i_data.eq(Cat(output, status, stages[-1].o_saturated, channel)),
            self.m_axis_tvalid.eq(buffer.o_valid),
            buffer.o_ready.eq(self.m_axis_tready),
        ]
        m.d.comb += [
            self.m_axis_tdata.eq(buffer.o_data[: len(output)]),
            self.m_axis_tuser.eq(buffer.o_data[len(output) : len(output) + live]),
        ]
        if self.channels > 1:
            m.d.comb += self.m_axis_tdest.eq(buffer.o_data[len(output) + live :])
        return m

    def _stage(self, m: Module, stage: Stage, advance: Value) -> PipelineStage | InterleavedStage:
        several = self.channels > 1
        component = InterleavedStage(stage, self.channels) if several else PipelineStage(stage)
        m.submodules[stage.name] = component
        m.d.comb += component.advance.eq(advance)
        return component

    def _source(
        self, m: Module, stages: list[PipelineStage | InterleavedStage], advance: Value
    ) -> tuple[Value, Value, Value]:
        """Return whether there is a sample for the first stage, its channel, and its word."""
        interleaved = [component for component in stages if isinstance(component, InterleavedStage)]
        if not interleaved:
            m.d.comb += self.s_axis_tready.eq(advance)
            return self.s_axis_tvalid, Const(0, 0), self.s_axis_tdata
        bits = channel_bits(self.channels)
        buffer = m.submodules.input_buffer = StreamBuffer(len(self.s_axis_tdata) + bits)
        clearing, cleared = Signal(init=1), Signal(bits)
        exists = self.s_axis_tdest < self.channels
        dest = buffer.o_data[:bits]
        with m.If(clearing):
            m.d.sync += cleared.eq(cleared + 1)
            with m.If(cleared == self.channels - 1):
                m.d.sync += clearing.eq(0)
        # Samples on their way whose states are not written yet: those of the last clocks, farther than any one stage's.
        waits: Value = Const(0, 1)
        near: list[tuple[Value, Value]] = []
        distance = max(component.schedule.distance for component in interleaved)
        valid = Signal()
        for k in range(distance - 1):
            before = near[-1] if near else (valid, dest)
            taken, channel = Signal(name=f"near{k}"), Signal(bits, name=f"near_channel{k}", reset_less=True)
            with m.If(advance):
                m.d.sync += [taken.eq(before[0]), channel.eq(before[1])]
            near.append((taken, channel))
            waits = waits | (taken & (channel == dest))
        m.d.comb += [
            self.s_axis_tready.eq(buffer.advance & ~clearing),
            buffer.i_valid.eq(self.s_axis_tvalid & exists & ~clearing),
            buffer.i_data.eq(Cat(self.s_axis_tdest[:bits], self.s_axis_tdata)),
            valid.eq(buffer.o_valid & ~waits),
            buffer.o_ready.eq(advance & ~waits),
        ]
        for component in interleaved:
            m.d.comb += [component.clear.eq(clearing), component.clear_channel.eq(cleared)]
        return valid, dest, buffer.o_data[bits:]
