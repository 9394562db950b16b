"""Regression: known polynomials are found again, orders rise as the paper says, bad data is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from sosmith.gen.calibration.fit import Measurements, candidate_orders, fit, read_measurements
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A, Polynomial

HEADER = "clearance_mm,voltage_V,temperature_C\n"


def grid(temperatures: int = 9) -> tuple[Values, Values]:
    """Voltages and temperatures over the paper's ranges, 25 voltages at each temperature."""
    V, T = np.meshgrid(np.linspace(0.1, 9.6, 25), np.linspace(20.0, 98.0, temperatures))
    return V.ravel(), T.ravel()


def measure(polynomial: Polynomial, scatter: float = 0.0, seed: int = 1) -> Measurements:
    V, T = grid()
    noise = np.random.default_rng(seed).normal(0.0, scatter, len(V)) if scatter else 0.0
    return Measurements(np.maximum(polynomial(V, T) + noise, 0.0), V, T)


def coefficients(polynomial: Polynomial) -> list[list[float]]:
    return [[float(a) for a in row] for row in polynomial.coefficients]


def test_noiseless_equation_5a_is_found_again() -> None:
    result = fit(measure(EQUATION_5A), required_r=0.9999999)
    assert result.orders == (2, 1)
    expected = coefficients(EQUATION_5A)
    assert [len(row) for row in result.polynomial.coefficients] == [2, 2, 1]
    for found, known in zip(coefficients(result.polynomial), expected, strict=True):
        assert found == pytest.approx(known, rel=1e-9, abs=0)
    assert result.rms < 1e-13
    assert result.adjusted_r == pytest.approx(1.0, abs=1e-15)


def test_linear_regression_is_rejected_where_it_falls_short() -> None:
    # Scatter of 0.55 mm brings the linear model below 0.975, as equation 5b with its 0.9743.
    result = fit(measure(EQUATION_5A, scatter=0.55))
    (linear,) = result.rejected
    assert linear.orders == (1, 1)
    assert linear.terms == 3
    assert 0.95 < linear.adjusted_r < 0.975
    assert result.orders == (2, 1)
    assert result.adjusted_r >= 0.975
    assert result.adjusted_r_squared == pytest.approx(result.adjusted_r**2)


def test_linear_regression_is_kept_where_it_is_good_enough() -> None:
    result = fit(measure(Polynomial.from_numbers([[-0.3407, 0.00595], [0.9617]]), scatter=0.1))
    assert result.orders == (1, 1)
    assert result.rejected == ()


def test_adjusted_r_squared_and_rms_by_their_definition() -> None:
    data = measure(EQUATION_5A, scatter=0.3)
    result = fit(data)
    residual = data.clearance - result.polynomial(data.voltage, data.temperature)
    r_squared = 1 - residual.var() / data.clearance.var()  # the residual's mean is zero: the model has a constant
    n, p = len(data), sum(len(row) for row in result.polynomial.coefficients)
    assert result.adjusted_r_squared == pytest.approx(1 - (1 - r_squared) * (n - 1) / (n - p), abs=1e-12)
    assert result.rms == pytest.approx(residual.std(), rel=1e-9)


def test_least_squares_minimum_by_an_independent_route() -> None:
    # Exact normal equations of equation 3 in rational arithmetic, on few short numbers.
    rows = [(0.5, 1.0, 20.0), (1.5, 2.0, 30.0), (4.0, 4.0, 25.0), (6.5, 6.0, 40.0), (7.0, 7.0, 90.0)]
    data = Measurements(*(np.array(column) for column in zip(*rows, strict=True)))
    matrix = [[1, int(v), int(t)] for _, v, t in rows]
    gram = np.array([[sum(a[i] * a[j] for a in matrix) for j in range(3)] for i in range(3)], dtype=np.float64)
    right = np.array([sum(a[i] * d for a, (d, _, _) in zip(matrix, rows, strict=True)) for i in range(3)])
    expected = np.linalg.solve(gram, right)
    found = fit(data, required_r=0.9).polynomial.coefficients
    assert [float(a) for a in (found[0][0], found[1][0], found[0][1])] == pytest.approx(expected.tolist(), rel=1e-9)


def test_ill_conditioned_order_4_keeps_the_digits_that_the_gram_matrix_loses() -> None:
    quartic = Polynomial.from_numbers([[1.16, -3.6e-3, 2e-5], [0.3672, 6.6e-4, 1e-6], [0.058, 1e-5], [1e-3], [2e-4]])
    V, T = grid()
    terms = [(i, j) for i in range(5) for j in range(3) if i + j <= 4]
    known = {(i, j): float(a) for i, row in enumerate(quartic.coefficients) for j, a in enumerate(row)}
    result = fit(measure(quartic), required_r=1 - 1e-9)
    assert result.orders == (4, 2)
    found = {(i, j): float(a) for i, row in enumerate(result.polynomial.coefficients) for j, a in enumerate(row)}
    raw = np.stack([V**i * T**j for i, j in terms], axis=1)
    gram = dict(zip(terms, np.linalg.solve(raw.T @ raw, raw.T @ quartic(V, T)), strict=True))
    ours = max(abs(found[term] / value - 1) for term, value in known.items())
    theirs = max(abs(gram[term] / value - 1) for term, value in known.items())
    assert ours < 1e-10
    assert theirs > 100 * ours


def test_orders_rise_by_count_of_terms_from_the_linear_polynomial() -> None:
    orders = candidate_orders()
    assert orders[:7] == ((1, 1), (2, 1), (1, 2), (2, 2), (3, 1), (1, 3), (3, 2))
    assert orders[-1] == (6, 6)
    assert len(set(orders)) == 36


def test_a_cubic_in_temperature_is_found() -> None:
    cubic = Polynomial.from_numbers([[5.0, 0.0, -0.004, 4.5e-5], [0.3]])
    result = fit(measure(cubic), required_r=0.99999)
    assert result.orders == (1, 3)
    assert (2, 2) in [trial.orders for trial in result.rejected]


def test_two_temperatures_pass_over_orders_they_cannot_determine() -> None:
    V, T = grid(temperatures=2)
    result = fit(Measurements(EQUATION_5A(V, T) + 0.02 * V**3, V, T), required_r=0.9999999)
    assert result.orders == (3, 1)
    assert [trial.orders for trial in result.rejected] == [(1, 1), (2, 1)]


def test_same_measurements_same_fit() -> None:
    assert fit(measure(EQUATION_5A, 0.3)) == fit(measure(EQUATION_5A, 0.3))


def refused(measurements: Measurements, message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        fit(measurements)


def test_fit_refusals() -> None:
    V, T = grid()
    d = EQUATION_5A(V, T)
    refused(
        Measurements(d[:3], V[:3], T[:3], "m.csv"),
        "m.csv must hold at least 4 measurements for a linear regression, not 3",
    )
    refused(Measurements(d, V, 0 * T + 20, "m.csv"), "m.csv: temperature_C must vary, not be 20.0 in every row")
    refused(Measurements(d, 0 * V, T, "m.csv"), "m.csv: voltage_V must vary, not be 0.0 in every row")
    refused(Measurements(0 * d + 1, V, T, "m.csv"), "m.csv: clearance_mm must vary, not be 1.0 in every row")
    refused(
        Measurements(d, V, 20 + 8.1 * V, "m.csv"),
        "m.csv: voltage_V and temperature_C must vary independently, not along one straight line",
    )


def test_measurements_without_any_law_are_refused() -> None:
    V, T = grid()
    d = np.random.default_rng(5).uniform(0, 10, len(V))
    pattern = (
        r"^measurements: adjusted r must reach 0\.975 with a polynomial up to order 6, "
        r"not at most 0\.\d{4} \(orders \d, \d\)$"
    )
    with pytest.raises(SpecificationError, match=pattern):
        fit(Measurements(d, V, T))


def test_measurements_refuse_wrong_shapes_and_numbers() -> None:
    one, two = np.array([1.0]), np.array([1.0, 2.0])
    with pytest.raises(ValueError, match=f"^{re.escape('voltage must be of shape (2,), not (1,)')}$"):
        Measurements(two, one, two)
    with pytest.raises(ValueError, match=r"^temperature must be finite, not nan$"):
        Measurements(two, two, np.array([1.0, np.nan]))


def test_read_measurements(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text("temperature_C,clearance_mm,voltage_V\n20,0,0.5\n20,1,1.5\n")
    data = read_measurements(path)
    assert data.clearance.tolist() == [0, 1]
    assert data.voltage.tolist() == [0.5, 1.5]
    assert data.temperature.tolist() == [20, 20]
    assert data.source == str(path)
    assert len(data) == 2


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (HEADER + "1,2,20\n-0.5,2,20\n", ", line 3: clearance_mm must be 0 or more, not -0.5"),
        (
            HEADER + "1,2,20\n2,3,20\n\n1.0,2,2e1\n",
            ", line 5: row must be a new measurement, not a duplicate of line 2",
        ),
        (
            "clearance_mm,voltage_V\n1,2\n",
            ", line 1: column temperature_C must be present, not missing from clearance_mm, voltage_V",
        ),
        (
            "clearance,voltage_V,temperature_C\n1,2,3\n",
            ", line 1: column must be one of clearance_mm, voltage_V, temperature_C, date, "
            "uncertainty_mm, uncertainty_V, uncertainty_C, not 'clearance'",
        ),
    ],
)
def test_read_measurements_refusals(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "m.csv"
    path.write_text(content)
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(path) + message)}$"):
        read_measurements(path)
