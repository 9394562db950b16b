"""The most that a calibration can reach on the bench: the true sensor's curve in its place, and that of the day."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sosmith.gen.calibration.least_squares import Sums
from sosmith.instrument.calibration.sensor_type import TERMS
from sosmith.instrument.scenarios.file import ScenarioFile
from sosmith.instrument.sensors.inductive_sensor import InductiveSensor, InductiveState
from sosmith.model.arithmetic.random_streams import streams
from sosmith.model.arrays import Values
from sosmith.model.polynomial import Polynomial
from sosmith.model.traces.trace import Trace

Curve = Callable[[Values, Values], Values]
"""Maps voltage in V and temperature in degC, shape (n,), to the clearance in mm."""

FARTHEST = 16.0
"""Clearance in mm below which a curve is inverted: the end of the output's range."""

BISECTIONS = 40
"""Steps of an inversion, to 15 fm."""

TEMPERATURES = 5
"""Temperatures over the run at which a polynomial is fitted."""


def ceilings(scenario: ScenarioFile, trace: Trace, seed: int) -> dict[str, Curve]:
    """Return what no calibration has, each in place of one.

    ``own curve`` is the true sensor's, without the day's systematic error: what measurements of other days would show
    if there were any number of them. ``own polynomial`` and ``day polynomial`` are the polynomials of the datapath, of
    orders 2, 1, nearest to it and to the curve with the day's error, at the clearances of the run, by least squares of
    the errors relative to the clearance: what any number of measurements of that very day would show. Readings at the
    sensor's rail count in the polynomials as they are; the inverted curve gives the clearance at which the rail begins.
    """
    (excerpt,) = scenario.document.excerpt
    sensor = scenario.sensors.inductive
    of_day = sensor.state(excerpt.day, streams(seed, "life of the sensor"))
    own = InductiveState(of_day.offset, of_day.gain)
    last = excerpt.temperature if excerpt.temperature_to is None else excerpt.temperature_to
    temperatures = np.linspace(excerpt.temperature, last, TEMPERATURES)
    d, T = (grid.ravel() for grid in np.meshgrid(np.unique(trace.truth[trace.reading]), temperatures))
    return {
        "own curve": inverted(replace(sensor, output_range=None), own),
        "own polynomial": nearest(sensor, own, d, T),
        "day polynomial": nearest(sensor, of_day, d, T),
    }


def inverted(sensor: InductiveSensor, state: InductiveState) -> Curve:
    """Return the clearance at which a sensor gives a voltage, by bisection."""

    def curve(V: Values, T: Values) -> Values:
        low, high = np.zeros(len(V)), np.full(len(V), FARTHEST)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            beyond = sensor.steady_voltage(middle, T, state) >= V
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return high

    return curve


def nearest(sensor: InductiveSensor, state: InductiveState, d: Values, T: Values) -> Polynomial:
    """Return the polynomial nearest to a sensor's curve at clearances in mm and temperatures in degC, shape (n,)."""
    solution = Sums(d, sensor.steady_voltage(d, T, state), T, 1.0 / d**2).solve(TERMS)
    assert solution is not None, "a run has enough clearances and temperatures"
    return solution.polynomial
