"""A dataflow graph as logic spread over pipeline stages: what `PipelinedStage` and `InterleavedStage` share.

Each node is computed in one pipeline stage. A value that a later one needs passes through a register for each pipeline
stage in between, made when it is first asked for::

    pipeline stage 0      takes[0]      pipeline stage 1      takes[1]      pipeline stage 2

    i0 --+--> node a ---->[a_passed1]------------------------>[a_passed2]-----> node c
         |                                                                        ^
         +--> node b ---->[b_passed1]-----> node d ---------->[d_passed2]---------+

Every signal is as wide as the range of its node asks, and signed only if that holds negative codes; a sum has no bits
above those that are used of it. Intermediate results are exact, but for bits above; other bits are dropped only by
FLOOR, TRUNCATE and FRACTION. What is added below all bits of a number is put there without an adder.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from types import MappingProxyType

from amaranth.hdl import Cat, Const, Module, Mux, Shape, Signal, Value
from amaranth.lib.wiring import Component

from sosmith.hdl.adders import multiples
from sosmith.hdl.constant_banks import Pair, chosen
from sosmith.hdl.plan.used_bits import used_bits
from sosmith.model.dataflow.adder_graph import by_operand
from sosmith.model.dataflow.graph import Graph, Node, Op


def shape_of(node: Node) -> Shape:
    """Shape that holds the range of `node`: unsigned if it cannot be negative."""
    return Shape(node.width, signed=node.signed)


_NO_WORDS: Mapping[int, Value] = MappingProxyType({})


class PipelinedLogic:
    """Signals for the nodes of a graph, each in its pipeline stage, and the registers that pass values on.

    The caller drives the signals of DELAY nodes.

    Parameters
    ----------
    m : Module
        Module that the logic is added to.
    graph : Graph
        What is computed.
    pipeline_stages : sequence of int
        Pipeline stage of each node.
    constants : dict of int to Pair
        Constants that come from one of two banks, by node.
    banks : sequence of Value
        Bank of the sample in each pipeline stage.
    takes : sequence of Value
        Whether the registers behind each pipeline stage are loaded at this clock.
    valid : sequence of Value
        Whether each pipeline stage holds a sample; asked where one uses a state that belongs to a later one.
    adders : collection of int
        Products by constants that are made of adders, see `sosmith.hdl.adders`.
    words : dict of int to Value
        What stands for the signals of some DELAY nodes, by node.
    kept : collection of int
        Nodes whose signals hold the same sample's values in all pipeline stages, and are not passed on.
    factors : dict of int to Value
        Constants of products that come from elsewhere, by node.

    Attributes
    ----------
    names : list of str
        Names of the nodes' signals.
    wires : list of Value
        Value of each node in its own pipeline stage, once `connect` has been called.
    """

    def __init__(
        self,
        m: Module,
        graph: Graph,
        pipeline_stages: Sequence[int],
        *,
        constants: Mapping[int, Pair],
        banks: Sequence[Value],
        takes: Sequence[Value],
        valid: Sequence[Value],
        adders: Collection[int] = (),
        words: Mapping[int, Value] = _NO_WORDS,
        kept: Collection[int] = (),
        factors: Mapping[int, Value] = _NO_WORDS,
    ) -> None:
        self._m, self._graph, self._pipeline_stages = m, graph, pipeline_stages
        self._constants, self._banks, self._takes, self._valid = constants, banks, takes, valid
        self._passed: dict[tuple[int, int], Value] = {}
        self._adders, self._words = adders, words
        self._kept, self._factors = kept, factors
        self._multiples: dict[int, Value] = {}
        self._used = used_bits(graph)
        self._awaited: dict[int, Signal] = {}
        self.names = unique_names(graph)
        self.wires: list[Value] = []

    def at(self, index: int, pipeline_stage: int) -> Value:
        """Value of a node for the sample in `pipeline_stage`."""
        node, own = self._graph.nodes[index], self._pipeline_stages[index]
        if node.op is Op.CONSTANT and index in self._constants:
            return chosen(self._constants[index], self._banks[pipeline_stage])
        if own == pipeline_stage or node.op is Op.CONSTANT or index in self._kept:
            return self.wires[index]
        if own > pipeline_stage:
            # A state that is updated in a later pipeline stage: if the sample before is still there, the update is due.
            return Mux(self._valid[own], self._following(index), self.wires[index])
        if node.op in {Op.FLOOR, Op.FRACTION} and self._is_state_of(node.operands[0], pipeline_stage):
            return logic(self._graph, node, [self.wires[node.operands[0]]])
        if (index, pipeline_stage) not in self._passed:
            register = Signal(self._shape(index), name=f"{self.names[index]}_passed{pipeline_stage}", reset_less=True)
            self._passed[index, pipeline_stage] = register
            before = self.at(index, pipeline_stage - 1)  # may make another register, which loads by its own rule
            with self._m.If(self._takes[pipeline_stage - 1]):
                self._m.d.sync += register.eq(before)
        return self._passed[index, pipeline_stage]

    def _following(self, index: int) -> Value:
        """Next value of a state, which may be yet to be made."""
        source = self._graph.nodes[index].operands[0]
        if source < len(self.wires):
            return self.wires[source]
        if source not in self._awaited:
            self._awaited[source] = Signal(self._shape(source), name=f"{self.names[index]}_next")
        return self._awaited[source]

    def connect(self, inputs: Sequence[Value], apart: Collection[int] = ()) -> None:
        """Make the logic of all nodes from the values of the inputs; synthesis must not merge the nodes in `apart`."""
        given = iter(inputs)
        for index, (node, name) in enumerate(zip(self._graph.nodes, self.names, strict=True)):
            own = self._pipeline_stages[index]
            if node.op is Op.INPUT:
                self.wires.append(next(given))
            elif index in self._words:
                self.wires.append(self._words[index])
            elif node.op is Op.SHIFT or self._is_once(index):  # the same code
                self.wires.append(self.at(node.operands[0], own))
            else:
                wire = Signal(self._shape(index), name=name, attrs={"keep": 1} if index in apart else {})
                if node.op is not Op.DELAY:
                    pair = self._constants.get(index)
                    factor = self._factors.get(index) if pair is None else chosen(pair, self._banks[own])
                    operands = [self.at(i, own) for i in node.operands]
                    of_adders = index in self._adders
                    value = self._multiple(index) if of_adders else logic(self._graph, node, operands, factor)
                    self._m.d.comb += wire.eq(value)
                self.wires.append(wire)
        self._m.d.comb += [awaited.eq(self.wires[source]) for source, awaited in self._awaited.items()]

    def _is_state_of(self, index: int, pipeline_stage: int) -> bool:
        """Whether a node is a state in its own pipeline stage, so that bits of it take no registers of their own."""
        return self._graph.nodes[index].op is Op.DELAY and self._pipeline_stages[index] == pipeline_stage

    def _shape(self, index: int) -> Shape:
        """Shape of a node's signal: of a sum, as many bits as are used, which may not hold its range."""
        node = self._graph.nodes[index]
        return Shape(self._used[index], signed=node.signed) if node.op in {Op.ADD, Op.SUBTRACT} else shape_of(node)

    def _is_once(self, index: int) -> bool:
        """Whether a node is a product by the constant 1, whose name would else compete with that of its operand."""
        node = self._graph.nodes[index]
        loaded = index in self._constants or index in self._factors
        return node.op is Op.SCALE and node.parameter == 1 and not loaded

    def _multiple(self, index: int) -> Value:
        """Product by a constant from adders, made with those of its operand in the same pipeline stage."""
        if index not in self._multiples:
            own, nodes = self._pipeline_stages[index], self._graph.nodes
            together = [i for i in self._adders if self._pipeline_stages[i] == own]
            operand, products = next(group for group in by_operand(self._graph, together) if index in group[1])
            constants = [nodes[i].parameter for i in products]
            name = self.names[operand] if own == self._pipeline_stages[operand] else f"{self.names[operand]}_in{own}"
            values = multiples(self._m, self.at(operand, own), nodes[operand].range, constants, name)
            self._multiples |= dict(zip(products, values, strict=True))
        return self._multiples[index]


def banks_in_use(valid: Sequence[Value], banks: Sequence[Value]) -> Value:
    """Return two bits: whether a valid sample uses the first bank, and the second."""
    inside = list(zip(valid, banks, strict=True))
    first, second = (Cat(*(there & (own == bank) for there, own in inside)).any() for bank in (0, 1))
    return Cat(first, second)


def unique_names(graph: Graph) -> list[str]:
    """Return a signal name for each node: its own, with its index added if that is missing or taken.

    A node without a name that another one only takes bits off, and that is no state, is the exact value of that.
    """
    labels = [node.name for node in graph.nodes]
    for index, node in reversed(list(enumerate(graph.nodes))):
        if node.op in _CUTS and labels[index]:
            operand = node.operands[0]
            if not labels[operand] and graph.nodes[operand].op is not Op.DELAY:
                labels[operand] = f"{labels[index].removesuffix('_exact')}_exact"
    seen: set[str] = set()
    names = []
    for index, (node, label) in enumerate(zip(graph.nodes, labels, strict=True)):
        name = label if label and label not in seen else f"{label or node.op.value}_{index}"
        seen.add(name)
        names.append(name)
    return names


_CUTS = frozenset({Op.BOUND, Op.FLOOR, Op.TRUNCATE, Op.CLAMP})
"""Operations that take bits off their operand."""


def name_ports(stage: Component, graph: Graph) -> list[str]:
    """Give the inputs of a stage the names of their nodes, which its module shows; return those of its outputs."""
    names = unique_names(graph)
    for k, index in enumerate(graph.inputs):
        getattr(stage, f"i{k}").name = names[index]
    return [names[index] for index in graph.outputs]


def logic(graph: Graph, node: Node, operands: list[Value], factor: Value | None = None) -> Value:
    """Value of a node from the values of its operands; every intermediate result is exact.

    `factor` replaces the constant that a SCALE multiplies by.
    """
    fracs = [graph.nodes[i].frac for i in node.operands]
    if node.op is Op.CONSTANT:
        return Const(node.parameter, shape_of(node))
    if node.op in {Op.ADD, Op.SUBTRACT}:
        joined = _joined(operands, fracs, node) if node.op is Op.ADD else None
        if joined is not None:
            return joined
        a, b = _aligned(operands, fracs, node.frac)
        return a + b if node.op is Op.ADD else a - b
    if node.op is Op.SCALE:
        return operands[0] * (Const(node.parameter) if factor is None else factor)
    if graph.is_gate(node):
        bit, other = sorted(operands, key=len)
        return Mux(bit, other, 0)
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
        below, above = limits(node, operands[0])
        return Mux(below, Const(node.low), Mux(above, Const(node.high), operands[0]))
    return operands[0]  # BOUND drops bits that are known to repeat the sign


def limits(node: Node, operand: Value) -> tuple[Value, Value]:
    """Return whether the operand of a CLAMP is below its range, and whether it is above.

    If the range ends at a power of two, the upper bits of the operand tell; otherwise it takes a comparison.
    """
    low, high = node.low, node.high
    bits = high.bit_length()
    value = operand if operand.shape().signed else Cat(operand, Const(0, 1)).as_signed()
    top = value[-1]
    below: Value = value < Const(low)
    above: Value = value > Const(high)
    if len(value) > bits + 1 and high == (1 << bits) - 1:
        above = ~top & value[bits:-1].any()
        if low in {0, -high - 1}:
            below = top if low == 0 else top & ~value[bits:-1].all()
    return below, above


def _joined(operands: list[Value], fracs: list[int], node: Node) -> Value | None:
    """Return a sum whose one operand, never negative, has all its bits below those of the other; else None."""
    for upper, lower in ((0, 1), (1, 0)):
        a, b = operands[upper], operands[lower]
        zeros, low = node.frac - fracs[upper], node.frac - fracs[lower]
        if not b.shape().signed and low + len(b) <= zeros:
            sum_of_both = Cat(Const(0, low), b, Const(0, zeros - low - len(b)), a)
            return sum_of_both.as_signed() if a.shape().signed else sum_of_both
    return None


def _aligned(operands: list[Value], fracs: list[int], frac: int) -> Iterator[Value]:
    return (operand.shift_left(frac - own) for operand, own in zip(operands, fracs, strict=True))
