"""Least squares: the exact minimum, correctly rounded, whatever the order of the measurements."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from flint import fmpq, fmpq_mat
from tests.instrument.calibration.measuring import readings

from sosmith.gen.calibration.fit import terms_of
from sosmith.gen.calibration.least_squares import Sums


def exact_minimum(
    rows: list[tuple[float, float, float]], terms: tuple[tuple[int, int], ...], weights: list[float]
) -> list[Fraction]:
    """Solve equation 3 as printed, in rational numbers."""

    def rational(value: Fraction) -> fmpq:
        return fmpq(value.numerator, value.denominator)

    exact = [(*map(Fraction, row), Fraction(weight)) for row, weight in zip(rows, weights, strict=True)]
    gram = [
        [rational(sum(w * v ** (i + p) * t ** (j + q) for _, v, t, w in exact)) for i, j in terms] for p, q in terms
    ]
    right = [[rational(sum(w * d * v**p * t**q for d, v, t, w in exact))] for p, q in terms]
    solved = fmpq_mat(gram).solve(fmpq_mat(right))
    return [Fraction(int(solved[k, 0].p), int(solved[k, 0].q)) for k in range(len(terms))]


@pytest.mark.parametrize("orders", [(1, 1), (2, 1), (2, 3), (5, 4)])
@pytest.mark.parametrize("weighted", [False, True])
def test_every_coefficient_is_the_exact_one_rounded_once(orders: tuple[int, int], weighted: bool) -> None:
    rows, terms = readings(40), terms_of(orders)
    weights = [1.0 - 0.3 * (k % 3) for k in range(len(rows))] if weighted else [1.0] * len(rows)
    d, V, T = np.array(rows).T
    solution = Sums(d, V, T, np.array(weights) if weighted else None).solve(terms)
    assert solution is not None
    found = [float(solution.polynomial.coefficients[i][j]) for i, j in terms]
    assert found == [float(a) for a in exact_minimum(rows, terms, weights)]


def test_a_double_solver_does_not_round_like_that() -> None:
    rows, terms = readings(40), terms_of((5, 4))
    d, V, T = np.array(rows).T
    doubles, *_ = np.linalg.lstsq(np.stack([V**i * T**j for i, j in terms], axis=1), d)
    assert doubles.tolist() != [float(a) for a in exact_minimum(rows, terms, [1.0] * 40)]


def test_the_order_of_measurements_does_not_matter() -> None:
    rows, terms = readings(200), terms_of((3, 3))
    there, back = (Sums(*np.array(order).T).solve(terms) for order in (rows, rows[::-1]))
    assert there is not None
    assert there == back


def test_sums_of_squares_by_their_definition() -> None:
    d, V, T = np.array(readings(100)).T
    solution = Sums(d, V, T).solve(terms_of((2, 1)))
    assert solution is not None
    residual = d - solution.polynomial(V, T)
    assert float(solution.residual_squares) == pytest.approx(float(np.sum(residual**2)), rel=1e-9)
    assert float(solution.total_squares) == pytest.approx(float(np.sum((d - d.mean()) ** 2)), rel=1e-12)


def test_dependent_terms_are_not_determined() -> None:
    d, V, _ = np.array(readings(50)).T
    assert Sums(d, V, 20 + 8.1 * V).solve(terms_of((1, 1))) is None  # but for rounding, on a line
    assert Sums(d, V, 20 + 8.1 * V + 1e-6 * (V - 5) ** 2).solve(terms_of((1, 1))) is not None


def test_other_weights_give_what_they_give_from_the_start() -> None:
    d, V, T = np.array(readings(60)).T
    first, second = (np.random.default_rng(seed).integers(1, 1025, 60) / 1024 for seed in (1, 2))
    second[::2] = first[::2]
    third = np.where(np.arange(60) < 5, second / 3, second)  # not on the grid of the others
    sums = Sums(d, V, T)
    for weights in (first, second, third, third, np.ones(60)):
        sums = sums.reweighted(weights)
        for orders in ((1, 1), (4, 3)):  # the second asks for sums that no turn before was asked for
            if orders == (1, 1) or weights is third:
                assert sums.solve(terms_of(orders)) == Sums(d, V, T, weights).solve(terms_of(orders))
