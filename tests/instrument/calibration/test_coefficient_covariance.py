"""The covariance of a calibration's coefficients gives the standard error that the calibration tells."""

import math

import numpy as np
import pytest
from scipy import stats

from sosmith.gen.calibration.fit import Measurements, fit
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.coefficient_covariance import of_bayes, of_least_squares, student
from sosmith.instrument.calibration.sensor_type import SENSOR_TYPES
from sosmith.instrument.calibration.uncertainty import of_polynomial, of_posterior
from sosmith.instrument.uncertainty.budget import Budget, Contribution
from sosmith.model.polynomial import EQUATION_5A

V, T = np.array([1.0, 3.0, 5.0, 9.0]), np.array([25.0, 60.0, 40.0, 90.0])
LAST = 105


@pytest.fixture(scope="module")
def measurements() -> Measurements:
    generator = np.random.default_rng(2)
    count, a_day = 90, 15
    v, t = generator.uniform(0.5, 9.5, count), generator.uniform(20.0, 95.0, count)
    d = EQUATION_5A(v, t)
    of_day = [0.1 * np.cos(d / 2 + generator.uniform(0, 6.28)) for _ in range(count // a_day)]
    day = np.arange(count) // a_day
    return Measurements(
        d + np.array(of_day)[day, np.arange(count)] + generator.normal(0, 0.1, count), v, t, "x", tuple(day + 100)
    )


def test_least_squares(measurements: Measurements) -> None:
    made = fit(measurements, 0.998)
    found = of_least_squares(measurements, made)
    assert found.standard(V, T) == pytest.approx(of_polynomial(measurements, made).standard_error(V, T), rel=1e-6)
    assert found.freedom == len(measurements) - 5


def test_a_later_day_has_the_whole_systematic_error(measurements: Measurements) -> None:
    made = bayesian_fit(measurements, SENSOR_TYPES["equation_5a"], LAST + 1, DEFAULT_RANGES)
    found = of_bayes(measurements, made)
    told = of_posterior(measurements, made).standard_error(V, T)
    mean_variance = [v / (v - 2) for v in (found.freedom, found.systematic_freedom)]
    parts = (found.standard(V, T) * math.sqrt(mean_variance[0]), found.systematic * math.sqrt(mean_variance[1]))
    assert np.hypot(*parts) == pytest.approx(told, rel=1e-6)
    assert parts[1] == pytest.approx(made.posterior.systematic, rel=0.15)
    assert 4 < found.systematic_freedom < 60


def test_the_budget_s_interval_is_the_posterior_s(measurements: Measurements) -> None:
    """The uncertainty of a variance counts once: Student's interval is that of the mixture over the scatters."""
    made = bayesian_fit(measurements, SENSOR_TYPES["equation_5a"], LAST + 1, DEFAULT_RANGES)
    found, one = of_bayes(measurements, made), np.ones(len(V))
    parts = ((found.standard(V, T), found.freedom), (found.systematic * one, found.systematic_freedom))
    budget = Budget(
        tuple(
            Contribution(source="s", kind="t", uncertainty=value, unit="mm", sensitivity=one, freedom=freedom)
            for value, freedom in parts
        )
    )
    assert budget.expanded == pytest.approx(of_posterior(measurements, made).half_width(V, T), rel=0.08)


def test_student_s_distribution_is_that_of_an_uncertain_variance() -> None:
    generator = np.random.default_rng(1)
    variances = 0.25 * 9.0 / generator.chisquare(9.0, 200_000)
    share, freedom = student(variances, np.full(len(variances), 1 / len(variances)))
    assert freedom == pytest.approx(9.0, rel=0.1)
    assert share * variances.mean() == pytest.approx(0.25, rel=0.02)
    drawn = generator.normal(0.0, np.sqrt(variances))
    half = stats.t.ppf(0.975, freedom) * np.sqrt(share * variances.mean())
    assert np.mean(np.abs(drawn) <= half) == pytest.approx(0.95, abs=0.003)
    assert student(np.array([4.0, 4.0]), np.array([0.5, 0.5])) == (1.0, math.inf)


def test_the_day_itself_has_the_rest(measurements: Measurements) -> None:
    made = bayesian_fit(measurements, SENSOR_TYPES["equation_5a"], LAST, DEFAULT_RANGES)
    found = of_bayes(measurements, made)
    told = of_posterior(measurements, made).standard_error(V, T)
    assert not made.plain
    assert np.hypot(found.standard(V, T), found.systematic) == pytest.approx(told, rel=0.5)
    assert found.systematic < 0.6 * made.posterior.systematic


def test_readings_at_a_rail_are_left_out(measurements: Measurements) -> None:
    voltage = measurements.voltage.copy()
    voltage[:4], voltage[4] = 0.0, 10.0
    railed = Measurements(
        measurements.clearance, voltage, measurements.temperature, measurements.source, measurements.days
    )
    made = bayesian_fit(railed, SENSOR_TYPES["equation_5a"], LAST, DEFAULT_RANGES)
    assert made.at_rail == 5
    assert [made.fit.weights[k] for k in range(5)] == [0.0] * 5
