"""The integer polynomial against rationals, over many shapes."""

import re
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sosmith.model.sections.horner import HornerPolynomial, Variable

V, T = Variable(name="voltage", bits=10), Variable(name="temperature", bits=8, signed=True)
rows = st.lists(st.lists(st.integers(-5000, 5000), min_size=1, max_size=4).map(tuple), min_size=1, max_size=5).map(
    tuple
)


def run(horner: HornerPolynomial, sample: list[int]) -> int:
    wires = sample
    for stage in horner.stages:
        wires = stage.graph.step(wires, [])
    (result,) = wires
    return result


@settings(max_examples=150)
@given(rows, st.integers(0, 1023), st.integers(-128, 127), st.integers(0, 9))
def test_error_is_at_most_half_an_lsb_per_rounding(
    coefficients: tuple[tuple[int, ...], ...], u: int, t: int, frac: int
) -> None:
    horner = HornerPolynomial(coefficients=coefficients, frac=frac, variables=(V, T))
    exact = sum(
        Fraction(c, 1 << frac) * Fraction(u, 1024) ** i * Fraction(t, 256) ** j
        for i, row in enumerate(coefficients)
        for j, c in enumerate(row)
    )
    roundings = sum(len(row) - 1 for row in coefficients) + len(coefficients) - 1
    error = Fraction(run(horner, [u, t]), 1 << frac) - exact
    assert abs(error) <= Fraction(roundings, 2 << frac)


@given(st.lists(st.integers(-5000, 5000).map(lambda c: (c,)), min_size=1, max_size=4).map(tuple), st.integers(0, 1023))
def test_one_variable(coefficients: tuple[tuple[int, ...], ...], u: int) -> None:
    horner = HornerPolynomial(coefficients=coefficients, frac=6, variables=(V,))
    exact = sum(Fraction(c, 64) * Fraction(u, 1024) ** i for i, (c,) in enumerate(coefficients))
    assert abs(Fraction(run(horner, [u]), 64) - exact) <= Fraction(len(coefficients) - 1, 128)


def test_equation_5a_takes_three_stages() -> None:
    horner = HornerPolynomial(coefficients=((1160, -460), (3672, 847), (5812,)), frac=8, variables=(V, T))
    assert [stage.name for stage in horner.stages] == ["row_power1", "column_power2", "column_power1"]


@pytest.mark.parametrize(
    ("coefficients", "variables", "message"),
    [
        ((), (V, T), "coefficients must have at least one row and no empty row"),
        (((1,), ()), (V, T), "coefficients must have at least one row and no empty row"),
        (((1,),), (), "variables must be one or two, not 0"),
        (((1, 2),), (V,), "coefficients must have one column where there is one variable"),
    ],
)
def test_refusals(coefficients: tuple[tuple[int, ...], ...], variables: tuple[Variable, ...], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        HornerPolynomial(coefficients=coefficients, frac=4, variables=variables)
