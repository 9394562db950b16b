"""Products by constants made of sums that drop bits, where the product itself drops the bits below.

::

    x ---+---- << 4 -----> floor --> + = 5 * 16 x - 5 x, without what lies below the bits that are kept
         |                           ^ -
    5x --+--------> floor -----------+

A product that keeps fewer bits than it has needs no carries from far below them, so that its sums need not begin at its
lowest bit. Each operand of a sum is floored on its own where it has such bits, which errs by less than the lowest bit
that stays, times the multiple that the sum becomes. How many bits below those of the product stay is chosen with the
word lengths (`sosmith.gen.word_lengths.truncated_sums`), and every floor is a quantizer of the proof. Truncated
sums of this kind are those of Garcia, Volkova and Kumm (Truncated multiple constant multiplication with minimal number
of full adders, IEEE ISCAS 2022); there the error is bounded for one result, here at the output of the filter.

>>> from sosmith.model.dataflow.adder_graph import adder_graph
>>> adders = adder_graph((75,))  # 5 = 1 + 4, 75 = 5 * 16 - 5
>>> lowest_bits(adders, {75: 3})
[0, 3]
>>> error_limits(adders, [0, 3])
(0, 7)
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

from sosmith.model.dataflow.adder_graph import Adder, adder_graph, multiple_name, odd_part
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op, Wire

_OF_SUMS = frozenset({Op.ADD, Op.SUBTRACT, Op.SHIFT})


def truncated(g: GraphBuilder, operand: Wire, coefficient: int, frac: int, kept: int, name: str) -> Wire:
    """Return the product by ``coefficient * 2**-frac`` as sums that have at most `kept` fraction bits of it."""
    adders, drops = _plan(g[operand].frac, coefficient, frac, kept)
    point, of = g[operand].frac, g[operand].name
    values = [operand]
    for adder, dropped in zip(adders, drops, strict=True):
        left, right = (_above(g, g.shift(values[k], shift), point - dropped) for k, shift in (adder.left, adder.right))
        total = multiple_name(of, adder.multiple) if of and adder is not adders[-1] else ""
        values.append(g.subtract(left, right, total) if adder.subtract else g.add(left, right, total))
    odd, power = odd_part(coefficient)
    last = values[0] if odd == 1 else values[-1]
    return g.named(g.shift(last, power - frac), name)


class Constant(NamedTuple):
    """What a product multiplies which node by: ``integer * 2**-frac``."""

    operand: int
    integer: int
    frac: int


def constants_of(graph: Graph) -> dict[int, Constant]:
    """Return the constants that products of a graph multiply by, by the node of the product.

    A product is one multiplication, or a sum of multiples of one node, whatever these drop, that is no part of another
    such sum.
    """
    multiples: list[tuple[int, Fraction]] = []
    for index, node in enumerate(graph.nodes):
        multiple = index, Fraction(1)
        if node.op is Op.FLOOR:
            multiple = multiples[node.operands[0]]
        elif node.op is Op.SHIFT:
            of, factor = multiples[node.operands[0]]
            multiple = of, factor * Fraction(2) ** node.parameter
        elif node.op is Op.ADD or node.op is Op.SUBTRACT:
            (left, first), (right, second) = (multiples[i] for i in node.operands)
            if left == right:
                multiple = left, first + second if node.op is Op.ADD else first - second
        multiples.append(multiple)
    parts = {
        i
        for index, node in enumerate(graph.nodes)
        if node.op in _OF_SUMS and multiples[index][0] != index
        for operand in node.operands
        for i in (operand, *(graph.nodes[operand].operands if graph.nodes[operand].op is Op.FLOOR else ()))
    }
    made: dict[int, Constant] = {}
    for index, node in enumerate(graph.nodes):
        of, factor = multiples[index]
        if node.op is Op.SCALE:
            made[index] = Constant(node.operands[0], node.parameter, node.parameter_frac)
        elif node.op in _OF_SUMS and of != index and index not in parts and abs(factor.numerator).bit_count() > 1:
            made[index] = Constant(of, factor.numerator, factor.denominator.bit_length() - 1)
    return made


def mean_error(operand_frac: int, coefficient: int, frac: int, kept: int) -> Fraction:
    """Return the error of `truncated` on average, where the bits that are dropped are of all values alike."""
    adders, drops = _plan(operand_frac, coefficient, frac, kept)
    low, high = error_limits(adders, drops)
    _, power = odd_part(coefficient)
    return (low + high) * Fraction(2) ** (power - frac - operand_frac - 1)


def truncation_error(operand_frac: int, coefficient: int, frac: int, kept: int) -> Fraction:
    """Return how far the smallest and the largest error of `truncated` are apart."""
    adders, drops = _plan(operand_frac, coefficient, frac, kept)
    low, high = error_limits(adders, drops)
    _, power = odd_part(coefficient)
    return (high - low) * Fraction(2) ** (power - frac - operand_frac)


def saved_bits(operand_frac: int, coefficient: int, frac: int, kept: int) -> int:
    """Return the adder bits that `truncated` has less than the whole product."""
    adders, drops = _plan(operand_frac, coefficient, frac, kept)
    return sum(bits_below(adder, dropped) for adder, dropped in zip(adders, drops, strict=True))


def bits_below(adder: Adder, dropped: int) -> int:
    """Return the adder bits of a sum among its lowest ones."""
    free = adder.right[1] or (0 if adder.subtract else adder.left[1])
    return max(0, dropped - free)


def _plan(operand_frac: int, coefficient: int, frac: int, kept: int) -> tuple[Sequence[Adder], list[int]]:
    """Return the sums that make a product, and the bits that each of them drops."""
    odd, power = odd_part(coefficient)
    adders = adder_graph((coefficient,))
    return adders, lowest_bits(adders, {odd: max(0, operand_frac + frac - power - kept)})


def lowest_bits(adders: Sequence[Adder], dropped: Mapping[int, int]) -> list[int]:
    """Return the bits of each sum below all that is needed of it, given those of multiples that are not needed.

    A multiple that is needed for sums alone need not be in `dropped`.
    """
    lowest: list[int] = [0] * len(adders)
    for number in range(len(adders), 0, -1):
        shifts = [
            (later, shift)
            for later in range(number, len(adders))
            for place, shift in (adders[later].left, adders[later].right)
            if place == number
        ]
        needs = [max(0, lowest[later] - shift) for later, shift in shifts]
        multiple = adders[number - 1].multiple
        if multiple in dropped:
            needs.append(dropped[multiple])
        lowest[number - 1] = min(needs)
    return lowest


def error_limits(adders: Sequence[Adder], drops: Sequence[int]) -> tuple[int, int]:
    """Return the smallest and the largest error of the last sum, in units of its lowest bit before any is dropped."""
    low = high = 0
    for weight, size in _errors(adders, drops):
        ends = 0, -weight * size
        low, high = low + min(ends), high + max(ends)
    return low, high


def _errors(adders: Sequence[Adder], drops: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield for each operand that is floored what one of it is in the last sum, and the most that it loses."""
    weights = [0] * len(adders) + [0]
    weights[len(adders)] = 1
    for number in range(len(adders), 0, -1):
        adder = adders[number - 1]
        for (place, shift), sign in ((adder.left, 1), (adder.right, -1 if adder.subtract else 1)):
            weights[place] += weights[number] * sign << shift
            there = shift + (drops[place - 1] if place else 0)
            if there < drops[number - 1]:
                yield sign * weights[number], (1 << drops[number - 1]) - (1 << there)


def _above(g: GraphBuilder, wire: Wire, frac: int) -> Wire:
    """Drop what a wire has below so many fraction bits."""
    return g.floor(wire, frac) if g[wire].frac > frac else wire
