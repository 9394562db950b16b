"""Calibration polynomial: known values, Horner against exact rational arithmetic, refusals."""

from __future__ import annotations

import re
from fractions import Fraction

import numpy as np
import pytest

from sosmith.model.polynomial import EQUATION_5A, Polynomial


def test_equation_5a_at_a_point_worked_by_hand() -> None:
    # 1.16 - 0.0036*50 + 5*(0.3672 + 0.0006618*50) + 25*0.05812
    assert EQUATION_5A.exact(Fraction(5), Fraction(50)) == Fraction("4.43445")
    assert EQUATION_5A(5.0, 50.0) == pytest.approx(4.43445, abs=1e-14)
    assert EQUATION_5A.orders == (2, 1)


def test_double_evaluation_agrees_with_exact_one() -> None:
    rng = np.random.default_rng(1)
    polynomial = Polynomial.from_numbers([rng.normal(size=width) for width in (3, 1, 4, 2)])
    V, T = rng.uniform(-2, 2, (2, 200))
    exact = [float(polynomial.exact(Fraction(v), Fraction(t))) for v, t in zip(V.tolist(), T.tolist(), strict=True)]
    np.testing.assert_allclose(polynomial(V, T), exact, rtol=0, atol=1e-12)
    assert polynomial.orders == (3, 3)


def test_arguments_broadcast() -> None:
    V, T = np.array([[0.0], [1.0], [2.0]]), np.array([20.0, 98.0])
    assert EQUATION_5A(V, T).shape == (3, 2)
    assert EQUATION_5A(V, T)[2, 1] == EQUATION_5A(2.0, 98.0)


def test_polynomial_of_one_variable_needs_no_second_one() -> None:
    square = Polynomial.from_numbers([[1], [0], [2]])
    assert square.exact(Fraction(3)) == 19
    assert square(np.array([3.0])).tolist() == [19.0]


def test_a_string_is_its_decimal_value_and_a_float_its_binary_one() -> None:
    assert Polynomial.from_numbers([["0.1"]]).coefficients == ((Fraction(1, 10),),)
    assert Polynomial.from_numbers([[0.1]]).coefficients == ((Fraction(0.1),),)
    assert Fraction(0.1) != Fraction(1, 10)


@pytest.mark.parametrize(
    ("coefficients", "error", "message"),
    [
        ((), ValueError, "coefficients must have at least one row, not none"),
        (((Fraction(1),), ()), ValueError, "coefficients[1] must have at least one coefficient, not none"),
        (((0.5,),), TypeError, "coefficients[0] must hold Fractions, not 0.5"),
    ],
)
def test_refusals(coefficients: tuple[tuple[Fraction, ...], ...], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=f"^{re.escape(message)}$"):
        Polynomial(coefficients)
