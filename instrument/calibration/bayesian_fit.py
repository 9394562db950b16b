"""Calibration by the mixed-effects model: for one day, with what is known of the sensor's type.

Unlike the paper's rule, it knows that a sensor is one of a type, that it drifts, that a day has an error of its own,
and how large these are compared with the scatter of a measurement. It ends in a polynomial, like the paper's: of the
type curve's orders, or of as high an order in the voltage as the type allows and the day's own curve needs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sosmith.gen.calibration.fit import (
    COLUMNS,
    MIN_SCATTER,
    NORMAL_CONSISTENCY,
    Fit,
    Measurements,
    Progress,
    Trial,
    check_variation,
    residuals,
    root_mean_square,
    untold,
)
from sosmith.instrument.calibration.acceptance import Range
from sosmith.instrument.calibration.covered_region import CoveredRegion
from sosmith.instrument.calibration.mixed_effects.day_polynomial import polynomial_of, terms_up_to
from sosmith.instrument.calibration.mixed_effects.doubts import doubts_of
from sosmith.instrument.calibration.mixed_effects.model import (
    NONE,
    RATIOS,
    SCATTERS,
    Index,
    Model,
    Posterior,
    Rows,
    Scatters,
    rows_of,
)
from sosmith.instrument.calibration.mixed_effects.steps import Step, step_of
from sosmith.instrument.calibration.mixed_effects.systematic_error import SystematicCurves
from sosmith.instrument.calibration.rails import Rails, rails_of
from sosmith.instrument.calibration.sensor_type import DEVIATIONS, MOST_ORDER, SYSTEMATIC_FACTOR, SensorType
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial

REJECTED = 3.5
"""Residual, in standard deviations estimated from the median magnitude, above which a measurement is left out."""

MAX_ROUNDS = 10
"""Limit on rounds of rejection. Two or three are usual."""

SURPRISING, SYSTEMATIC_SURPRISING = 4.0, 2.0
"""Deviations beyond this many tolerances, and systematic errors beyond this many standard deviations, are told."""

MISSED, SOME = 1.0, 16
"""What a polynomial may miss of the day's curve, relative to the standard uncertainty of that, rms, before it is told;
and one of how many points of the covered region is looked at."""

MOST_REJECTED = 0.25
"""Share of outliers above which it is the sensor that is not of the type."""


@dataclass(frozen=True, eq=False)
class BayesianFit:
    """A calibration for one day.

    Attributes
    ----------
    fit : Fit
        The polynomial, with weights of 0 for measurements left out as outliers.
    posterior : Posterior
        What the measurements say about the day's curve.
    model : Model
        The model and its sums, without the outliers.
    plain : bool
        Whether the day's own curve is left out of the polynomial: no measurement is of that day, or a polynomial with
        it would leave the range of the clearance or not rise with the voltage.
    order : ndarray, shape (n,)
        The measurement of each row of the model.
    at_rail : int
        Measurements that were left out because the voltage was at an end of its range, or at a rail inside it.
    rails : Rails
        Between which voltages the sensor measures.
    region : CoveredRegion
        Region of the measurements, without those at a rail inside the range: nothing is calibrated there.
    clearance : ndarray, shape (n,)
        Clearance in mm of each row of the model, at which the errors of the days are taken.
    step : Step or None
        A step of the sensor on one of the last days, if one is possible: intervals hold with it and, unless it is past
        doubt, without.
    """

    fit: Fit
    posterior: Posterior
    model: Model
    plain: bool
    order: Index
    at_rail: int
    rails: Rails
    region: CoveredRegion
    clearance: Values
    step: Step | None

    @property
    def doubted(self) -> Posterior:
        """What is known if the sensor stepped, where it may have; else the posterior."""
        return self.posterior if self.step is None else self.step.posterior

    @property
    def either(self) -> tuple[Posterior, ...]:
        """What intervals hold for: with a step and without, or only with it where it is past doubt."""
        if self.step is None:
            return (self.posterior,)
        return (self.step.posterior,) if self.step.told else (self.posterior, self.step.posterior)

    @cached_property
    def averaged(self) -> Posterior:
        """What the polynomial is made of: the posterior, with a step and without where the sensor may have stepped."""
        return self.posterior if self.step is None else self.step.averaged(self.posterior)

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Sentences about what explains the measurements far better than the type's errors of a day do."""
        posterior = self.posterior
        return doubts_of(self.model, posterior.curves, self.clearance, self.given, of_day=posterior.same_day)

    @property
    def missed(self) -> str:
        """A sentence if the polynomial follows the day's curve much worse than that is known, else empty."""
        posterior, order = self.averaged, self.fit.orders[0]
        if self.plain or posterior.sensor_type.order == MOST_ORDER:
            return ""
        V, T = (values[::SOME] for values in self.region.points())
        mean, variance = (posterior.scatters.mean_of(values) for values in posterior.predicted(V, T))
        off = (self.fit.polynomial(V, T) - mean) ** 2
        if float(np.mean(off / variance)) <= MISSED**2:
            return ""
        return (
            f"the polynomial of orders {order}, 1 misses the curve of the day by {math.sqrt(float(np.mean(off))):.2g} "
            "mm rms, by which its intervals are wider: a higher --order follows it, where the hardware has room"
        )

    @property
    def given(self) -> Values:
        """Weights of 0 or 1 of the rows of the model."""
        return np.array(self.fit.weights)[self.order]

    @property
    def surprise(self) -> str:
        """A sentence if the measurements are far from what is known of the sensor's type, else empty."""
        posterior = self.posterior
        deviations = dict(zip(DEVIATIONS, posterior.deviations, strict=True))
        name, most = max(deviations.items(), key=lambda one: abs(one[1]))
        known = posterior.sensor_type
        if abs(most) > SURPRISING:
            return f"the sensor's {name} is {abs(most):.1f} tolerances off that of the type {known.name}"
        if posterior.systematic > SYSTEMATIC_FACTOR**SYSTEMATIC_SURPRISING * known.systematic:
            return (
                f"the systematic error of a day is {posterior.systematic:.2g} mm rms, and {known.systematic:g} mm is "
                f"that of the type {known.name}"
            )
        return ""

    @property
    def kept(self) -> Index:
        """Rows of the model that are no outliers."""
        return np.flatnonzero(self.given)


def bayesian_fit(
    measurements: Measurements,
    sensor_type: SensorType,
    date: int,
    ranges: tuple[Range, Range, Range],
    progress: Progress = untold,
) -> BayesianFit:
    """Calibrate a sensor for the day of ordinal `date`.

    1. Measurements with the voltage at an end of its range, or at a rail inside it, are left out: a sensor at its rail
       says only that the clearance is there or beyond, and hides the day's systematic error.
    2. Without systematic errors of the days, the model gives a curve, at which those errors are then taken.
    3. Measurements whose residual from the curve of their day is more than `REJECTED` standard deviations are left
       out, and the model is fitted again, until these are the same.
    4. A step of the sensor on one of the last days is looked for. Where there may be one, the posterior is that with a
       step and that without, by their probabilities, and intervals hold in either case, unless it is past doubt.
    5. The posterior mean for `date` is the polynomial. If there are measurements of that very day, it is the polynomial
       nearest to the day's own curve, with squared errors relative to the clearance, unless that polynomial leaves the
       range of the clearance somewhere or falls with the voltage; for a later day the day's own curve is unknown.

    Parameters
    ----------
    measurements : Measurements
        With their `days`; without, all are taken to be of the day `date`.
    sensor_type : SensorType
        The prior.
    date : int
        Proleptic Gregorian ordinal; a day before the last measurement counts as that of the last.
    ranges : tuple of Range
        Lowest and highest clearance in mm, voltage in V, temperature in degC, of the sensor's ports.
    progress : callable
        Receives the number of steps done and expected.

    Raises
    ------
    SpecificationError
        If measurements are too few, or clearance or voltage do not vary, as for `fit`; if all are at a rail; if more
        than `MOST_REJECTED` of them are outliers; if the polynomial falls with the voltage somewhere in the region that
        the measurements cover. All may be of one temperature: how a sensor depends on it is known from its type.
    """
    check_variation(measurements, COLUMNS[:2])
    rows, order = rows_of(measurements, sensor_type, date)
    V, T, d = (values[order] for values in (measurements.voltage, measurements.temperature, measurements.clearance))
    rails = rails_of(measurements, ranges[1])
    free = rails.hold(V).astype(np.float64)
    at_rail = int(np.count_nonzero(free == 0))
    if at_rail == len(d):
        raise SpecificationError(
            f"{measurements.source}: some voltage_V must be inside the range {ranges[1][0]:g} to {ranges[1][1]:g} V, "
            f"not all {len(d):,} at an end of it"
        )
    progress(0, 3)
    # Without the errors of the days, those of known variance are off by these: neither used nor judged before them.
    scattering = np.where(rows.known > 0, 0.0, free)
    first = scattering if np.any(scattering) else free
    model, at, weights = _rejecting(sensor_type, rows, first, first, NONE)
    weights = np.where(rows.known > 0, free, weights)
    curve = sensor_type.polynomial(tuple(at.mean_of(model.course(at).mean[-1]).tolist()))
    clearance = curve(V, T)
    curves = SystematicCurves(float(clearance.min()), float(clearance.max()), sensor_type.correlation)
    rows = replace(rows, h=curves.columns(clearance))
    progress(1, 3)
    model, _, weights = _rejecting(sensor_type, rows, weights, free, RATIOS)
    progress(2, 3)
    outliers = int(np.count_nonzero(weights == 0)) - at_rail
    if outliers > MOST_REJECTED * len(d):
        raise SpecificationError(
            f"{measurements.source}: at most a quarter of the measurements must be outliers for a sensor of the type "
            f"{sensor_type.name}, not {outliers:,} of {len(d):,}"
        )
    day = max(date, rows.days[-1])
    posterior = model.posterior(model.scatters(), curves, day)
    step = step_of(model, posterior, day)
    usable = _without_rails(measurements, rails, ranges[1])
    region = CoveredRegion.of(usable.voltage, usable.temperature)
    averaged = posterior if step is None else step.averaged(posterior)
    polynomial, plain = polynomial_of(averaged, usable, region, ranges)
    given = np.empty(len(d))
    given[order] = weights
    fit = _as_fit(measurements, polynomial, usable.covered, given)
    return BayesianFit(fit, posterior, model, plain, order, at_rail, rails, region, clearance, step)


def _without_rails(measurements: Measurements, rails: Rails, voltages: Range) -> Measurements:
    """Leave out what is at a rail inside the range of the port, whose ends the hardware knows by itself."""
    V = measurements.voltage
    inside = np.logical_or(rails.hold(V), (voltages[0] >= V) | (voltages[1] <= V))
    return measurements if inside.all() else measurements.of(inside)


def _rejecting(
    sensor_type: SensorType, rows: Rows, weights: Values, free: Values, ratios: Values
) -> tuple[Model, Scatters, Values]:
    """Fit on the coarse grid, leaving out outliers; return the model, its scatters and weights of 0 or 1.

    `free` is 0 for what is left out in any case.
    """
    for _ in range(MAX_ROUNDS):
        model = Model.of(sensor_type, rows, weights)
        at = model.weighed(SCATTERS, ratios)
        off = np.abs(model.residuals(at.likeliest))
        scattering = (free > 0) & (rows.known == 0)
        scatter = NORMAL_CONSISTENCY * float(np.median(off[scattering])) if scattering.any() else 0.0
        allowed = REJECTED * np.maximum(max(scatter, MIN_SCATTER), np.sqrt(rows.known))
        kept = np.where(off > allowed, 0.0, free)
        if np.array_equal(kept, weights):
            return model, at, weights
        weights = kept
    model = Model.of(sensor_type, rows, weights)
    return model, model.weighed(SCATTERS, ratios), weights


def _as_fit(measurements: Measurements, polynomial: Polynomial, covered: tuple[Range, Range], weights: Values) -> Fit:
    residual = residuals(measurements, polynomial)
    count, d = math.fsum(weights), measurements.clearance
    off = d - math.fsum(weights * d) / count
    terms = len(terms_up_to(polynomial.orders[0]))
    unexplained = math.fsum(weights * residual**2) / max(count - terms, 1.0)
    adjusted = 1.0 - unexplained / (math.fsum(weights * off**2) / (count - 1.0))
    trial = Trial(polynomial.orders, terms, adjusted)
    given = tuple(weights.tolist())
    return Fit(polynomial, trial, root_mean_square(residual), (), covered, given)
