"""Signals over time in a CSV file: a measured clearance with or without its truth, motion of a vehicle."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sosmith.model.csv_table import CsvTable, check_rows, csv_header, read_csv_table
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Values
from sosmith.model.trace_file import CHANNEL, PHYSICAL_COLUMNS, TIME_TOLERANCE

TIME = "time_s"
READING = "reading"
DISTANCE = "distance_m"
"""Where the vehicle is, which rises all the time: no signal unless it is chosen."""
CALIBRATED = "calibrated clearance"
"""Name of the signal that the calibration polynomial makes of voltage and temperature."""

TRUTHS = ("truth", "truth_mm", "true_clearance_mm")
"""Columns that are the truth wherever they stand; `clearance_mm` is beside voltage and temperature only."""

LEAST_ROWS = 64
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
        Column, or `CALIBRATED`.
    unit : str
        Unit of the values: mm, mrad, V or degC; empty where the column's name ends in none.
    values : ndarray, shape (n,)
        What was measured or simulated.
    truth : ndarray, shape (n,), optional
        What an ideal measurement would show, in the same unit.
    """

    name: str
    unit: str
    values: Values
    truth: Values | None = None


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
        At least one, all with the same count of at least `LEAST_ROWS` values.
    reading : ndarray of bool, shape (n,), optional
        Rows at which truth and measurement are compared.
    """

    path: Path
    sha256: str
    sample_rate: float
    signals: tuple[Signal, ...]
    reading: npt.NDArray[np.bool_] | None


def read_signal_file(
    path: Path, polynomial: Polynomial, columns: Sequence[str] = (), truth: str | None = None
) -> SignalFile:
    """Read a CSV file with the column time_s and at least one column of values.

    A trace with voltage_V and temperature_C holds one signal, the clearance that `polynomial` makes of them, with
    clearance_mm as its truth where that is there. Any other file holds one signal for each column whose name ends in a
    unit (_mm, _um, _m, _V, _mV, _C, _rad, _mrad, _deg), with the truth in one of `TRUTHS`. Columns of codes and
    `DISTANCE` are left alone.

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

    Raises
    ------
    SpecificationError
        As `read_csv_table`; if there are several channels; if a column asked for is not there or a name tells no unit;
        if there are too few rows; if time does not rise in even steps; if reading is neither 0 nor 1. One sentence with
        the file and the line.
    """
    header = csv_header(path)
    for name in (*columns, *([truth] if truth else [])):
        if name not in header:
            raise SpecificationError(f"{path} must have the column {name}, not only {', '.join(header)}")
    if CHANNEL in header:
        raise SpecificationError(f"{path} must hold a trace of one channel, not have the column {CHANNEL}")
    table = read_csv_table(path, header, required=[TIME])
    if len(table.lines) < LEAST_ROWS:
        raise SpecificationError(f"{path} must hold at least {LEAST_ROWS} rows, not {len(table.lines)}")
    return SignalFile(
        path=path,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        sample_rate=_sample_rate(table),
        signals=_signals(table, polynomial, columns, truth),
        reading=_reading(table),
    )


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
    aside = {TIME, READING, DISTANCE, truth}
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
    return Signal(name=signal.name, unit=signal.unit, values=signal.values, truth=factor * table.column(truth))


def _reading(table: CsvTable) -> npt.NDArray[np.bool_] | None:
    if READING not in table:
        return None
    values = table.column(READING)
    check_rows(table, (values != 0) & (values != 1), lambda k: f"{READING} must be 0 or 1, not {values[k]:g}")
    return np.asarray(values != 0) if values.any() else None
