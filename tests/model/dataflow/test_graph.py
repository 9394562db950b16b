"""The dataflow graphs: exact arithmetic, derived ranges, refusals."""

import math
import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sosmith.model.dataflow.graph import GraphBuilder, Op, RangeError, value

codes = st.integers(-(1 << 20), 1 << 20)


@given(codes, codes, st.integers(-3, 12), st.integers(0, 12))
def test_sums_and_products_are_exact(a: int, b: int, frac_a: int, frac_b: int) -> None:
    g = GraphBuilder()
    x, y = g.input("x", frac_a, -(1 << 20), 1 << 20), g.input("y", frac_b, -(1 << 20), 1 << 20)
    wires = [g.add(x, y), g.subtract(x, y), g.multiply(x, y), g.shift(x, 5), g.scale(y, -77, 9)]
    graph = g.build(wires)
    exact_a, exact_b = a * Fraction(2) ** -frac_a, b * Fraction(2) ** -frac_b
    expected = [exact_a + exact_b, exact_a - exact_b, exact_a * exact_b, exact_a * 32, exact_b * Fraction(-77, 512)]
    results = graph.step([a, b], [])
    assert [value(graph.nodes[i], code) for i, code in zip(graph.outputs, results, strict=True)] == expected


@given(codes, st.integers(1, 15))
def test_floor_and_fraction_add_up(a: int, bits: int) -> None:
    g = GraphBuilder()
    x = g.input("x", bits, -(1 << 20), 1 << 20)
    graph = g.build([g.floor(x, 0), g.fraction(x, 0)])
    whole, fraction = graph.step([a], [])
    assert (whole << bits) + fraction == a
    assert 0 <= fraction < 1 << bits


@given(codes, st.integers(1, 15))
def test_round_is_to_nearest_with_ties_upward(a: int, bits: int) -> None:
    g = GraphBuilder()
    graph = g.build([g.round(g.input("x", bits, -(1 << 20), 1 << 20), 0)])
    (rounded,) = graph.step([a], [])
    assert -Fraction(1, 2) < rounded - Fraction(a, 1 << bits) <= Fraction(1, 2)


@given(codes, st.integers(-2, 15))
def test_truncate_is_towards_zero(a: int, bits: int) -> None:
    g = GraphBuilder()
    graph = g.build([g.truncate(g.input("x", bits, -(1 << 20), 1 << 20), 0)])
    (truncated,) = graph.step([a], [])  # raises if its range is too narrow
    assert truncated == math.trunc(a * Fraction(2) ** -bits)


@pytest.mark.parametrize(("low", "high", "expected"), [(-9, 11, (-2, 2)), (-3, 3, (0, 0)), (5, 9, (1, 2))])
def test_range_of_truncate(low: int, high: int, expected: tuple[int, int]) -> None:
    g = GraphBuilder()
    node = g[g.truncate(g.input("x", 2, low, high), 0)]
    assert (node.low, node.high) == expected


@given(st.lists(st.tuples(st.integers(-100, 100), st.integers(0, 200)), min_size=2, max_size=2), st.data())
def test_ranges_hold_every_value_and_are_reached(ranges: list[tuple[int, int]], data: st.DataObject) -> None:
    g = GraphBuilder()
    ends = [(low, low + span) for low, span in ranges]
    x, y = (g.input(name, 0, *end) for name, end in zip("xy", ends, strict=True))
    graph = g.build([g.multiply(x, y), g.subtract(x, y), g.scale(x, -3, 0)])
    inputs = [data.draw(st.integers(*end)) for end in ends]
    graph.step(inputs, [])  # raises if a range is too narrow
    corners = [graph.step([a, b], []) for a in ends[0] for b in ends[1]]
    for k, index in enumerate(graph.outputs):
        node = graph.nodes[index]
        assert {node.low, node.high} <= {corner[k] for corner in corners}


def test_delays_start_at_zero_and_hold_one_sample() -> None:
    g = GraphBuilder()
    x = g.input("x", 0, 0, 9)
    graph = g.build([g.previous(g.previous(x, "x1"), "x2")])
    assert graph.run([[5], [6], [7], [8]]) == [[0], [0], [5], [6]]


def test_a_value_outside_its_stated_bound_is_an_error() -> None:
    g = GraphBuilder()
    graph = g.build([g.bound(g.input("x", 0, -8, 7), -4, 3, "v")])
    assert graph.step([3], []) == [3]
    with pytest.raises(RangeError, match=r"^v must be in -4\.\.3, not 4$"):
        graph.step([4], [])


@pytest.mark.parametrize(
    ("low", "high", "frac", "width", "text"),
    [
        (0, 255, 4, 8, "UQ4.4"),
        (-128, 127, 4, 8, "Q3.4"),
        (-129, 0, 0, 9, "Q8.0"),
        (0, 0, 0, 1, "UQ1.0"),
        (-1, 0, 3, 1, "Q-3.3"),
    ],
)
def test_formats(low: int, high: int, frac: int, width: int, text: str) -> None:
    g = GraphBuilder()
    node = g[g.input("x", frac, low, high)]
    assert (node.width, node.format) == (width, text)


def test_clamp_limits() -> None:
    g = GraphBuilder()
    graph = g.build([g.clamp(g.input("x", 0, -100, 100), -5, 6)])
    assert [graph.step([x], [])[0] for x in (-100, -5, 0, 6, 7)] == [-5, -5, 0, 6, 6]


def test_combine_orders_and_negates() -> None:
    g = GraphBuilder()
    x, y = g.input("x", 0, 0, 9), g.input("y", 0, 0, 9)
    graph = g.build([g.combine([(-4, x), (2, y)]), g.combine([(-1, x)]), g.combine([(0, x)])])
    results = zip(graph.outputs, graph.step([3, 5], []), strict=True)
    assert [value(graph.nodes[i], code) for i, code in results] == [-2, -3, 0]


def test_refusals() -> None:
    g = GraphBuilder()
    x = g.input("x", 0, 0, 9)
    with pytest.raises(ValueError, match=r"^factor must be 0 or plus or minus a power of two, not 3$"):
        g.combine([(3, x)])
    with pytest.raises(ValueError, match=re.escape("wire must be an unconnected delay, not input 'x'")):
        g.connect(x, x)
    narrow = g.delay("d", 0, 0, 8)
    with pytest.raises(ValueError, match=r"^source of 'd' must fit its format and range, not Node\(.*\)$"):
        g.connect(narrow, x)
    with pytest.raises(ValueError, match=r"^delay 'd' must be connected$"):
        g.build([x])


def test_only_delays_are_state() -> None:
    g = GraphBuilder()
    x = g.input("x", 0, 0, 9)
    graph = g.build([g.add(x, g.previous(x, "x1"))])
    assert [graph.nodes[i].op for i in graph.delays] == [Op.DELAY]
    assert graph.reset() == [0]
