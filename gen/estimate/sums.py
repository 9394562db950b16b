"""Quantities of sums, with those that products by constants are made of.

Synthesis merges sums that only one other sum uses in the same pipeline stage, and adds up all their operands at once:
three by three without carries, in two LUT4 a bit, until two are left for a chain of carries. A constant is an operand
as well, though what adds it is simpler.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from sosmith.gen.estimate.pipelined import SUMS, Pipelined
from sosmith.gen.estimate.quantities import Quantities
from sosmith.model.dataflow.adder_graph import Adder, adder_bits, adder_graph, by_operand, multiple_range, odd_part
from sosmith.model.dataflow.graph import Graph, Node, Op


class _Added(NamedTuple):
    """What is added up: its lowest bit, the bit behind its highest, and whether it is subtracted."""

    low: int
    end: int
    signed: bool
    negative: bool = False
    constant: bool = False


class _Last(NamedTuple):
    """The last sum of a product by a constant that no other product uses, and what it adds up: lowest bit and width."""

    bits: int
    operands: tuple[tuple[int, int], ...]


def of_sums(plan: Pipelined) -> Quantities:
    """Count all sums of a stage."""
    made: Quantities = Counter()
    last = dict(_last_sums(plan, made))
    for index in range(len(plan.graph.nodes)):
        if _is_sum(plan, index):
            if not _is_taken(plan, index):
                made += _of_added(list(_added(plan, index, last)), plan.width(index))
        elif index in last and not _is_taken(plan, index):
            made["sums"] += last[index].bits
    return made


def _last_sums(plan: Pipelined, made: Quantities) -> Iterator[tuple[int, _Last]]:
    """Yield the last sum of each product by a constant, and add all others to `made`."""
    nodes = plan.graph.nodes
    for operand, group in by_operand(plan.graph, plan.adders):
        low, high = nodes[operand].range[1:]
        sums = adder_graph(tuple(nodes[index].parameter for index in group))
        used = {term[0] for each in sums for term in (each.left, each.right)}
        last = {each.multiple: each for number, each in enumerate(sums, 1) if number not in used}
        made["sums"] += adder_bits([each for each in sums if each.multiple not in last], low, high)
        multiples = [1, *(each.multiple for each in sums)]
        for index in group:
            multiple, shift = odd_part(nodes[index].parameter)
            if multiple in last:
                yield index, _last_sum(last.pop(multiple), multiples, shift, (low, high))


def _last_sum(adder: Adder, multiples: Sequence[int], shift: int, ends: tuple[int, int]) -> _Last:
    terms = []
    for number, place in (adder.left, adder.right):
        least, most = multiple_range(multiples[number], *ends)
        bits = max((least if least >= 0 else ~least).bit_length(), most.bit_length()) + (least < 0)
        terms.append((shift + place, bits))
    return _Last(adder_bits([adder], *ends), tuple(terms))


def _is_sum(plan: Pipelined, index: int) -> bool:
    return plan.graph.nodes[index].op in SUMS and not _is_concatenation(plan.graph, plan.graph.nodes[index])


def _is_taken(plan: Pipelined, index: int) -> bool:
    """Say whether synthesis merges a sum with the one that uses it."""
    user = next(iter(plan.users[index]), len(plan.graph.nodes))
    return user < len(plan.graph.nodes) and _is_sum(plan, user) and plan.is_merged(index, user)


def _added(
    plan: Pipelined, index: int, last: Mapping[int, _Last], low: int = 0, *, negative: bool = False
) -> Iterator[_Added]:
    """Yield what is added up for a sum whose lowest bit is `low`; `last` as in `_last_sums`."""
    nodes = plan.graph.nodes
    node = nodes[index]
    for number, operand in enumerate(node.operands):
        source, start = plan.source(operand), low + node.frac - nodes[operand].frac
        minus = negative != (number == 1 and node.op is Op.SUBTRACT)
        if nodes[source].op is Op.CONSTANT:
            yield _Added(start, start + 1, signed=False, constant=True)
        elif _is_sum(plan, source) and _is_taken(plan, source):
            yield from _added(plan, source, last, start, negative=minus)
        elif source in last and _is_taken(plan, source):
            for place, bits in last[source].operands:
                yield _Added(start + place, start + place + bits, nodes[operand].signed, minus)
        else:
            yield _Added(start, start + nodes[operand].width, nodes[operand].signed, minus)


def _of_added(added: Sequence[_Added], width: int) -> Quantities:
    """Count what adds up so many numbers in `width` bits: carries, and what leaves two numbers to them."""
    made: Quantities = Counter()
    values = [each for each in added if not each.constant]
    for bit in range(min(width, max((each.end for each in values), default=0))):
        here = sum(each.low <= bit and (each.signed or bit < each.end) for each in values)
        made["merged"] += max(0, here - 2)
        made["rounded"] += here > 1 and len(values) < len(added)
    starts = sorted(each.low for each in added)[1:2] + [each.low for each in added if each.negative]
    made["sums"] += max(0, width - min(starts, default=width))
    return made


def _is_concatenation(graph: Graph, node: Node) -> bool:
    """Say whether a sum takes no adder, as one operand is a constant with bits below those of the other alone."""
    for own, other in (node.operands, node.operands[::-1]):
        constant = graph.nodes[own]
        if constant.op is Op.CONSTANT and (node.op is Op.ADD or own == node.operands[1]):
            end = constant.parameter.bit_length() - constant.frac
            if constant.parameter == 0 or (
                node.op is Op.ADD and constant.parameter > 0 and end <= -graph.nodes[other].frac
            ):
                return True
    return False
