"""What to measure next: the measurements of a day that narrow the intervals of its readings the most."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from sosmith.instrument.calibration.acceptance import Range
from sosmith.instrument.calibration.bayesian_fit import BayesianFit
from sosmith.instrument.calibration.mixed_effects.day_filter import moved
from sosmith.instrument.calibration.mixed_effects.day_polynomial import (
    SMALLEST,
    projected_at,
    temperatures_about,
    terms_up_to,
)
from sosmith.instrument.calibration.mixed_effects.model import Scatters, mixture_half_width
from sosmith.instrument.calibration.uncertainty import SHARE
from sosmith.model.arithmetic.stacked_matrices import product, transposed
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial

STEP = 0.5
"""Distance in mm of the clearances that may be measured: what a set of gauges has."""

MAX_MEASUREMENTS = 200
"""Most measurements advised."""

VOLTAGES = 2001
"""Points at which the calibration is inverted."""

PAIRS = 48
"""Pairs of scatters for which a plan is followed."""

PROMISED = 1.15
"""Factor by which planned intervals are promised wider than expected: scatters will be estimated anew."""

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
    uncertainty: float = 0.0,
) -> Advice:
    """Choose the measurements of a later day, one after the other, by what each is expected to bring.

    Each time, the measurement is taken that lowers the sum of the variances at the targets the most (I-optimality, one
    point at a time), until every interval is as narrow as `within`. In a linear model that does not depend on what is
    measured. Intervals are those that the fit will state: over all scatters that the measurements so far leave
    possible, and with what the polynomial will miss of the day's own curve, in the mean.

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
    uncertainty : float
        Standard uncertainty in mm of what is measured, as of reference targets; 0 if it scatters as what was measured.

    Raises
    ------
    SpecificationError
        If a clearance is out of what the sensor reads at one of the temperatures.
    """
    curve = made.posterior.sensor_type.polynomial(made.posterior.deviations)
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
    plan = _Plan.of(made, curve, ranges[1], targets, possible, days)
    noise = np.full_like(plan.scatter, uncertainty**2) if uncertainty else plan.scatter**2
    before = after = plan.half_widths()
    chosen: Counter[tuple[float, float]] = Counter()
    while float(after.max()) > within and chosen.total() < most:
        pick = plan.best(noise)
        chosen[possible[pick]] += 1
        plan = plan.measured(pick, noise)
        after = PROMISED * plan.half_widths()
    return Advice(
        plan=tuple((d, T, chosen[d, T]) for d, T in sorted(chosen, key=lambda one: (one[1], one[0]))),
        targets=tuple(targets),
        before=tuple(before.tolist()),
        after=tuple(after.tolist()),
        reached=bool(after.max() <= within),
    )


@dataclass(frozen=True, eq=False)
class _Plan:
    """What is expected to be known of deviations and day's curve, n numbers, for each of k pairs of scatters.

    Attributes
    ----------
    prior, covariance : ndarray, shape (n, n, k)
        Before any measurement of the day, and after those chosen so far.
    scatter : ndarray, shape (k,)
        Of a measurement in mm.
    wanted, offered : ndarray, shapes (n, targets) and (n, possible)
        What each number adds to the clearance at the targets, and where measurements are possible.
    missed : ndarray, shape (n, targets)
        What of it the polynomial misses.
    """

    prior: Values
    covariance: Values
    scatter: Values
    wanted: Values
    offered: Values
    missed: Values

    @classmethod
    def of(
        cls,
        made: BayesianFit,
        curve: Polynomial,
        voltages: Range,
        targets: list[tuple[float, float]],
        possible: list[tuple[float, float]],
        days: int,
    ) -> _Plan:
        """Return what is known `days` after the last measurement."""
        posterior = made.posterior
        pairs = _pairs(posterior.scatters)
        factor = moved(made.model.course(pairs).factor[-1], days, posterior.sensor_type.drifts)
        size, nodes = len(factor), posterior.curves.count
        covariance = np.zeros((size + nodes, size + nodes, len(pairs.scatter)))
        covariance[:size, :size] = product(factor, transposed(factor))
        covariance[np.arange(size, size + nodes), np.arange(size, size + nodes)] = (pairs.scatter * pairs.ratio) ** 2

        def columns(V: Values, T: Values) -> Values:
            return np.concatenate((posterior.sensor_type.columns(V, T), posterior.curves.columns(curve(V, T))))

        def at(points: list[tuple[float, float]]) -> tuple[Values, Values]:
            V = np.array([_voltage(curve, voltages, one, T) for one, T in points])
            return V, np.array([T for _, T in points])

        V, T = at(targets)
        wanted, terms = columns(V, T), terms_up_to(posterior.sensor_type.order)
        covered = (*made.fit.covered[1], *T.tolist())
        x, grid = projected_at(voltages, temperatures_about((min(covered), max(covered))))
        weigh = 1.0 / np.maximum(curve(x, grid), SMALLEST)
        powers, here = (np.array([v**i * t**j for i, j in terms]) for v, t in ((x, grid), (V, T)))
        fitted = np.linalg.lstsq((powers * weigh).T, (columns(x, grid) * weigh).T, rcond=None)[0]
        missed = wanted - fitted.T @ here
        missed[:size] = 0.0
        return cls(covariance, covariance, pairs.scatter, wanted, columns(*at(possible)), missed)

    def half_widths(self) -> Values:
        """Return the half-widths of the intervals at the targets in mm."""
        left = np.einsum("it,ijk,jt->tk", self.wanted, self.covariance, self.wanted)
        missed = np.einsum("it,ijk,jt->tk", self.missed, self.prior - self.covariance, self.missed)
        variance, count = left + np.maximum(missed, 0.0), len(self.scatter)
        return mixture_half_width(np.zeros_like(variance), variance, np.full(count, 1.0 / count), SHARE)

    def best(self, noise: Values) -> int:
        """Return which measurement lowers the variances at the targets the most."""
        shared = np.einsum("ijk,jp->ipk", self.covariance, self.offered)
        whole = np.einsum("ip,ipk->pk", self.offered, shared) + noise
        gains = np.mean(np.einsum("it,ipk->tpk", self.wanted, shared) ** 2 / whole, axis=(0, 2))
        return int(np.argmax(np.round(gains / gains.max(), GAIN_DIGITS)))

    def measured(self, pick: int, noise: Values) -> _Plan:
        """Return what is known after one more measurement."""
        shared = np.einsum("ijk,j->ik", self.covariance, self.offered[:, pick])
        whole = self.offered[:, pick] @ shared + noise
        return replace(self, covariance=self.covariance - shared[:, None] * shared[None] / whole)


def _pairs(scatters: Scatters) -> Scatters:
    """Return `PAIRS` equally likely pairs of scatters in place of all of them, by their systematic errors."""
    order = np.argsort(scatters.scatter * scatters.ratio, kind="stable")
    upto = np.cumsum(scatters.of_intervals[order])
    some = order[np.minimum(np.searchsorted(upto, (np.arange(PAIRS) + 0.5) / PAIRS), len(order) - 1)]
    even = np.full(PAIRS, 1.0 / PAIRS)
    return Scatters(scatters.scatter[some], scatters.ratio[some], even, even)


def _readable(curve: Polynomial, voltages: Range, temperature: float) -> Range:
    """Return the clearances at the ends of the range of voltages."""
    low, high = (float(curve(v, temperature)) for v in voltages)
    return max(low, 0.0), high


def _voltage(curve: Polynomial, voltages: Range, clearance: float, temperature: float) -> float:
    """Return the voltage at which the curve gives a clearance, interpolated."""
    V = np.linspace(*voltages, VOLTAGES)
    return float(np.interp(clearance, np.maximum.accumulate(curve(V, np.full(len(V), temperature))), V))
