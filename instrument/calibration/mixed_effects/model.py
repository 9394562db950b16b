"""The mixed-effects model of a sensor's measurements, and its posterior for one day.

``d = phi(V, T) theta_day + s_day(d) + e``: the coefficients theta are those of the type curve plus deviations with the
type's tolerances, and walk from day to day; s is a Gaussian process over the clearance, new each day; e is the scatter
of a single measurement. Given the standard deviations of s and e, everything is normal and the posterior follows from
a Kalman filter over the days. The two standard deviations are integrated over a grid, each point weighted by its
marginal likelihood (and by the type's expectation of s), so that few days leave them as uncertain as they are.

The grid is geometric: every order of magnitude is as likely as the next, also those of s that are lost in the scatter.
Intervals made so hold their share on average over the sensors of a type, but less for a sensor whose days err by more
than its type says. Intervals are therefore made with Jeffreys' prior, the root of the determinant of Fisher's
information, which comes nearest to the share for every single sensor (Welch and Peers, J. R. Stat. Soc. B 25, 1963);
what the type says of s counts as an earlier estimate of it. Where few measurements cannot tell s from none, such
intervals are wide. The curve itself is the posterior mean without Jeffreys' prior.
"""

from __future__ import annotations

import itertools
import math
import operator
from dataclasses import dataclass, replace
from decimal import Decimal

import numpy as np
import numpy.typing as npt
from scipy import special

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.mixed_effects.day_filter import Course, course, moved, smoothed
from sosmith.instrument.calibration.mixed_effects.day_sums import DaySums, Information, Scaled
from sosmith.instrument.calibration.mixed_effects.systematic_error import SystematicCurves
from sosmith.instrument.calibration.sensor_type import SYSTEMATIC_FACTOR, SensorType
from sosmith.model.arithmetic.stacked_matrices import applied, dot, product, transposed
from sosmith.model.arrays import Values

SCATTERS = np.array(list(itertools.accumulate([1.5] * 23, operator.mul, initial=0.0005)))
"""Scatter of a measurement in mm rms: the points of the coarse grid, 0.5 um to 5.6 mm."""

RATIOS = np.array(list(itertools.accumulate([2.0] * 10, operator.mul, initial=0.02)))
"""Systematic error of a day over the scatter: the points of the coarse grid, up to 20. 0.02 is as good as none."""

NONE = np.zeros(1)
"""The ratio without a systematic error."""

HALVINGS = 4
"""The fine grid has 2**HALVINGS + 1 points along each axis."""

NEGLIGIBLE = 1e-3
"""Points of the grid of less than this share of the largest weight are left out."""

BISECTIONS = 48
"""Steps to a quantile of the posterior: to a double's precision."""

_FACTOR = Decimal(SYSTEMATIC_FACTOR).ln()

Index = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Rows:
    """Measurements as the model sees them, in the order of their days.

    Attributes
    ----------
    a : ndarray, shape (5, n)
        What each deviation adds, in mm.
    h : ndarray, shape (m, n)
        Systematic curves at the measurements.
    r : ndarray, shape (n,)
        Measured clearance minus that of the type curve, in mm.
    day : ndarray, shape (n,)
        Index of the day in `days`.
    days : tuple of int
        Ordinals of the days with measurements, rising.
    known : ndarray, shape (n,)
        Variance of a measurement in mm**2 where it is known, else 0: it scatters like the others.
    """

    a: Values
    h: Values
    r: Values
    day: Index
    days: tuple[int, ...]
    known: Values

    @property
    def gaps(self) -> list[int]:
        """Days from each day to the next."""
        return [later - day for day, later in zip(self.days, self.days[1:], strict=False)]


def rows_of(measurements: Measurements, sensor_type: SensorType, date: int = 0) -> tuple[Rows, Index]:
    """Return measurements as rows without systematic curves, and the measurement of each row.

    They are sorted, so that a result does not depend on the order in which files were added. Without their own `days`,
    all are taken to be of the day `date`.
    """
    days = np.array(measurements.days or [date] * len(measurements), dtype=np.int64)
    order = np.lexsort((measurements.temperature, measurements.voltage, measurements.clearance, days))
    V, T, d = (values[order] for values in (measurements.voltage, measurements.temperature, measurements.clearance))
    own_days, day = np.unique(days[order], return_inverse=True)
    rows = Rows(
        a=sensor_type.columns(V, T),
        h=np.zeros((1, len(d))),
        r=d - sensor_type.polynomial()(V, T),
        day=day,
        days=tuple(own_days.tolist()),
        known=np.zeros(len(d))
        if measurements.uncertainty is None
        else sensor_type.known_variance(V, T, measurements.uncertainty[:, order]),
    )
    return rows, order


@dataclass(frozen=True, eq=False)
class Scatters:
    """Pairs of standard deviations with their posterior weights; every array has the shape (k,).

    Attributes
    ----------
    scatter : ndarray
        Scatter of a measurement in mm.
    ratio : ndarray
        Systematic error divided by the scatter.
    weight : ndarray
        Posterior probability, of which the curve is made; the sum is 1.
    of_intervals : ndarray
        Posterior probability with Jeffreys' prior, of which intervals are made; the sum is 1.
    """

    scatter: Values
    ratio: Values
    weight: Values
    of_intervals: Values

    @property
    def likeliest(self) -> Scatters:
        """The pair of the largest weight alone."""
        best = int(np.argmax(self.weight))
        return Scatters(self.scatter[best : best + 1], self.ratio[best : best + 1], np.ones(1), np.ones(1))

    def together(self, other: Scatters, share: float) -> Scatters:
        """Return these pairs and those of another model, whose probability is `share`."""
        parts = ((self, 1.0 - share), (other, share))
        scatter, ratio = (np.concatenate((getattr(self, name), getattr(other, name))) for name in ("scatter", "ratio"))
        weight = np.concatenate([part * one.weight for one, part in parts])
        return Scatters(scatter, ratio, weight, np.concatenate([part * one.of_intervals for one, part in parts]))

    def mean_of(self, values: Values) -> Values:
        """Return the posterior mean of values whose last axis is the pair."""
        return _weighted(values, self.weight)

    def variance_of(self, values: Values) -> Values:
        """Return the posterior mean, as intervals have it, of variances whose last axis is the pair."""
        return _weighted(values, self.of_intervals)


@dataclass(frozen=True, eq=False)
class Model:
    """The model with the sums over its measurements; `weights` of 0 leave measurements out."""

    sensor_type: SensorType
    rows: Rows
    sums: DaySums
    weights: Values

    @classmethod
    def of(cls, sensor_type: SensorType, rows: Rows, weights: Values) -> Model:
        """Sum over the measurements."""
        is_known, days = rows.known > 0, len(rows.days)
        own = DaySums.of(rows.a, rows.h, rows.r, np.where(is_known, 0.0, weights), rows.day, days)
        if is_known.any():
            known = np.where(is_known, weights, 0.0) / np.where(is_known, rows.known, 1.0)
            own = replace(own, known=DaySums.of(rows.a, rows.h, rows.r, known, rows.day, days))
        return cls(sensor_type, rows, own, weights)

    def scatters(self) -> Scatters:
        """Return the pairs of scatters that the measurements leave possible: a coarse grid, then a fine one there."""
        coarse = self.weighed(SCATTERS, RATIOS)
        likely = coarse.weight > 0
        return self.weighed(_refined(coarse.scatter[likely], SCATTERS), _refined(coarse.ratio[likely], RATIOS))

    @property
    def drifts(self) -> tuple[float, ...]:
        """Variance added in a day to each deviation; what there is beside those of the type stays as it is."""
        known = self.sensor_type.drifts
        return (*known, *(0.0 for _ in range(len(self.rows.a) - len(known))))

    def weighed(self, scatters: Values, ratios: Values) -> Scatters:
        """Return the pairs on a grid that are not `NEGLIGIBLE`."""
        logarithms = self._logarithms(scatters, ratios)
        weight = of_intervals = _probabilities(logarithms)
        squared, rho = self._pairs(scatters, ratios)
        told = self.sums.fisher(rho, squared).tolist()
        if all(one > 0 for one in told):  # else there is no systematic error to be told
            jeffreys = [Decimal(one).ln() / 2 for one in told] * (len(logarithms) // len(told))
            of_intervals = _probabilities([a + b for a, b in zip(logarithms, jeffreys, strict=True)])
        kept = np.flatnonzero(weight + of_intervals)
        return Scatters(scatters[kept // len(ratios)], ratios[kept % len(ratios)], weight[kept], of_intervals[kept])

    def evidence(self, scatters: Values, ratios: Values) -> float:
        """Return the logarithm of the probability of the measurements over a grid, up to a constant of the grid."""
        return float(special.logsumexp([float(one) for one in self._logarithms(scatters, ratios)]))

    def _logarithms(self, scatters: Values, ratios: Values) -> list[Decimal]:
        """Return the logarithm of the posterior at each point of a grid, up to a constant; ratios vary fastest."""
        of_pairs, rho = self._pairs(scatters, ratios)
        information = self.sums.information(rho, of_pairs)
        stack = (len(scatters), len(ratios))
        squared = (scatters**2)[:, None]
        days = []
        of_days = Scaled(np.ones(len(rho)), np.zeros(len(rho)))
        for k in range(len(self.rows.days)):
            at_day = (values[..., k, :] for values in (information.j, information.h, information.q))
            j, h, q = (values.reshape(*values.shape[:-1], -1, len(ratios)) / squared for values in at_day)
            days.append((j, h, q))
            of_days = Scaled(of_days.mantissa, of_days.exponent + information.root.exponent[k])
            of_days = of_days.times(information.root.mantissa[k])
        found = course(days, self.rows.gaps, self.drifts, stack)
        count = int(self.sums.count.sum())
        of_day = of_days.logarithm() * (len(scatters) * len(ratios) // len(rho))
        of_scatter = {scatter: count * Decimal(scatter).ln() for scatter in scatters.tolist()}
        return [
            -Decimal(quadratic) / 2 - root - day - of_scatter[scatter] + self._expected(scatter * ratio)
            for (scatter, ratio), day, quadratic, root in zip(
                itertools.product(scatters.tolist(), ratios.tolist()),
                of_day,
                found.quadratic.ravel().tolist(),
                found.root.logarithm(),
                strict=True,
            )
        ]

    def _pairs(self, scatters: Values, ratios: Values) -> tuple[Values, Values]:
        """Return the squared scatters and ratios of a grid for which the days' sums differ; ratios vary fastest.

        Without measurements of known variance, the ratio alone decides: one scatter stands for all.
        """
        which = scatters if self.sums.known is not None else np.ones(1)
        return np.repeat(which**2, len(ratios)), np.tile(ratios**2, len(which))

    def _expected(self, systematic: float) -> Decimal:
        """Return the logarithm of the prior of the systematic error, up to a constant; the smallest stands for none."""
        smallest = 0.03 * self.sensor_type.systematic
        off = (Decimal(max(systematic, smallest)) / Decimal(self.sensor_type.systematic)).ln()
        return -((off / _FACTOR) ** 2) / 2

    def course(self, at: Scatters, left_out: Values | None = None) -> Course:
        """Filter over the days for pairs of scatters; the stack is (k,), or (folds, k).

        `left_out`, of shape (folds, days), is 1 where a fold leaves a day out and 0 elsewhere.
        """
        information = self.information(at)
        stack = at.scatter.shape if left_out is None else (len(left_out), *at.scatter.shape)
        days = []
        for k in range(len(self.rows.days)):
            day = (information.j[..., k, :], information.h[..., k, :], information.q[..., k, :])
            if left_out is None:
                days.append(day)
            else:
                kept = (1.0 - left_out[:, k])[:, None]
                days.append((day[0][..., None, :] * kept, day[1][..., None, :] * kept, day[2][..., None, :] * kept))
        return course(days, self.rows.gaps, self.drifts, stack)

    def information(self, at: Scatters) -> Information:
        """Return the information of the days for pairs of scatters, the last axis."""
        made = self.sums.information(at.ratio**2, at.scatter**2)
        return replace(made, j=made.j / at.scatter**2, h=made.h / at.scatter**2, q=made.q / at.scatter**2)

    def residuals(self, at: Scatters) -> Values:
        """Return the residuals from the curve of each day, with its systematic error, for one pair of scatters."""
        means, _ = smoothed(self.course(at), self.rows.gaps, self.drifts)
        z = np.concatenate(means, axis=1)
        offset, slope, _ = self.sums.day_curves(at.ratio**2, at.scatter**2)
        weights = offset[..., 0] - applied(slope[..., 0], z)
        day = self.rows.day
        return self.rows.r - dot(self.rows.a, z[:, day]) - dot(self.rows.h, weights[:, day])

    def posterior(self, at: Scatters, curves: SystematicCurves, date: int) -> Posterior:
        """Return the posterior for the day of ordinal `date`, not before the last measurement."""
        last = self.course(at)
        gap = date - self.rows.days[-1]
        offset = slope = factor = None
        if not gap:
            curves_of_day = self.sums.only(len(self.rows.days) - 1).day_curves(at.ratio**2, at.scatter**2)
            offset, slope, factor = (values[..., 0, :] for values in curves_of_day)
        return Posterior(
            sensor_type=self.sensor_type,
            curves=curves,
            scatters=at,
            mean=last.mean[-1],
            factor=moved(last.factor[-1], gap, self.drifts),
            offset=offset,
            slope=slope,
            curve_factor=factor,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Posterior:
    """What the measurements say about a day's curve; k pairs of scatters, m systematic curves.

    Attributes
    ----------
    sensor_type : SensorType
    curves : SystematicCurves
    scatters : Scatters
    mean, factor : ndarray, shapes (5, k) and (5, 5, k)
        Mean of the deviations, and S of their covariance ``S S'``.
    offset, slope, curve_factor : ndarray or None, shapes (m, k), (m, 5, k) and (m, m, k)
        The day's systematic error as `DaySums.day_curves` gives it; None if there is no measurement of that day.
    """

    sensor_type: SensorType
    curves: SystematicCurves
    scatters: Scatters
    mean: Values
    factor: Values
    offset: Values | None
    slope: Values | None
    curve_factor: Values | None

    @property
    def deviations(self) -> tuple[float, ...]:
        """Mean of the deviations, in tolerances."""
        return tuple(self.scatters.mean_of(self.mean).tolist())

    @property
    def same_day(self) -> bool:
        """Whether there are measurements of the day itself."""
        return self.offset is not None

    @property
    def scatter(self) -> float:
        """Scatter of a measurement in mm rms, posterior mean."""
        return float(self.scatters.mean_of(self.scatters.scatter))

    @property
    def systematic(self) -> float:
        """Systematic error of a day in mm rms, posterior mean."""
        return float(self.scatters.mean_of(self.scatters.scatter * self.scatters.ratio))

    def predicted(self, voltage: Values, temperature: Values) -> tuple[Values, Values]:
        """Return mean and variance of the clearance of a reading for each pair of scatters, shapes (n, k)."""
        mean, of_curve, of_day = self.predicted_parts(voltage, temperature)
        return mean, dot(of_curve, of_curve) + of_day

    def predicted_parts(self, voltage: Values, temperature: Values) -> tuple[Values, Values, Values]:
        """Return the mean of the clearance, and the variance in two parts, for each pair of scatters.

        Returns
        -------
        mean : ndarray, shape (n, k)
            In mm.
        of_curve : ndarray, shape (r, n, k)
            Factor F of the covariance ``F' F`` between the points that the curve has, by the deviations and by the
            day's own curve as far as its measurements leave it open.
        of_day : ndarray, shape (n, k)
            Variance of the systematic error of a day without measurements, else 0.
        """
        plain = self.sensor_type.polynomial()(voltage, temperature)
        a = self.sensor_type.columns(voltage, temperature)
        systematic = self.scatters.scatter * self.scatters.ratio
        if self.offset is None or self.slope is None or self.curve_factor is None:
            mean = plain[:, None] + product(transposed(a), self.mean)
            shifted = product(transposed(self.factor), a[:, :, None])
            return mean, shifted, np.broadcast_to(systematic**2, mean.shape)
        at = self.sensor_type.polynomial(self.deviations)(voltage, temperature)
        h = self.curves.columns(at)[:, :, None]
        mean = (
            plain[:, None]
            + product(transposed(a), self.mean)
            + dot(h, (self.offset - applied(self.slope, self.mean))[:, None])
        )
        left = a[:, :, None] - product(transposed(self.slope)[:, :, None], h[:, None])[:, 0]
        shifted = product(transposed(self.factor)[:, :, None], left[:, None])[:, 0]
        own = product(self.curve_factor[:, :, None], h[:, None])[:, 0]
        return mean, np.concatenate((shifted, systematic * own)), np.zeros_like(mean)

    def curve(self, voltage: Values, temperature: Values) -> Values:
        """Return the mean clearance of a reading in mm, shape (n,)."""
        return self.scatters.mean_of(self.predicted(voltage, temperature)[0])

    def half_width(
        self, voltage: Values, temperature: Values, centre: Values, share: float, beside: Values | float = 0.0
    ) -> Values:
        """Return the half-widths of intervals about `centre` that hold the true clearance of a reading, in mm.

        Parameters
        ----------
        voltage, temperature, centre : ndarray, shape (n,)
            In V, degC and mm.
        share : float
            Probability, such as 0.95.
        beside : ndarray, shape (n,), or float
            Variance in mm**2 of what else a reading errs by, such as the noise that the filter lets through.
        """
        mean, variance = self.predicted(voltage, temperature)
        variance = variance + np.broadcast_to(beside, len(voltage))[:, None]
        return mixture_half_width(mean - centre[:, None], variance, self.scatters.of_intervals, share)


def _weighted(values: Values, weight: Values) -> Values:
    return dot(np.moveaxis(values, -1, 0), np.expand_dims(weight, tuple(range(1, values.ndim))))


def _probabilities(logarithms: list[Decimal]) -> Values:
    """Return probabilities from their logarithms, which lack a constant; 0 for what is `NEGLIGIBLE`."""
    highest = max(logarithms)
    found = np.array([float((one - highest).exp()) for one in logarithms])
    found[found < NEGLIGIBLE] = 0.0
    return found / math.fsum(found.tolist())


def _refined(kept: Values, grid: Values) -> Values:
    """Return a finer geometric grid from one step below the kept points of `grid` to one step above them."""
    first, last = int(np.searchsorted(grid, kept.min())), int(np.searchsorted(grid, kept.max()))
    low, high = float(grid[max(first - 1, 0)]), float(grid[min(last + 1, len(grid) - 1)])
    step = high / low
    for _ in range(HALVINGS):
        step = math.sqrt(step)
    return np.array(list(itertools.accumulate([step] * 2**HALVINGS, operator.mul, initial=low)))


def mixture_half_width(off: Values, variance: Values, weight: Values, share: float) -> Values:
    """Return h, shape (n,), such that a mixture of normal numbers is in [-h, h] with probability `share`.

    Means and variances are of shape (n, k), weights (k,). By bisection.
    """
    deviation = np.sqrt(variance)
    low, high = np.zeros(len(off)), np.max(np.abs(off) + 40.0 * deviation, axis=1)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        inside = special.ndtr((middle[:, None] - off) / deviation) - special.ndtr((-middle[:, None] - off) / deviation)
        enough = np.sum(inside * weight, axis=1) >= share
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.asarray(high)
