"""Figures of a fit, each by a route of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.instrument.calibration.measuring import as_arrays, readings

from sosmith.gen.calibration.fit import Measurements, fit, residuals, terms_of
from sosmith.gen.calibration.least_squares import Solution, Sums
from sosmith.instrument.calibration.covered_region import CoveredRegion
from sosmith.instrument.calibration.fit_quality import assess
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A, Polynomial


def hat_matrix(data: Measurements, orders: tuple[int, int], weights: np.ndarray) -> np.ndarray:
    columns = np.stack([data.voltage**i * data.temperature**j for i, j in terms_of(orders)], axis=1)
    return columns @ np.linalg.solve(columns.T @ (weights[:, None] * columns), columns.T * weights)


@pytest.mark.parametrize("robust", [False, True])
def test_leverage_is_the_diagonal_of_the_hat_matrix(robust: bool) -> None:
    data = as_arrays(readings(80, scatter=0.2))
    made = fit(data, 0.99, robust=robust)
    assert (min(made.weights, default=1.0) < 1) == robust
    quality = assess(data, made)
    weights = np.array(made.weights) if robust else np.ones(80)
    assert quality.leverage == pytest.approx(np.diag(hat_matrix(data, made.orders, weights)), abs=1e-9)
    assert quality.leverage.sum() == pytest.approx(len(terms_of(made.orders)))


def test_cross_validated_error_by_leaving_each_measurement_out() -> None:
    rows = readings(30, scatter=0.2)
    data = as_arrays(rows)
    made = fit(data, 0.99)
    errors = []
    for k, (d, V, T) in enumerate(rows):
        others = fit(as_arrays(rows[:k] + rows[k + 1 :]), 0.99)
        assert others.orders == made.orders
        errors.append(d - float(others.polynomial(V, T)))
    assert assess(data, made).cross_validated == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=1e-9)


def test_a_measurement_that_alone_determines_a_coefficient() -> None:
    rows = [(1.0, 1.0, 20.0), (2.1, 2.0, 20.0), (3.0, 3.0, 20.0), (4.0, 4.0, 20.0), (5.0, 5.0, 90.0)]
    quality = assess(as_arrays(rows), fit(as_arrays(rows)))
    assert quality.leverage[4] == pytest.approx(1.0)
    assert quality.cross_validated is None


def test_far_measurements_have_high_leverage() -> None:
    rows = [(5.0 + 0.1 * k, 5.0 + 0.1 * k, 20.0 + 7 * k % 11) for k in range(40)]
    quality = assess(as_arrays([*rows, (0.9, 1.0, 97.0)]), fit(as_arrays([*rows, (0.9, 1.0, 97.0)]), 0.9))
    assert quality.high_leverage == (40,)
    assert quality.largest_residuals(1) != (40,)  # it pulls the fit to itself


def test_the_region_is_the_convex_hull() -> None:
    V, T = np.array([0.0, 2.0, 2.0, 0.0, 1.0, 1.0]), np.array([20.0, 20.0, 60.0, 60.0, 20.0, 40.0])
    region = CoveredRegion.of(V, T)
    assert region.corners == ((0.0, 20.0), (2.0, 20.0), (2.0, 60.0), (0.0, 60.0))
    assert region.area == 80.0
    triangle = CoveredRegion.of(V[:3], T[:3])
    assert triangle.area == 40.0
    v, t = triangle.points()
    assert np.all(t <= 20 + 20 * v + 1e-9)
    assert {(0.0, 20.0), (2.0, 20.0), (2.0, 60.0)} <= set(zip(v.tolist(), t.tolist(), strict=True))


def test_drift_counts_inside_the_region_only() -> None:
    region = CoveredRegion.of(np.array([0.0, 2.0, 2.0]), np.array([20.0, 20.0, 60.0]))
    zero, tilted = Polynomial.from_numbers([["0"]]), Polynomial.from_numbers([["-2", "0.1"], ["-2"]])
    assert region.largest_difference(zero, zero) == 0.0
    # -2 + T / 10 - 2 V is 0 at two corners and along the third side; at (0, 60), outside, it would be 4.
    assert region.largest_difference(zero, tilted) == pytest.approx(4.0, abs=1e-12)
    assert tilted(2.0, 20.0) == -4.0


def test_filled_cells() -> None:
    steps = np.linspace(0, 1, 10)
    V, T = (axis.ravel() for axis in np.meshgrid(9 * steps, 20 + 70 * steps))
    data = Measurements(EQUATION_5A(V, T), V, T)
    assert assess(data, fit(data)).filled_cells == 1.0
    half = Measurements(data.clearance[:50], V[:50], T[:50])
    assert assess(half, fit(half)).filled_cells == 0.5


def test_outliers_hardly_move_a_robust_fit() -> None:
    rows = readings(200)
    spoilt = [(d + 4.0, V, T) if k % 20 == 0 else (d, V, T) for k, (d, V, T) in enumerate(rows)]
    data = as_arrays(spoilt)
    region = assess(data, fit(data, 0.9)).region
    plain, robust = (fit(data, 0.5, robust=chosen) for chosen in (False, True))
    clean = fit(as_arrays(rows), 0.5)
    assert plain.orders == robust.orders == clean.orders
    off = {
        name: region.largest_difference(clean.polynomial, made.polynomial)
        for name, made in (("plain", plain), ("robust", robust))
    }
    assert off["robust"] < off["plain"] / 2
    assert max(robust.weights[::20]) < 0.5
    assert fit(data, 0.5, robust=True) == robust


def test_a_robust_fit_without_outliers_is_close_and_stays_put() -> None:
    data = as_arrays(readings(200))
    plain, robust = fit(data, 0.999), fit(data, 0.999, robust=True)
    assert robust.rms == pytest.approx(plain.rms, rel=0.01)
    limit = 1.345 * 1.4826 * np.median(np.abs(residuals(data, robust.polynomial)))
    expected = np.minimum(1, limit / np.abs(residuals(data, robust.polynomial)))
    assert np.array(robust.weights) == pytest.approx(expected, abs=1 / 1024)


def test_a_robust_fit_to_data_without_scatter_ends() -> None:
    data = as_arrays(readings(50, scatter=0.0))
    exact = replace(data, clearance=EQUATION_5A(data.voltage, data.temperature))
    assert fit(exact, 0.9999999, robust=True).weights == (1.0,) * 50


def weighted_to_the_end(data: Measurements, orders: tuple[int, int]) -> tuple[Solution, int]:
    """Carry every round of weighting out; returns the solution, and how often weights came again before the end."""
    weights, seen, again = np.ones(len(data)), set(), 0
    for number in range(1, 26):
        solution = Sums(data.clearance, data.voltage, data.temperature, weights).solve(terms_of(orders))
        assert solution is not None
        off = np.abs(residuals(data, solution.polynomial))
        allowed = 1.345 * max(1.4826 * float(np.median(off)), 1e-6)
        before = weights
        weights = np.maximum(np.rint(allowed / np.maximum(off, allowed) * 1024), 1) / 1024
        if np.array_equal(weights, before) or number == 25:
            break
        again += weights.tobytes() in seen
        seen.add(weights.tobytes())
    return solution, again


def test_weights_that_come_again_end_where_all_rounds_would() -> None:
    turned = 0
    for seed in range(4):
        generator = np.random.default_rng(seed)
        V, T = np.round(generator.uniform(0, 10, 200), 3), np.round(generator.uniform(20, 98, 200), 1)
        data = Measurements(np.round(np.abs(2 + 0.8 * V + 0.5 * generator.standard_t(1, 200)), 3), V, T)
        expected, again = weighted_to_the_end(data, (1, 1))
        turned += again > 0
        made = fit(data, 0, robust=True)
        assert made.polynomial == expected.polynomial
        unexplained = (expected.residual_squares / 197) / (expected.total_squares / 199)
        assert made.adjusted_r_squared == 1 - float(unexplained)
    assert turned == 2


@pytest.mark.slow
def test_10000_measurements_that_no_robust_fit_satisfies_are_refused() -> None:
    with pytest.raises(SpecificationError, match=r"^measurements: adjusted r must reach 0\.9999 "):
        fit(as_arrays(readings(10_000, scatter=0.3)), 0.9999, robust=True)


def test_progress_tells_how_many_orders_were_tried() -> None:
    told: list[tuple[int, int]] = []
    fit(as_arrays(readings(50)), 0.999, progress=lambda tried, count: told.append((tried, count)))
    assert told == [(0, 36), (1, 36)]
