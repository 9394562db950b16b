"""The uncertainty budget of an instrument, from the sensor to its output, over what its calibration covers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sosmith.gen.calibration.fit import Fit, read_measurements
from sosmith.gen.core import CoreDesign, filter_of, polynomial_of, pre_stage_in
from sosmith.gen.filter.design import Filter, decay_length
from sosmith.gen.filter.response import complex_response, group_delay
from sosmith.gen.specification.specification import CalibrationSpec, Specification
from sosmith.gen.specification.uncertainty import UncertaintySpec
from sosmith.gen.word_lengths.decimation.decimator import PreStage
from sosmith.instrument.calibration.coefficient_covariance import CoefficientUncertainty, of_least_squares
from sosmith.instrument.uncertainty.budget import SHARE, Budget, Contribution, Kind, of_limits
from sosmith.instrument.wear.assessment import ClearanceUncertainty
from sosmith.model.arithmetic.recursive_filters import sosfilt
from sosmith.model.arrays import Values
from sosmith.model.polynomial import Polynomial

GRID = (9, 5)
"""Voltages and temperatures at which the budget is made up."""

SOURCES = {
    "noise": "sensor noise",
    "temperature": "thermocouple",
    "voltage": "converter of the voltage",
    "clearance_rate": "delay of a moving reading",
    "motion": "motion let through",
}
"""Sources by their keys in ``[uncertainty]``."""

DIGITS = 4
"""Significant digits told: quantiles may differ in the last bits from machine to machine."""


@dataclass(frozen=True, eq=False, kw_only=True)
class InstrumentBudget:
    """The budget of an instrument at the points of a grid.

    Attributes
    ----------
    budget : Budget
        All contributions, in the unit of the output.
    voltage, temperature, clearance : ndarray, shape (n,)
        The points in V and degC, and the clearance there.
    unit : str
        Unit of the output.
    bound : float
        The proven bound of the arithmetic.
    missing : tuple of str
        Sources of which the specification says nothing.
    """

    budget: Budget
    voltage: Values
    temperature: Values
    clearance: Values
    unit: str
    bound: float
    missing: tuple[str, ...]

    @property
    def worst(self) -> int:
        """Index of the point with the largest expanded uncertainty."""
        return int(np.argmax(self.budget.expanded))

    def main_source(self, at: int) -> str:
        """Return the largest source at a point."""
        return max(self.budget.contributions, key=lambda one: float(one.contribution[at])).source

    @property
    def summary(self) -> str:
        """One sentence."""
        low, high = float(self.budget.expanded.min()), float(self.budget.expanded.max())
        least, most = f"±{low:.2g}", f"±{high:.2g}"
        span = f"{most} {self.unit} holds" if least == most else f"{least} to {most} {self.unit} hold"
        text = (
            f"{span} the true value in {100 * SHARE:g} %, "
            f"most of it {self.main_source(self.worst)}; the arithmetic is {self.bound:.2g} {self.unit} of it"
        )
        return text + (f"; not stated: {', '.join(self.missing)}" if self.missing else "")


@dataclass(frozen=True, eq=False, kw_only=True)
class Instrument:
    """What the budget follows from.

    Attributes
    ----------
    spec : Specification
    polynomial : Polynomial
        The calibration.
    known : CoefficientUncertainty
        What its coefficients are worth.
    ideal : Filter or None
        The filter; None for a calibration alone.
    pre_stage : PreStage or None
        What decimates before it; None if all samples go in.
    bound : float
        Bound of the error of the arithmetic, in the output's unit.
    """

    spec: Specification
    polynomial: Polynomial
    known: CoefficientUncertainty
    ideal: Filter | None
    pre_stage: PreStage | None = None
    bound: float

    @property
    def missing(self) -> tuple[str, ...]:
        """Sources of which the specification says nothing."""
        stated = self.spec.uncertainty
        keys = list(SOURCES) if self.ideal is not None else list(SOURCES)[:3]
        return tuple(SOURCES[key] for key in keys if stated is None or getattr(stated, key) in (None, ()))

    def budget(self, V: Values, T: Values) -> Budget:
        """Return the budget at voltages in V and temperatures in degC, shape (n,)."""
        spec, known, one = self.spec, self.known, np.ones(len(V))
        by_voltage, by_temperature = slopes(self.polynomial, V, T)
        unit = spec.output.unit
        found = [
            _of("calibration", "t", known.standard(V, T), unit, one, known.freedom),
            _of("systematic error of a day", "t", known.systematic * one, unit, one, known.systematic_freedom),
        ]
        stated = spec.uncertainty
        if stated is not None and stated.noise is not None:
            noise = float(stated.noise) * noise_gain(self.ideal, self.pre_stage) * one
            found.append(_of("sensor noise", "normal", noise, "V", by_voltage))
        if stated is not None and stated.temperature is not None:
            found.append(_of("thermocouple", "normal", float(stated.temperature) * one, "°C", by_temperature))
        if stated is not None and stated.voltage is not None:
            limits = of_limits(float(stated.voltage)) * one
            found.append(_of("converter of the voltage", "rectangular", limits, "V", by_voltage))
        if self.ideal is not None and stated is not None:
            found += _of_motion(self, self.ideal, stated, one)
        for port, slope, symbol in zip(spec.inputs, (by_voltage, by_temperature), ("V", "°C"), strict=True):
            step = of_limits(float(port.lsb) / 2) * one
            found.append(_of(f"steps of the {port.name}", "rectangular", step, symbol, slope))
        found.append(_of("arithmetic, proven", "rectangular", of_limits(self.bound) * one, unit, one))
        return Budget(tuple(found))

    def at_clearance(self, clearance: float) -> tuple[Values, Values]:
        """Return the voltages at which the calibration gives a clearance, at `GRID` temperatures."""
        voltage, _ = self.spec.inputs
        low, high = voltage.decode(np.array([voltage.lowest, voltage.highest]))
        V = np.linspace(low, high, 1001)
        T = np.linspace(*self.known.temperature, GRID[1])
        nearest = [int(np.argmin(np.abs(self.polynomial(V, np.full(len(V), t)) - clearance))) for t in T]
        return V[nearest], T

    def of_wear(self, begin: float, now: float) -> ClearanceUncertainty:
        """Return what the clearances of a record are worth, from the first one to that of now; in the output's unit."""
        at, before = self.at_clearance(now), self.at_clearance(begin)
        found = self.budget(*at)
        worst = int(np.argmax(found.expanded))
        apart = self.known.columns(*at) - self.known.columns(*before)
        rise = float(np.sqrt(np.max(np.sum(apart * (self.known.covariance @ apart), axis=0))))
        return ClearanceUncertainty(
            standard=float(found.combined[worst]), freedom=float(found.freedom[worst]), rise=rise
        )

    def shared(self, clearance: float) -> float:
        """Return the standard uncertainty that all readings share at a clearance: that of the coefficients."""
        x = self.known.columns(*self.at_clearance(clearance))
        return float(np.sqrt(np.max(np.sum(x * (self.known.covariance @ x), axis=0))))


def _of_motion(instrument: Instrument, ideal: Filter, stated: UncertaintySpec, one: Values) -> list[Contribution]:
    found, pre_stage, unit = [], instrument.pre_stage, instrument.spec.output.unit
    rate = float(instrument.spec.sample_rate if pre_stage is None else pre_stage.decimation.rate)
    if stated.clearance_rate is not None:
        delay = float(group_delay(ideal.sos, np.zeros(1), rate)[0])
        delay = delay if pre_stage is None else float(pre_stage.decimation.delay(ideal))
        speed = of_limits(float(stated.clearance_rate)) * one
        found.append(_of("delay of a moving reading", "rectangular", speed, f"{unit}/s", delay * one))
    for frequency, amplitude in stated.motion:
        at = np.array([float(frequency)])
        (gain,) = np.abs(complex_response(ideal.sos, at, rate)) * (
            1 if pre_stage is None else pre_stage.decimation.gain(at)
        )
        rms = float(amplitude) / math.sqrt(2.0) * one
        found.append(_of(f"motion at {float(frequency):g} Hz", "arcsine", rms, unit, float(gain) * one))
    return found


def instrument_of(spec: Specification, bound: float | None = None, *, filtered: bool = True) -> Instrument | None:
    """Return what the budget of a specification follows from; None if its calibration's uncertainty is not known.

    Parameters
    ----------
    spec : Specification
    bound : float or None
        Proven bound of the arithmetic in the output's unit; None for what the specification allows.
    filtered : bool
        Whether the core has the filter.
    """
    if spec.calibration is None or not spec.calibration.has_uncertainty:
        return None
    polynomial, fitted = polynomial_of(spec)
    known = _coefficients(spec.calibration, fitted)
    if known is None:
        return None
    pre_stage, _ = pre_stage_in(spec, "instrument", polynomial) if filtered else (None, {})
    return Instrument(
        spec=spec,
        polynomial=polynomial,
        known=known,
        ideal=None if not filtered else filter_of(spec) if pre_stage is None else pre_stage.filter,
        pre_stage=pre_stage,
        bound=float(spec.max_error) if bound is None else bound,
    )


def budget_of(design: CoreDesign) -> InstrumentBudget | None:
    """Make up the budget of an instrument; None if nothing is known of what its calibration is worth.

    Readings are taken to stand still, but for what ``[uncertainty]`` states of motion.
    """
    if design.core == "filter":
        return None
    bound = float(design.quantized.bound) * float(design.datapath.output.lsb)
    found = instrument_of(design.spec, bound, filtered=design.core == "instrument")
    if found is None:
        return None
    axes = (np.linspace(*ends, n) for ends, n in zip((found.known.voltage, found.known.temperature), GRID, strict=True))
    V, T = (grid.ravel() for grid in np.meshgrid(*axes))
    return InstrumentBudget(
        budget=found.budget(V, T),
        voltage=V,
        temperature=T,
        clearance=found.polynomial(V, T),
        unit=design.spec.output.unit,
        bound=bound,
        missing=found.missing,
    )


def _coefficients(calibration: CalibrationSpec, fitted: Fit | None) -> CoefficientUncertainty | None:
    """Return what the coefficients of the calibration are worth; None if it is not known."""
    if calibration.data is not None and fitted is not None:
        return of_least_squares(read_measurements(calibration.data), fitted)
    stated = calibration.uncertainty
    if stated is None or calibration.coefficients is None:
        return None
    (v_low, v_high), (t_low, t_high) = stated.voltage, stated.temperature
    return CoefficientUncertainty(
        lengths=tuple(map(len, calibration.coefficients)),
        covariance=np.array([[float(value) for value in row] for row in stated.covariance]),
        freedom=math.inf if stated.freedom is None else float(stated.freedom),
        systematic=float(stated.systematic),
        systematic_freedom=math.inf if stated.systematic_freedom is None else float(stated.systematic_freedom),
        voltage=(float(v_low), float(v_high)),
        temperature=(float(t_low), float(t_high)),
    )


def _of(
    source: str, kind: Kind, uncertainty: Values, unit: str, sensitivity: Values, freedom: float = math.inf
) -> Contribution:
    return Contribution(
        source=source, kind=kind, uncertainty=uncertainty, unit=unit, sensitivity=sensitivity, freedom=freedom
    )


def slopes(polynomial: Polynomial, V: Values, T: Values) -> tuple[Values, Values]:
    """Return the derivatives of a polynomial by voltage and by temperature."""
    by_voltage, by_temperature = np.zeros(len(V)), np.zeros(len(V))
    for i, row in enumerate(polynomial.coefficients):
        for j, value in enumerate(row):
            if i:
                by_voltage += float(value) * i * V ** (i - 1) * T**j
            if j:
                by_temperature += float(value) * j * V**i * T ** (j - 1)
    return by_voltage, by_temperature


def noise_gain(ideal: Filter | None, pre_stage: PreStage | None = None) -> float:
    """Return the factor by which the filter changes the standard deviation of white noise; 1 without a filter.

    What decimates before it counts too.
    """
    if ideal is None:
        return 1.0
    impulse = np.zeros(decay_length(ideal.sos))
    impulse[0] = 1.0
    response = sosfilt(ideal.sos, impulse)
    return math.sqrt(float(np.sum((response if pre_stage is None else pre_stage.decimator.before(response)) ** 2)))


def budget_in_json(design: CoreDesign) -> dict[str, Any] | None:
    """Return `budget_json` of a core's budget, for its report; None for a core that has none."""
    made = budget_of(design)
    return None if made is None else budget_json(made)


def budget_json(found: InstrumentBudget) -> dict[str, Any]:
    """Return the budget at the point of the largest uncertainty, and the smallest and largest one."""
    at, budget = found.worst, found.budget
    return {
        "probability": SHARE,
        "unit": found.unit,
        "expanded": {"smallest": _told(float(budget.expanded.min())), "largest": _told(float(budget.expanded[at]))},
        "not_stated": list(found.missing),
        "arithmetic_bound": _told(found.bound),
        "at": {
            "voltage_V": _told(float(found.voltage[at])),
            "temperature_C": _told(float(found.temperature[at])),
            "clearance": _told(float(found.clearance[at])),
            "contributions": [
                {
                    "source": one.source,
                    "distribution": one.kind,
                    "standard_uncertainty": _told(float(one.uncertainty[at])),
                    "unit": one.unit,
                    "sensitivity": _told(float(one.sensitivity[at])),
                    "contribution": _told(float(one.contribution[at])),
                    "degrees_of_freedom": _told(one.freedom),
                }
                for one in budget.contributions
            ],
            "combined": _told(float(budget.combined[at])),
            "degrees_of_freedom": _told(float(budget.freedom[at])),
            "coverage_factor": _told(float(budget.factor[at])),
            "expanded": _told(float(budget.expanded[at])),
        },
    }


def _told(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
