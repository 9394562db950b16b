"""Sums as synthesis makes them: those that only one other uses are added up at once."""

from collections.abc import Collection

import pytest

from sosmith.gen.estimate.pipelined import Pipelined
from sosmith.gen.estimate.sums import of_sums
from sosmith.model.dataflow.graph import GraphBuilder, Wire


def counted(
    g: GraphBuilder, *outputs: Wire, stages: tuple[int, ...] = (), adders: Collection[int] = ()
) -> tuple[int, int, int]:
    """Return carries, what is added up three by three, and what is with a constant."""
    graph = g.build(outputs)
    found = of_sums(Pipelined(graph, stages or (0,) * len(graph.nodes), adders))
    return found["sums"], found["merged"], found["rounded"]


def three(frac: int = 0) -> tuple[GraphBuilder, Wire, Wire, Wire]:
    g = GraphBuilder()
    a, b, c = (g.input(name, frac, -128, 127) for name in "abc")
    return g, a, b, c


def test_a_sum_takes_a_carry_for_each_bit() -> None:
    g, a, b, _ = three()
    assert counted(g, g.add(a, b)) == (9, 0, 0)


def test_a_sum_that_one_other_uses_is_added_up_with_it() -> None:
    g, a, b, c = three()
    assert counted(g, g.add(g.add(a, b), c)) == (10, 8, 0)


def test_a_sum_with_two_users_is_made_by_itself() -> None:
    g, a, b, c = three()
    first = g.add(a, b)
    assert counted(g, g.add(first, c), first) == (9 + 10, 0, 0)


def test_a_sum_behind_a_register_is_made_by_itself() -> None:
    g, a, b, c = three()
    assert counted(g, g.add(g.add(a, b), c), stages=(0, 0, 0, 0, 1)) == (9 + 10, 0, 0)


def test_a_sum_is_added_up_with_one_that_shifts_it() -> None:
    g, a, b, c = three()
    assert counted(g, g.add(g.shift(g.add(a, b), 2), c)) == (10, 8, 0)  # c has the lowest two bits alone


@pytest.mark.parametrize(("subtracted", "carries"), [("", 5), ("coarse", 5), ("fine", 9)])
def test_what_one_operand_has_alone_takes_no_carries_unless_it_is_subtracted(subtracted: str, carries: int) -> None:
    g = GraphBuilder()
    fine, coarse = g.input("fine", 4, -128, 127), g.input("coarse", 0, -8, 7)
    sums = {"": lambda: g.add(fine, coarse), "coarse": lambda: g.subtract(fine, coarse)}
    assert counted(g, sums.get(subtracted, lambda: g.subtract(coarse, fine))()) == (carries, 0, 0)


def test_a_constant_is_an_operand() -> None:
    g, a, _, _ = three(frac=4)
    assert counted(g, g.add(a, g.constant(1, 1))) == (9 - 3, 0, 0)
    g, a, b, _ = three(frac=4)
    assert counted(g, g.add(g.add(a, b), g.constant(1, 1))) == (10, 0, 8)


def test_a_constant_below_all_bits_is_wires() -> None:
    g, a, _, _ = three()
    assert counted(g, g.add(a, g.constant(1, 1))) == (0, 0, 0)


def test_the_last_sum_of_a_product_by_a_constant_is_added_up_with_what_uses_it() -> None:
    """5 a = a + 4 a, where 4 a has no lowest two bits; 5 a + b has three operands from there on."""
    g, a, b, _ = three()
    product = g.scale(a, 5, 0)
    assert counted(g, g.add(product, b), adders=[product]) == (11, 8, 0)
    g, a, _, _ = three()
    product = g.scale(a, 5, 0)
    assert counted(g, product, adders=[product]) == (11 - 2, 0, 0)


def test_a_sum_that_two_products_share_is_made_by_itself() -> None:
    """5 a is a product of its own, and 21 a = 16 a + 5 a."""
    g, a, b, _ = three()
    five, more = g.scale(a, 5, 0), g.scale(a, 21, 0)
    assert counted(g, g.add(five, b), g.add(more, b), adders=[five, more]) == (9 + 11 + 13, 8, 0)
