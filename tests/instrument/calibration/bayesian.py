"""Measurements of a sensor type to fit."""

import numpy as np

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.bayesian_fit import BayesianFit, bayesian_fit
from sosmith.instrument.calibration.measurement_store import Version
from sosmith.instrument.calibration.sensor_type import SENSOR_TYPES
from sosmith.model.polynomial import Polynomial

TYPE = SENSOR_TYPES["equation_5a"]


RANGES = ((0.0, 16.0), (0.0, 10.0), (0.0, 128.0))


FIRST = 738000


TRUE = TYPE.polynomial((0.6, -0.8, 0.4, 0.1, 0.5))


def measured(
    days: int, each: int, *, scatter: float = 0.3, systematic: float = 0.0, seed: int = 1, curve: Polynomial = TRUE
) -> Measurements:
    """Measurements of a sensor whose day has an error of one period of 8 mm, of random phase."""
    generator = np.random.default_rng(seed)
    day = np.repeat(np.arange(days), each)
    V, T = generator.uniform(0.5, 9.5, days * each), generator.uniform(20.0, 98.0, days * each)
    clearance = curve(V, T)
    phase = generator.uniform(0, 2 * np.pi, days)[day]
    error = np.sqrt(2) * systematic * np.sin(2 * np.pi * clearance / 8.0 + phase)
    d = np.maximum(clearance + error + generator.normal(0, scatter, len(day)), 0)
    return Measurements(d, V, T, "m.csv", tuple((FIRST + day).tolist()))


def fitted(measurements: Measurements, date: int | None = None) -> BayesianFit:
    return bayesian_fit(measurements, TYPE, max(measurements.days) if date is None else date, RANGES)


def version_of(known: Measurements) -> Version:
    """Return version 3 of a sensor, fitted to what is known of it."""
    made = fitted(known).fit
    return Version(
        number=3,
        date="2024-03-01",
        measurements=len(known),
        last_measurement=len(known),
        data_sha256="",
        required_r=0.0,
        robust=False,
        polynomial=made.polynomial,
        adjusted_r_squared=made.adjusted_r_squared,
        rms=made.rms,
        cross_validated=None,
        drift=None,
    )
