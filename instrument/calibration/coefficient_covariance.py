"""What a calibration's coefficients are worth: their covariance, and the systematic error that no coefficient has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sosmith.gen.calibration.fit import Fit, Measurements, residuals, terms_of
from sosmith.gen.calibration.least_squares import Sums
from sosmith.instrument.calibration.bayesian_fit import BayesianFit
from sosmith.instrument.calibration.lack_of_fit import lack_of_fit
from sosmith.instrument.calibration.mixed_effects.day_polynomial import BESIDE
from sosmith.model.arrays import Values

EVERY = 16
"""Of the points of the covered region, one in so many is taken."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CoefficientUncertainty:
    """Standard uncertainty of a polynomial; n coefficients, row by row: the powers of T of V**0, then of V**1, ...

    Attributes
    ----------
    lengths : tuple of int
        Coefficients in each row.
    covariance : ndarray, shape (n, n)
        Covariance of the coefficients.
    freedom : float
        Its degrees of freedom.
    systematic : float
        Standard uncertainty in mm of what no coefficient has: the systematic error of a day, lack of fit.
    systematic_freedom : float
        Its degrees of freedom.
    voltage, temperature : tuple of float
        Lowest and highest that were measured, in V and degC.
    """

    lengths: tuple[int, ...]
    covariance: Values
    freedom: float
    systematic: float
    systematic_freedom: float
    voltage: tuple[float, float]
    temperature: tuple[float, float]

    def columns(self, V: Values, T: Values) -> Values:
        """Return what each coefficient is multiplied by; shape (n, points)."""
        return columns(self.lengths, V, T)

    def standard(self, V: Values, T: Values) -> Values:
        """Return the standard uncertainty in mm that the coefficients cause; shape (points,)."""
        x = self.columns(V, T)
        return np.asarray(np.sqrt(np.maximum(np.sum(x * (self.covariance @ x), axis=0), 0.0)))


def columns(lengths: Sequence[int], V: Values, T: Values) -> Values:
    """Return the powers of V and T, row by row; shape (coefficients, points)."""
    return np.array([V**i * T**j for i, length in enumerate(lengths) for j in range(length)])


def of_least_squares(measurements: Measurements, fit: Fit) -> CoefficientUncertainty:
    """Return the uncertainty of coefficients fitted by least squares.

    What no coefficient has is the lack of fit, if the residuals are structured; a day's own error is not known to this
    method.
    """
    lengths = tuple(map(len, fit.polynomial.coefficients))
    weights = np.array(fit.weights) if fit.weights else np.ones(len(measurements))
    sums = Sums(measurements.clearance, measurements.voltage, measurements.temperature, weights)
    solution = sums.solve(terms_of(fit.orders))
    assert solution is not None, "a fit has terms that the measurements determine"
    freedom = len(measurements) - sum(lengths)
    x = columns(lengths, measurements.voltage, measurements.temperature)
    scale = np.sqrt(np.sum(x**2, axis=1))  # the powers differ by orders of magnitude
    scaled = x / scale[:, None]
    normal = (scaled * weights) @ scaled.T
    variance = float(solution.residual_squares) / freedom
    lack = lack_of_fit(residuals(measurements, fit.polynomial), measurements.voltage, measurements.temperature)
    return CoefficientUncertainty(
        lengths=lengths,
        covariance=variance * np.linalg.inv(normal) / np.multiply.outer(scale, scale),
        freedom=float(freedom),
        systematic=lack.missed if lack.structured else 0.0,
        systematic_freedom=float(freedom),
        voltage=fit.covered[0],
        temperature=fit.covered[1],
    )


def of_bayes(measurements: Measurements, made: BayesianFit) -> CoefficientUncertainty:
    """Return the uncertainty of the coefficients of a Bayesian calibration.

    The curve of the day is projected on the terms of the polynomial, by least squares over the covered region: the
    covariance is that of the projection about the coefficients, and the systematic error, in the mean over the region,
    the rest, which includes that of a day without measurements. Both variances are uncertain over the pairs of
    scatters, weighted as for intervals; `student` makes of each a standard uncertainty with degrees of freedom. Where
    the sensor may have stepped, it is what is known if it did: the polynomial is then off by a part of the step.
    """
    posterior, polynomial = made.doubted, made.fit.polynomial
    lengths = tuple(map(len, polynomial.coefficients))
    V, T = made.region.points()
    V, T = V[::EVERY], T[::EVERY]
    if T.min() == T.max():  # the coefficients of the temperature are as uncertain as the type leaves them
        T = T + np.resize((-BESIDE, 0.0, BESIDE), len(T))
    x = columns(lengths, V, T)
    scale = np.sqrt(np.mean(x**2, axis=1))
    projection = np.linalg.pinv((x / scale[:, None]).T) / scale[:, None]
    mean, of_curve, of_day = posterior.predicted_parts(V, T)
    off = mean - polynomial(V, T)[:, None]
    weight = posterior.scatters.of_intervals
    covariance = np.zeros((len(x), len(x)))
    inside, outside = np.zeros(len(weight)), np.zeros(len(weight))
    for k in range(len(weight)):
        spread = np.concatenate((of_curve[:, :, k], off[None, :, k]))
        projected = projection @ spread.T
        own = projected @ projected.T
        covariance += float(weight[k]) * own
        inside[k] = float(np.mean(np.sum(x * (own @ x), axis=0)))
        outside[k] = max(float(np.mean(np.sum(spread**2, axis=0) + of_day[:, k])) - inside[k], 0.0)
    of_curve_share, freedom = student(inside, weight)
    of_rest_share, systematic_freedom = student(outside, weight)
    return CoefficientUncertainty(
        lengths=lengths,
        covariance=of_curve_share * covariance,
        freedom=freedom,
        systematic=math.sqrt(of_rest_share * float(weight @ outside)),
        systematic_freedom=systematic_freedom,
        voltage=made.fit.covered[0],
        temperature=made.fit.covered[1],
    )


def student(variances: Values, weight: Values) -> tuple[float, float]:
    """Return Student's distribution for an error whose variance is uncertain: with probabilities `weight`, shape (n,).

    A normal error whose variance is scaled inverse chi-square distributed with v degrees of freedom about ``s**2`` is
    s times Student's t (JCGM 101:2008, 6.4.9). The variance then has the mean ``m = s**2 v / (v - 2)`` and the variance
    ``2 m**2 / (v - 4)``, from which v and s follow. To widen m itself by t would count its uncertainty twice.

    Returns
    -------
    share : float
        ``s**2`` divided by the mean of the variances.
    freedom : float
        v, above 4; infinite if the variance is certain.

    Examples
    --------
    >>> student(np.array([1.0, 3.0]), np.array([0.5, 0.5]))
    (0.8333333333333334, 12.0)
    """
    mean = float(weight @ variances)
    spread = float(weight @ (variances - mean) ** 2)
    if not spread > 0:
        return 1.0, math.inf
    freedom = 4.0 + 2.0 * mean**2 / spread
    return (freedom - 2.0) / freedom, freedom
