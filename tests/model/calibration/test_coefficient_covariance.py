"""The covariance of a calibration's coefficients gives the standard error that the calibration tells."""

import numpy as np
import pytest

from sosmith.model.calibration.acceptance import DEFAULT_RANGES
from sosmith.model.calibration.bayesian_fit import bayesian_fit
from sosmith.model.calibration.coefficient_covariance import of_bayes, of_least_squares
from sosmith.model.calibration.fit import Measurements, fit
from sosmith.model.calibration.polynomial import EQUATION_5A
from sosmith.model.calibration.sensor_type import SENSOR_TYPES
from sosmith.model.calibration.uncertainty import of_polynomial, of_posterior

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
    assert np.hypot(found.standard(V, T), found.systematic) == pytest.approx(told, rel=1e-6)
    assert found.systematic == pytest.approx(made.posterior.systematic, rel=0.15)
    assert 1 <= found.systematic_freedom < 60


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
