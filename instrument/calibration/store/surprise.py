"""Whether a file looks like a slip: other units, swapped columns, another sensor."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sosmith.gen.calibration.fit import Measurements, root_mean_square
from sosmith.instrument.calibration.measurement_store import Version
from sosmith.instrument.calibration.sensor_type import SensorType
from sosmith.instrument.calibration.store.shift import where_calibrated
from sosmith.model.arrays import Values
from sosmith.model.polynomial import Polynomial

FEWEST = 4
"""Rows of a file that can show a slip."""

FITS, OFF = 2.0, 4.0
"""With a slip undone, the rows are at most `FITS` times as far off as expected, and without at least `OFF` times."""

FIRST_SCATTER = 0.5
"""Scatter in mm of measurements of a sensor of which there are no others: that of a depot."""

_Columns = tuple[Values, Values, Values]


@dataclass(frozen=True)
class _Slip:
    sentence: str
    undone: Callable[[Values, Values, Values], _Columns]


_SLIPS = (
    _Slip("clearance_mm must be in millimetres, not in inches", lambda d, V, T: (d * 25.4, V, T)),
    _Slip("clearance_mm must be in millimetres, not in centimetres", lambda d, V, T: (d * 10.0, V, T)),
    _Slip("temperature_C must be in degC, not in degrees Fahrenheit", lambda d, V, T: (d, V, (T - 32.0) / 1.8)),
    _Slip("clearance_mm and voltage_V must be in their own columns, not swapped", lambda d, V, T: (V, d, T)),
    _Slip("clearance_mm and temperature_C must be in their own columns, not swapped", lambda d, V, T: (T, V, d)),
    _Slip("voltage_V and temperature_C must be in their own columns, not swapped", lambda d, V, T: (d, T, V)),
)


def surprise_of(
    added: Measurements, known: Measurements, version: Version | None, sensor_type: SensorType | None
) -> str:
    """Return a sentence if the rows of a file look like a slip, else an empty string.

    They are held against the newest version, where it is calibrated: a slip is told if the rows fit the version with it
    undone (`FITS` times its rms residual) and not as they are (`OFF` times); the error of another day may come on top
    where they are `OFF` times nearer with the slip undone. Rows that differ from the version
    `OFF` times as much as two sensors of the type do are told as well, whatever they are. The rows of a sensor
    without a version are held against the type, whose tolerances then say what is expected.

    Parameters
    ----------
    added : Measurements
        The file's valid rows.
    known : Measurements
        What the sensor has so far; may be empty.
    version : Version or None
        The newest version.
    sensor_type : SensorType or None
        The sensor's type; None if nothing is known of it.
    """
    held = added if version is None else added.of(where_calibrated(version, known, added))
    if len(held) < FEWEST or (version is None and sensor_type is None):
        return ""
    columns = d, V, T = held.clearance, held.voltage, held.temperature
    if version is None:
        assert sensor_type is not None, "one of both is known"
        against, curve = f"the type {sensor_type.name}", sensor_type.polynomial()
        expected = _differing(sensor_type, FIRST_SCATTER, V, T)
        gross = ""
    else:
        against, curve = f"version {version.number}", version.polynomial
        expected = np.full(len(d), version.rms)
        gross = _gross(d - curve(V, T), version, sensor_type, V, T)
    as_it_is = _off(curve, columns, expected)
    if as_it_is < OFF:
        return ""
    undone = [(_off(curve, slip.undone(d, V, T), expected), slip) for slip in _SLIPS]
    least, slip = min(undone, key=lambda one: one[0])
    another_day = 0.0 if version is None or sensor_type is None else sensor_type.systematic / version.rms
    explained = gross or least <= FITS * math.hypot(1.0, another_day)
    if least <= FITS or (explained and least * OFF <= as_it_is):
        first, second = (_rms(curve, one) for one in (columns, slip.undone(d, V, T)))
        return (
            f"{slip.sentence}: the rms residual against {against} is {first:.3g} mm as it is, and {second:.3g} mm with "
            "that undone"
        )
    return gross


def _off(curve: Polynomial, columns: _Columns, expected: Values) -> float:
    """Return how many times as far off as expected the rows are."""
    d, V, T = columns
    return root_mean_square((d - curve(V, T)) / expected)


def _rms(curve: Polynomial, columns: _Columns) -> float:
    d, V, T = columns
    return root_mean_square(d - curve(V, T))


def _differing(sensor_type: SensorType, scatter: float, V: Values, T: Values) -> Values:
    """Return how far a sensor is from its type, and a measurement from the sensor, in mm rms for each row."""
    return np.asarray(np.sqrt(np.sum(sensor_type.columns(V, T) ** 2, axis=0) + scatter**2))


def _gross(off: Values, version: Version, sensor_type: SensorType | None, V: Values, T: Values) -> str:
    if sensor_type is None:
        return ""
    two = math.sqrt(2.0) * _differing(sensor_type, version.rms, V, T)
    times = root_mean_square(off / two)
    if times < OFF:
        return ""
    return (
        f"the measurements must be those of this sensor, not {root_mean_square(off):.3g} mm rms off version "
        f"{version.number}, {times:.2g} times as far as two sensors of the type {sensor_type.name} are apart"
    )
