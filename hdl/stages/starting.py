"""The start of a filter for one channel, and the first sample beside its stages, kept in one place.

What `sosmith.model.sections.start.StartStage` says takes one subtractor here. The first sample is loaded once; before,
the register that holds it is 0 like the change, whose register is cleared instead of loaded::

                                                 +--------+
    i0 ---+--------------------------> - ------->| change |---> o0
          |                            ^         +--------+
          |        +---------+         |    cleared  ^
          +------->|  first  |---------+-------------|--------> o1
                   +---------+  loaded by the        |
                        ^       first sample     +---------+
                        +------------------------| started |<--- 1
                                                 +---------+

The first sample is 0 after a reset, and from the clock on at which the first one leaves the stage it does not change.
Whatever sample is in a later stage, it belongs to it: so o1 goes straight to the last stage, and no register passes it
on. Latency of o0: one clock at which `advance` is high. With x = 5, 7, -8, one at each of these clocks::

    clock        0    1    2    3
    i0           5    7   -8
    started      0    1    1    1
    o0           -    0    2  -13
    o1           0    5    5    5
"""

from __future__ import annotations

from amaranth.hdl import Module, Mux, Signal

from sosmith.hdl.pipelined_logic import shape_of
from sosmith.hdl.stages.pipelined import PipelinedStage
from sosmith.model.sections.start import StartStage


class StartingStage(PipelinedStage):
    """The stage in front of a filter that starts from its first sample, for one channel, without parity.

    Latency: one clock at which `advance` is high. Throughput: one sample at each of these clocks.

    Parameters
    ----------
    stage : StartStage
        What it computes.
    clears : bool
        As of `PipelinedStage`, as are the members.
    """

    def __init__(self, stage: StartStage, *, clears: bool = False) -> None:
        super().__init__(stage, clears=clears)

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        graph = self.stage.graph
        _, (take,), _ = self._control(m, 1)
        started, first = (
            Signal(shape_of(node), name=node.name) for node in (graph.nodes[index] for index in graph.delays)
        )
        change = Signal.like(self.o0, name="change_register", reset_less=True)
        with m.If(take):
            m.d.sync += [
                started.eq(1),
                first.eq(Mux(started, first, self.i0)),
                change.eq(Mux(started, self.i0 - first, 0)),
            ]
        if self.clears:
            with m.If(self.clear):
                m.d.sync += [started.eq(0), first.eq(0)]
        m.d.comb += self.o0.eq(change)
        if len(graph.outputs) > 1:
            m.d.comb += self.o1.eq(first)
        return m
