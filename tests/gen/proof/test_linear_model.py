"""Linear models of small graphs, worked out by hand, and graphs that have none."""

import re
from collections.abc import Callable
from fractions import Fraction

import pytest

from sosmith.gen.proof.linear_model import linear_model, linear_models
from sosmith.model.dataflow.graph import Graph, GraphBuilder


def leaky(feedback: bool) -> Graph:
    """``y = floor(t)`` of ``t = u + 3/4 y w``, to which the bits that were dropped before are added, or not."""
    g = GraphBuilder()
    u, y, before = g.input("u", 0, -8, 7), g.delay("y1", 0, -64, 63), g.delay("t1", 2, -256, 255)
    total = g.add(u, g.scale(y, 3, 2))
    t = g.bound(g.add(total, g.fraction(before, 0)) if feedback else total, -256, 255, "t")
    out = g.bound(g.floor(t, 0), -64, 63, "y")
    g.connect(before, t)
    g.connect(y, out)
    return g.build([out])


@pytest.mark.parametrize(("feedback", "noise"), [(False, (-1,)), (True, (-1, 1))])
def test_a_leaky_sum(feedback: bool, noise: tuple[int, ...]) -> None:
    """Bits that are dropped and then added again are one source, which is zero at frequency zero."""
    model = linear_model(leaky(feedback))
    assert model.denominator == (1, Fraction(-3, 4))
    assert model.transfer == (1,)
    (error,) = model.quantizers
    assert (error.low, error.high, error.kept) == (0, Fraction(3, 4), 0)
    assert error.numerators[model.output] == noise


def test_an_error_does_not_reach_what_was_computed_before_it() -> None:
    g = GraphBuilder()
    t = g.bound(g.scale(g.input("u", 0, -8, 7), 5, 3), -40, 35, "t")
    before = g.previous(t, "t1")
    model = linear_model(g.build([g.shift(g.subtract(g.floor(before, 0), g.constant(1, 0)), 2)]))
    source, error, constant = model.sources
    (bounded,) = model.bounds
    assert model.denominator == (1,)
    assert source.numerators == {bounded: (Fraction(5, 8),), model.output: (0, Fraction(5, 2))}
    assert constant.numerators == {bounded: (0,), model.output: (-4,)}
    assert error.numerators == {bounded: (0,), model.output: (0, -4)}


def test_a_coefficient_may_be_a_multiple_of_a_power_of_two() -> None:
    """As taps of a filter whose output has far longer steps than its input have, where others can be loaded."""
    g = GraphBuilder()
    u = g.input("u", 0, -8, 7)
    model = linear_model(g.build([g.add(g.scale(u, 3, -2), g.scale(u, 5, 0))]))
    assert model.transfer == (17,)


def two_outputs() -> Graph:
    g = GraphBuilder()
    u = g.input("u", 0, -8, 7)
    g.bound(u, -4, 3, "aside")
    return g.build([u, g.add(u, u)])


def product() -> Graph:
    g = GraphBuilder()
    u = g.input("u", 0, -8, 7)
    return g.build([g.multiply(u, u)])


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (two_outputs, "outputs must depend on every range that is stated, not leave out aside"),
        (product, "graph must be linear, not multiply"),
    ],
)
def test_graphs_without_a_model_are_refused(made: Callable[[], Graph], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        linear_models(made())


def test_one_model_needs_one_output() -> None:
    with pytest.raises(ValueError, match=r"^graph must have one input and one output, not 1, 2$"):
        linear_model(two_outputs())
