"""Signals over time in a CSV file: a measured clearance with or without its truth, motion of a vehicle."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values
from sosmith.model.calibration.polynomial import Polynomial
from sosmith.model.errors import SpecificationError
from sosmith.model.tables.csv_table import CsvTable, check_rows, csv_header, read_csv_table
from sosmith.model.traces.trace_file import CHANNEL, PHYSICAL_COLUMNS, TIME_TOLERANCE, rows_of_channel

TIME = "time_s"
READING = "reading"
DISTANCE = "distance_m"
"""Where the vehicle is, which rises all the time: no signal unless it is chosen."""
CALIBRATED = "calibrated clearance"
"""Name of the signal that the calibration polynomial makes of voltage and temperature."""

TRUTHS = ("truth", "truth_mm", "true_clearance_mm")
"""Columns that are the truth wherever they stand; `clearance_mm` is beside voltage and temperature only."""

MIN_ROWS = 64
"""Rows that a file must have: below, no spectrum has both a resolution and an average worth the name."""

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
"""Unit and factor by the last part of a column's name, so that lengths and angles have one unit each."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Signal:
    """One signal of a file at even steps of time.

    Attributes
    ----------
    name : str
        Column, or `CALIBRATED`; in a file of several channels with the channel's number.
    unit : str
        Unit of the values: mm, mrad, V or degC; empty where the column's name ends in none.
    values : ndarray, shape (n,)
        What was measured or simulated.
    truth : ndarray, shape (n,), optional
        What an ideal measurement would show, in the same unit.
    reading : ndarray of bool, shape (n,), optional
        Rows at which truth and measurement are compared.
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
        Hash over its bytes, hexadecimal.
    sample_rate : float
        Rows per second, Hz, to nine digits.
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

    A trace with voltage_V and temperature_C holds one signal, the clearance that `polynomial` makes of them, with
    clearance_mm as its truth where that is there. Any other file holds one signal for each column whose name ends in a
    unit (_mm, _um, _m, _V, _mV, _C, _rad, _mrad, _deg), with the truth in one of `TRUTHS`. Columns of codes and
    `DISTANCE` are left alone. A file with the column channel holds all that for each of its channels.

    Parameters
    ----------
    path : Path
        The file, UTF-8.
    polynomial : Polynomial
        Clearance in mm from voltage in V and temperature in degC.
    columns : sequence of str
        The columns to take as signals, whatever their names, instead of the above.
    truth : str, optional
        The column with the truth, likewise.
    channels : sequence of int
        The channels to take, instead of all; a file without the column channel holds channel 0.

    Raises
    ------
    SpecificationError
        As `read_csv_table`; if a column or channel asked for is not there, a channel is no integer or a name tells no
        unit; if a channel has too few rows; if its time does not rise in even steps, the same for all; if reading is
        neither 0 nor 1. One sentence with the file and the line.
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
    """Return the rows of each channel by " of channel N"; of a file without the column, all rows by nothing."""
    if CHANNEL not in table:
        if set(channels) - {0}:
            raise SpecificationError(
                f"{table.path} must have the column {CHANNEL}, not only {', '.join(table.header)}, for others than 0"
            )
        return {"": table}
    number = table.column(CHANNEL)
    check_rows(
        table,
        (number % 1 != 0) | (number < 0),
        lambda k: f"{CHANNEL} must be an integer from 0 on, not {number[k]:g}",
    )
    chosen = sorted(set(channels)) or np.unique(number).astype(int).tolist()
    return {f" of channel {channel}": rows_of_channel(table, channel) for channel in chosen}


def unit_of(column: str) -> tuple[str, float]:
    """Return the unit that the name of a column ends in, and the factor to it; ``("", 1.0)`` if it names none.

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
        lambda k: f"{TIME} must be above {time[k - 1]:g} s, the row before, not {time[k]:g} s",
    )
    period = float(np.median(step))
    check_rows(
        table,
        np.concatenate([[False], np.abs(step - period) > TIME_TOLERANCE * period]),
        lambda k: f"{TIME} must be {period:.6g} s after the row before, as most rows are, not {step[k - 1]:.6g} s",
    )
    # over the whole length, rounding of the single times does not count
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
            f"{table.path} must have a column of values beside {TIME}, not only {', '.join(table.header)}"
        )
    signals = []
    for name in chosen:
        unit, factor = unit_of(name)
        if not columns and not unit:
            raise SpecificationError(
                f"{table.path}: column must end in its unit (_{', _'.join(_UNITS)}) or be chosen by --column, "
                f"not {name!r}"
            )
        signals.append(_with_truth(table, Signal(name=name, unit=unit, values=factor * table.column(name)), truth))
    return tuple(signals)


def _with_truth(table: CsvTable, signal: Signal, truth: str | None) -> Signal:
    """Add the truth to a signal that has its unit; a truth without a unit goes with every signal."""
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
