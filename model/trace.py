"""Traces: the input codes of a core over time, with the truth behind them, and their CSV files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sosmith.model.csv_table import CsvTable, check_rows, read_csv_table
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Codes, Port, Values
from sosmith.model.text_files import write_files

PHYSICAL_COLUMNS = {"voltage": "voltage_V", "temperature": "temperature_C"}
"""Columns of the paper's sensors; those of every other input have the input's name."""

TIME_TOLERANCE = 0.01
"""Relative deviation of a time step from the sample period that a file may have."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """Input codes of a core, one row per sample period. All arrays are read-only.

    Attributes
    ----------
    name : str
        Name of the scenario or file.
    ports : tuple of Port
        Inputs, in the order of the columns of `codes`.
    sample_rate : Fraction
        Samples per second.
    codes : ndarray of int64, shape (n, n_inputs)
        Codes within the ports' ranges; at least one sample.
    truth : ndarray, shape (n,), optional
        What an ideal measurement would show, in the unit of the core's output.
    reading : ndarray of bool, shape (n,), optional
        The samples at which truth and measurement are compared.
    seed : int, optional
        Seed that a generated trace came from.

    Raises
    ------
    ValueError
        If there is no sample, a shape does not fit, a code is out of range, a true value is not finite, or
        the sample rate is not positive.
    """

    name: str
    ports: tuple[Port, ...]
    sample_rate: Fraction
    codes: Codes
    truth: Values | None = None
    reading: npt.NDArray[np.bool_] | None = None
    seed: int | None = None

    def __post_init__(self) -> None:
        if self.sample_rate <= 0:
            raise ValueError(f"sample_rate must be positive, not {self.sample_rate}")
        codes = np.array(self.codes, dtype=np.int64)
        if codes.ndim != 2 or codes.shape[1] != len(self.ports) or not codes.size:
            raise ValueError(f"codes must be of shape (n, {len(self.ports)}) with n > 0, not {codes.shape}")
        for port, column in zip(self.ports, codes.T, strict=True):
            wrong = column[(column < port.lowest) | (column > port.highest)]
            if len(wrong):
                raise ValueError(f"{port.name} must be in {port.lowest}..{port.highest}, not {wrong[0]}")
        self._freeze("codes", codes)
        if self.truth is not None:
            truth = np.array(self.truth, dtype=np.float64)
            if truth.shape != codes.shape[:1] or not np.all(np.isfinite(truth)):
                raise ValueError(f"truth must be {len(codes)} finite numbers, not of shape {truth.shape}")
            self._freeze("truth", truth)
        if self.reading is not None:
            reading = np.array(self.reading, dtype=np.bool_)
            if reading.shape != codes.shape[:1]:
                raise ValueError(f"reading must be {len(codes)} flags, not of shape {reading.shape}")
            self._freeze("reading", reading)

    def _freeze(self, name: str, array: npt.NDArray[np.generic]) -> None:
        array.setflags(write=False)
        object.__setattr__(self, name, array)

    def __len__(self) -> int:
        """Count of samples."""
        return len(self.codes)

    @property
    def time(self) -> Values:
        """Time of each sample in s, shape (n,), from 0."""
        return np.arange(len(self), dtype=np.float64) / float(self.sample_rate)

    def delayed(self, samples: int) -> Trace:
        """Return the same trace, of the same length, beginning `samples` later; its first sample is held until then."""
        source = np.maximum(np.arange(len(self)) - samples, 0)
        return replace(
            self,
            codes=self.codes[source],
            truth=None if self.truth is None else self.truth[source],
            reading=None if self.reading is None else self.reading[source],
        )

    def values(self) -> Values:
        """Physical values of the codes in the ports' units, shape (n, n_inputs)."""
        decoded = [port.decode(column) for port, column in zip(self.ports, self.codes.T, strict=True)]
        return np.stack(decoded, axis=1)

    def to_csv(self) -> str:
        """Text of the trace as CSV, the same on every run.

        Columns: time_s; for each input its physical value (voltage_V, temperature_C, or the input's
        name); for each input its code (``<input>_code``); clearance_mm, called truth unless the core has
        two inputs, and reading (0 or 1), where the trace has them. Numbers read back to the same doubles.

        Raises
        ------
        SpecificationError
            If an input has the name of another column.
        """
        header = _Columns.of(self.ports)
        columns: list[list[str]] = [[repr(value) for value in self.time.tolist()]]
        names = [header.time, *header.physical, *header.codes]
        columns += [[repr(value) for value in column] for column in self.values().T.tolist()]
        columns += [[str(code) for code in column] for column in self.codes.T.tolist()]
        if self.truth is not None:
            names.append(header.truth)
            columns.append([repr(value) for value in self.truth.tolist()])
        if self.reading is not None:
            names.append(header.reading)
            columns.append(["1" if value else "0" for value in self.reading.tolist()])
        lines = [",".join(names), *map(",".join, zip(*columns, strict=True))]
        return "\n".join(lines) + "\n"

    def write_csv(self, path: Path) -> None:
        """Write `to_csv` to `path`; the file appears complete or not at all.

        Raises
        ------
        SpecificationError
            As `to_csv`, or if the file cannot be written.
        """
        write_files(path.parent, {path.name: self.to_csv()})


@dataclass(frozen=True)
class _Columns:
    """Names of the columns of a trace file."""

    physical: tuple[str, ...]
    codes: tuple[str, ...]
    truth: str
    time: str = "time_s"
    reading: str = "reading"

    @classmethod
    def of(cls, ports: Sequence[Port]) -> _Columns:
        columns = cls(
            physical=tuple(PHYSICAL_COLUMNS.get(port.name, port.name) for port in ports),
            codes=tuple(f"{port.name}_code" for port in ports),
            truth="clearance_mm" if len(ports) == 2 else "truth",
        )
        for index, name in enumerate(columns.all):
            if name in columns.all[:index]:
                raise SpecificationError(
                    f"input names must differ from the other columns of a trace file, not give {name!r} twice"
                )
        return columns

    @property
    def all(self) -> tuple[str, ...]:
        return (self.time, self.truth, self.reading, *self.physical, *self.codes)


def read_csv(path: Path, ports: tuple[Port, ...], sample_rate: Fraction) -> Trace:
    """Read a trace file for a core with the inputs `ports`, running at `sample_rate` in Hz.

    Every input needs its code column or its physical column (see `Trace.write_csv`). Where only the
    physical column is there, the port's format quantizes it as an ADC does: nearest code, saturating at
    the ends of the range. Where both are there, the code counts and the other must agree with it.
    time_s, the truth and reading are optional; the trace has the file's name without its extension.

    Raises
    ------
    SpecificationError
        As `read_csv_table`; if an input has no column; if a code is no integer or out of range, or
        contradicts the physical value; if time_s does not increase by one sample period from row to
        row within `TIME_TOLERANCE`; if reading is neither 0 nor 1.
    """
    columns = _Columns.of(ports)
    table = read_csv_table(path, columns.all)
    if columns.time in table:
        _check_time(table, table.column(columns.time), sample_rate)
    codes = [
        _read_codes(table, port, physical, code)
        for port, physical, code in zip(ports, columns.physical, columns.codes, strict=True)
    ]
    return Trace(
        name=path.stem,
        ports=ports,
        sample_rate=sample_rate,
        codes=np.stack(codes, axis=1),
        truth=table.column(columns.truth) if columns.truth in table else None,
        reading=_read_flags(table, columns.reading) if columns.reading in table else None,
    )


def _check_time(table: CsvTable, time: Values, sample_rate: Fraction) -> None:
    period = 1 / float(sample_rate)
    step = np.concatenate([[period], np.diff(time)])
    check_rows(table, step <= 0, lambda k: f"time_s must be above {time[k - 1]}, the row before, not {time[k]}")
    check_rows(
        table,
        np.abs(step - period) > TIME_TOLERANCE * period,
        lambda k: f"time_s must be {period:.6g} s after the row before, not {step[k]:.6g} s",
    )


def _read_codes(table: CsvTable, port: Port, physical: str, code: str) -> Codes:
    if code not in table:
        if physical not in table:
            raise SpecificationError(
                f"{table.path} must have the column {code} or {physical}, not only {', '.join(table.header)}"
            )
        return port.encode(table.column(physical))
    values = table.column(code)
    check_rows(table, values % 1 != 0, lambda k: f"{code} must be an integer, not {values[k]}")
    check_rows(
        table,
        (values < port.lowest) | (values > port.highest),
        lambda k: f"{code} must be in {port.lowest}..{port.highest}, not {values[k]:.0f}",
    )
    codes = values.astype(np.int64)
    if physical in table:
        encoded = port.encode(table.column(physical))
        check_rows(
            table,
            np.abs(encoded - codes) > 1,
            lambda k: f"{code} must be {encoded[k]} to agree with {physical}, not {codes[k]}",
        )
    return codes


def _read_flags(table: CsvTable, name: str) -> npt.NDArray[np.bool_]:
    values = table.column(name)
    check_rows(table, (values != 0) & (values != 1), lambda k: f"{name} must be 0 or 1, not {values[k]:g}")
    return np.asarray(values != 0)
