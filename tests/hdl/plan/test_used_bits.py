"""Bits of sums that are used, and sums that take no adder: the model and the hardware agree on both."""

import pytest
from tests.hdl.stages.stage_bench import run

from sosmith.hdl.plan.used_bits import used_bits
from sosmith.model.dataflow.graph import Graph, GraphBuilder


class _Stage:
    """A graph as a stage."""

    name = "sums"

    def __init__(self, graph: Graph) -> None:
        self.graph = graph


def chained() -> Graph:
    """Return a sum of three numbers that is known to be small."""
    g = GraphBuilder()
    a, b, c = (g.input(name, 0, -128, 127) for name in "abc")
    return g.build([g.bound(g.subtract(g.add(a, b), c), -8, 7)])


def joined(below: int) -> Graph:
    """Return a number with two zeros below its bits, to which a number of so many bits is added."""
    g = GraphBuilder()
    a, b = g.input("a", 0, -8, 7), g.input("b", 2, 0, (1 << below) - 1)
    return g.build([g.add(a, b)])


def test_upper_bits_of_sums_that_nothing_uses_are_not_made() -> None:
    assert used_bits(chained()) == [4, 4, 4, 4, 4, 4]


def test_a_sum_without_its_upper_bits_is_the_same() -> None:
    samples = [[100, 27, 124], [-100, -28, -120], [127, -127, 7], [-128, 127, -1]]
    assert run(_Stage(chained()), samples, 1) == chained().run(samples)


@pytest.mark.parametrize(("below", "takes_none"), [(1, True), (2, True), (3, False)])
def test_what_lies_below_all_bits_takes_no_adder(below: int, takes_none: bool) -> None:
    graph = joined(below)
    (output,) = graph.outputs
    assert (graph.concatenated(graph.nodes[output]) == (0, 1)) == takes_none
    samples = [[a, b] for a in (-8, -1, 0, 7) for b in range(1 << below)]
    assert run(_Stage(graph), samples, 1) == graph.run(samples)
