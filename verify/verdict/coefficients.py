"""The coefficients of a recursion in a certificate: what its products multiply by.

A product is a node of its own, or is made of sums of one operand, each of which may drop bits: then its constant is
what they come to if none does.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from sosmith.verify.certificate_file import NodeEntry, Operation

_PREFIX = "product_"
_OF_SUMS = frozenset({Operation.ADD, Operation.SUBTRACT, Operation.SHIFT})


def coefficients(nodes: Sequence[NodeEntry]) -> list[tuple[str, int, int]]:
    """Return name, integer and fraction bits of each coefficient, in the order of the products."""
    found = []
    for index, node in enumerate(nodes):
        name = node.name.removeprefix(_PREFIX)
        if node.op is Operation.SCALE:
            found.append((name, node.parameter, node.parameter_frac))
        elif node.name.startswith(_PREFIX) and node.op in _OF_SUMS:
            constant = _times(nodes, index)[1]
            frac = constant.denominator.bit_length() - 1
            found.append((name, int(constant * 2**frac), frac))
    return found


def _times(nodes: Sequence[NodeEntry], index: int) -> tuple[int, Fraction]:
    """Return the node that a node is a multiple of, whatever bits are dropped on the way, and the factor."""
    node = nodes[index]
    if node.op is Operation.FLOOR:
        return _times(nodes, node.operands[0])
    if node.op is Operation.SHIFT:
        of, factor = _times(nodes, node.operands[0])
        return of, factor * Fraction(2) ** node.parameter
    if node.op in {Operation.ADD, Operation.SUBTRACT}:
        (left, first), (right, second) = (_times(nodes, i) for i in node.operands)
        if left == right:
            return left, first + second if node.op is Operation.ADD else first - second
    return index, Fraction(1)
