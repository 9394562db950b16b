"""Which nodes of a chain of stages are the same signal, but for a delay, and what a signal is as a sum of others.

The C model stores and computes signals, not nodes: a floor of a delayed sum is the floor of that sum a sample earlier,
the second past input of a section is the second past output of the section before it, and a sum and what its floor
drops need no mask. Nothing is rounded otherwise than in the graph; only what is computed twice, or never used, goes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from sosmith.model.dataflow.graph import Graph, Node, Op

MOST_TERMS = 24
"""Terms of a sum from which on it gets a name of its own."""

_KEPT = {Op.SHIFT, Op.BOUND}
"""Operations that keep the code."""
_OF_VALUES = {Op.FLOOR, Op.FRACTION, Op.TRUNCATE, Op.CLAMP, Op.MULTIPLY}
"""Operations whose operands need a name, unlike those of sums."""
_SUMS = {Op.ADD, Op.SUBTRACT, Op.SCALE, Op.FRACTION, Op.CONSTANT}
"""Operations that are sums of signals."""


class Floor(NamedTuple):
    """The root of what is left of `of` without its lowest `bits`."""

    of: Root
    bits: int


Root = tuple[int, int] | Floor
"""A node by its stage and index, or a floor of a root."""


class Signal(NamedTuple):
    """A root, `delay` samples ago; 0 before the first sample."""

    root: Root
    delay: int


class Sum(NamedTuple):
    """A sum of signals times numbers, and of a number."""

    terms: dict[Signal, int]
    constant: int = 0

    def times(self, factor: int) -> Sum:
        """Multiply by a number."""
        if not factor:
            return Sum({})
        return Sum({each: value * factor for each, value in self.terms.items()}, self.constant * factor)

    def plus(self, other: Sum) -> Sum:
        """Add another one."""
        terms = dict(self.terms)
        for each, value in other.terms.items():
            terms[each] = terms.get(each, 0) + value
        return Sum({each: value for each, value in terms.items() if value}, self.constant + other.constant)


def signals_of(graphs: Sequence[Graph]) -> list[list[Signal]]:
    """Return the signal of each node of each stage of a chain."""
    chain: list[list[Signal]] = []
    for stage, graph in enumerate(graphs):
        entering = [chain[-1][i] for i in graphs[stage - 1].outputs] if stage else []
        chain.append(_Namer(stage, graph, entering).signals())
    return chain


class _Namer:
    """Gives the nodes of a stage their signals: a floor of 0 is 0, so that it may be taken before a delay or after."""

    def __init__(self, stage: int, graph: Graph, entering: Sequence[Signal]) -> None:
        self._stage, self._graph = stage, graph
        self._known = dict(zip(graph.inputs, entering, strict=False))

    def signals(self) -> list[Signal]:
        return [self._signal(index) for index in range(len(self._graph.nodes))]

    def _signal(self, index: int) -> Signal:
        path: list[int] = []
        place = index
        while place not in self._known:
            node = self._graph.nodes[place]
            if node.op not in _KEPT | {Op.FLOOR, Op.DELAY} or place in path:
                self._known[place] = Signal((self._stage, place), 0)
                break
            path.append(place)
            place = node.operands[0]
        for place in reversed(path):
            node = self._graph.nodes[place]
            of = self._known[node.operands[0]]
            if node.op is Op.DELAY:
                of = Signal(of.root, of.delay + 1)
            elif node.op is Op.FLOOR:
                of = Signal(Floor(of.root, self._graph.nodes[node.operands[0]].frac - node.frac), of.delay)
            self._known[place] = of
        return self._known[index]


def live_nodes(graphs: Sequence[Graph], more: Sequence[int]) -> list[set[int]]:
    """Return the nodes of each stage on which those of the last one depend that are in `more`."""
    live: list[set[int]] = [set() for _ in graphs]
    wanted = list(more)
    for stage in reversed(range(len(graphs))):
        graph, reached = graphs[stage], live[stage]
        while wanted:
            index = wanted.pop()
            if index not in reached:
                reached.add(index)
                wanted += graph.nodes[index].operands
        if stage:
            wanted = [graphs[stage - 1].outputs[k] for k, i in enumerate(graph.inputs) if i in reached]
    return live


class StageSums:
    """The nodes of a stage that are computed under a name, and what those are that are sums.

    Parameters
    ----------
    graph : Graph
    signals : sequence of Signal
        Those of its nodes.
    live : set of int
        The nodes that count.
    wanted : sequence of int
        Nodes that need a name in any case.
    expanded : bool
        Whether sums of sums are one sum, which is shorter; otherwise each node has a name.

    Attributes
    ----------
    sums : dict of Signal to Sum
        The named ones that are sums, in the order of their nodes.
    nodes : dict of Signal to int
        The node of each signal whose range is the narrowest.
    """

    def __init__(
        self, graph: Graph, signals: Sequence[Signal], live: set[int], wanted: Sequence[int], *, expanded: bool = True
    ) -> None:
        self._graph, self._signals, self._expanded = graph, signals, expanded
        self.nodes: dict[Signal, int] = {}
        for index, signal in enumerate(signals):
            if index in live and self._span(index) < self._span(self.nodes.get(signal)):
                self.nodes[signal] = index
        self._floors = {each for each in self.nodes if isinstance(each.root, Floor)}
        self._order = sorted(live)
        self._uses = Counter(
            self._base(i)
            for index in self._order
            if graph.nodes[index].op not in _KEPT
            for i in graph.nodes[index].operands
        )
        self._named = {self._base(index) for index in (wanted if expanded else self._order)}
        for index in self._order:
            node = graph.nodes[index]
            if node.op is Op.DELAY or (node.op in _OF_VALUES and self._factor_of(node) is None):
                self._named.update(map(self._base, node.operands))
        self._sums: dict[int, Sum] = {}
        for index in self._order:
            self._add(index)
        self.sums = {signals[index]: self._sums[index] for index in self._order if self._is_named_sum(index)}
        for signal, each in self.sums.items():
            self.sums[signal] = self._shorter(signal, each) if expanded else each

    def _span(self, index: int | None) -> float:
        return math.inf if index is None else self._graph.nodes[index].high - self._graph.nodes[index].low

    def _base(self, index: int) -> int:
        """Return the node whose code a node keeps."""
        while self._graph.nodes[index].op in _KEPT:
            index = self._graph.nodes[index].operands[0]
        return index

    def _is_sum(self, node: Node) -> bool:
        if node.op is Op.FRACTION:
            return self._expanded and self._floor_of(node) in self._floors
        return node.op in _SUMS or self._factor_of(node) is not None

    def _factor_of(self, node: Node) -> tuple[int, int] | None:
        """Return the operand and the factor of a product with a number; None if it is none."""
        if node.op is Op.SCALE:
            return node.operands[0], node.parameter
        if node.op is Op.MULTIPLY:
            for one, other in (node.operands, node.operands[::-1]):
                factor = self._graph.nodes[self._base(other)]
                if factor.op is Op.CONSTANT:
                    return one, factor.parameter
        return None

    def _floor_of(self, node: Node) -> Signal:
        """Return what is left of what a FRACTION takes away from."""
        of = self._signals[node.operands[0]]
        return Signal(Floor(of.root, self._graph.nodes[node.operands[0]].frac - node.parameter), of.delay)

    def _is_named_sum(self, index: int) -> bool:
        return index in self._named and index == self._base(index) and self._is_sum(self._graph.nodes[index])

    def _add(self, index: int) -> None:
        node = self._graph.nodes[index]
        if node.op in _KEPT:
            return
        if not self._is_sum(node):
            self._sums[index] = Sum({self._signals[index]: 1})
            return
        self._sums[index] = each = self._sum(node)
        long = len(each.terms) > MOST_TERMS
        if long or (self._uses[index] > 1 and len(each.terms) > 1):
            self._named.add(index)

    def _sum(self, node: Node) -> Sum:
        operands = [self._graph.nodes[i] for i in node.operands]
        if node.op is Op.CONSTANT:
            return Sum({}, node.parameter)
        if node.op is Op.FRACTION:
            floor = self._floor_of(node)
            assert isinstance(floor.root, Floor)
            return self._term(node.operands[0]).plus(Sum({floor: -1 << floor.root.bits}))
        if (scaled := self._factor_of(node)) is not None:
            index, factor = scaled
            term = self._term(index)
            size = abs(factor)
            if len(term.terms) > 1 and size & (size - 1):
                self._named.add(self._base(index))
                term = self._term(index)
            return term.times(factor)
        left, right = (
            self._term(i).times(1 << node.frac - operand.frac)
            for i, operand in zip(node.operands, operands, strict=True)
        )
        return left.plus(right if node.op is Op.ADD else right.times(-1))

    def _term(self, index: int) -> Sum:
        """Return what an operand adds to a sum: its own terms, or itself where it has a name."""
        base = self._base(index)
        if base in self._named and self._graph.nodes[base].op is not Op.CONSTANT:
            return Sum({self._signals[base]: 1})
        return self._sums[base]

    def _shorter(self, signal: Signal, whole: Sum) -> Sum:
        """Write terms that are a multiple of a named sum as that multiple."""
        for part in list(whole.terms):
            inner = self.sums.get(part)
            if part == signal or inner is None or len(inner.terms) < 2 or inner.constant:
                continue
            first = next(iter(inner.terms))
            factor, left = divmod(whole.terms.get(first, 0), inner.terms[first])
            if factor and not left and all(whole.terms.get(k) == factor * v for k, v in inner.terms.items()):
                whole = whole.plus(inner.times(-factor)).plus(Sum({part: factor}))
        return whole
