"""The coefficients of a recursion in a certificate: what its products multiply by.

A product is a node of its own, or a sum of multiples of one node that is no part of another such sum; its operands may
drop bits. Then its constant is what they come to if none does. What is a product is seen from the graph, whatever the
nodes are called.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from sosmith.verify.certificate_file import NodeEntry, Operation

_PREFIX = "product_"
_OF_SUMS = frozenset({Operation.ADD, Operation.SUBTRACT, Operation.SHIFT})


def coefficients(nodes: Sequence[NodeEntry]) -> list[tuple[str, int, int]]:
    """Return name, integer and fraction bits of each coefficient, in the order of the products."""
    of, factors = _multiples(nodes)
    parts: set[int] = set()
    for index, node in enumerate(nodes):
        if node.op in _OF_SUMS and of[index] != index:
            parts |= {*node.operands}
            parts |= {k for i in node.operands if nodes[i].op is Operation.FLOOR for k in nodes[i].operands}
    found = []
    for index, node in enumerate(nodes):
        factor = factors[index]
        if node.op is Operation.SCALE:
            made = node.parameter, node.parameter_frac
        elif node.op in _OF_SUMS and of[index] != index and index not in parts and _is_sum(factor):
            made = factor.numerator, factor.denominator.bit_length() - 1
        else:
            continue
        found.append((node.name.removeprefix(_PREFIX), *made))
    return found


def _is_sum(factor: Fraction) -> bool:
    """Whether a factor is no power of two, nor 0."""
    return abs(factor.numerator).bit_count() > 1


def _multiples(nodes: Sequence[NodeEntry]) -> tuple[list[int], list[Fraction]]:
    """Return of each node what it is a multiple of, whatever bits are dropped on the way, and the factor."""
    of, factors = [*range(len(nodes))], [Fraction(1)] * len(nodes)
    for index, node in enumerate(nodes):
        if node.op in {Operation.FLOOR, Operation.SHIFT}:
            (operand,) = node.operands
            scale = Fraction(2) ** node.parameter if node.op is Operation.SHIFT else 1
            of[index], factors[index] = of[operand], factors[operand] * scale
        elif node.op in _OF_SUMS:
            left, right = node.operands
            if of[left] == of[right]:
                sign = 1 if node.op is Operation.ADD else -1
                of[index], factors[index] = of[left], factors[left] + sign * factors[right]
    return of, factors
