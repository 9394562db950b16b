"""What a calibration is worth: the interval for the clearance of a reading, and how often such intervals hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy import special

from sosmith.gen.calibration.fit import Fit, Measurements, residuals, root_mean_square, terms_of
from sosmith.gen.calibration.least_squares import Sums
from sosmith.instrument.calibration.bayesian_fit import BayesianFit
from sosmith.instrument.calibration.covered_region import CoveredRegion
from sosmith.instrument.calibration.lack_of_fit import LackOfFit, lack_of_fit
from sosmith.instrument.calibration.mixed_effects.day_filter import smoothed
from sosmith.instrument.calibration.mixed_effects.model import mixture_half_width
from sosmith.model.arithmetic.stacked_matrices import dot, product, transposed
from sosmith.model.arrays import Values

SHARE = 0.95
"""Probability with which an interval holds the true clearance."""

FOLDS = 10
"""Most parts into which the days are divided for cross-validation."""

EVERY = 16
"""Of the points of the covered region, one in so many is taken for the smallest and the largest interval."""

Interval = Callable[[Values, Values], Values]
"""Maps voltage in V and temperature in degC, shape (n,), to half-widths in mm."""


@dataclass(frozen=True)
class CrossValidation:
    """Measurements predicted from those of other days.

    Attributes
    ----------
    rms : float
        Root mean square of measured minus predicted clearance in mm; includes the scatter of the measurement.
    inside : float
        Share of the measurements inside their intervals, which are made to hold the share `SHARE`.
    count : int
        Number of measurements.
    """

    rms: float
    inside: float
    count: int


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """What a calibration is worth.

    Attributes
    ----------
    standard_error : callable
        Standard error of the polynomial in mm, as a function of voltage and temperature.
    half_width : callable
        Half-width in mm of the interval that holds the clearance of a reading with probability `SHARE`. It is that of
        the calibration alone, for the day of the calibration: noise of the reading is not in it.
    lack : LackOfFit
        Whether the residuals are pure scatter.
    predict_days : callable
        Predicts each day from the others; returns None if there is only one day.
    region : CoveredRegion
        The region that the measurements cover.
    """

    standard_error: Interval
    half_width: Interval
    lack: LackOfFit
    predict_days: Callable[[], CrossValidation | None]
    region: CoveredRegion

    @cached_property
    def over_days(self) -> CrossValidation | None:
        """Each day predicted from the others; None if there is only one day."""
        return self.predict_days()

    @cached_property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest half-width in mm over the covered region."""
        V, T = self.region.points()
        corners = len(self.region.corners)
        some = np.concatenate((np.arange(0, len(V) - corners, EVERY), np.arange(len(V) - corners, len(V))))
        half = self.half_width(V[some], T[some])
        return float(half.min()), float(half.max())


def of_polynomial(measurements: Measurements, fit: Fit) -> Uncertainty:
    """Return the uncertainty of a polynomial fitted by least squares.

    The standard error is that of the regression. What the polynomial misses (`LackOfFit.missed`) is added to its
    square where the residuals are structured; a day's own error is not known to this method, and not in it.
    """
    weights = np.array(fit.weights) if fit.weights else np.ones(len(measurements))
    sums = Sums(measurements.clearance, measurements.voltage, measurements.temperature, weights)
    terms = terms_of(fit.orders)
    solution = sums.solve(terms)
    assert solution is not None, "a fit has terms that the measurements determine"
    freedom = len(measurements) - len(terms)
    variance = float(solution.residual_squares) / freedom
    lack = lack_of_fit(residuals(measurements, fit.polynomial), measurements.voltage, measurements.temperature)
    missed = lack.missed if lack.structured else 0.0
    wide = float(special.stdtrit(freedom, (1 + SHARE) / 2))

    def standard_error(V: Values, T: Values) -> Values:
        return np.asarray(np.sqrt(variance * sums.leverage(solution, V, T)))

    def half_width(V: Values, T: Values) -> Values:
        return np.asarray(wide * np.sqrt(standard_error(V, T) ** 2 + missed**2))

    region = CoveredRegion.of(measurements.voltage, measurements.temperature)
    return Uncertainty(standard_error, half_width, lack, lambda: _refitted(measurements, fit, sums, weights), region)


def _folds(days: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return for each measurement the part that its day belongs to; parts hold about equally many days."""
    own, index = np.unique(days, return_inverse=True)
    return np.asarray(index % min(len(own), FOLDS), dtype=np.int64)


def _refitted(measurements: Measurements, fit: Fit, sums: Sums, weights: Values) -> CrossValidation | None:
    """Predict each day by a polynomial of the same orders, fitted to the other days."""
    if len(set(measurements.days)) < 2:
        return None
    fold = _folds(np.array(measurements.days, dtype=np.int64))
    off, allowed = np.zeros(len(measurements)), np.zeros(len(measurements))
    terms = terms_of(fit.orders)
    for k in range(int(fold.max()) + 1):
        out = fold == k
        freedom = int(np.count_nonzero(~out)) - len(terms)
        without = sums.reweighted(np.where(out, 0.0, weights))
        solution = without.solve(terms) if freedom > 0 else None
        if solution is None:
            return None
        V, T = measurements.voltage[out], measurements.temperature[out]
        variance = float(solution.residual_squares) / freedom
        off[out] = measurements.clearance[out] - solution.polynomial(V, T)
        wide = float(special.stdtrit(freedom, (1 + SHARE) / 2))
        allowed[out] = wide * np.sqrt(variance * (1.0 + without.leverage(solution, V, T)))
    return CrossValidation(root_mean_square(off), float(np.mean(np.abs(off) <= allowed)), len(off))


def of_posterior(measurements: Measurements, made: BayesianFit) -> Uncertainty:
    """Return the uncertainty of a Bayesian calibration.

    The interval includes the day's systematic error: as far as the measurements of that day leave it open, and all of
    it if there are none. It is centred on the polynomial, and so holds what the polynomial misses of the day's curve.
    Where the sensor may have stepped, it is the wider of the intervals with and without a step.
    """
    posterior, polynomial = made.posterior, made.fit.polynomial

    def standard_error(V: Values, T: Values) -> Values:
        variances = []
        for one in made.either:
            mean, variance = one.predicted(V, T)
            variances.append(one.scatters.variance_of(variance + (mean - polynomial(V, T)[:, None]) ** 2))
        return np.asarray(np.sqrt(np.max(variances, axis=0)))

    def half_width(V: Values, T: Values) -> Values:
        return reading_half_width(made, V, T)

    own = made.order[made.kept]
    off = made.model.residuals(posterior.scatters.likeliest)[made.kept]
    lack = lack_of_fit(off, measurements.voltage[own], measurements.temperature[own])
    return Uncertainty(standard_error, half_width, lack, lambda: _predicted(made), made.region)


def reading_half_width(made: BayesianFit, V: Values, T: Values, beside: Values | float = 0.0) -> Values:
    """Return half-widths in mm of intervals for readings at voltages in V and temperatures in degC, shape (n,).

    `beside` is the variance in mm**2 of what else a reading errs by, such as the noise that a filter lets through.
    """
    centre = made.fit.polynomial(V, T)
    return np.asarray(np.max([one.half_width(V, T, centre, SHARE, beside) for one in made.either], axis=0))


def _predicted(made: BayesianFit) -> CrossValidation | None:
    """Predict each day by the model without it; outliers do not count."""
    model, at, rows = made.model, made.posterior.scatters, made.model.rows
    days = len(rows.days)
    if days < 2:
        return None
    fold = _folds(np.arange(days))
    left_out = np.equal.outer(np.arange(int(fold.max()) + 1), fold).astype(np.float64)
    course = model.course(at, left_out)
    means, covariances = smoothed(course, rows.gaps, model.sensor_type.drifts)
    noise = np.where(rows.known[:, None] > 0, rows.known[:, None], at.scatter**2) + (at.scatter * at.ratio) ** 2
    off, allowed = [], []
    for k in range(days):
        here = made.kept[rows.day[made.kept] == k]
        a = rows.a[:, here]
        mean = product(transposed(a), means[k][:, fold[k]])
        spread = product(covariances[k][:, :, None, fold[k]], a[:, None, :, None])[:, 0]
        centre = at.mean_of(mean)
        variance = dot(a[..., None], spread) + noise[here]
        off.append(rows.r[here] - centre)
        allowed.append(mixture_half_width(mean - centre[:, None], variance, at.of_intervals, SHARE))
    every = np.concatenate(off)
    inside = float(np.mean(np.abs(every) <= np.concatenate(allowed)))
    return CrossValidation(root_mean_square(every), inside, len(every))


def largest_half_width(measurements: Measurements, fit: Fit) -> float:
    """Return the largest half-width in mm over the covered region, of a polynomial fitted by least squares."""
    return of_polynomial(measurements, fit).limits[1]
