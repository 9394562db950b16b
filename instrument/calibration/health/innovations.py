"""How far each day's measurements are from what the days before predict, in standard deviations.

The mixed-effects model is filtered forwards with a grid of scatters and systematic errors, weighted by what the days
so far say about them, so that nothing of a day is known before it comes. Of each day's measurements three numbers are
kept, which are independent and standard normal while the sensor behaves as its type says: the score for a step of the
offset; that for a step of the gain, given the offset; and the rest, a chi-square number, for the scatter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import special

from sosmith.gen.calibration.fit import MIN_SCATTER, NORMAL_CONSISTENCY, Measurements
from sosmith.instrument.calibration.acceptance import Range
from sosmith.instrument.calibration.mixed_effects.day_filter import moved, updated
from sosmith.instrument.calibration.mixed_effects.day_sums import DaySums, Information
from sosmith.instrument.calibration.mixed_effects.model import NEGLIGIBLE, RATIOS, SCATTERS, Index, rows_of
from sosmith.instrument.calibration.mixed_effects.systematic_error import SystematicCurves
from sosmith.instrument.calibration.sensor_type import SYSTEMATIC_FACTOR, SensorType
from sosmith.model.arithmetic.stacked_matrices import applied, cholesky, identity, product, transposed
from sosmith.model.arrays import Values

SCATTER_STEP, RATIO_STEP = 1.12, 2.0**0.5
"""Ratio of neighbouring points of the fine grid: scatters, and systematic errors over the scatter."""

REJECTED = 3.5
"""Distance from the plane of the day, in standard deviations estimated from the median, above which a measurement is an
outlier."""

MIN_FOR_OUTLIERS = 8
"""Measurements of a day below which none can be told to be an outlier."""

LEARNING = 4
"""Days after which the scatters that are possible decide on the fine grid; before it, nearly all are."""

MAX_ROUNDS = 10
"""Limit on rounds of rejection."""

_OFFSET, _GAIN = 0, 1
_APART = 1e-9
"""Share of a gain's information that the offset leaves over; below it, the day has one voltage only."""


@dataclass(frozen=True, eq=False)
class Belief:
    """What is known of a sensor before a day; the stack is a grid of p scatters and q ratios.

    Attributes
    ----------
    mean, factor : ndarray, shapes (5, p, q) and (5, 5, p, q)
        Mean of the deviations, and S of their covariance ``S S'``.
    logarithm : ndarray, shape (p, q)
        Logarithms of the probabilities of the grid's points.
    """

    mean: Values
    factor: Values
    logarithm: Values

    def later(self, days: int, drifts: tuple[float, ...]) -> Belief:
        """Return the belief some days later."""
        return replace(self, factor=moved(self.factor, days, drifts))

    def changed(self, steps: Sequence[Values]) -> Belief:
        """Return the belief after a change by normal multiples of `steps`, each of shape (5,), in tolerances."""
        covariance = product(self.factor, transposed(self.factor))
        for step in steps:
            covariance = covariance + np.multiply.outer(step, step)[..., None, None]
        return replace(self, factor=cholesky(covariance))

    def of_another(self) -> Belief:
        """Return the belief about another sensor of the type."""
        size, shape = len(self.mean), self.logarithm.shape
        return replace(self, mean=np.zeros((size, *shape)), factor=identity(size, shape))


@dataclass(frozen=True, eq=False)
class Day:
    """One day's measurements as the filter takes them in, over the grid."""

    j: Values
    h: Values
    q: Values
    count: float
    root: Values
    """Logarithm of the likelihood's denominator, without the power of the scatter."""
    scatter: Values

    def louder(self, times: float) -> Day:
        """Return the same measurements, taken to scatter so many times as much."""
        j, h, q = (values / times**2 for values in (self.j, self.h, self.q))
        return replace(self, j=j, h=h, q=q, scatter=self.scatter * times)

    def taken_in(self, belief: Belief) -> tuple[Belief, Values, float]:
        """Return the belief afterwards, the squared distance from the prediction, and the log of the evidence.

        The distance is chi-square distributed with `count` degrees of freedom at the true point of the grid.
        """
        mean, factor, off, lower = updated(belief.mean, belief.factor, (self.j, self.h, self.q))
        determinant = sum((np.log(lower[k, k]) for k in range(len(lower))), self.root)
        logarithm = belief.logarithm - off / 2 - determinant - self.count * np.log(self.scatter)
        evidence = float(special.logsumexp(logarithm))
        return Belief(mean, factor, logarithm - evidence), off, evidence

    def standardised(self, belief: Belief, off: Values) -> tuple[float, float, float, float]:
        """Return offset, gain and scatter as standard normal numbers, given the squared distance `off`.

        And the offset as it is measured, in tolerances.
        """
        score = self.h - applied(self.j, belief.mean)
        of_factor = product(self.j, belief.factor)
        spread = self.j + product(of_factor, transposed(of_factor))
        of_offset = spread[_OFFSET, _OFFSET]
        offset = score[_OFFSET] / np.sqrt(of_offset)
        own = spread[_GAIN, _GAIN] - spread[_GAIN, _OFFSET] ** 2 / of_offset
        told = bool(np.all(own > _APART * spread[_GAIN, _GAIN]))
        gain = np.zeros_like(offset)
        if told:
            gain = (score[_GAIN] - spread[_GAIN, _OFFSET] / of_offset * score[_OFFSET]) / np.sqrt(own)
        freedom = self.count - 1.0 - told
        rest = np.maximum(off - offset**2 - gain**2, 0.0)
        each = (offset, gain, _normal(rest, freedom))
        first, second, third = (_mixed(x, belief.logarithm) for x in each)
        shift = np.sum(np.exp(belief.logarithm) * score[_OFFSET] / self.j[_OFFSET, _OFFSET])
        return first, second, third, float(shift)


@dataclass(frozen=True, eq=False)
class Innovations:
    """Standard normal numbers of each day, shape (days,).

    Attributes
    ----------
    days : tuple of int
        Ordinals of the days.
    count, outliers : ndarray of int
        Measurements, and how many of them were left out as outliers.
    offset, gain, scatter : ndarray
        Positive if the measured clearance, its slope over the voltage, or the scatter is larger than expected.
    shift : ndarray
        The offset in mm: measured clearance less the expected one.
    """

    days: tuple[int, ...]
    count: Index
    outliers: Index
    offset: Values
    gain: Values
    scatter: Values
    shift: Values


@dataclass(frozen=True, eq=False)
class Course:
    """The days of a sensor; see `course_of`."""

    sensor_type: SensorType
    ordinals: tuple[int, ...]
    count: Index
    outliers: Index
    sums: DaySums
    scatters: Values
    ratios: Values

    @cached_property
    def days(self) -> list[Day]:
        """The information of each day over the grid."""
        found: Information = self.sums.information(self.ratios**2, np.ones(len(self.ratios)))
        squared = (self.scatters**2)[:, None]
        roots = np.log(found.root.mantissa) + found.root.exponent * math.log(2.0)
        return [
            Day(
                j=found.j[..., k, None, :] / squared,
                h=found.h[..., k, None, :] / squared,
                q=found.q[..., k, None, :] / squared,
                count=float(self.sums.count[k]),
                root=roots[k],
                scatter=self.scatters[:, None],
            )
            for k in range(len(self.ordinals))
        ]

    @property
    def gaps(self) -> list[int]:
        """Days since the day before; 0 for the first."""
        return [0, *(later - day for day, later in zip(self.ordinals, self.ordinals[1:], strict=False))]

    def beliefs(self) -> Iterator[tuple[Belief, tuple[float, float, float, float]]]:
        """Yield the belief before each day, and what `Day.standardised` gives of the day."""
        shape = (len(self.scatters), len(self.ratios))
        expected = self.sensor_type.systematic
        systematic = np.maximum(np.multiply.outer(self.scatters, self.ratios), 0.03 * expected)
        prior = -((np.log(systematic / expected) / math.log(SYSTEMATIC_FACTOR)) ** 2) / 2
        belief = Belief(np.zeros((5, *shape)), identity(5, shape), prior - special.logsumexp(prior))
        for day, gap in zip(self.days, self.gaps, strict=True):
            belief = belief.later(gap, self.sensor_type.drifts)
            after, off, _ = day.taken_in(belief)
            yield belief, day.standardised(belief, off)
            belief = after

    def innovations(self) -> Innovations:
        """Go through the days."""
        offset, gain, scatter, shift = np.array([found for _, found in self.beliefs()]).T
        tolerance = float(self.sensor_type.deviations[0][0, 0])
        return Innovations(self.ordinals, self.count, self.outliers, offset, gain, scatter, tolerance * shift)


def course_of(measurements: Measurements, sensor_type: SensorType, voltages: Range) -> Course:
    """Prepare a sensor's measurements: outliers left out, sums over each day, and the grid of what is possible.

    Parameters
    ----------
    measurements : Measurements
        With their `days`.
    sensor_type : SensorType
        The prior.
    voltages : tuple of float
        Range of the voltage in V; a measurement at an end of it is left out, too.
    """
    rows, order = rows_of(measurements, sensor_type)
    V, T = measurements.voltage[order], measurements.temperature[order]
    # the systematic error is taken at the type's clearance: at the measured one it would explain the scatter
    d = sensor_type.polynomial()(V, T)
    curves = SystematicCurves(float(d.min()), float(d.max()), sensor_type.correlation)
    weights = np.where((voltages[0] < V) & (voltages[1] > V), 1.0, 0.0)
    at_rail = np.bincount(rows.day, weights=1.0 - weights)
    for k in range(len(rows.days)):
        own = np.flatnonzero((rows.day == k) & (weights > 0))
        weights[own] = _kept(rows.r[own], np.array([np.ones(len(own)), d[own], T[own]]))
    sums = DaySums.of(rows.a, curves.columns(d), rows.r, weights, rows.day, len(rows.days))
    count = np.bincount(rows.day)
    outliers = (count - at_rail - np.bincount(rows.day, weights=weights)).astype(np.int64)
    coarse = Course(sensor_type, rows.days, count, outliers, sums, SCATTERS, RATIOS)
    likely = np.full((len(SCATTERS), len(RATIOS)), -np.inf)
    for number, (belief, _) in enumerate(coarse.beliefs()):
        if number >= min(LEARNING, len(rows.days) - 1):
            likely = np.maximum(likely, belief.logarithm - belief.logarithm.max())
    if len(rows.days) == 1:
        return coarse
    at_scatter, at_ratio = np.nonzero(likely >= math.log(NEGLIGIBLE))
    return replace(
        coarse,
        scatters=_finer(SCATTERS, at_scatter, SCATTER_STEP),
        ratios=_finer(RATIOS, at_ratio, RATIO_STEP),
    )


def _finer(grid: Values, kept: Index, step: float) -> Values:
    """Return a geometric grid from one point below the kept ones of `grid` to one above them."""
    low, high = float(grid[max(int(kept.min()) - 1, 0)]), float(grid[min(int(kept.max()) + 1, len(grid) - 1)])
    return np.asarray(np.geomspace(low, high, 1 + math.ceil(math.log(high / low) / math.log(step))))


def _kept(r: Values, columns: Values) -> Values:
    """Return weights of 0 for outliers of a day and 1 for the others, from the plane through the others."""
    weights = np.ones(len(r))
    if len(r) < MIN_FOR_OUTLIERS:
        return weights
    for _ in range(MAX_ROUNDS):
        plane, *_ = np.linalg.lstsq((columns * weights).T, r * weights)
        off = np.abs(r - plane @ columns)
        kept = np.where(off > REJECTED * max(NORMAL_CONSISTENCY * float(np.median(off)), MIN_SCATTER), 0.0, 1.0)
        if np.array_equal(kept, weights):
            break
        weights = kept
    return weights


def _normal(squares: Values, freedom: float) -> Values:
    """Map chi-square numbers to standard normal ones.

    E. B. Wilson and M. M. Hilferty, Proc. Natl. Acad. Sci. 17, 1931.
    """
    if freedom <= 0:
        return np.zeros_like(squares)
    narrow = 2.0 / (9.0 * freedom)
    return np.asarray((np.cbrt(squares / freedom) - (1.0 - narrow)) / math.sqrt(narrow))


def _mixed(x: Values, logarithm: Values) -> float:
    """Return one standard normal number from those of the grid's points: that of the same probability."""
    below, above = (float(special.logsumexp(special.log_ndtr(sign * x) + logarithm)) for sign in (1.0, -1.0))
    if below < above:
        return float(special.ndtri_exp(min(below, 0.0)))
    return -float(special.ndtri_exp(min(above, 0.0)))
