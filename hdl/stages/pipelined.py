"""A stage of a datapath for one channel: its logic in one to three pipeline stages, and its state.

Only what depends on the newest sample that a recursion remembers has to be done within one clock. What depends on the
input alone, and then what depends on older samples, is computed and registered a pipeline stage before; the delay of
what is left is all that limits the clock.

As an example, ``v(n) = x(n) + x(n-1) - floor(v(n-2) / 4) + floor(v(n-1) / 2)``, with the width of each signal in bits;
names in brackets are registers, and so are the states x1, v1 and v2::

    pipeline stage 0       pipeline stage 1                        pipeline stage 2

                               floor(/4) <--- Mux(valid2, v1, v2) <--- [v2] <------+
                                   | 3                          5        5         |
      +--> [x1] -+                 |                               floor(/2) <-----+
      |      2   v                 v                                   v 4         |
    i0+--------> +--[passed1]----> - ----------------[passed2]-------> + ---> [v1]-+--> o0
     2         3          3      4                         4         5      5

    i_valid --------[valid1]-------------------------[valid2]------------> [valid3] --> o_valid

With parity, each state has one more register, [x1_parity] and so on, and what the sample found wrong goes with it::

    i_fault ---> or -->[fault1]-----------------> or -->[fault2]-----> or -->[fault3]-----> or ---> o_fault
                 ^ x1                             ^ none               ^ v1, v2             ^ v1, v2

The state v2 belongs to pipeline stage 2, which may still hold the sample before. Its update is due then: the value that
it is about to take is v1.

With x = -2 at each clock, from reset on, the output is valid three clocks after the input::

    clock            0    1    2    3    4    5
    i0              -2   -2   -2   -2   -2   -2
    passed1          -   -2   -4   -4   -4   -4     x(n) + x(n-1)
    Mux              -    0    0   -2   -5   -6     v(n-2)
    passed2          -    -   -2   -4   -3   -2     less floor(v(n-2) / 4)
    v1, o0           0    0    0   -2   -5   -6
    o_valid          0    0    0    1    1    1

>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> g = GraphBuilder()
>>> x = g.input("x", frac=0, low=-2, high=1)
>>> v1 = g.delay("v1", frac=0, low=-12, high=11)
>>> v2 = g.previous(v1, "v2")
>>> early = g.add(x, g.previous(x, "x1"), "early")
>>> older = g.subtract(early, g.floor(g.shift(v2, -2), frac=0), "older")
>>> v = g.bound(g.add(older, g.floor(g.shift(v1, -1), frac=0)), -12, 11, "v")
>>> g.connect(v1, v)
>>> graph = g.build([v])
>>> [(node.name, node.width, k) for node, k in zip(graph.nodes, pipeline_stages(graph)) if node.name]
[('x', 2, 0), ('v1', 5, 2), ('v2', 5, 2), ('x1', 2, 0), ('early', 3, 0), ('older', 4, 1), ('v', 5, 2)]
>>> graph.run([[-2]] * 3)
[[-2], [-5], [-6]]
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from amaranth.hdl import Cat, Const, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.constant_banks import NO_CONSTANTS, Pair
from sosmith.hdl.pipelined_logic import PipelinedLogic, banks_in_use, limits, name_ports, shape_of
from sosmith.hdl.plan.pipeline import inner_sums, pipeline_stages
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.dataflow.structure import Stage


class PipelinedStage(wiring.Component):
    """A datapath stage for one channel.

    Latency: `pipeline_depth` of its graph, 1 to 3, in clocks at which `advance` is high. Throughput: one sample at each
    of these clocks.

    Parameters
    ----------
    stage : Stage
        What it computes.
    constants : dict of int to Pair
        Constants that come from one of two banks, by node.
    parity : bool
        Whether each register that holds a state has a parity bit, which every sample checks.
    clears : bool
        Whether the states can be cleared while the core works, as they always can with parity.
    adders : collection of int
        Products by constants that are made of adders, by node.

    Members
    -------
    i0, i1, .. : In(shape)
        Input codes, in the order of the graph's inputs.
    i_valid : In(1)
        Whether the inputs hold a sample. The state changes with valid samples only.
    i_bank, o_bank : In(1), Out(1)
        Bank that the sample at the inputs uses, and the one at the outputs.
    uses : Out(2)
        Whether a sample inside uses the first bank, and the second.
    advance : In(1)
        Whether the pipeline moves at this clock.
    o0, o1, .. : Out(shape)
        Output codes, in the order of the graph's outputs; defined while `o_valid` is high.
    o_valid : Out(1)
        Whether the outputs hold a sample.
    o_saturated : Out(max(1, limited outputs))
        Whether each output that is limited to its range had to be.
    i_fault, o_fault : In(1), Out(1)
        Whether a wrong bit was found for the sample at the inputs, and for the one at the outputs; only with parity.
    clear : In(1)
        Whether to set the states to 0; no sample may be inside. Only with parity or `clears`.
    """

    def __init__(
        self,
        stage: Stage,
        constants: Mapping[int, Pair] = NO_CONSTANTS,
        *,
        parity: bool = False,
        clears: bool = False,
        adders: Collection[int] = (),
    ) -> None:
        self.name = stage.name
        self.stage = stage
        self.adders = adders
        self.constants = constants
        self.parity = parity
        self.clears = clears
        graph = stage.graph
        members = {f"i{k}": In(shape_of(graph.nodes[i])) for k, i in enumerate(graph.inputs)}
        members |= {f"o{k}": Out(shape_of(graph.nodes[i])) for k, i in enumerate(graph.outputs)}
        members |= {"i_bank": In(1), "o_bank": Out(1), "uses": Out(2)}
        if parity:
            members |= {"i_fault": In(1), "o_fault": Out(1)}
        if parity or clears:
            members |= {"clear": In(1)}
        limited = sum(graph.nodes[i].op is Op.CLAMP for i in graph.outputs)
        members |= {"i_valid": In(1), "advance": In(1), "o_valid": Out(1), "o_saturated": Out(max(1, limited))}
        super().__init__(members)
        self.outputs = name_ports(self, graph)

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        graph = self.stage.graph
        stages = pipeline_stages(graph)
        valid, takes, banks = self._control(m, max(stages) + 1)
        apart = inner_sums(graph, stages)
        logic = PipelinedLogic(
            m,
            graph,
            stages,
            constants=self.constants,
            banks=banks,
            takes=takes,
            valid=valid,
            adders=self.adders,
        )
        logic.connect([getattr(self, f"i{k}") for k in range(len(graph.inputs))], apart)
        at, wires, names = logic.at, logic.wires, logic.names
        for i in graph.delays:
            following = at(graph.nodes[i].operands[0], stages[i])  # may make a register, which loads by its own rule
            with m.If(takes[stages[i]]):
                m.d.sync += wires[i].eq(following)
        if self.parity:
            self._check(m, logic, stages, takes)
        elif self.clears:
            with m.If(self.clear):
                m.d.sync += [wires[i].eq(0) for i in graph.delays]
        last = len(takes) - 1
        saturated = iter(self.o_saturated)
        for k, i in enumerate(graph.outputs):
            output = getattr(self, f"o{k}")
            state = held(graph, i, wires) if stages[i] == last else None
            if state is not None:
                m.d.comb += output.eq(state)
            else:
                register = Signal(shape_of(graph.nodes[i]), name=f"{names[i]}_register", reset_less=True)
                m.d.comb += output.eq(register)
                loads = [register.eq(at(i, last))]
                if graph.nodes[i].op is Op.CLAMP:
                    outside = limits(graph.nodes[i], at(graph.nodes[i].operands[0], last))
                    loads.append(next(saturated).eq(Cat(*outside).any()))
                with m.If(takes[last]):
                    m.d.sync += loads
        return m

    def _check(self, m: Module, logic: PipelinedLogic, stages: list[int], takes: list[Value]) -> None:
        """Give each state a parity bit; a sample takes along whether one of those that it met was wrong.

        A sample checks a state in the pipeline stage that changes it. If it used the state in an earlier one, the state
        has not changed in between, as no other sample was in the later one. A state that is the output, too, is checked
        as long as it is there.
        """
        graph = self.stage.graph
        fault: Value = self.i_fault
        wrong: Value = Const(0, 1)
        for k, take in enumerate(takes):
            wrong = Const(0, 1)
            for i in (i for i in graph.delays if stages[i] == k):
                state, parity = logic.wires[i], Signal(name=f"{logic.names[i]}_parity")
                following = logic.at(graph.nodes[i].operands[0], k)
                wrong = wrong | (state.as_unsigned().xor() ^ parity)
                with m.If(take):
                    m.d.sync += parity.eq(_fitting(following, state).xor())
                with m.If(self.clear):
                    m.d.sync += [state.eq(0), parity.eq(0)]
            later = Signal(name=f"fault{k + 1}")
            with m.If(take):
                m.d.sync += later.eq(fault | wrong)
            fault = later
        m.d.comb += self.o_fault.eq(fault | wrong)

    def _control(self, m: Module, depth: int) -> tuple[list[Value], list[Value], list[Value]]:
        """Return for each pipeline stage whether it holds a sample, whether its registers load it now, and its bank."""
        valid: list[Value] = [self.i_valid]
        banks: list[Value] = [self.i_bank]
        for k in range(1, depth + 1):
            valid.append(Signal(name=f"valid{k}"))
            banks.append(Signal(name=f"bank{k}", reset_less=True))
            with m.If(self.advance):
                m.d.sync += [valid[k].eq(valid[k - 1]), banks[k].eq(banks[k - 1])]
        takes: list[Value] = [Signal(name=f"take{k}") for k in range(depth)]
        m.d.comb += [take.eq(self.advance & ready) for take, ready in zip(takes, valid, strict=False)]
        m.d.comb += [self.o_valid.eq(valid[-1]), self.o_bank.eq(banks[-1])]
        m.d.comb += self.uses.eq(banks_in_use(valid[:-1], banks[:-1]))
        return valid, takes, banks


def _fitting(value: Value, state: Value) -> Value:
    """Return the bits of `value` that a register as wide as `state` takes."""
    return Cat(value, *([value[-1] if value.shape().signed else Const(0, 1)] * len(state)))[: len(state)]


def held(graph: Graph, output: int, wires: list[Value]) -> Value | None:
    """Return the output of the sample that has just been computed from a state among `wires` that holds it, or None.

    A section's output is the upper part of its state v, so that it needs no register of its own.
    """
    chain: list[Node] = []
    index = output
    while True:
        for delay in graph.delays:
            if graph.nodes[delay].operands == (index,):
                value = wires[delay]
                for node in reversed(chain):
                    value = _drop(graph, node, value)
                return value
        node = graph.nodes[index]
        if node.op not in {Op.FLOOR, Op.SHIFT, Op.BOUND}:
            return None
        chain.append(node)
        index = node.operands[0]


def _drop(graph: Graph, node: Node, value: Value) -> Value:
    """Return the value of a FLOOR, SHIFT or BOUND from that of its operand."""
    shift = graph.nodes[node.operands[0]].frac - node.frac if node.op is Op.FLOOR else 0
    return value.shift_right(shift)
