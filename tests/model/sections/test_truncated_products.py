"""Products whose sums drop bits: how much they err, on average and at most, and what they save."""

import random
from fractions import Fraction

import pytest

from sosmith.model.dataflow.adder_graph import adder_bits, adder_graph
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op
from sosmith.model.sections.truncated_products import (
    bits_below,
    constants_of,
    error_limits,
    lowest_bits,
    mean_error,
    saved_bits,
    truncated,
    truncation_error,
)

LOW, HIGH = -200, 199


def product(coefficient: int, frac: int, kept: int, point: int = 2) -> Graph:
    """Return the graph of a product of an operand with 9 bits, `point` of them fraction bits."""
    g = GraphBuilder()
    x = g.input("x", point, LOW, HIGH)
    return g.build([truncated(g, x, coefficient, frac, kept, "product_A1")])


def errors(graph: Graph, coefficient: int, frac: int, point: int = 2) -> list[Fraction]:
    """Return the error for each code of the operand."""
    node = graph.nodes[graph.outputs[0]]
    outputs = graph.run([[code] for code in range(LOW, HIGH + 1)])
    return [
        Fraction(output) / Fraction(2) ** node.frac - Fraction(code * coefficient) / Fraction(2) ** (point + frac)
        for code, (output,) in zip(range(LOW, HIGH + 1), outputs, strict=True)
    ]


def test_no_error_is_beyond_the_limits() -> None:
    draws = random.Random(1)
    dropping = 0
    for _ in range(200):
        coefficient = draws.choice((1, -1)) * draws.randrange(1, 1 << draws.randrange(1, 18))
        point, frac = draws.randrange(-2, 6), draws.randrange(20)
        kept = draws.randrange(point + frac - 14, point + frac + 3)
        found = errors(product(coefficient, frac, kept, point), coefficient, frac, point)
        middle = mean_error(point, coefficient, frac, kept)
        reach = truncation_error(point, coefficient, frac, kept) / 2
        assert middle - reach <= min(found)
        assert max(found) <= middle + reach
        assert (saved_bits(point, coefficient, frac, kept) == 0) <= (reach >= 0)
        dropping += reach > 0
    assert dropping > 50


def test_errors_reach_their_limits_where_bits_are_those_of_one_operand() -> None:
    """5 x - 80 x loses the three lowest bits of 5 x, which take all values."""
    found = errors(product(75, 8, 7), 75, 8)
    assert (min(found), max(found)) == (0, Fraction(7, 1 << 10))
    assert mean_error(2, 75, 8, 7) == Fraction(7, 1 << 11)
    assert truncation_error(2, 75, 8, 7) == Fraction(7, 1 << 10)


def test_a_sum_keeps_what_any_of_its_readers_needs() -> None:
    """Of 5 x, 75 x = 16 * 5 x - 5 x needs all bits above the third, 16 * 5 x all; of 3 x, 13 x = 3 x * 4 + x."""
    adders = adder_graph((75,))
    assert [adder.multiple for adder in adders] == [5, 75]
    assert lowest_bits(adders, {75: 3}) == [0, 3]
    assert lowest_bits(adders, {75: 6}) == [2, 6]
    assert lowest_bits(adders, {75: 6, 5: 1}) == [1, 6]
    assert error_limits(adders, [0, 3]) == (0, 7)


def test_what_keeps_all_bits_is_exact() -> None:
    assert set(errors(product(1297, 10, 12), 1297, 10)) == {0}
    assert saved_bits(2, 1297, 10, 12) == 0
    assert truncation_error(2, 1297, 10, 12) == mean_error(2, 1297, 10, 12) == 0


@pytest.mark.parametrize(("coefficient", "kept"), [(137967, 10), (64911, 9), (-16125, 12), (108265, 11)])
def test_saved_bits_are_those_that_no_sum_has(coefficient: int, kept: int) -> None:
    graph = product(coefficient, 20, kept)
    adders = adder_graph((coefficient,))
    sums = [node for node in graph.nodes if node.op in {Op.ADD, Op.SUBTRACT}]
    assert len(sums) == len(adders)
    left = 0
    for node in sums:
        first, second = (graph.nodes[i] for i in node.operands)
        free = max(first.frac - second.frac, 0 if node.op is Op.SUBTRACT else second.frac - first.frac)
        left += node.width - free
    saved = saved_bits(2, coefficient, 20, kept)
    assert saved > 0
    # Without a stated range, the interval of a sum may be a bit wider than its multiple.
    assert adder_bits(adders, LOW, HIGH) - saved <= left <= adder_bits(adders, LOW, HIGH) - saved + len(sums)


def test_bits_that_take_no_adder_are_not_saved() -> None:
    (adder,) = adder_graph((17,))
    assert adder.right == (0, 4)
    assert [bits_below(adder, dropped) for dropped in (3, 4, 6)] == [0, 0, 2]


@pytest.mark.parametrize("coefficient", [75, -4087, 137967, 3 << 5, 16125])
def test_the_constant_is_read_off_the_sums(coefficient: int) -> None:
    graph = product(coefficient, 20, 9)
    constants = constants_of(graph)
    assert constants.keys() == {graph.outputs[0]}
    operand, integer, frac = constants[graph.outputs[0]]
    assert graph.nodes[operand].name == "x"
    assert Fraction(integer, 1 << frac) == Fraction(coefficient, 1 << 20)
    assert integer % 2 or frac == 0
