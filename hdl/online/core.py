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

from amaranth.hdl import Const, EnableInserter, Module, Signal, Value

from sosmith.hdl.online.cascade import OnlineCascade
from sosmith.hdl.pipelined_logic import shape_of
from sosmith.hdl.plan.online_clocks import schedule_of
from sosmith.hdl.plan.pipeline import pipeline_depth
from sosmith.hdl.shell.pipeline import Sample, delayed, through
from sosmith.hdl.shell.shell import Shell
from sosmith.hdl.stages.pipelined import PipelinedStage
from sosmith.hdl.status import status_of_result
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.structure import Stage
from sosmith.model.sections.online import sections_of


class OnlineCore(Shell):
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
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(self, datapath: Datapath) -> None:
        super().__init__(datapath)

    def fill(self, m: Module) -> None:
        """Build the pipeline."""
        datapath, schedule = self.datapath, schedule_of(self.datapath)
        numbers = sections_of(datapath)
        first, last = datapath.stages[numbers.start].graph, datapath.stages[numbers.stop - 1].graph
        buffer = self.output_buffer(m)
        advance = buffer.advance
        status = self.status_of_inputs(self.s_axis_tdata)
        cascade = OnlineCascade(
            schedule, shape_of(first.nodes[first.inputs[0]]), shape_of(last.nodes[last.outputs[0]]), len(status)
        )
        m.submodules.sections = EnableInserter(advance)(cascade)
        m.d.comb += self.s_axis_tready.eq(advance & cascade.tick)
        sample, codes = Sample(self.s_axis_tvalid & cascade.tick), self.codes(self.s_axis_tdata)
        for stage in datapath.stages[: numbers.start]:
            (sample, codes), status, _ = self._stage(m, stage, advance, sample, codes, status)
        m.d.comb += [cascade.i.eq(codes[0]), cascade.i_valid.eq(sample.valid), cascade.i_tag.eq(status)]
        passed = []
        for k, code in enumerate(codes[1:]):
            register = Signal(code.shape(), name=f"held{k}")
            with m.If(advance & sample.valid):
                m.d.sync += register.eq(code)
            passed.append(register)
        (sample, codes), status, saturated = self._stage(
            m, datapath.stages[-1], advance, Sample(cascade.o_valid), [cascade.o, *passed], cascade.o_tag
        )
        result_status = status_of_result(
            m,
            datapath,
            codes[0],
            inputs=status,
            saturated=saturated,
            settling=codes[1][-1] if datapath.settles else Const(0, 0),
        )
        self.hand_out(m, buffer, sample.valid, [(codes[0], result_status.flags)])

    @staticmethod
    def _stage(
        m: Module, stage: Stage, advance: Value, sample: Sample, codes: list[Value], status: Value
    ) -> tuple[tuple[Sample, list[Value]], Value, Value]:
        """Connect a stage that works on words; return what is behind it, its status, and whether it saturated."""
        component = m.submodules[stage.name] = PipelinedStage(stage)
        behind = through(m, [component], sample, codes)
        m.d.comb += component.advance.eq(advance)
        later = delayed(m, advance, status, pipeline_depth(stage.graph), f"{stage.name}_status")
        return behind, later, component.o_saturated
