"""One stage of a datapath in hardware: its state, and its logic in one to three register ranks.

Where a stage has a recursion, only what depends on the newest sample that it remembers has to be done within a clock.
What depends on the input alone, and what depends on older samples, is done and registered a rank before; the delay
of the loop proper then is all that limits the clock.
"""

from __future__ import annotations

from collections.abc import Mapping

from amaranth.hdl import Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.constant_banks import NO_CONSTANTS, Pair
from sosmith.hdl.ranked_logic import RankedLogic, banks_in_use, limits, shape_of
from sosmith.model.dataflow.datapath import Stage
from sosmith.model.dataflow.graph import Graph, Node, Op

PLAIN = {Op.INPUT, Op.CONSTANT, Op.DELAY, Op.SHIFT, Op.FLOOR, Op.FRACTION, Op.BOUND}
"""What takes no time in hardware."""


def rank_count(graph: Graph) -> int:
    """Register ranks of a stage, 1 to 3."""
    return max(_ranks(graph)) + 1


def _ranks(graph: Graph) -> list[int]:
    """Rank of each node.

    What no recursion reaches comes first. Then comes what depends on a recursion only through states that are at
    least two samples old, so that it can be had a rank before it is needed; and last the rest of the loop.
    """
    loop = _recursive(graph)
    late = _late(graph, loop)
    ranks = [0] * len(graph.nodes)
    for part, whole in ((loop, set(range(len(ranks)))), (late, loop)):
        if part and any(graph.nodes[i].op not in PLAIN for i in whole - part):
            for i in part:
                ranks[i] += 1
    return ranks


def _known_early(graph: Graph, ranks: list[int]) -> set[int]:
    """Find sums without a product of their rank that are added to one with a product.

    They are kept apart in synthesis, which would else delay the product by adding up everything at once.
    """
    products: set[int] = set()
    for index, node in enumerate(graph.nodes):
        own = [i for i in node.operands if ranks[i] == ranks[index] and node.op is not Op.DELAY]
        if node.op in {Op.SCALE, Op.MULTIPLY} or products & set(own):
            products.add(index)
    return {
        i
        for index, node in enumerate(graph.nodes)
        if index in products and node.op in {Op.ADD, Op.SUBTRACT}
        for i in node.operands
        if i not in products and ranks[i] == ranks[index] and graph.nodes[i].op in {Op.ADD, Op.SUBTRACT}
    }


def _recursive(graph: Graph) -> set[int]:
    """Nodes that depend on a state which depends on itself."""
    sources = {delay: set[int]() for delay in graph.delays}
    while True:
        reached: list[set[int]] = []  # the delays that a node depends on, through any number of samples
        for index, node in enumerate(graph.nodes):
            own = {index} | sources[index] if node.op is Op.DELAY else set[int]()
            reached.append(own.union(*(reached[i] for i in node.operands if node.op is not Op.DELAY)))
        found = {delay: reached[graph.nodes[delay].operands[0]] for delay in graph.delays}
        if found == sources:
            break
        sources = found
    loop = {delay for delay in graph.delays if delay in sources[delay]}
    return {index for index, depends in enumerate(reached) if depends & loop}


def _late(graph: Graph, loop: set[int]) -> set[int]:
    """Nodes of the loop that depend on the newest of several samples that it remembers; all of it if it has but one."""
    late = {i for i in graph.delays if i in loop and graph.nodes[i].operands[0] in loop and _is_followed(graph, i)}
    if not late:
        return loop
    while more := {i for i in loop - late if any(_is_new(graph, i, k, late) for k in graph.nodes[i].operands)}:
        late |= more
    return late


def _is_new(graph: Graph, user: int, operand: int, late: set[int]) -> bool:
    """Whether what `user` takes from `operand` can be had in the last rank only."""
    return operand in late and not (_is_older(graph, operand) and graph.nodes[user].op is not Op.DELAY)


def _is_followed(graph: Graph, delay: int) -> bool:
    return any(graph.nodes[other].operands[0] == delay for other in graph.delays)


def _is_older(graph: Graph, index: int) -> bool:
    """Whether a node is a delay of another delay."""
    node = graph.nodes[index]
    return node.op is Op.DELAY and graph.nodes[node.operands[0]].op is Op.DELAY


class PipelineStage(wiring.Component):
    """A stage that takes a sample at every clock at which the pipeline advances.

    Latency: `rank_count` of its graph in clocks of the pipeline. Throughput: one sample per clock.

    Parameters
    ----------
    stage : Stage
        What it computes.
    constants : dict of int to Pair
        Constants that come from one of two banks, by their nodes.

    Members
    -------
    i0, i1, .. : In(shape)
        Input codes, in the order of the graph's inputs.
    i_valid : In(1)
        Whether the inputs hold a sample; without one, the state stays as it is.
    i_bank, o_bank, uses : In(1), Out(1), Out(2)
        Bank of the sample that comes in, and of the one that goes out; which banks samples inside use.
    advance : In(1)
        Whether the pipeline moves at this clock.
    o0, o1, .. : Out(shape)
        Output codes of the sample before; defined while `o_valid` is high.
    o_valid : Out(1)
        Whether the outputs hold a sample.
    o_saturated : Out(1)
        Whether the stage had to limit it.
    """

    def __init__(self, stage: Stage, constants: Mapping[int, Pair] = NO_CONSTANTS) -> None:
        self.stage = stage
        self.constants = constants
        graph = stage.graph
        members = {f"i{k}": In(shape_of(graph.nodes[i])) for k, i in enumerate(graph.inputs)}
        members |= {f"o{k}": Out(shape_of(graph.nodes[i])) for k, i in enumerate(graph.outputs)}
        members |= {"i_bank": In(1), "o_bank": Out(1), "uses": Out(2)}
        super().__init__({**members, "i_valid": In(1), "advance": In(1), "o_valid": Out(1), "o_saturated": Out(1)})

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        graph = self.stage.graph
        ranks = _ranks(graph)
        valid, takes, banks = self._control(m, max(ranks) + 1)
        apart = _known_early(graph, ranks)
        ranked = RankedLogic(m, graph, ranks, constants=self.constants, banks=banks, takes=takes, valid=valid)
        ranked.connect([getattr(self, f"i{k}") for k in range(len(graph.inputs))], apart)
        at, wires, names = ranked.at, ranked.wires, ranked.names
        for i in graph.delays:
            with m.If(takes[ranks[i]]):
                m.d.sync += wires[i].eq(at(graph.nodes[i].operands[0], ranks[i]))
        last = len(takes) - 1
        for k, i in enumerate(graph.outputs):
            output = getattr(self, f"o{k}")
            held = _held(graph, i, wires) if ranks[i] == last else None
            if held is not None:
                m.d.comb += output.eq(held)
            else:
                register = Signal(shape_of(graph.nodes[i]), name=f"{names[i]}_register", reset_less=True)
                m.d.comb += output.eq(register)
                with m.If(takes[last]):
                    m.d.sync += register.eq(at(i, last))
                    if graph.nodes[i].op is Op.CLAMP:
                        m.d.sync += self.o_saturated.eq(
                            Cat(*limits(graph.nodes[i], at(graph.nodes[i].operands[0], last))).any()
                        )
        return m

    def _control(self, m: Module, count: int) -> tuple[list[Value], list[Value], list[Value]]:
        """Return for each rank whether it is about a sample, whether it takes it at this clock, and its bank."""
        valid: list[Value] = [self.i_valid]
        banks: list[Value] = [self.i_bank]
        for rank in range(1, count + 1):
            valid.append(Signal(name=f"valid{rank}"))
            banks.append(Signal(name=f"bank{rank}", reset_less=True))
            with m.If(self.advance):
                m.d.sync += [valid[rank].eq(valid[rank - 1]), banks[rank].eq(banks[rank - 1])]
        takes: list[Value] = [Signal(name=f"take{rank}") for rank in range(count)]
        m.d.comb += [take.eq(self.advance & ready) for take, ready in zip(takes, valid, strict=False)]
        m.d.comb += [self.o_valid.eq(valid[-1]), self.o_bank.eq(banks[-1])]
        m.d.comb += self.uses.eq(banks_in_use(valid[:-1], banks[:-1]))
        return valid, takes, banks


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
