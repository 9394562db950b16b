"""How the graph of a section fits a longer one, whose hardware computes it too.

The nodes of the shorter graph are found among those of the longer one from the output back. What the shorter one lacks
may be there if it changes nothing: a FLOOR whose operand has no bits to drop; what such a FLOOR drops, which is 0; and
a product or a constant that is added, which then is 0::

    longer     y = floor(x + c2 * x2 + half)             with 3 fraction bits
    shorter    y = x                                     of 2 fraction bits: c2 = 0, half = 0, nothing is dropped
"""

from __future__ import annotations

from dataclasses import dataclass, field

from sosmith.model.dataflow.graph import Graph, Node, Op

_EQUAL_FRAC = frozenset({Op.FLOOR, Op.TRUNCATE})
"""Operations whose fraction bits have to be the same, as they decide what is dropped."""

_EQUAL_PARAMETER = frozenset({Op.SHIFT, Op.FRACTION})


@dataclass(frozen=True)
class Fit:
    """What nodes of a longer graph are in a shorter one.

    Attributes
    ----------
    values : dict of int to int
        The node of the shorter graph whose value each node of the longer one has, where it has one.
    zeros : frozenset of int
        Nodes of the longer graph that are 0.
    """

    values: dict[int, int]
    zeros: frozenset[int]


def fit(longer: Graph, shorter: Graph) -> Fit | None:
    """Find a section's graph in a longer one; None if it is not there."""
    search = _Search(longer, shorter)
    ends = zip((*longer.outputs, *longer.inputs), (*shorter.outputs, *shorter.inputs), strict=True)
    if not all(search.same(long, short) for long, short in ends) or not search.is_whole():
        return None
    return Fit(search.values, frozenset(search.zeros))


@dataclass
class _Search:
    """What has been found so far."""

    longer: Graph
    shorter: Graph
    values: dict[int, int] = field(default_factory=dict)
    zeros: set[int] = field(default_factory=set)

    def same(self, long: int, short: int) -> bool:
        """Whether a node of the longer graph can have the value of one of the shorter graph; find all that follows."""
        if long in self.values:
            return self.values[long] == short
        if long in self.zeros:
            return False
        before = dict(self.values), set(self.zeros)
        self.values[long] = short
        for way in (self._alike, self._without_bits_to_drop, self._without_an_operand):
            if way(self.longer.nodes[long], long, short):
                return True
            self.values, self.zeros = {**before[0], long: short}, set(before[1])
        self.values, self.zeros = before
        return False

    def _alike(self, node: Node, _long: int, short: int) -> bool:
        """Whether both are the same operation of the same operands."""
        other = self.shorter.nodes[short]
        if node.op is not other.op or (node.op is Op.DELAY and node.name != other.name):
            return False
        if (node.op in _EQUAL_FRAC and node.frac != other.frac) or (
            node.op in _EQUAL_PARAMETER and node.parameter != other.parameter
        ):
            return False
        return all(self.same(*pair) for pair in zip(node.operands, other.operands, strict=True))

    def _without_bits_to_drop(self, node: Node, _long: int, short: int) -> bool:
        """Whether a node passes its operand on as it is, so that the shorter graph may lack it."""
        floors = node.op is Op.FLOOR and self.shorter.nodes[short].frac <= node.frac
        return (floors or node.op is Op.BOUND) and self.same(node.operands[0], short)

    def _without_an_operand(self, node: Node, _long: int, short: int) -> bool:
        """Whether a sum has one operand alone in the shorter graph, the other one being 0."""
        if node.op not in {Op.ADD, Op.SUBTRACT}:
            return False
        first, second = node.operands
        before = dict(self.values), set(self.zeros)
        for kept, dropped in ((first, second), (second, first))[: 1 + (node.op is Op.ADD)]:
            if self._is_zero(dropped) and self.same(kept, short):
                return True
            self.values, self.zeros = dict(before[0]), set(before[1])
        return False

    def _is_zero(self, long: int) -> bool:
        """Whether a node of the longer graph can be 0; find what must be for that."""
        if long in self.values:
            return False
        node = self.longer.nodes[long]
        if node.op in {Op.FLOOR, Op.SHIFT, Op.BOUND}:
            if not self._is_zero(node.operands[0]):
                return False
        elif node.op is Op.DELAY:
            if self.longer.nodes[node.operands[0]].op is not Op.FRACTION:
                return False
        elif node.op not in {Op.CONSTANT, Op.SCALE, Op.FRACTION}:
            return False
        self.zeros.add(long)
        return True

    def is_whole(self) -> bool:
        """Whether all states are there, and what has to be 0 is: what nothing is dropped of."""
        states = {index for index in self.shorter.delays if index not in self.values.values()}
        fractions = {
            self.longer.nodes[index].operands[0] if self.longer.nodes[index].op is Op.DELAY else index
            for index in self.zeros
            if self.longer.nodes[index].op in {Op.DELAY, Op.FRACTION}
        }
        return not states and all(self._drops_nothing(self.longer.nodes[index]) for index in fractions)

    def _drops_nothing(self, fraction: Node) -> bool:
        (of,) = fraction.operands
        return of in self.values and self.shorter.nodes[self.values[of]].frac <= fraction.parameter
