"""What a calibration says of itself, against the truth over many emulated sensors."""

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import FIRST, RANGES, TRUE, TYPE, measured
from tests.instrument.calibration.measuring import as_arrays, readings

from sosmith.gen.calibration.fit import Measurements, fit
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.uncertainty import of_polynomial, of_posterior
from sosmith.model.polynomial import EQUATION_5A

V, T = (grid.ravel() for grid in np.meshgrid(np.linspace(1.0, 9.0, 9), [30.0, 60.0, 90.0]))


def test_intervals_of_least_squares_hold_a_curve_of_the_right_orders() -> None:
    inside = []
    for seed in range(60):
        rows = as_arrays(readings(60, 0.2, seed))
        made = fit(rows, 0.99)
        found = of_polynomial(rows, made)
        assert found.over_days is None
        inside.append(np.abs(made.polynomial(V, T) - EQUATION_5A(V, T)) <= found.half_width(V, T))
    assert 0.91 < np.mean(inside) < 0.99


def test_intervals_of_a_line_through_a_curve_include_what_it_misses() -> None:
    rows = as_arrays(readings(60, 0.05))
    made = fit(rows)
    assert made.orders == (1, 1)
    found = of_polynomial(rows, made)
    assert found.lack.structured
    assert np.mean(np.abs(made.polynomial(V, T) - EQUATION_5A(V, T)) <= found.half_width(V, T)) > 0.9
    assert found.standard_error(V, T).max() < 0.3 * found.half_width(V, T).min()


@pytest.mark.slow
def test_bayesian_intervals_hold_the_clearance_of_readings_on_another_day() -> None:
    inside, over_days = [], []
    for seed in range(5):
        rows = measured(5, 12, systematic=0.15, seed=seed)
        made = bayesian_fit(rows, TYPE, FIRST + 5, RANGES)
        found = of_posterior(rows, made)
        phases = np.random.default_rng([seed, 1]).uniform(0, 2 * np.pi, (50, 1))
        of_day = np.sqrt(2) * 0.15 * np.sin(2 * np.pi * TRUE(V, T) / 8.0 + phases)
        off = made.fit.polynomial(V, T) + of_day - TRUE(V, T)
        inside.append(np.abs(off) <= found.half_width(V, T))
        assert found.over_days is not None
        over_days.append(found.over_days.inside)
    assert 0.85 < np.mean(inside) < 0.999
    assert 0.9 < np.mean(over_days) < 0.99


def test_days_are_predicted_from_other_days_only() -> None:
    """A day with an offset of its own is not held by intervals that know nothing of such days."""
    rows = measured(2, 40, scatter=0.05)
    shifted = rows.clearance + np.where(np.array(rows.days) > FIRST, 1.0, 0.0)
    apart = Measurements(shifted, rows.voltage, rows.temperature, rows.source, rows.days)
    made = fit(apart, 0.9)
    found = of_polynomial(apart, made).over_days
    assert found is not None
    assert found.inside < 0.6
    assert found.rms > 0.9
    alike = of_polynomial(rows, fit(rows, 0.99)).over_days
    assert alike is not None
    assert alike.inside > 0.85


def test_the_limits_are_those_over_the_covered_region() -> None:
    rows = as_arrays(readings(60, 0.2))
    found = of_polynomial(rows, fit(rows, 0.99))
    half = found.half_width(*found.region.points())
    low, high = found.limits
    assert half.min() <= low <= 1.02 * half.min()
    assert high == pytest.approx(half.max())
