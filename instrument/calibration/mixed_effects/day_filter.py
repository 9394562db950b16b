"""The sensor's deviations from day to day: a Kalman filter and smoother, for many pairs of scatters at once.

The deviations z start as independent standard normal numbers and walk: from one day to another, t days later, the
variance of z[i] grows by ``t drifts[i]``. Covariances are kept as factors, ``P = S S'``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.instrument.calibration.mixed_effects.day_sums import Scaled
from sosmith.model.arithmetic.stacked_matrices import (
    applied,
    cholesky,
    dot,
    identity,
    product,
    solved,
    solved_transposed,
    transposed,
)
from sosmith.model.arrays import Values


@dataclass(frozen=True, eq=False)
class Course:
    """Deviations over the days; "..." is the stack, the pairs of scatters.

    Attributes
    ----------
    mean : list of ndarray, shape (5, ...)
        Mean for each day.
    factor : list of ndarray, shape (5, 5, ...)
        S of the covariance for each day.
    quadratic : ndarray, shape stack
        What stands in the exponent of the marginal likelihood: ``exp(-quadratic / 2) / root``.
    root : Scaled
        Its denominator, without the power of the scatter.
    """

    mean: list[Values]
    factor: list[Values]
    quadratic: Values
    root: Scaled


def course(
    days: list[tuple[Values, Values, Values]], gaps: list[int], drifts: tuple[float, ...], stack: tuple[int, ...]
) -> Course:
    """Filter forwards.

    Parameters
    ----------
    days : list of (j, h, q)
        Information of each day, of shapes (5, 5, ...), (5, ...) and stack, divided by the squared scatter.
    gaps : list of int
        Days since the day before, one less than `days`.
    drifts : tuple of float
        Variance added in a day.
    stack : tuple of int
        Shape of the pairs of scatters.
    """
    size = len(drifts)
    z, s = np.zeros((size, *stack)), identity(size, stack)
    means, factors = [], []
    quadratic, root = np.zeros(stack), Scaled(np.ones(stack), np.zeros(stack))
    for number, day in enumerate(days):
        if number:
            s = moved(s, gaps[number - 1], drifts)
        z, s, off, lower = updated(z, s, day)
        quadratic = quadratic + off
        for k in range(size):
            root = root.times(lower[k, k])
        means.append(z)
        factors.append(s)
    return Course(means, factors, quadratic, root)


def updated(z: Values, s: Values, day: tuple[Values, Values, Values]) -> tuple[Values, Values, Values, Values]:
    """Take in the information (j, h, q) of one day.

    Returns
    -------
    z, s : ndarray, shapes (5, ...) and (5, 5, ...)
        Mean and factor of the covariance afterwards.
    off : ndarray, shape stack
        Squared distance of the day's measurements from their prediction, in its standard deviations: chi-square
        distributed with as many degrees of freedom as there are measurements.
    lower : ndarray, shape (5, 5, ...)
        Triangular; the product of its diagonal stands in the denominator of the likelihood.
    """
    j, h, q = day
    of_s = product(j, s)
    lower = cholesky(identity(len(z), z.shape[1:]) + product(transposed(s), of_s))
    of_z = applied(j, z)
    forward = solved(lower, applied(transposed(s), h - of_z)[:, None])
    off = q - 2.0 * dot(z, h) + dot(z, of_z) - dot(forward[:, 0], forward[:, 0])
    s = transposed(solved(lower, transposed(s)))
    return z + applied(s, forward[:, 0]), s, np.asarray(off), lower


def moved(factor: Values, gap: int, drifts: tuple[float, ...]) -> Values:
    """Return the factor of the covariance `gap` days later."""
    if not gap or not any(drifts):
        return factor
    return cholesky(_later(product(factor, transposed(factor)), gap, drifts))


def _later(covariance: Values, gap: int, drifts: tuple[float, ...]) -> Values:
    later = covariance.copy()
    for k, drift in enumerate(drifts):
        later[k, k] += gap * drift
    return later


def smoothed(filtered: Course, gaps: list[int], drifts: tuple[float, ...]) -> tuple[list[Values], list[Values]]:
    """Return mean and covariance for each day, given the measurements of all days (Rauch, Tung and Striebel)."""
    z, p = filtered.mean[-1], product(filtered.factor[-1], transposed(filtered.factor[-1]))
    means, covariances = [z], [p]
    for number in reversed(range(len(gaps))):
        factor = filtered.factor[number]
        now = product(factor, transposed(factor))
        ahead = _later(now, gaps[number], drifts)
        lower = cholesky(ahead)
        gain = transposed(solved_transposed(lower, solved(lower, now)))
        z = filtered.mean[number] + applied(gain, z - filtered.mean[number])
        p = now + product(product(gain, p - ahead), transposed(gain))
        means.append(z)
        covariances.append(p)
    return means[::-1], covariances[::-1]
