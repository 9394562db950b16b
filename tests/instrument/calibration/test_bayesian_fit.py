"""The Bayesian calibration: what it finds, what it leaves out, what it refuses."""

import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import FIRST, RANGES, TRUE, TYPE, fitted, measured

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.coefficient_covariance import columns, of_bayes
from sosmith.instrument.calibration.covered_region import CoveredRegion
from sosmith.instrument.calibration.fit_quality import assess_posterior
from sosmith.instrument.calibration.mixed_effects.day_polynomial import extremes, lowest_slope, stays_within
from sosmith.instrument.calibration.rails import rails_of
from sosmith.instrument.calibration.uncertainty import of_posterior
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A, Polynomial


def picked(measurements: Measurements, index: np.ndarray) -> Measurements:  # type: ignore[type-arg]
    """Return some of the measurements, in the order of `index`."""
    m = measurements
    days = tuple(np.array(m.days)[index].tolist())
    return Measurements(m.clearance[index], m.voltage[index], m.temperature[index], m.source, days)


def test_many_measurements_give_the_sensor_and_its_scatters() -> None:
    made = fitted(measured(25, 20, systematic=0.2), FIRST + 25)
    assert made.plain
    assert made.posterior.scatter == pytest.approx(0.3, rel=0.1)
    assert made.posterior.systematic == pytest.approx(0.2, rel=0.3)
    V, T = np.array([1.0, 5.0, 9.0]), np.array([30.0, 60.0, 90.0])
    assert made.fit.polynomial(V, T) == pytest.approx(TRUE(V, T), abs=0.12)


def test_without_a_systematic_error_none_is_found() -> None:
    assert fitted(measured(15, 20)).posterior.systematic < 0.06


def test_few_measurements_stay_near_the_type() -> None:
    made = fitted(measured(1, 5))
    V, T = np.array([1.0, 9.0]), np.array([30.0, 90.0])
    assert made.fit.polynomial(V, T) == pytest.approx(TRUE(V, T), abs=1.0)


def test_the_order_of_the_measurements_does_not_matter() -> None:
    rows = measured(3, 12, systematic=0.2)
    shuffled = np.random.default_rng(2).permutation(len(rows))
    one, other = fitted(rows), fitted(picked(rows, shuffled))
    assert one.fit.polynomial == other.fit.polynomial
    assert [one.fit.weights[k] for k in shuffled] == list(other.fit.weights)


def test_the_days_own_curve_is_used_on_that_day_only() -> None:
    rows = measured(8, 60, scatter=0.05, systematic=0.2)
    today, later = fitted(rows), fitted(rows, FIRST + 8)
    assert not today.plain
    assert later.plain
    last = np.array(rows.days) == FIRST + 7
    V, T, d = rows.voltage[last], rows.temperature[last], rows.clearance[last]
    off = [float(np.std(d - made.fit.polynomial(V, T))) for made in (today, later)]
    assert off[0] < 0.9 * off[1]
    half = [float(made.posterior.half_width(V, T, made.fit.polynomial(V, T), 0.95).mean()) for made in (today, later)]
    assert half[0] < half[1]


def test_outliers_are_left_out() -> None:
    rows = measured(4, 25)
    off = np.arange(0, 100, 20)
    clearance = rows.clearance.copy()
    clearance[off] += 3.0
    spoilt = Measurements(clearance, rows.voltage, rows.temperature, rows.source, rows.days)
    made = fitted(spoilt, FIRST + 4)
    assert set(np.flatnonzero(np.array(made.fit.weights) == 0)) >= set(off)
    V, T = np.array([1.0, 5.0, 9.0]), np.array([30.0, 60.0, 90.0])
    assert made.fit.polynomial(V, T) == pytest.approx(fitted(rows, FIRST + 4).fit.polynomial(V, T), abs=0.03)


def test_a_curve_that_falls_is_refused() -> None:
    rows = measured(2, 30, scatter=0.01, curve=TYPE.polynomial((3.0, -12.0, 0.0, 0.0, 7.0)))
    text = r"must rise with voltage_V over all measurements, not with a slope of -0\.\d+ mm/V somewhere$"
    with pytest.raises(SpecificationError, match=rf"^m\.csv: the clearance {text}"):
        fitted(rows)


def test_a_sensor_of_another_type_is_told_by_its_interval() -> None:
    V, T = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 9, 10), [20.0, 60.0, 98.0]))
    clearance = 3.0 + 0.15 * (V - 4.0) ** 2 + 0.001 * T
    made = fitted(Measurements(clearance, V, T, "m.csv", (FIRST,) * 30))
    off = np.abs(made.fit.polynomial(V, T) - clearance)
    assert off.max() > 1.0
    assert made.posterior.half_width(V, T, made.fit.polynomial(V, T), 0.95).mean() > 1.0


def test_too_many_outliers_are_refused() -> None:
    rows = measured(2, 30, scatter=0.05)
    clearance = rows.clearance + np.where(np.arange(60) % 10 < 3, 3.0, 0.0) * (-1) ** np.arange(60)
    text = "at most a quarter of the measurements must be outliers for a sensor of the type equation_5a"
    with pytest.raises(SpecificationError, match=rf"^m\.csv: {text}, not 18 of 60$"):
        fitted(Measurements(clearance, rows.voltage, rows.temperature, "m.csv", rows.days))


@pytest.mark.slow
def test_a_days_curve_that_leaves_the_range_falls_back_to_the_posterior() -> None:
    rows = measured(8, 60, scatter=0.05, systematic=0.2, seed=2)
    made = fitted(rows)
    assert not made.plain
    plain = TYPE.polynomial(made.posterior.deviations)
    (_, own), (_, most) = extremes(made.fit.polynomial, RANGES), extremes(plain, RANGES)
    between = ((0.0, float(own + most) / 2), *RANGES[1:])
    assert most < own
    narrow = bayesian_fit(rows, TYPE, FIRST + 7, between)
    assert narrow.plain
    assert narrow.fit.polynomial == plain


@pytest.mark.slow
def test_a_sensor_that_leaves_the_range_anyway_keeps_its_days_curve() -> None:
    rows = measured(8, 60, scatter=0.05, systematic=0.2, seed=2)
    own = fitted(rows).fit.polynomial
    made = bayesian_fit(rows, TYPE, FIRST + 7, ((0.0, 11.3), *RANGES[1:]))
    assert (made.plain, made.fit.polynomial) == (False, own)


@pytest.mark.slow
def test_a_day_is_followed_by_as_high_an_order_as_it_needs() -> None:
    rows = measured(3, 60, scatter=0.05, systematic=0.2)
    kind = replace(TYPE, order=6)
    low, high = (bayesian_fit(rows, one, FIRST + 2, RANGES) for one in (TYPE, kind))
    assert (low.fit.orders, high.fit.orders) == ((2, 1), (6, 1))
    V, T = rows.voltage[-60:], rows.temperature[-60:]
    off = [float(np.std(one.fit.polynomial(V, T) - one.posterior.curve(V, T))) for one in (low, high)]
    assert off[1] < 0.2 * off[0]
    assert re.fullmatch(
        r"the polynomial of orders 2, 1 misses the curve of the day by 0\.\d+ mm rms, by which its intervals are "
        "wider: a higher --order follows it, where the hardware has room",
        low.missed,
    )
    assert high.missed == ""
    assert bayesian_fit(rows, kind, FIRST + 3, RANGES).fit.orders == (2, 1)


@pytest.mark.parametrize(
    ("polynomial", "inside"),
    [(EQUATION_5A, True), ([[15.0], [0.3], [-0.02]], False), ([[0.1], [-0.1], [0.02]], False), ([[5], [0], [0]], True)],
)
def test_the_range_is_exact_at_ends_and_turns(polynomial: Polynomial | list[list[float]], inside: bool) -> None:
    made = polynomial if isinstance(polynomial, Polynomial) else Polynomial.from_numbers(polynomial)
    assert stays_within(made, RANGES) == inside
    V, T = np.meshgrid(np.linspace(0, 10, 201), [0.0, 128.0])
    values = made(V, T)
    assert bool(np.all((values >= 0) & (values <= 16))) == inside


def test_high_orders_are_enclosed_over_the_ports_and_along_the_edges() -> None:
    generator = np.random.default_rng(4)
    grid = np.linspace(0.0, 10.0, 401)
    region = CoveredRegion(((1.0, 20.0), (8.0, 25.0), (9.0, 90.0), (2.0, 80.0)))
    for order in (3, 6, 8):
        rows = [
            [float(generator.normal() / 5.0**i), float(generator.normal() / 5.0**i / 100)] for i in range(order + 1)
        ]
        polynomial = Polynomial.from_numbers(rows)
        values = np.array([polynomial(grid, T) for T in RANGES[2]])
        low, high = map(float, extremes(polynomial, RANGES))
        assert low <= values.min() + 1e-12
        assert values.max() - 1e-12 <= high
        assert high - low < 1.005 * np.ptp(values)
        V, T = region.points()
        slopes = (polynomial(V + 1e-5, T) - polynomial(V - 1e-5, T)) / 2e-5
        lowest = float(lowest_slope(polynomial, region))
        assert lowest <= slopes.min() + 1e-6
        assert slopes.min() - lowest < 0.1 * np.ptp(slopes)


def test_a_polynomial_that_turns_often_is_enclosed_closely() -> None:
    turning = np.polynomial.Chebyshev([0.0] * 8 + [1.0], domain=[0.0, 10.0]).convert(kind=np.polynomial.Polynomial)
    low, high = extremes(Polynomial.from_numbers([[c] for c in turning.coef.tolist()]), RANGES)
    assert -1.2 < low <= -1.0
    assert 1.0 <= high < 1.1


def test_the_lowest_slope_is_at_a_corner() -> None:
    region = CoveredRegion(((0.0, 20.0), (8.0, 20.0), (8.0, 90.0), (0.0, 90.0)))
    polynomial = Polynomial.from_numbers([["1", "0"], ["0.5", "-0.004"], ["0.03"]])
    assert lowest_slope(polynomial, region) == Fraction("0.5") - 90 * Fraction("0.004")


def test_days_must_be_as_many_as_measurements() -> None:
    with pytest.raises(ValueError, match=r"^days must be of length 3, not 2$"):
        Measurements(np.ones(3), np.ones(3), np.ones(3), "m.csv", (1, 2))


def test_measurements_of_one_temperature_are_fitted_by_the_prior() -> None:
    """What the temperature does is known from the type only: intervals are wide away from it."""
    made = measured(2, 30, scatter=0.02)
    cold = replace(made, temperature=np.full(60, 20.0), clearance=TRUE(made.voltage, np.full(60, 20.0)))
    found = fitted(cold)
    V = np.array([2.0, 5.0, 8.0])
    at, beyond = (np.full(3, T) for T in (20.0, 90.0))
    assert found.fit.polynomial(V, at) == pytest.approx(TRUE(V, at), abs=0.02)
    worth = of_posterior(cold, found)
    assert np.all(worth.half_width(V, beyond) > 5 * worth.half_width(V, at))
    assert np.all(np.abs(found.fit.polynomial(V, beyond) - TRUE(V, beyond)) < worth.half_width(V, beyond))
    assert assess_posterior(cold, found).filled_cells > 0.05
    exported = of_bayes(cold, found)
    V, T = np.full(1, 5.0), np.full(1, 25.0)
    x = columns(exported.lengths, V, T)
    assert float(x[:, 0] @ exported.covariance @ x[:, 0]) ** 0.5 > 0.01
    with pytest.raises(SpecificationError, match=r"^m\.csv: voltage_V must vary, not be 5\.0 in every row$"):
        fitted(replace(made, voltage=np.full(60, 5.0)))


def test_a_rail_is_found_at_one_temperature() -> None:
    made = measured(2, 30, scatter=0.02)
    T = np.full(60, 20.0)
    V = np.minimum(made.voltage, 6.0)
    scatter = 0.02 * (-1.0) ** np.arange(60)
    railed = replace(made, temperature=T, voltage=V, clearance=TRUE(made.voltage, T) + scatter)
    assert rails_of(railed, RANGES[1]).ends == (0.0, 6.0)
