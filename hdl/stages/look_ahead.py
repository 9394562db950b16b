"""A stage of a datapath for one stream whose loops go back several samples: pipelined through the samples between.

As an example, ``v(n) = x(n) + x(n-1) + floor(v(n-4) / 2)``, whose loop has four clocks; names in brackets are
registers::

    stage 0             stage 1              stage 2

    i0 -+--> [x1] -+
        |          v
        +--------> + --[early_passed1]-----------------[early_passed2]---> + ---[v_register]--> o0
                +-----------+                                              ^  |
      [turn] -->| v4, 4 x v |--> & warm --[v4_word]--[v4_passed2]--> floor(/2)|
                +-----------+                                                 |
                     ^ write <-- [turn2], data: v <---------------------------+

    i_valid --[valid1]--[valid2]--[valid3]--> o_valid       [turn] counts samples: 0, 1, 2, 3, 0, ..
    [warm] is set when it has come around: the samples before have no past, and find 0 whatever the memory holds

Whether a sample has a past is said by `warm`, which a reset clears. No memory has to be cleared, so that the stage is
ready at once. A loop that goes back a single sample has a register instead of a memory, and one pipeline stage.
"""

from __future__ import annotations

from collections.abc import Mapping

from amaranth.hdl import Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.constant_banks import NO_CONSTANTS
from sosmith.hdl.memory_ports import read_port, write_port
from sosmith.hdl.pipelined_logic import PipelinedLogic, limits, name_ports, shape_of, unique_names
from sosmith.hdl.plan.look_ahead import TurnPlan
from sosmith.model.dataflow.graph import Op


class LookAheadStage(wiring.Component):
    """A datapath stage whose loops take turns.

    Latency: `TurnPlan.depth`, in clocks at which `advance` is high. Throughput: one sample at each of these clocks, or
    as many as the graph has been unfolded into.

    Parameters
    ----------
    name : str
        Name of the stage.
    plan : TurnPlan
        What it computes, and in which pipeline stages.

    Members
    -------
    i0, i1, .. : In(shape)
        Input codes, in the order of the graph's inputs.
    i_valid : In(1)
        Whether the inputs hold a sample. The state changes with valid samples only.
    advance : In(1)
        Whether the pipeline moves at this clock.
    o0, o1, .. : Out(shape)
        Output codes, in the order of the graph's outputs; defined while `o_valid` is high.
    o_valid : Out(1)
        Whether the outputs hold a sample.
    o_saturated : Out(max(1, limited outputs))
        Whether each output that is limited to its range had to be.
    """

    def __init__(self, name: str, plan: TurnPlan) -> None:
        self.name = name
        self.plan = plan
        graph = plan.graph
        members = {f"i{k}": In(shape_of(graph.nodes[i])) for k, i in enumerate(graph.inputs)}
        members |= {f"o{k}": Out(shape_of(graph.nodes[i])) for k, i in enumerate(graph.outputs)}
        limited = sum(graph.nodes[i].op is Op.CLAMP for i in graph.outputs)
        members |= {"i_valid": In(1), "advance": In(1), "o_valid": Out(1), "o_saturated": Out(max(1, limited))}
        super().__init__(members)
        self.outputs = name_ports(self, graph)

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        plan, graph = self.plan, self.plan.graph
        valid = self._passed(m, self.i_valid, "valid", plan.depth, resets=True)
        names = unique_names(graph)
        words = {
            i: Signal(shape_of(graph.nodes[i]), name=f"{names[i]}_word", reset_less=True)
            for i in plan.loops
            if plan.turns > 1
        }
        logic = PipelinedLogic(
            m,
            graph,
            plan.pipeline_stages,
            constants=NO_CONSTANTS,
            banks=valid,
            takes=[self.advance] * plan.depth,
            valid=valid,
            words=words,
        )
        sums = [index for index, node in enumerate(graph.nodes) if node.op in {Op.ADD, Op.SUBTRACT}]
        # Synthesis would merge sums that follow each other, and lose the carry chains that they share.
        logic.connect([getattr(self, f"i{k}") for k in range(len(graph.inputs))], sums)
        at, wires = logic.at, logic.wires
        for i in graph.delays:
            if i not in plan.loops or plan.turns == 1:
                stage = plan.writes.get(i, plan.pipeline_stages[i])
                following = at(graph.nodes[i].operands[0], stage)
                with m.If(self.advance & valid[stage]):
                    m.d.sync += wires[i].eq(following)
        if words:
            self._connect_memories(m, logic, words, valid)
        last = plan.depth - 1
        flags: list[Value] = []
        for k, i in enumerate(graph.outputs):
            register = Signal(shape_of(graph.nodes[i]), name=f"{logic.names[i]}_register", reset_less=True)
            m.d.comb += getattr(self, f"o{k}").eq(register)
            following = at(i, last)
            with m.If(self.advance):
                m.d.sync += register.eq(following)
            if graph.nodes[i].op is Op.CLAMP:
                own = plan.pipeline_stages[i]
                outside = Cat(*limits(graph.nodes[i], at(graph.nodes[i].operands[0], own))).any()
                flags.append(self._passed(m, outside, f"saturated{k}_", last + 1 - own)[-1])
        m.d.comb += [self.o_valid.eq(valid[-1]), self.o_saturated.eq(Cat(*flags))]
        return m

    def _passed(self, m: Module, value: Value, name: str, clocks: int, *, resets: bool = False) -> list[Value]:
        """Return a value, and what it was up to so many clocks of the pipeline ago."""
        delayed_by = [value]
        for k in range(1, clocks + 1):
            delayed_by.append(Signal(value.shape(), name=f"{name}{k}", reset_less=not resets))
            with m.If(self.advance):
                m.d.sync += delayed_by[k].eq(delayed_by[k - 1])
        return delayed_by

    def _connect_memories(
        self, m: Module, logic: PipelinedLogic, words: Mapping[int, Signal], valid: list[Value]
    ) -> None:
        """Give each state of a loop a memory with one word for each turn, of which `words` takes over one."""
        plan, graph = self.plan, self.plan.graph
        turn, warm = Signal(range(plan.turns), name="turn"), Signal(name="warm")
        with m.If(self.advance & self.i_valid):
            m.d.sync += turn.eq(turn + 1)
            with m.If(turn == plan.turns - 1):
                m.d.sync += [turn.eq(0), warm.eq(1)]
        turns = self._passed(m, turn, "turn", max(plan.writes.values()))
        warms = self._passed(m, warm, "warm", max(plan.pipeline_stages[i] for i in plan.loops) - 1)
        for i in sorted(words):
            node, own, written = graph.nodes[i], plan.pipeline_stages[i], plan.writes[i]
            memory = Memory(shape=shape_of(node), depth=plan.turns, init=[])
            name = f"{logic.names[i]}_memory"
            m.submodules[name] = memory
            read, write = read_port(memory, name, domain="comb"), write_port(memory, name)
            following = logic.at(node.operands[0], written)
            with m.If(self.advance):
                # Not a multiplexer: synthesis would make a reset of it, with which no register moves into a block.
                m.d.sync += words[i].eq(read.data.as_unsigned() & warms[own - 1].replicate(node.width))
            m.d.comb += [
                read.addr.eq(turns[own - 1]),
                write.addr.eq(turns[written]),
                write.data.eq(following),
                write.en.eq(self.advance & valid[written]),
            ]
