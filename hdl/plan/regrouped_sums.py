"""Sums in loops in an order in which what is there early is added early, so that a loop takes the fewest additions.

As an example, the product of a state by a constant that has more than a multiplier block takes is three terms, of which
one is the state itself. What comes from the input, `x`, is there before::

    x - (upper + (lower + state))     takes three additions after the state, two of them behind the product
    (x - state) - (upper + lower)     takes two behind the product, and the first is made beside it

All of it is exact.

>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> g = GraphBuilder()
>>> x, state = g.input("x", 0, -9, 9), g.delay("state", 0, -99, 99)
>>> product = g.scale(state, 3, 2)
>>> total = g.floor(g.bound(g.subtract(x, g.add(product, state)), -99 * 4, 99 * 4), 0)
>>> g.connect(state, total)
>>> graph = g.build([total])
>>> other = regrouped(graph)
>>> [(node.op.value, node.operands) for node in other.nodes if node.op in _SUMS]
[('subtract', (0, 1)), ('subtract', (3, 2))]
>>> other.run([[5, -7, 9]]) == graph.run([[5, -7, 9]])
True
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence, Set
from typing import NamedTuple

from sosmith.hdl.plan.pipeline import loop_delays, operation_time, recursive
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op, Wire

_SUMS = frozenset({Op.ADD, Op.SUBTRACT})


class _Term(NamedTuple):
    """A term of a sum: when it is there, its place among all terms, sums first, its sign, and its wire."""

    time: float
    place: int
    sign: int
    wire: Wire


def regrouped(graph: Graph) -> Graph:
    """Return the graph with the sums in its loops regrouped; the time is that since the newest state."""
    return with_places(graph, recursive(graph), _times(graph, loop_delays(graph)))[0]


def with_places(graph: Graph, inside: Set[int], times: Sequence[float]) -> tuple[Graph, list[int]]:
    """Return the graph with the sums `inside` regrouped, and where each node of the first is in it.

    `times` says when the value of each node is there, in additions. A sum that is part of a larger one has none, -1.
    """
    parts = _parts_of_sums(graph, inside)
    g = GraphBuilder()
    wires: list[Wire] = []
    for index, node in enumerate(graph.nodes):
        if index in parts:
            wires.append(Wire(-1))  # of a larger sum, which stands for it
        elif node.op in _SUMS and index in inside:
            terms = [(sign, wires[i], times[i]) for sign, i in _terms(graph, index, parts)]
            total = _added_up(g, terms)
            wires.append(g.named(total, node.name) if node.name else total)
        else:
            wires.append(g.copied(node, [] if node.op is Op.DELAY else [wires[i] for i in node.operands]))
    for i in graph.delays:
        g.connect(wires[i], wires[graph.nodes[i].operands[0]])
    return g.build([wires[i] for i in graph.outputs]), [int(wire) for wire in wires]


def _parts_of_sums(graph: Graph, inside: Set[int]) -> set[int]:
    """Return the sums, and what states their ranges, that nothing uses but one other sum."""
    users: dict[int, list[int]] = {}
    for index, node in enumerate(graph.nodes):
        for i in node.operands:
            users.setdefault(i, []).append(index)
    parts: set[int] = set()
    for index in sorted(inside - {*graph.outputs}, reverse=True):
        node = graph.nodes[index]
        used = users.get(index, [])
        is_sum = node.op in _SUMS or (node.op is Op.BOUND and graph.nodes[node.operands[0]].op in _SUMS)
        if is_sum and len(used) == 1 and (graph.nodes[used[0]].op in _SUMS or used[0] in parts):
            parts.add(index)
    return parts


def _terms(graph: Graph, index: int, parts: set[int]) -> list[tuple[int, int]]:
    """Return what a sum adds up, each with its sign."""
    terms: list[tuple[int, int]] = []
    pending = [(1, index)]
    while pending:
        sign, at = pending.pop()
        node = graph.nodes[at]
        if at != index and at not in parts:
            terms.append((sign, at))
        elif node.op is Op.SUBTRACT:
            pending += [(sign, node.operands[0]), (-sign, node.operands[1])]
        else:
            pending += [(sign, i) for i in node.operands]
    return terms


def _times(graph: Graph, loops: frozenset[int]) -> list[float]:
    """Return when each value is there after the newest state, in additions, of which a product takes the time of one.

    Older states can be read before it, and what no state leads to is there long before.
    """
    used = {i for index, node in enumerate(graph.nodes) if index not in loops for i in node.operands} & loops
    ages = {i: graph.undelayed(i)[1] for i in used}
    newest = min(ages.values(), default=0)
    times: list[float] = []
    for index, node in enumerate(graph.nodes):
        if index in loops:
            times.append(0 if ages.get(index) == newest else min(0, 2 - newest))
        else:
            before = max((times[i] for i in node.operands if node.op is not Op.DELAY), default=-math.inf)
            times.append(before + (operation_time(graph, node, powers=True) > 0))
    return times


def _added_up(g: GraphBuilder, terms: list[tuple[int, Wire, float]]) -> Wire:
    """Add up terms, always the two that are there first; of those of the same moment, sums made here."""
    left = [_Term(time, place, sign, wire) for place, (sign, wire, time) in enumerate(terms)]
    heapq.heapify(left)
    for place in range(1 - len(terms), 0):
        one, other = heapq.heappop(left), heapq.heappop(left)
        if one.sign == other.sign:
            sign, wire = one.sign, g.add(one.wire, other.wire)
        else:
            plus, minus = (one, other) if one.sign > 0 else (other, one)
            sign, wire = 1, g.subtract(plus.wire, minus.wire)
        heapq.heappush(left, _Term(max(one.time, other.time) + 1, place, sign, wire))
    (total,) = left
    return total.wire if total.sign > 0 else g.subtract(g.constant(0, 0), total.wire)
