"""One stage of a datapath in hardware: its dataflow graph as combinational logic, its state, one or two register ranks.

Where a stage has a recursion, what only feeds it has a rank of its own: the sums and products of the input alone are
registered before they enter the loop, whose delay then is all that limits the clock.
"""

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


def rank_count(graph: Graph) -> int:
    """Register ranks of a stage: 2 where arithmetic feeds a recursion, else 1."""
    loop = _recursive(graph)
    feeds = (i for i, node in enumerate(graph.nodes) if i not in loop and node.op not in _PLAIN)
    return 2 if loop and any(feeds) else 1


_PLAIN = {Op.INPUT, Op.CONSTANT, Op.DELAY, Op.SHIFT, Op.FLOOR, Op.FRACTION, Op.BOUND}
"""What takes no time in hardware."""


def _recursive(graph: Graph) -> set[int]:
    """Nodes that depend on a state which depends on itself."""
    reached: list[set[int]] = []  # for each node the delays it depends on, through any number of samples
    delays = graph.delays
    sources = {delay: set[int]() for delay in delays}
    while True:
        reached = []
        for index, node in enumerate(graph.nodes):
            if node.op is Op.DELAY:
                reached.append({index} | sources[index])
            else:
                reached.append(set().union(*(reached[i] for i in node.operands)))
        found = {delay: reached[graph.nodes[delay].operands[0]] for delay in delays}
        if found == sources:
            break
        sources = found
    loop = {delay for delay in delays if delay in sources[delay]}
    return {index for index, depends in enumerate(reached) if depends & loop}


class PipelineStage(wiring.Component):
    """A stage that takes a sample at every clock at which the pipeline advances.

    Latency: `rank_count` of its graph in clocks of the pipeline. Throughput: one sample per clock.

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
        names = _unique_names(graph)
        takes, valid = self._ranks(m)
        later = _recursive(graph) if len(takes) > 1 else set[int]()
        last = len(takes) - 1
        wires: list[Value] = []
        across: dict[int, Signal] = {}

        def in_last_rank(index: int) -> Value:
            """Value of a node in the last rank: registered if it comes from the one before."""
            if last == 0 or index in later or graph.nodes[index].op is Op.CONSTANT:
                return wires[index]
            if index not in across:
                across[index] = Signal(shape_of(graph.nodes[index]), name=f"{names[index]}_across", reset_less=True)
                with m.If(takes[0]):
                    m.d.sync += across[index].eq(wires[index])
            return across[index]

        def seen(user: int, operand: int) -> Value:
            """Value of an operand in the rank of the node that uses it."""
            return in_last_rank(operand) if user in later else wires[operand]

        inputs = iter([getattr(self, f"i{k}") for k in range(len(graph.inputs))])
        for index, (node, name) in enumerate(zip(graph.nodes, names, strict=True)):
            if node.op is Op.INPUT:
                wires.append(next(inputs))
                continue
            if node.op is Op.SHIFT:  # the same code
                wires.append(seen(index, node.operands[0]))
                continue
            wire = Signal(shape_of(node), name=name)
            if node.op is not Op.DELAY:
                m.d.comb += wire.eq(_logic(graph, node, [seen(index, i) for i in node.operands]))
            wires.append(wire)
        for i in graph.delays:
            with m.If(takes[last if i in later else 0]):
                m.d.sync += wires[i].eq(seen(i, graph.nodes[i].operands[0]))
        with m.If(self.advance):
            m.d.sync += self.o_valid.eq(valid)
        for k, i in enumerate(graph.outputs):
            output = getattr(self, f"o{k}")
            held = _held(graph, i, wires) if last == 0 or i in later else None
            if held is not None:
                m.d.comb += output.eq(held)
            else:
                register = Signal(shape_of(graph.nodes[i]), name=f"{names[i]}_register", reset_less=True)
                m.d.comb += output.eq(register)
                with m.If(takes[last]):
                    m.d.sync += register.eq(in_last_rank(i))
        return m

    def _ranks(self, m: Module) -> tuple[list[Value], Value]:
        """When each rank takes a sample, and whether the last one holds one to take."""
        takes: list[Value] = []
        valid: Value = self.i_valid
        for rank in range(rank_count(self.stage.graph)):
            if rank:
                passed = Signal(name="valid_across")
                with m.If(self.advance):
                    m.d.sync += passed.eq(valid)
                valid = passed
            take = Signal(name=f"take{rank}")
            m.d.comb += take.eq(self.advance & valid)
            takes.append(take)
        return takes, valid


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


def _logic(graph: Graph, node: Node, operands: list[Value]) -> Value:
    """Value of a node from those of its operands; every intermediate result is exact."""
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
