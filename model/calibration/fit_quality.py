"""Quality of a fitted calibration: residuals, leverage, cross-validated error, coverage."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from sosmith.model.arrays import Values
from sosmith.model.calibration.covered_region import CoveredRegion
from sosmith.model.calibration.fit import Fit, Measurements, residuals, root_mean_square, terms_of
from sosmith.model.calibration.least_squares import Sums

CELLS = 10
"""Grid cells along each axis for the share of filled cells."""

HIGH_LEVERAGE = 3.0
"""Multiple of the mean leverage above which a measurement is reported (a rule of thumb)."""

_ALONE = 1e-9
"""Value of ``1 - leverage`` below which a measurement alone determines a coefficient."""


@dataclass(frozen=True, eq=False)
class FitQuality:
    """Quality of a fit; every array has one element per measurement.

    Attributes
    ----------
    residual : ndarray, shape (n,)
        Measured minus fitted clearance in mm.
    leverage : ndarray, shape (n,)
        Weight of a measurement in its own fitted value, from 0 to 1; the sum is the number of coefficients.
    region : CoveredRegion
        Region that the measurements cover.
    filled_cells : float
        Share of the cells that hold a measurement, in a grid of `CELLS` by `CELLS` over the range of voltage and
        temperature.
    """

    residual: Values
    leverage: Values
    region: CoveredRegion
    filled_cells: float

    @property
    def cross_validated(self) -> float | None:
        """Root mean square error in mm by leave-one-out cross-validation.

        None if it is undefined because a measurement alone determines a coefficient. For a robust fit, the weights
        of the full fit are used.
        """
        if np.any(1.0 - self.leverage < _ALONE):
            return None
        return root_mean_square(self.residual / (1.0 - self.leverage))

    @property
    def high_leverage(self) -> tuple[int, ...]:
        """Indices of measurements whose leverage is above `HIGH_LEVERAGE` times the mean."""
        return tuple(np.flatnonzero(self.leverage > HIGH_LEVERAGE * self.leverage.mean()).tolist())

    def largest_residuals(self, count: int) -> tuple[int, ...]:
        """Return the indices of the `count` largest residuals by magnitude, largest first."""
        return tuple(np.argsort(-np.abs(self.residual), kind="stable")[:count].tolist())


def assess(measurements: Measurements, fit: Fit) -> FitQuality:
    """Assess `fit`, which must have been fitted to `measurements`."""
    region = CoveredRegion.of(measurements.voltage, measurements.temperature)
    return FitQuality(
        residuals(measurements, fit.polynomial), _leverage(measurements, fit), region, _filled_cells(measurements)
    )


def _leverage(measurements: Measurements, fit: Fit) -> Values:
    """Return the diagonal of the hat matrix, ``w x' N**-1 x``.

    With ``N = L D L'`` and ``z = L**-1 x`` it is w times the sum of ``z**2 / D``.
    """
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
