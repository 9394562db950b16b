"""A dataflow graph as logic in register ranks: what stages of one channel and of several have in common."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

from amaranth.hdl import Cat, Const, Module, Mux, Shape, Signal, Value

from sosmith.hdl.constant_banks import Pair, chosen
from sosmith.model.dataflow.graph import Graph, Node, Op


def shape_of(node: Node) -> Shape:
    """Shape that holds the range of `node`: unsigned where it cannot be negative."""
    return Shape(node.width, signed=node.signed)


class RankedLogic:
    """Wires for the nodes of a graph, each in the rank that computes it, and registers that hand them on.

    What a DELAY holds is left to the caller, who drives its wire.

    Parameters
    ----------
    m : Module
        Where the logic goes.
    graph : Graph
        What is computed.
    ranks : sequence of int
        Rank of each node.
    constants : dict of int to Pair
        Constants that come from one of two banks, by their nodes.
    banks : sequence of Value
        Bank of the sample that each rank is about.
    takes : sequence of Value
        Whether the registers behind each rank are loaded at this clock.
    valid : sequence of Value
        Whether each rank is about a sample; asked where a rank takes the state of a later one.

    Attributes
    ----------
    names : list of str
        Names of the nodes' signals.
    wires : list of Value
        Values of the nodes in their own ranks, once `connect` has been called.
    """

    def __init__(
        self,
        m: Module,
        graph: Graph,
        ranks: Sequence[int],
        *,
        constants: Mapping[int, Pair],
        banks: Sequence[Value],
        takes: Sequence[Value],
        valid: Sequence[Value],
    ) -> None:
        self._m, self._graph, self._ranks = m, graph, ranks
        self._constants, self._banks, self._takes, self._valid = constants, banks, takes, valid
        self._passed: dict[tuple[int, int], Value] = {}
        self.names = unique_names(graph)
        self.wires: list[Value] = []

    def at(self, index: int, rank: int) -> Value:
        """Value of a node as a rank sees it that belongs to a sample at least as new."""
        node, own = self._graph.nodes[index], self._ranks[index]
        if node.op is Op.CONSTANT and index in self._constants:
            return chosen(self._constants[index], self._banks[rank])
        if own == rank or node.op is Op.CONSTANT:
            return self.wires[index]
        if own > rank:  # the loop may still be about the sample before, with all its states one sample behind
            return Mux(self._valid[own], self.wires[node.operands[0]], self.wires[index])
        if (index, rank) not in self._passed:
            register = Signal(shape_of(node), name=f"{self.names[index]}_passed{rank}", reset_less=True)
            self._passed[index, rank] = register
            with self._m.If(self._takes[rank - 1]):
                self._m.d.sync += register.eq(self.at(index, rank - 1))
        return self._passed[index, rank]

    def connect(self, inputs: Sequence[Value], apart: Collection[int] = ()) -> None:
        """Walk over the graph, given the values of its inputs; the nodes `apart` are kept as they are in synthesis."""
        given = iter(inputs)
        for index, (node, name) in enumerate(zip(self._graph.nodes, self.names, strict=True)):
            own = self._ranks[index]
            if node.op is Op.INPUT:
                self.wires.append(next(given))
            elif node.op is Op.SHIFT:  # the same code
                self.wires.append(self.at(node.operands[0], own))
            else:
                wire = Signal(shape_of(node), name=name, attrs={"keep": 1} if index in apart else {})
                if node.op is not Op.DELAY:
                    pair = self._constants.get(index)
                    factor = None if pair is None else chosen(pair, self._banks[own])
                    operands = [self.at(i, own) for i in node.operands]
                    self._m.d.comb += wire.eq(logic(self._graph, node, operands, factor))
                self.wires.append(wire)


def banks_in_use(valid: Sequence[Value], banks: Sequence[Value]) -> Value:
    """Return for each bank whether a sample that is there uses it."""
    inside = list(zip(valid, banks, strict=True))
    first, second = (Cat(*(there & (own == bank) for there, own in inside)).any() for bank in (0, 1))
    return Cat(first, second)


def unique_names(graph: Graph) -> list[str]:
    """Name every node's signal: by its own name, with the index where that is missing or taken."""
    seen: set[str] = set()
    names = []
    for index, node in enumerate(graph.nodes):
        name = node.name if node.name and node.name not in seen else f"{node.name or node.op.value}_{index}"
        seen.add(name)
        names.append(name)
    return names


def logic(graph: Graph, node: Node, operands: list[Value], factor: Value | None = None) -> Value:
    """Value of a node from those of its operands; every intermediate result is exact.

    `factor` is what a SCALE multiplies by, where that is not its parameter.
    """
    fracs = [graph.nodes[i].frac for i in node.operands]
    if node.op is Op.CONSTANT:
        return Const(node.parameter, shape_of(node))
    if node.op in {Op.ADD, Op.SUBTRACT}:
        a, b = _aligned(operands, fracs, node.frac)
        return a + b if node.op is Op.ADD else a - b
    if node.op is Op.SCALE:
        return operands[0] * (Const(node.parameter) if factor is None else factor)
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
    """Whether a CLAMP finds `operand` below its range, and above.

    Where an end of the range is that of so many bits, the bits above them tell; else a comparison does.
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


def _aligned(operands: list[Value], fracs: list[int], frac: int) -> Iterator[Value]:
    return (operand.shift_left(frac - own) for operand, own in zip(operands, fracs, strict=True))
