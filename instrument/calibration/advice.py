"""What to measure next: the measurements of a day that narrow the intervals of its readings the most."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from sosmith.instrument.calibration.acceptance import Range
from sosmith.instrument.calibration.bayesian_fit import BayesianFit
from sosmith.instrument.calibration.mixed_effects.day_filter import moved
from sosmith.instrument.calibration.uncertainty import SHARE
from sosmith.model.arithmetic.stacked_matrices import dot, product, transposed
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial

STEP = 0.5
"""Distance in mm of the clearances that may be measured: what a set of gauges has."""

MAX_MEASUREMENTS = 200
"""Most measurements advised."""

VOLTAGES = 2001
"""Points at which the calibration is inverted."""

GAIN_DIGITS = 12
"""Decimals to which gains are compared, so that rounding does not decide between equal ones."""


@dataclass(frozen=True)
class Advice:
    """Measurements of one day, and what they are expected to bring.

    Attributes
    ----------
    plan : tuple of (float, float, int)
        Clearance in mm, temperature in degC, and how many times to measure there; by temperature and clearance.
    targets : tuple of (float, float)
        Clearances in mm and temperatures in degC of the readings that matter.
    before, after : tuple of float
        Expected half-width in mm of the interval at each target, on that day, without and with the measurements.
    reached : bool
        Whether all of them are as narrow as wanted.
    """

    plan: tuple[tuple[float, float, int], ...]
    targets: tuple[tuple[float, float], ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    reached: bool

    @property
    def count(self) -> int:
        """Number of measurements."""
        return sum(count for _, _, count in self.plan)


def advise(
    made: BayesianFit,
    ranges: tuple[Range, Range, Range],
    clearances: tuple[float, ...],
    temperatures: tuple[float, ...],
    *,
    within: float,
    days: int = 1,
    most: int = MAX_MEASUREMENTS,
) -> Advice:
    """Choose the measurements of a later day, one after the other, by what each is expected to bring.

    Each time, the measurement is taken that lowers the sum of the variances at the targets the most (I-optimality, one
    point at a time), until every interval is as narrow as `within`. In a linear model that does not depend on what is
    measured. The scatters are taken as the likeliest ones.

    Parameters
    ----------
    made : BayesianFit
        The calibration so far.
    ranges : tuple of Range
        Of the sensor: clearance in mm, voltage in V, temperature in degC.
    clearances, temperatures : tuple of float
        Of the readings that matter, in mm and degC, each with each; measurements are taken at these temperatures.
    within : float
        Wanted half-width in mm.
    days : int
        Days from the last measurement to the day in question, 1 or more.
    most : int
        Most measurements.

    Raises
    ------
    SpecificationError
        If a clearance is out of what the sensor reads at one of the temperatures.
    """
    posterior = made.posterior
    at = posterior.scatters.likeliest
    scatter, systematic = float(at.scatter[0]), float(at.scatter[0] * at.ratio[0])
    course = made.model.course(at)
    factor = moved(course.factor[-1], days, posterior.sensor_type.drifts)[..., 0]
    size, nodes = len(factor), posterior.curves.count
    covariance = np.zeros((size + nodes, size + nodes))
    covariance[:size, :size] = product(factor, transposed(factor))
    covariance[size:, size:] = systematic**2 * np.eye(nodes)
    curve = posterior.sensor_type.polynomial(posterior.deviations)

    def columns(points: list[tuple[float, float]]) -> Values:
        d, T = (np.array(values) for values in zip(*points, strict=True))
        V = np.array([_voltage(curve, ranges[1], one, at) for one, at in points])
        return np.concatenate((posterior.sensor_type.columns(V, T), posterior.curves.columns(d)))

    targets = [(d, T) for T in temperatures for d in clearances]
    for d, T in targets:
        low, high = _readable(curve, ranges[1], T)
        if not low <= d <= high:
            raise SpecificationError(
                f"the clearance must be {low:.3g} to {high:.3g} mm, what the sensor reads at {T:g} degC, not {d:g} mm"
            )
    steps = range(int(np.ceil(ranges[0][0] / STEP)), int(ranges[0][1] / STEP) + 1)
    possible = [
        (k * STEP, T)
        for T in temperatures
        for k in steps
        if _readable(curve, ranges[1], T)[0] <= k * STEP <= _readable(curve, ranges[1], T)[1]
    ]
    wanted, offered = columns(targets), columns(possible)
    wide = NormalDist().inv_cdf((1 + SHARE) / 2)

    def half_widths() -> Values:
        return wide * np.sqrt(dot(wanted, product(covariance, wanted)))

    before = half_widths()
    chosen: Counter[tuple[float, float]] = Counter()
    while float(half_widths().max()) > within and chosen.total() < most:
        shared = product(covariance, offered)
        noise = dot(offered, shared) + scatter**2
        gains = dot(product(transposed(wanted), shared), product(transposed(wanted), shared)) / noise
        pick = int(np.argmax(np.round(gains / gains.max(), GAIN_DIGITS)))
        chosen[possible[pick]] += 1
        covariance = covariance - shared[:, pick, None] * shared[None, :, pick] / noise[pick]
    after = half_widths()
    return Advice(
        plan=tuple((d, T, chosen[d, T]) for d, T in sorted(chosen, key=lambda one: (one[1], one[0]))),
        targets=tuple(targets),
        before=tuple(before.tolist()),
        after=tuple(after.tolist()),
        reached=bool(after.max() <= within),
    )


def _readable(curve: Polynomial, voltages: Range, temperature: float) -> Range:
    """Return the clearances at the ends of the range of voltages."""
    low, high = (float(curve(v, temperature)) for v in voltages)
    return max(low, 0.0), high


def _voltage(curve: Polynomial, voltages: Range, clearance: float, temperature: float) -> float:
    """Return the voltage at which the curve gives a clearance, interpolated."""
    V = np.linspace(*voltages, VOLTAGES)
    return float(np.interp(clearance, np.maximum.accumulate(curve(V, np.full(len(V), temperature))), V))
