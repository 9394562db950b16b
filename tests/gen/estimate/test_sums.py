"""Sums as synthesis makes them: each is a carry chain of its own, over the bits that are used."""

from collections.abc import Collection

import pytest

from sosmith.gen.estimate.pipelined import Pipelined
from sosmith.gen.estimate.sums import of_sums
from sosmith.model.dataflow.graph import GraphBuilder, Wire


def carries(g: GraphBuilder, *outputs: Wire, stages: tuple[int, ...] = (), adders: Collection[int] = ()) -> int:
    """Return the bits of carry chains."""
    graph = g.build(outputs)
    return of_sums(Pipelined(graph, stages or (0,) * len(graph.nodes), adders))["sums"]


def three(frac: int = 0) -> tuple[GraphBuilder, Wire, Wire, Wire]:
    g = GraphBuilder()
    a, b, c = (g.input(name, frac, -128, 127) for name in "abc")
    return g, a, b, c


def test_a_sum_takes_a_carry_for_each_bit() -> None:
    g, a, b, _ = three()
    assert carries(g, g.add(a, b)) == 9


def test_sums_that_follow_each_other_are_chains_of_their_own() -> None:
    g, a, b, c = three()
    assert carries(g, g.add(g.add(a, b), c)) == 9 + 10
    g, a, b, c = three()
    assert carries(g, g.add(g.shift(g.add(a, b), 2), c)) == 9 + (12 - 2)  # c has the lowest two bits alone


def test_bits_above_those_that_are_used_take_no_carries() -> None:
    g, a, b, c = three()
    assert carries(g, g.bound(g.add(g.add(a, b), c), -128, 127)) == 8 + 8


@pytest.mark.parametrize(("subtracted", "bits"), [("", 5), ("coarse", 5), ("fine", 9)])
def test_what_one_operand_has_alone_takes_no_carries_unless_it_is_subtracted(subtracted: str, bits: int) -> None:
    g = GraphBuilder()
    fine, coarse = g.input("fine", 4, -128, 127), g.input("coarse", 0, -8, 7)
    sums = {"": lambda: g.add(fine, coarse), "coarse": lambda: g.subtract(fine, coarse)}
    assert carries(g, sums.get(subtracted, lambda: g.subtract(coarse, fine))()) == bits


def test_bits_below_the_lowest_one_of_a_constant_take_no_carries() -> None:
    g, a, _, _ = three(frac=4)
    assert carries(g, g.add(a, g.constant(1, 1))) == 9 - 3
    g, a, _, _ = three(frac=4)
    assert carries(g, g.subtract(a, g.constant(24, 4))) == 9 - 3
    g, a, _, _ = three(frac=4)
    assert carries(g, g.subtract(g.constant(24, 4), a)) == 9


def test_what_lies_below_all_bits_is_wires() -> None:
    g, a, _, _ = three()
    assert carries(g, g.add(a, g.constant(1, 1))) == 0
    g, a, b, _ = three()
    assert carries(g, g.add(a, g.fraction(g.shift(b, -2), 0))) == 0


def test_what_is_put_below_a_sum_leaves_it_as_it_is() -> None:
    """The upper 9 bits are a + b; what is added then begins where c does, two bits higher than the lowest."""
    g, a, b, c = three()
    joined = g.add(g.add(a, b), g.fraction(g.shift(c, -2), 0))
    assert carries(g, joined) == 9
    assert carries(g, g.add(joined, c)) == 9 + 10


def test_a_sum_with_zero_is_wires_unless_the_other_is_subtracted() -> None:
    g, a, _, _ = three()
    assert carries(g, g.add(g.constant(0, 0), a)) == carries(g, g.subtract(a, g.constant(0, 0))) == 0
    assert carries(g, g.subtract(g.constant(0, 0), a)) == 9


def test_products_by_constants_are_sums_of_their_own() -> None:
    """5 a = a + 4 a, where 4 a has no lowest two bits."""
    g, a, b, _ = three()
    product = g.scale(a, 5, 0)
    assert carries(g, g.add(product, b), adders=[product]) == (11 - 2) + 11


def test_products_of_an_operand_share_sums_in_the_same_pipeline_stage() -> None:
    """21 a = 16 a + 5 a is one sum more, or three where 5 a is another pipeline stage's."""
    g, a, _, _ = three()
    five, more = g.scale(a, 5, 0), g.scale(a, 21, 0)
    shared = carries(g, five, more, adders=[five, more])
    assert shared == (11 - 2) + (13 - 4)
    alone = carries(g, five, more, stages=(0, 0, 0, 0, 1), adders=[five, more])
    assert alone > shared
