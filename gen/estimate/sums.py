"""Quantities of sums.

Synthesis merges sums that only one other sum uses in the same pipeline stage, and adds up all their operands at once:
three by three without carries, in two LUT4 a bit, until two are left for a chain of carries.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from sosmith.gen.estimate.pipelined import SUMS, Pipelined
from sosmith.gen.estimate.quantities import Quantities
from sosmith.model.dataflow.graph import Graph, Node, Op


class _Added(NamedTuple):
    """What is added up: its lowest bit, and the bit behind its highest; a negative one is subtracted."""

    low: int
    end: int
    signed: bool
    negative: bool = False


def of_sums(plan: Pipelined) -> Quantities:
    """Count all sums of a stage but those that products by constants are made of."""
    made: Quantities = Counter()
    nodes = plan.graph.nodes
    for index in range(len(nodes)):
        users = plan.users[index]
        alone = not (len(users) == 1 and users[0] < len(nodes) and _takes(plan, index, users[0]))
        if _is_sum(plan, index) and alone:
            made += _of_added(list(_added(plan, index)), plan.width(index))
    return made


def _is_sum(plan: Pipelined, index: int) -> bool:
    return plan.graph.nodes[index].op in SUMS and not _is_concatenation(plan.graph, plan.graph.nodes[index])


def _takes(plan: Pipelined, index: int, user: int) -> bool:
    return _is_sum(plan, index) and _is_sum(plan, user) and plan.is_merged(index, user)


def _added(plan: Pipelined, index: int, low: int = 0, *, negative: bool = False) -> Iterator[_Added]:
    """Yield what is added up for a sum whose lowest bit is `low`."""
    nodes = plan.graph.nodes
    node = nodes[index]
    for number, operand in enumerate(node.operands):
        source, start = plan.source(operand), low + node.frac - nodes[operand].frac
        minus = negative != (number == 1 and node.op is Op.SUBTRACT)
        if nodes[source].op is Op.CONSTANT:
            yield from _ones(nodes[source].parameter, start)
        elif _takes(plan, source, index):
            yield from _added(plan, source, start, negative=minus)
        else:
            yield _Added(start, start + nodes[operand].width, nodes[operand].signed, minus)


def _ones(constant: int, low: int) -> Iterator[_Added]:
    """Yield the ones of a constant; those of a negative one from the sign on are one."""
    for bit in range(constant.bit_length() + 1):
        if constant >> bit & 1:
            yield _Added(low + bit, low + bit + 1, signed=constant < 0 and bit == constant.bit_length())


def _of_added(added: Sequence[_Added], width: int) -> Quantities:
    """Count what adds up so many numbers in `width` bits: carries, and what leaves two numbers to them."""
    made: Quantities = Counter()
    end = min(width, max(each.end for each in added))
    for bit in range(end):
        here = [each for each in added if each.low <= bit and (each.signed or bit < each.end)]
        made["merged"] += max(0, len(here) - 2)
        made["sums"] += len(here) >= 2 or (len(here) == 1 and any(each.negative for each in added if each.low <= bit))
    made["sums"] += width - end
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
