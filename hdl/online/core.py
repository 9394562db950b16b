"""A core whose filter sections work in on-line arithmetic, between two AXI4-Stream interfaces.

Stages before and behind the sections work on words, as in the parallel architecture; one sample enters them at every
`interval` clocks of the sections::

    s_axis_tdata -----> start --- word --> OnlineCascade --- word --> output_stage --> output_buffer --> m_axis_tdata
                   |      |                  digits                        ^              |              m_axis_tuser
                   |      +--> [held], the first sample, for ever ---------+              |
                   +--> status --[..]--> tag of the sample --> tag --[..]-----------------+
                                                                                          |
    s_axis_tready <---------------- tick of the OnlineCascade, if advance <---------------+

Everything moves at the clocks at which `advance`, which comes from a register of the output buffer, is high.
"""

from __future__ import annotations

from amaranth.hdl import Cat, ClockDomain, ClockSignal, Const, EnableInserter, Module, ResetSignal, Signal, Value
from amaranth.lib import wiring

from sosmith.hdl.axi_stream import StreamBuffer, core_members, extended
from sosmith.hdl.online.cascade import OnlineCascade
from sosmith.hdl.pipelined_logic import shape_of
from sosmith.hdl.plan.online_clocks import schedule_of
from sosmith.hdl.plan.pipeline import pipeline_depth
from sosmith.hdl.plan.streams import fields, width
from sosmith.hdl.stages.pipelined import PipelinedStage
from sosmith.hdl.status import at_rail, flag_count, in_order, outside_calibration, worn
from sosmith.model.dataflow.datapath import Datapath, Stage
from sosmith.model.sections.online import sections_of


class OnlineCore(wiring.Component):
    """A datapath whose sections work on signed digits, the most significant first.

    Latency: `latency_cycles` of the datapath, without a stall. Throughput: one sample in as many clocks as the
    schedule's interval, which does not depend on the word lengths. A sample waits for the next clock with `tick`.

    Parameters
    ----------
    datapath : Datapath
        What it computes; its sections must be ones for on-line arithmetic.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As those of `sosmith.hdl.core.Core`.
    """

    def __init__(self, datapath: Datapath) -> None:
        self.datapath = datapath
        super().__init__(core_members(datapath.inputs, datapath.output))

    def elaborate(self, platform: object) -> Module:
        """Build the pipeline."""
        m = Module()
        m.domains.sync = ClockDomain(local=True)
        m.d.comb += [ClockSignal("sync").eq(self.aclk), ResetSignal("sync").eq(~self.aresetn)]
        datapath, schedule = self.datapath, schedule_of(self.datapath)
        numbers = sections_of(datapath)
        first, last = datapath.stages[numbers.start].graph, datapath.stages[numbers.stop - 1].graph
        buffer = m.submodules.output_buffer = StreamBuffer(width([datapath.output]) + flag_count(datapath))
        advance = buffer.advance
        status: Value = Cat(
            at_rail(datapath.inputs, self.s_axis_tdata), outside_calibration(datapath, self.s_axis_tdata)
        )
        cascade = OnlineCascade(
            schedule, shape_of(first.nodes[first.inputs[0]]), shape_of(last.nodes[last.outputs[0]]), len(status)
        )
        m.submodules.sections = EnableInserter(advance)(cascade)
        m.d.comb += self.s_axis_tready.eq(advance & cascade.tick)
        valid: Value = self.s_axis_tvalid & cascade.tick
        codes: list[Value] = [self.s_axis_tdata[f.offset : f.offset + f.port.bits] for f in fields(datapath.inputs)]
        for stage in datapath.stages[: numbers.start]:
            valid, codes, status, _ = self._stage(m, stage, advance, valid, codes, status)
        m.d.comb += [cascade.i.eq(codes[0]), cascade.i_valid.eq(valid), cascade.i_tag.eq(status)]
        passed = []
        for k, code in enumerate(codes[1:]):
            held = Signal(code.shape(), name=f"held{k}")
            with m.If(advance & valid):
                m.d.sync += held.eq(code)
            passed.append(held)
        valid, codes, status, saturated = self._stage(
            m, datapath.stages[-1], advance, cascade.o_valid, [cascade.o, *passed], cascade.o_tag
        )
        settling = codes[1][-1] if datapath.settles else Const(0, 0)
        wear = worn(m, datapath, codes[0], Const(0, 1), advance, "none")
        flags = in_order(datapath, status, saturated, wear, settling)
        output = extended(codes[0], datapath.output.bytes * 8)
        m.d.comb += [
            buffer.i_valid.eq(valid),
            buffer.i_data.eq(Cat(output, flags)),
            self.m_axis_tvalid.eq(buffer.o_valid),
            buffer.o_ready.eq(self.m_axis_tready),
            self.m_axis_tdata.eq(buffer.o_data[: len(output)]),
            self.m_axis_tuser.eq(buffer.o_data[len(output) :]),
        ]
        return m

    def _stage(
        self, m: Module, stage: Stage, advance: Value, valid: Value, codes: list[Value], status: Value
    ) -> tuple[Value, list[Value], Value, Value]:
        """Connect a stage that works on words; return its valid bit, outputs, status and whether it saturated."""
        component = m.submodules[stage.name] = PipelinedStage(stage)
        m.d.comb += [getattr(component, f"i{k}").eq(code) for k, code in enumerate(codes)]
        m.d.comb += [component.i_valid.eq(valid), component.advance.eq(advance)]
        for k in range(pipeline_depth(stage.graph)):
            later = Signal(len(status), name=f"{stage.name}_status{k + 1}", reset_less=True)
            with m.If(advance):
                m.d.sync += later.eq(status)
            status = later
        outputs = [getattr(component, f"o{k}") for k in range(len(stage.graph.outputs))]
        return component.o_valid, outputs, status, component.o_saturated
