"""Signals over time in a CSV file: measured clearance, with or without its true value, or vehicle motion."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.tables.csv_table import CsvTable, check_rows, csv_header, read_csv_table
from sosmith.model.traces.trace_file import (
    CHANNEL,
    PHYSICAL_COLUMNS,
    TIME_TOLERANCE,
    is_a_period,
    last_digit,
    rows_of_channel,
)

TIME = "time_s"
READING = "reading"
DISTANCE = "distance_m"
"""Column with the position of the vehicle; it rises throughout, so it is a signal only if it is selected."""
CALIBRATED = "calibrated clearance"
"""Name of the signal that the calibration polynomial gives for voltage and temperature."""

TRUTHS = ("truth", "truth_mm", "true_clearance_mm")
"""Columns that hold the true value in any file; `clearance_mm` does so only beside voltage and temperature."""

MIN_ROWS = 64
"""Lowest number of rows: a spectrum of fewer has neither usable resolution nor usable averaging."""

_UNITS = {
    "mm": ("mm", 1.0),
    "um": ("mm", 1e-3),
    "m": ("mm", 1e3),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    "C": ("degC", 1.0),
    "degC": ("degC", 1.0),
    "rad": ("mrad", 1e3),
    "mrad": ("mrad", 1.0),
    "deg": ("mrad", 1e3 * np.pi / 180),
}
"""Unit and conversion factor by the suffix of a column's name; lengths and angles are converted to one unit each."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Signal:
    """One signal of a file, uniformly sampled.

    Attributes
    ----------
    name : str
        Name of the column, or `CALIBRATED`; with the channel's number if the file has the column channel.
    unit : str
        Unit of the values: mm, mrad, V or degC; empty if the column's name has no unit.
    values : ndarray, shape (n,)
        Measured or simulated values.
    truth : ndarray, shape (n,), optional
        True values, in the same unit.
    reading : ndarray of bool, shape (n,), optional
        Rows at which `values` are compared with `truth`.
    """

    name: str
    unit: str
    values: Values
    truth: Values | None = None
    reading: npt.NDArray[np.bool_] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class SignalFile:
    """Signals of a file.

    Attributes
    ----------
    path : Path
        The file.
    sha256 : str
        SHA-256 of the file, in hexadecimal.
    sample_rate : float
        Sample rate in Hz, to nine digits.
    signals : tuple of Signal
        At least one, each with at least `MIN_ROWS` values.
    """

    path: Path
    sha256: str
    sample_rate: float
    signals: tuple[Signal, ...]


def read_signal_file(
    path: Path,
    polynomial: Polynomial,
    columns: Sequence[str] = (),
    truth: str | None = None,
    channels: Sequence[int] = (),
) -> SignalFile:
    """Read a CSV file with the column time_s and at least one column of values.

    A trace with voltage_V and temperature_C gives one signal, the clearance by `polynomial`, with clearance_mm as its
    true value if present. Any other file gives one signal per column whose name ends in a unit (_mm, _um, _m, _V, _mV,
    _C, _rad, _mrad, _deg), with the true value in one of `TRUTHS`. Columns of codes and `DISTANCE` are ignored. A file
    with the column channel gives these signals for each channel.

    Parameters
    ----------
    path : Path
        The file, UTF-8.
    polynomial : Polynomial
        Clearance in mm from voltage in V and temperature in degC.
    columns : sequence of str
        Columns to read as signals, whatever their names; by default those above.
    truth : str, optional
        Column with the true value; by default as above.
    channels : sequence of int
        Channels to read; all by default. A file without the column channel has only channel 0.

    Raises
    ------
    SpecificationError
        As for `read_csv_table`; if a requested column or channel is missing, a channel number is not an integer, or a
        name has no unit; if a channel has too few rows; if time steps are not uniform or differ between channels; if
        reading is neither 0 nor 1. The message is one sentence with the file and the line.
    """
    header = csv_header(path)
    for name in (*columns, *([truth] if truth else [])):
        if name not in header:
            raise SpecificationError(f"{path} must have the column {name}, not only {', '.join(header)}")
    parts = _parts(read_csv_table(path, header, required=[TIME]), channels)
    for of_channel, part in parts.items():
        if len(part.lines) < MIN_ROWS:
            raise SpecificationError(f"{path} must hold at least {MIN_ROWS} rows{of_channel}, not {len(part.lines)}")
    rates = {of_channel: _sample_rate(part) for of_channel, part in parts.items()}
    (first, rate), *others = rates.items()
    for of_channel, other in others:
        if abs(other - rate) > TIME_TOLERANCE * rate:
            raise SpecificationError(
                f"{path}: the sample rate{of_channel} must be the {rate:g} Hz{first}, not {other:g} Hz"
            )
    return SignalFile(
        path=path,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        sample_rate=rate,
        signals=tuple(
            replace(signal, name=signal.name + of_channel, reading=_reading(part))
            for of_channel, part in parts.items()
            for signal in _signals(part, polynomial, columns, truth)
        ),
    )


def _parts(table: CsvTable, channels: Sequence[int]) -> dict[str, CsvTable]:
    """Return the rows of each channel, keyed by " of channel N"; without the column, all rows, keyed by ""."""
    if CHANNEL not in table:
        if set(channels) - {0}:
            raise SpecificationError(
                f"{table.path} must have the column {CHANNEL} for channels above 0, not only {', '.join(table.header)}"
            )
        return {"": table}
    number = table.column(CHANNEL)
    check_rows(
        table,
        (number % 1 != 0) | (number < 0),
        lambda k: f"{CHANNEL} must be an integer of 0 or more, not {number[k]:g}",
    )
    chosen = sorted(set(channels)) or np.unique(number).astype(int).tolist()
    return {f" of channel {channel}": rows_of_channel(table, channel) for channel in chosen}


def unit_of(column: str) -> tuple[str, float]:
    """Return the unit of a column by its name, and the factor that converts to it; ``("", 1.0)`` if it has none.

    Examples
    --------
    >>> unit_of("lateral_um"), unit_of("truth")
    (('mm', 0.001), ('', 1.0))
    """
    return _UNITS.get(column.rpartition("_")[2], ("", 1.0)) if "_" in column else ("", 1.0)


def _sample_rate(table: CsvTable) -> float:
    time = table.column(TIME)
    step = np.diff(time)
    check_rows(
        table,
        np.concatenate([[False], step <= 0]),
        lambda k: f"{TIME} must be above the {time[k - 1]:g} s of the previous row, not {time[k]:g} s",
    )
    period, digit = float(np.median(step)), last_digit(time)
    mean = float((time[-1] - time[0]) / len(step))
    if abs(mean - period) < digit < period / 2:  # most stamps are rounded to the same step
        period = mean
    check_rows(
        table,
        np.concatenate([[False], ~is_a_period(step, period, digit)]),
        lambda k: f"{TIME} must be {period:.6g} s after the previous row, like most rows, not {step[k - 1]:.6g} s",
    )
    # taken over the whole length, to average out rounding of single times
    return float(f"{(len(time) - 1) / (time[-1] - time[0]):.9g}")


def _signals(table: CsvTable, polynomial: Polynomial, columns: Sequence[str], truth: str | None) -> tuple[Signal, ...]:
    voltage, temperature = PHYSICAL_COLUMNS["voltage"], PHYSICAL_COLUMNS["temperature"]
    emulated = voltage in table and temperature in table
    truth = truth or next((name for name in TRUTHS if name in table), None)
    if emulated and truth is None and "clearance_mm" in table:
        truth = "clearance_mm"
    if not columns and emulated:
        values = polynomial(table.column(voltage), table.column(temperature))
        return (_with_truth(table, Signal(name=CALIBRATED, unit="mm", values=values), truth),)
    aside = {TIME, CHANNEL, READING, DISTANCE, truth}
    chosen = columns or [name for name in table.header if name not in aside and not name.endswith("_code")]
    if not chosen:
        raise SpecificationError(
            f"{table.path} must have a column of values besides {TIME}, not only {', '.join(table.header)}"
        )
    signals = []
    for name in chosen:
        unit, factor = unit_of(name)
        if not columns and not unit:
            raise SpecificationError(
                f"{table.path}: column must end in its unit (_{', _'.join(_UNITS)}) or be selected by --column, "
                f"not {name!r}"
            )
        signals.append(_with_truth(table, Signal(name=name, unit=unit, values=factor * table.column(name)), truth))
    return tuple(signals)


def _with_truth(table: CsvTable, signal: Signal, truth: str | None) -> Signal:
    """Add the true value to a signal of its unit; a true value without a unit applies to every signal."""
    if truth is None or signal.name == truth:
        return signal
    unit, factor = unit_of(truth)
    if unit not in ("", signal.unit):
        return signal
    return replace(signal, truth=factor * table.column(truth))


def _reading(table: CsvTable) -> npt.NDArray[np.bool_] | None:
    if READING not in table:
        return None
    values = table.column(READING)
    check_rows(table, (values != 0) & (values != 1), lambda k: f"{READING} must be 0 or 1, not {values[k]:g}")
    return np.asarray(values != 0) if values.any() else None
