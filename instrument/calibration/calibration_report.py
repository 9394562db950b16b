"""The results of a self-updating calibration: report and history as JSON, and the files exported from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from sosmith.gen.calibration.day_room import with_day_room
from sosmith.gen.calibration.fit import COLUMNS, DATE_COLUMN, UNCERTAINTY_COLUMNS
from sosmith.instrument.calibration.acceptance import Range
from sosmith.instrument.calibration.advice import Advice
from sosmith.instrument.calibration.coefficient_covariance import CoefficientUncertainty, of_bayes, of_least_squares
from sosmith.instrument.calibration.measurement_store import Source, StoredMeasurement, Version, as_measurements
from sosmith.instrument.calibration.self_updating import Addition, Calibration
from sosmith.instrument.calibration.store.reference import Morning
from sosmith.instrument.calibration.store.shift import Shift
from sosmith.instrument.calibration.uncertainty import SHARE
from sosmith.model.arrays import Values

PLANE = (6, 4)
"""Voltages and temperatures at which the interval of a reading is told."""

SIGNIFICANT = 9
"""Digits of an exported covariance: its last ones may differ from machine to machine."""

CALLED_OUT = 5
"""Count of measurements that the report lists by their residuals, and by their leverage."""


def calibration_json(made: Calibration) -> dict[str, Any]:
    """Report of a version; lengths in mm, voltages in V, temperatures in degC."""
    quality, weights = made.quality, made.fit.weights
    (v_low, v_high), (t_low, t_high) = made.fit.covered
    high = sorted(quality.high_leverage, key=lambda index: -quality.leverage[index])
    return version_json(made.sensor, made.version) | {
        "new": made.new,
        "rejected": [
            {"orders": list(trial.orders), "adjusted_r": trial.adjusted_r, "terms": trial.terms}
            for trial in made.fit.rejected
        ],
        "coverage": {
            "voltage_V": [v_low, v_high],
            "temperature_C": [t_low, t_high],
            "share_of_range": made.coverage,
            "filled_cells": quality.filled_cells,
        },
        "weighted_down": sum(weight < 1 for weight in weights),
        "at_rail": 0 if made.bayesian is None else made.bayesian.at_rail,
        "largest_residuals": [_measurement(made, index) for index in quality.largest_residuals(CALLED_OUT)],
        "leverage": {
            "mean": float(quality.leverage.mean()),
            "largest": float(quality.leverage.max()),
            "high": len(high),
            "highest": [_measurement(made, index) for index in high[:CALLED_OUT]],
        },
        "uncertainty": _uncertainty(made),
        "warnings": list(made.warnings),
        "drift_mm": {str(number): drift for number, drift in made.drift.items()},
    }


def uncertainty_plane(made: Calibration) -> tuple[Values, Values, Values]:
    """Return voltages, temperatures, and half-widths in mm of 95 % intervals, shape (temperatures, voltages)."""
    voltages, temperatures = (
        np.linspace(low, high, count if low < high else 1)
        for (low, high), count in zip(made.fit.covered, PLANE, strict=True)
    )
    V, T = np.meshgrid(voltages, temperatures)
    return voltages, temperatures, made.quality.uncertainty.half_width(V.ravel(), T.ravel()).reshape(V.shape)


def _uncertainty(made: Calibration) -> dict[str, Any]:
    found, model = made.quality.uncertainty, made.bayesian
    voltages, temperatures, half = uncertainty_plane(made)
    V, T = np.meshgrid(voltages, temperatures)
    error = found.standard_error(V.ravel(), T.ravel()).reshape(V.shape)
    days = found.over_days
    return {
        "probability": SHARE,
        "half_width_mm": {"smallest": _nanometres(found.limits[0]), "largest": _nanometres(found.limits[1])},
        "plane": {
            "voltage_V": voltages.tolist(),
            "temperature_C": temperatures.tolist(),
            "standard_error_mm": [[_nanometres(value) for value in row] for row in error.tolist()],
            "half_width_mm": [[_nanometres(value) for value in row] for row in half.tolist()],
        },
        "scatter_mm": None if model is None else model.posterior.scatter,
        "systematic_mm": None if model is None else model.posterior.systematic,
        "day_curve": model is not None and not model.plain,
        "lack_of_fit": {
            "pure_scatter_mm": found.lack.pure,
            "missed_mm": found.lack.missed,
            "along": found.lack.along,
            "structured": found.lack.structured,
        },
        "over_days": None
        if days is None
        else {"rms_mm": _nanometres(days.rms), "inside": days.inside, "measurements": days.count},
    }


def _nanometres(value: float) -> float:
    """Round to a nanometre: quantiles may differ in the last bits from machine to machine."""
    return round(value, 6)


def _measurement(made: Calibration, index: int) -> dict[str, Any]:
    one = made.stored[index]
    return {
        "measurement": one.number,
        "source": one.source,
        "line": one.reading.line,
        "date": one.reading.date,
        **dict(zip(COLUMNS, one.reading.values, strict=True)),
        "residual_mm": float(made.quality.residual[index]),
        "leverage": float(made.quality.leverage[index]),
        "weight": made.fit.weights[index] if made.fit.weights else 1.0,
    }


def version_json(sensor: str, version: Version) -> dict[str, Any]:
    """One line of the history; lengths in mm."""
    return {
        "sensor": sensor,
        "version": version.number,
        "date": version.date,
        "measurements": version.measurements,
        "data_sha256": version.data_sha256,
        "required_r": version.required_r,
        "robust": version.robust,
        "orders": list(version.polynomial.orders),
        "coefficients": _coefficients(version),
        "adjusted_r": max(version.adjusted_r_squared, 0.0) ** 0.5,
        "method": version.method,
        "type": None if version.sensor_type is None else version.sensor_type.name,
        "accept_mm": version.accept,
        "rms_mm": version.rms,
        "cross_validated_mm": version.cross_validated,
        "drift_from_previous_mm": version.drift,
    }


def source_json(source: Source) -> dict[str, Any]:
    """Return a file that was added, and its withdrawal if it was withdrawn."""
    gone = source.withdrawal
    return {
        "number": source.number,
        "file": source.name,
        "sha256": source.sha256,
        "measurements": source.measurements,
        "dates": [source.first, source.last],
        "withdrawn": None if gone is None else {"date": gone.date, "author": gone.author, "reason": gone.reason},
    }


def addition_json(addition: Addition) -> dict[str, Any]:
    """Return which lines of a file were kept and which were refused, and the calibration made from them."""
    made, shift = addition.calibration, addition.shift
    return {
        "file": str(addition.file.path),
        "kept": len(addition.file.readings) if addition.kept else 0,
        "refused": [{"line": refusal.line, "reason": refusal.reason} for refusal in addition.file.refusals],
        "shortfall": addition.shortfall,
        "shift": None if shift is None else _shift(shift),
        "alarms": None if addition.health is None else len(addition.health.alarms),
        "warnings": list(addition.warnings),
        "calibration": None if made is None else calibration_json(made),
    }


def _shift(shift: Shift) -> dict[str, Any]:
    return {
        "from_version": shift.version,
        "measurements": shift.count,
        "reads_more_by_mm": _nanometres(shift.mean),
        "half_width_mm": _nanometres(shift.half_width) if math.isfinite(shift.half_width) else None,
    }


def morning_json(morning: Morning) -> dict[str, Any]:
    """Return the targets of a day with what was read, before and now, and the addition that they make."""
    return (
        {
            "targets": [
                {
                    **dict(zip(COLUMNS, target.reading.values, strict=True)),
                    **dict(zip(UNCERTAINTY_COLUMNS, (u or None for u in target.reading.uncertainty), strict=True)),
                    "before_mm": _nanometres(target.before[0]),
                    "before_half_width_mm": _nanometres(target.before[1]),
                    "now_mm": _nanometres(target.after[0]),
                    "now_half_width_mm": _nanometres(target.after[1]),
                }
                for target in morning.targets
            ]
        }
        | addition_json(morning.addition)
        | {"warnings": [*morning.warnings, *morning.addition.warnings]}
    )


def advice_json(sensor: str, date: str, within: float, found: Advice) -> dict[str, Any]:
    """Return what to measure on a day, and the half-widths of 95 % intervals to expect, in mm."""
    return {
        "sensor": sensor,
        "date": date,
        "within_mm": within,
        "reached": found.reached,
        "measurements": [
            {"clearance_mm": clearance, "temperature_C": temperature, "count": count}
            for clearance, temperature, count in found.plan
        ],
        "half_width_mm": [
            {
                "clearance_mm": clearance,
                "temperature_C": temperature,
                "without": _nanometres(before),
                "with": _nanometres(after),
            }
            for (clearance, temperature), before, after in zip(found.targets, found.before, found.after, strict=True)
        ],
    }


def specification_table(sensor: str, version: Version, made: Calibration | None = None) -> str:
    """TOML for a specification: the table ``[calibration]``; numbers read back as the same doubles.

    With the calibration, also ``[calibration.uncertainty]``, to `SIGNIFICANT` digits.
    """
    robust = ", robust" if version.robust else ""
    name = sensor.replace("\\", "\\\\")  # the comment ends with its line whatever the name holds
    return (
        f"# Sensor {name}, version {version.number} of {version.date}: {version.measurements} measurements{robust}.\n"
        f"# Hash over them: {version.data_sha256}\n"
        "[calibration]\n"
        f"coefficients = {_coefficients(version)}\n"
    ) + ("" if made is None else _uncertainty_table(coefficient_uncertainty(made)))


def design_table(sensor: str, version: Version, ranges: Sequence[Range], room: float) -> str:
    """TOML for a specification of hardware in whose coefficients every curve near that of a version fits.

    Parameters
    ----------
    sensor, version
        As for `specification_table`.
    ranges : sequence of Range
        Ranges of voltage and temperature of the ports.
    room : float
        How far other curves may be from that of the version in mm; more than 0.
    """
    ports = [(Fraction(low), Fraction(high)) for low, high in ranges]
    polynomial, off = with_day_room(version.polynomial, ports, Fraction(room))
    name = sensor.replace("\\", "\\\\")
    return (
        f"# To design hardware with, not to measure with: off by up to {float(off):.3g} mm until a set is loaded.\n"
        f"# Every curve within {room:g} mm of sensor {name}, version {version.number} of {version.date}, fits.\n"
        f"[calibration]\ncoefficients = {[[float(a) for a in row] for row in polynomial.coefficients]}\n"
    )


def coefficient_uncertainty(made: Calibration) -> CoefficientUncertainty:
    """Return what the coefficients of a calibration are worth."""
    measurements = as_measurements(made.stored, made.sensor)
    return of_least_squares(measurements, made.fit) if made.bayesian is None else of_bayes(measurements, made.bayesian)


def _uncertainty_table(found: CoefficientUncertainty) -> str:
    # rounded as correlations, which stay below 1
    shrunk = 1.0 - 10.0 ** (1 - SIGNIFICANT)
    rounded = [
        [float(f"{value * (1.0 if i == j else shrunk):.{SIGNIFICANT}g}") for j, value in enumerate(row)]
        for i, row in enumerate(((found.covariance + found.covariance.T) / 2).tolist())
    ]
    freedoms = {"freedom": found.freedom, "systematic_freedom": found.systematic_freedom}
    lines = [
        "[calibration.uncertainty]",
        f"covariance = {rounded}",
        f"systematic = {float(f'{found.systematic:.4g}')}",
        *(f"{key} = {float(f'{value:.4g}')}" for key, value in freedoms.items() if math.isfinite(value)),
        f"voltage = {list(found.voltage)}",
        f"temperature = {list(found.temperature)}",
    ]
    return "\n".join(lines) + "\n"


def measurements_csv(stored: list[StoredMeasurement]) -> str:
    """CSV as ``calibration.data`` of a specification reads it; numbers read back as the same doubles."""
    readings = [one.reading for one in stored]
    stated = any(any(reading.uncertainty) for reading in readings)
    rows = [
        [*map(repr, reading.values), reading.date, *([repr(u) if u else "" for u in reading.uncertainty] * stated)]
        for reading in readings
    ]
    header = (*COLUMNS, DATE_COLUMN, *UNCERTAINTY_COLUMNS[: 3 * stated])
    return "\n".join([",".join(cells) for cells in (header, *rows)]) + "\n"


def _coefficients(version: Version) -> list[list[float]]:
    return [[float(a) for a in row] for row in version.polynomial.coefficients]
