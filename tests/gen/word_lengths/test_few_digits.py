"""Word lengths for products that are made of adders."""

from dataclasses import replace

import pytest
from tests.verify.parallel.cores import specified
from tests.verify.small_specifications import PLAIN

from sosmith.gen.architectures.blocks import Blocks, blocks_for
from sosmith.gen.architectures.budget import Budget
from sosmith.gen.architectures.registry import ARCHITECTURES, candidates
from sosmith.gen.core import design_core
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.realizations.coefficients import with_fewer_digits
from sosmith.gen.specification.combinations import NO_MULTIPLIERS, SEVERAL, Option
from sosmith.gen.word_lengths.cost import area_by_digits, cost_of_graphs, products_from_adders
from sosmith.gen.word_lengths.objective import FEW_ADDERS, SMALL_AREA
from sosmith.model.dataflow.adder_graph import scalings, signed_digits
from sosmith.model.dataflow.graph import Graph, GraphBuilder


def graph(*constants: int) -> Graph:
    """Return products of one operand of 8 bits by constants, and one of two operands."""
    g = GraphBuilder()
    x, y = g.input("x", 0, -128, 127), g.input("y", 0, -128, 127)
    return g.build([*(g.scale(x, constant, 0) for constant in constants), g.multiply(x, y)])


def test_products_of_two_values_take_blocks_first() -> None:
    graphs = [graph(3, 683), graph(8)]
    assert products_from_adders(graphs, None) == (frozenset(), frozenset())
    assert products_from_adders(graphs, 5) == (frozenset(), frozenset())
    assert products_from_adders(graphs, 4) == (frozenset(), frozenset({2}))
    assert products_from_adders(graphs, 3) == (frozenset({2}), frozenset({2}))
    assert products_from_adders(graphs, 2) == (frozenset({2, 3}), frozenset({2}))
    assert products_from_adders(graphs, 0) == (frozenset({2, 3}), frozenset({2}))


def test_a_product_by_zero_is_no_sum() -> None:
    assert scalings(graph(0, 5)) == {3}


def test_sums_are_counted_once_where_they_are_shared() -> None:
    made = graph(5, 45)
    apart = sum(cost_of_graphs([graph(k)], [scalings(graph(k))]).adder_bits for k in (5, 45))
    together = cost_of_graphs([made], [scalings(made)])
    assert together.adder_bits < apart
    assert together.multiplier_blocks == 1
    assert cost_of_graphs([made]).multiplier_blocks == 3


def test_each_digit_but_the_first_is_a_sum() -> None:
    sizes = [area_by_digits(graph(k)) for k in (1, 64, 5, 7, 21, 85)]
    assert sizes[0] == sizes[1] < sizes[2] == sizes[3] < sizes[4] < sizes[5]


@pytest.mark.parametrize("exact", [216531.4, -216531.4, 5.9, 1000.3])
def test_neighbours_with_fewer_digits(exact: float) -> None:
    integer = round(exact)
    found = list(with_fewer_digits(integer, exact))
    assert found
    assert all(near and len(signed_digits(near)) < len(signed_digits(integer)) for near in found)
    assert min(found) < exact < max(found)


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("multipliers", "chosen"), [(None, "folded"), (1, "folded"), (0, "parallel")])
def test_without_multipliers_nothing_is_folded(multipliers: int | None, chosen: str) -> None:
    """Within 100 clocks a sample, folded is the smallest that keeps up; serial does not."""
    spec = specified(PLAIN)
    hardware = replace(spec.hardware, clock=100 * spec.sample_rate, architecture="auto", multipliers=multipliers)
    made = design_core(replace(spec, hardware=hardware))
    assert made.architecture.name == chosen
    assert bool(made.architecture.multiplier_blocks) == (chosen == "folded")


def tried(blocks: Blocks, *options: Option) -> list[str]:
    return [kind.terms.name for kind in candidates("auto", blocks, options)]


def test_the_board_and_the_specification_say_how_many_blocks_there_are() -> None:
    hx8k, up5k = find_board("ice40_hx8k_b_evn"), find_board("icebreaker")
    assert blocks_for(None, None) == Blocks(None)
    assert blocks_for(None, hx8k) == Blocks(0)
    assert blocks_for(None, up5k) == Blocks(8, 16)
    assert blocks_for(3, up5k) == Blocks(3, 16, asked=3)
    assert tried(Blocks(0)) == ["serial", "folded", "parallel"]
    assert tried(Blocks(8)) == ["folded", "multiplexed", "parallel"]
    assert tried(Blocks(0), NO_MULTIPLIERS) == ["serial", "parallel"]
    assert tried(Blocks(0), SEVERAL) == ["parallel"]
    assert ARCHITECTURES["parallel"].objective(hx8k, adders=True) == FEW_ADDERS
    assert ARCHITECTURES["parallel"].objective(up5k) == SMALL_AREA
    budget = Budget(clock=specified(PLAIN).hardware.clock, sample_rate=specified(PLAIN).sample_rate, blocks=Blocks(0))
    assert budget.adders
    assert not replace(budget, reload=True).adders
