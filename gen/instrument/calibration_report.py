"""The results of a self-updating calibration: report and history as JSON, and the files exported from it."""

from __future__ import annotations

from typing import Any

from sosmith.model.calibration.fit import COLUMNS, terms_of
from sosmith.model.calibration.measurement_store import StoredMeasurement, Version
from sosmith.model.calibration.self_updating import Addition, Calibration

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
        "largest_residuals": [_measurement(made, index) for index in quality.largest_residuals(CALLED_OUT)],
        "leverage": {
            "mean": len(terms_of(made.fit.orders)) / len(made.stored),
            "largest": float(quality.leverage.max()),
            "high": len(high),
            "highest": [_measurement(made, index) for index in high[:CALLED_OUT]],
        },
        "drift_mm": {str(number): drift for number, drift in made.drift.items()},
    }


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
        "rms_mm": version.rms,
        "cross_validated_mm": version.cross_validated,
        "drift_from_previous_mm": version.drift,
    }


def addition_json(addition: Addition) -> dict[str, Any]:
    """Return which lines of a file were kept and which were refused, and the calibration made from them."""
    made = addition.calibration
    return {
        "file": str(addition.file.path),
        "kept": len(addition.file.readings) if addition.kept else 0,
        "refused": [{"line": refusal.line, "reason": refusal.reason} for refusal in addition.file.refusals],
        "shortfall": addition.shortfall,
        "calibration": None if made is None else calibration_json(made),
    }


def specification_table(sensor: str, version: Version) -> str:
    """TOML for a specification: the table ``[calibration]``; numbers read back as the same doubles."""
    robust = ", robust" if version.robust else ""
    name = sensor.replace("\\", "\\\\")  # the comment ends with its line whatever the name holds
    return (
        f"# Sensor {name}, version {version.number} of {version.date}: {version.measurements} measurements{robust}.\n"
        f"# Hash over them: {version.data_sha256}\n"
        "[calibration]\n"
        f"coefficients = {_coefficients(version)}\n"
    )


def measurements_csv(stored: list[StoredMeasurement]) -> str:
    """CSV as ``calibration.data`` of a specification reads it; numbers read back as the same doubles."""
    rows = [",".join(map(repr, one.reading.values)) for one in stored]
    return "\n".join([",".join(COLUMNS), *rows, ""])


def _coefficients(version: Version) -> list[list[float]]:
    return [[float(a) for a in row] for row in version.polynomial.coefficients]
