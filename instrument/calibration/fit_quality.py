"""Quality of a fitted calibration: residuals, leverage, cross-validated error, coverage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.gen.calibration.fit import Fit, Measurements, residuals, root_mean_square, terms_of
from sosmith.gen.calibration.least_squares import Sums
from sosmith.instrument.calibration.bayesian_fit import BayesianFit
from sosmith.instrument.calibration.covered_region import CoveredRegion
from sosmith.instrument.calibration.uncertainty import Uncertainty, of_polynomial, of_posterior
from sosmith.model.arrays import Values

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
    uncertainty : Uncertainty
        The intervals of the calibration, and whether they hold.
    by_days : bool
        Whether whole days are left out for cross-validation, as a Bayesian calibration does, or single measurements.
    """

    residual: Values
    leverage: Values
    region: CoveredRegion
    filled_cells: float
    uncertainty: Uncertainty
    by_days: bool = False

    @property
    def cross_validated(self) -> float | None:
        """Root mean square error in mm by cross-validation, leaving out one measurement or one day at a time.

        None if it is undefined because a measurement alone determines a coefficient, or there is one day only. For a
        robust fit, the weights of the full fit are used.
        """
        if self.by_days:
            return None if self.uncertainty.over_days is None else self.uncertainty.over_days.rms
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
    """Assess `fit`, which must have been fitted to `measurements` by least squares."""
    uncertainty = of_polynomial(measurements, fit)
    return FitQuality(
        residuals(measurements, fit.polynomial),
        _leverage(measurements, fit),
        uncertainty.region,
        _filled_cells(measurements),
        uncertainty,
    )


def assess_posterior(measurements: Measurements, made: BayesianFit) -> FitQuality:
    """Assess a Bayesian calibration, which must have been made from `measurements`.

    The leverage is that of least squares with the same terms, without the outliers.
    """
    uncertainty = of_posterior(measurements, made)
    return FitQuality(
        residuals(measurements, made.fit.polynomial),
        _leverage(measurements, made.fit),
        uncertainty.region,
        _filled_cells(measurements),
        uncertainty,
        by_days=True,
    )


def _leverage(measurements: Measurements, fit: Fit) -> Values:
    """Return the diagonal of the hat matrix; 1 if the measurements do not determine the terms, as a prior allows."""
    weights = np.array(fit.weights) if fit.weights else np.ones(len(measurements))
    sums = Sums(measurements.clearance, measurements.voltage, measurements.temperature, weights)
    solution = sums.solve(terms_of(fit.orders))
    if solution is None:
        return weights
    return weights * sums.leverage(solution, measurements.voltage, measurements.temperature)


def _filled_cells(measurements: Measurements) -> float:
    cells = set(zip(_cell(measurements.voltage), _cell(measurements.temperature), strict=True))
    return len(cells) / CELLS**2


def _cell(values: Values) -> list[int]:
    low, high = values.min(), values.max()
    if low == high:
        return [0] * len(values)
    index: list[int] = np.minimum((values - low) / (high - low) * CELLS, CELLS - 1).astype(int).tolist()
    return index
