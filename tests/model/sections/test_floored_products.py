"""Products that drop bits: what is dropped cancels on average, and every code is that of the sum written out."""

import random
from fractions import Fraction
from itertools import accumulate

import pytest

from sosmith.model.dataflow.graph import Op, Range
from sosmith.model.sections.fir import FirSection, Form, TapProduct
from sosmith.model.sections.floored_products import directions, factors
from sosmith.model.sections.look_ahead import LookAhead, Tap


@pytest.mark.parametrize("seed", range(8))
def test_as_many_products_are_rounded_up_as_down(seed: int) -> None:
    rng = random.Random(seed)
    constants = [rng.choice((-1, 1)) * rng.randint(1, 99) for _ in range(rng.randint(0, 9))]
    assert {abs(total) for total in accumulate(directions(constants))} <= {0, 1}


def test_constants_stay_positive_where_they_can() -> None:
    assert directions([-7, 5, 3, -4]) == [-1, 1, 1, -1]
    assert directions([7, 5, 3, 4]) == [1, -1, 1, -1]


@pytest.mark.parametrize("constant", [3, -75001, 131071, 131072, -783785, 1729795, -(1 << 24) + 5])
def test_factors_make_up_the_constant(constant: int) -> None:
    upper, dropped, rest = factors(constant, 18)
    assert (upper << dropped) + rest == constant
    assert abs(upper) < 1 << 17
    assert abs(rest) < 1 << dropped


TAPS = {"b0": -801, "b1": 955, "b2": 1203, "b3": 77, "b4": -1021, "b5": -333}


def fir(floored: int | None) -> FirSection:
    products = tuple(TapProduct(name, c, 12, ((k, 1),), floored) for k, (name, c) in enumerate(TAPS.items()))
    return FirSection(name="fir", products=products, form=Form.TRANSPOSED, x=Range(0, -999, 999))


def test_an_fir_filter_of_products_that_drop_bits_is_right_on_average() -> None:
    rng = random.Random(1)
    rows = [[rng.randint(-999, 999)] for _ in range(600)]
    exact = [row[0] / 4096 for row in fir(None).graph.run(rows)]
    short = [row[0] / 16 for row in fir(4).graph.run(rows)]
    errors = [(a - b) * 16 for a, b in zip(short, exact, strict=True)]  # in units of what is kept
    assert max(map(abs, errors)) < len(TAPS) / 2
    assert max(map(abs, errors)) > 1
    assert abs(sum(errors) / len(errors)) < 0.2  # floored alone, they are short of half a unit each: of three
    (y,) = fir(4).graph.output_ranges
    assert y.frac == 4
    assert fir(4).coefficients == fir(None).coefficients == {name: (c, 12) for name, c in TAPS.items()}


def test_the_oldest_product_is_not_taken_off() -> None:
    """That would take a sum of its own."""
    assert sum(node.op in {Op.ADD, Op.SUBTRACT} for node in fir(4).graph.nodes) == len(TAPS) - 1


def section(a1: int, a2: int, floored: int | None) -> LookAhead:
    return LookAhead(
        name="section",
        distance=3,
        factors=(),
        recursion=(Tap("A1", a1, 20, 3, floored), Tap("A2", a2, 20, 6, floored)),
        x=Range(8, -(1 << 20), 1 << 20),
        fracs=(),
        ranges=(),
        y_frac=8,
        v_range=(-(1 << 60), 1 << 60),
    )


@pytest.mark.parametrize(
    ("a1", "a2", "products"),
    [
        (-98765, 43210, 2),
        (98765, 43210, 2),
        (-1729795, 823077, 4),  # constants of more than 17 bits are two
        (-1572865, 786433, 4),
        (-131071, -1, 2),
    ],
)
def test_a_recursion_with_products_that_drop_bits_is_right_on_average(a1: int, a2: int, products: int) -> None:
    graph = section(a1, a2, 8).graph
    constants = [node.parameter for node in graph.nodes if node.op is Op.SCALE]
    assert len(constants) == products
    assert all(abs(constant) < 1 << 17 for constant in constants)
    assert not any(node.op is Op.CONSTANT for node in graph.nodes)  # v drops no bits, and needs no half
    rng = random.Random(2)
    rows = [[rng.randint(-(1 << 20), 1 << 20)] for _ in range(400)]
    y = [0] * 6 + [row[0] for row in graph.run(rows)]
    errors = [
        Fraction(y[n + 6] - rows[n][0]) + Fraction(a1 * y[n + 3] + a2 * y[n], 1 << 20) for n in range(6, len(rows))
    ]
    assert max(map(abs, errors)) <= products / 2
    assert abs(sum(errors) / len(errors)) < 0.25  # whole units, if all were rounded to one side


def test_products_that_drop_nothing_stay_as_they_are() -> None:
    assert section(-98765, 43210, 28).graph == section(-98765, 43210, None).graph
