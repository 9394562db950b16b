"""One stage of a datapath in hardware: its dataflow graph as combinational logic, its state, one register rank."""

from __future__ import annotations

from collections.abc import Iterator

from amaranth.hdl import Const, Module, Mux, Shape, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.model.datapath import Stage
from sosmith.model.graph import Graph, Node, Op


def shape_of(node: Node) -> Shape:
    """Shape that holds the range of `node`: unsigned where it cannot be negative."""
    return Shape(node.width, signed=node.signed)


class PipelineStage(wiring.Component):
    """A stage that takes a sample at every clock at which the pipeline advances.

    Latency: one clock of the pipeline. Throughput: one sample per clock.

    Parameters
    ----------
    stage : Stage
        What it computes.

    Members
    -------
    i0, i1, .. : In(shape)
        Input codes, in the order of the graph's inputs.
    i_valid : In(1)
        Whether the inputs hold a sample; without one, the state stays as it is.
    advance : In(1)
        Whether the pipeline moves at this clock.
    o0, o1, .. : Out(shape)
        Output codes of the sample before; defined while `o_valid` is high.
    o_valid : Out(1)
        Whether the outputs hold a sample.
    """

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        graph = stage.graph
        members = {f"i{k}": In(shape_of(graph.nodes[i])) for k, i in enumerate(graph.inputs)}
        members |= {f"o{k}": Out(shape_of(graph.nodes[i])) for k, i in enumerate(graph.outputs)}
        super().__init__({**members, "i_valid": In(1), "advance": In(1), "o_valid": Out(1)})

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        graph = self.stage.graph
        wires: list[Value] = []
        names = _unique_names(graph)
        inputs = iter([getattr(self, f"i{k}") for k in range(len(graph.inputs))])
        for node, name in zip(graph.nodes, names, strict=True):
            if node.op is Op.INPUT:
                wires.append(next(inputs))
                continue
            if node.op is Op.SHIFT:  # the same code
                wires.append(wires[node.operands[0]])
                continue
            wire = Signal(shape_of(node), name=name)
            wires.append(wire)
            if node.op is not Op.DELAY:
                m.d.comb += wire.eq(_logic(graph, node, wires))
        take = Signal()
        m.d.comb += take.eq(self.advance & self.i_valid)
        with m.If(self.advance):
            m.d.sync += self.o_valid.eq(self.i_valid)
        with m.If(take):
            for i in graph.delays:
                m.d.sync += wires[i].eq(wires[graph.nodes[i].operands[0]])
        for k, i in enumerate(graph.outputs):
            output = getattr(self, f"o{k}")
            held = _held(graph, i, wires)
            if held is not None:
                m.d.comb += output.eq(held)
            else:
                register = Signal(shape_of(graph.nodes[i]), name=f"{names[i]}_register", reset_less=True)
                m.d.comb += output.eq(register)
                with m.If(take):
                    m.d.sync += register.eq(wires[i])
        return m


def _unique_names(graph: Graph) -> list[str]:
    """Name every node's signal: by its own name, with the index where that is missing or taken."""
    seen: set[str] = set()
    names = []
    for index, node in enumerate(graph.nodes):
        name = node.name if node.name and node.name not in seen else f"{node.name or node.op.value}_{index}"
        seen.add(name)
        names.append(name)
    return names


def _held(graph: Graph, output: int, wires: list[Value]) -> Value | None:
    """Output value of the sample before as a function of a state that already holds it, or None.

    A section's output is the upper part of its state v, which therefore needs no register of its own.
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
    shift = graph.nodes[node.operands[0]].frac - node.frac if node.op is Op.FLOOR else 0
    return value.shift_right(shift)


def _logic(graph: Graph, node: Node, wires: list[Value]) -> Value:
    """Value of a node from the wires of its operands; every intermediate result is exact."""
    operands = [wires[i] for i in node.operands]
    fracs = [graph.nodes[i].frac for i in node.operands]
    if node.op is Op.CONSTANT:
        return Const(node.parameter, shape_of(node))
    if node.op in {Op.ADD, Op.SUBTRACT}:
        a, b = _aligned(operands, fracs, node.frac)
        return a + b if node.op is Op.ADD else a - b
    if node.op is Op.SCALE:
        return operands[0] * Const(node.parameter)
    if node.op is Op.MULTIPLY:
        return operands[0] * operands[1]
    if node.op is Op.FLOOR:
        return operands[0].shift_right(fracs[0] - node.frac)
    if node.op is Op.TRUNCATE:
        shift = fracs[0] - node.frac
        return (operands[0] + Mux(operands[0] < 0, (1 << shift) - 1, 0)).shift_right(shift)
    if node.op is Op.FRACTION:
        return operands[0].as_unsigned()[: fracs[0] - node.parameter]
    if node.op is Op.CLAMP:
        low, high = Const(node.low), Const(node.high)
        return Mux(operands[0] < low, low, Mux(operands[0] > high, high, operands[0]))
    return operands[0]  # BOUND drops bits that are known to repeat the sign


def _aligned(operands: list[Value], fracs: list[int], frac: int) -> Iterator[Value]:
    return (operand.shift_left(frac - own) for operand, own in zip(operands, fracs, strict=True))
