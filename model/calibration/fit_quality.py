"""How far a fitted calibration can be trusted: residuals, leverage, cross-validated error, coverage."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from sosmith.model.arrays import Values
from sosmith.model.calibration.covered_region import CoveredRegion
from sosmith.model.calibration.fit import Fit, Measurements, residuals, root_mean_square, terms_of
from sosmith.model.calibration.least_squares import Sums

CELLS = 10
"""Cells along each axis in which measurements are counted."""

HIGH_LEVERAGE = 3.0
"""Multiple of the mean leverage from which a measurement is called out (a rule of thumb)."""

_ALONE = 1e-9
"""Part of a measurement's own residual, below which it determines a coefficient alone."""


@dataclass(frozen=True, eq=False)
class FitQuality:
    """Figures of a fit, one element of every array per measurement.

    Attributes
    ----------
    residual : ndarray, shape (n,)
        Measured minus fitted clearance in mm.
    leverage : ndarray, shape (n,)
        How much of its own fitted value a measurement determines, from 0 to 1; they add up to the count of
        coefficients.
    region : CoveredRegion
        Where the measurements lie.
    filled_cells : float
        Share of `CELLS` by `CELLS` equal cells between least and largest voltage and temperature that hold a
        measurement.
    """

    residual: Values
    leverage: Values
    region: CoveredRegion
    filled_cells: float

    @property
    def cross_validated(self) -> float | None:
        """Root mean square error in mm at each measurement of the fit to all others.

        None if that is not defined, because a measurement determines a coefficient alone. In a robust fit the
        weights are those of the fit to all.
        """
        if np.any(1.0 - self.leverage < _ALONE):
            return None
        return root_mean_square(self.residual / (1.0 - self.leverage))

    @property
    def high_leverage(self) -> tuple[int, ...]:
        """Indices of measurements with more than `HIGH_LEVERAGE` times the mean leverage."""
        return tuple(np.flatnonzero(self.leverage > HIGH_LEVERAGE * self.leverage.mean()).tolist())

    def largest_residuals(self, count: int) -> tuple[int, ...]:
        """Pick the indices of the largest residuals, the largest first."""
        return tuple(np.argsort(-np.abs(self.residual), kind="stable")[:count].tolist())


def assess(measurements: Measurements, fit: Fit) -> FitQuality:
    """Work out the figures of `fit`, which has to come from these `measurements`."""
    region = CoveredRegion.of(measurements.voltage, measurements.temperature)
    return FitQuality(
        residuals(measurements, fit.polynomial), _leverage(measurements, fit), region, _filled_cells(measurements)
    )


def _leverage(measurements: Measurements, fit: Fit) -> Values:
    """Diagonal of the hat matrix, ``w x' N**-1 x`` with ``N = L D L'``: z = L**-1 x, then the sum of z**2 / D."""
    weights = np.array(fit.weights) if fit.weights else np.ones(len(measurements))
    terms = terms_of(fit.orders)
    sums = Sums(measurements.clearance, measurements.voltage, measurements.temperature, weights)
    solution = sums.solve(terms)
    assert solution is not None, "a fit has terms that the measurements determine"
    x, y = sums.centred(measurements.voltage, measurements.temperature)
    powers_x, powers_y = _powers(x, fit.orders[0]), _powers(y, fit.orders[1])
    leverage = np.zeros(len(measurements))
    reduced: list[Values] = []
    # Element by element: matrix products and the power function round differently from machine to machine.
    for (i, j), row, pivot in zip(terms, solution.factor, solution.pivots, strict=True):
        column = powers_x[i] * powers_y[j]
        for factor, before in zip(row, reduced, strict=True):
            column = column - factor * before
        reduced.append(column)
        leverage = leverage + column**2 / pivot
    return np.asarray(weights * leverage)


def _powers(values: Values, highest: int) -> list[Values]:
    return list(itertools.accumulate([values] * highest, np.multiply, initial=np.ones(len(values))))


def _filled_cells(measurements: Measurements) -> float:
    cells = set(zip(_cell(measurements.voltage), _cell(measurements.temperature), strict=True))
    return len(cells) / CELLS**2


def _cell(values: Values) -> list[int]:
    low, high = values.min(), values.max()
    index: list[int] = np.minimum((values - low) / (high - low) * CELLS, CELLS - 1).astype(int).tolist()
    return index
