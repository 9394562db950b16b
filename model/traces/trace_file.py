"""Trace files: the traces of all channels of a core as one CSV file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes, Values
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.model.tables.csv_table import CsvTable, check_rows, read_csv_table
from sosmith.model.text_files import write_files
from sosmith.model.traces.trace import Trace

CHANNEL = "channel"
"""Column with the number of a row's channel, from 0; a file without it holds one channel."""

PHYSICAL_COLUMNS = {"voltage": "voltage_V", "temperature": "temperature_C"}
"""Columns of the paper's sensors; those of every other input have the input's name."""

TIME_TOLERANCE = 0.01
"""Relative deviation of a time step from the sample period that a file may have."""


@dataclass(frozen=True)
class _Columns:
    """Names of the columns of a trace file."""

    physical: tuple[str, ...]
    codes: tuple[str, ...]
    truth: str
    time: str = "time_s"
    channel: str = CHANNEL
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
        return (self.time, self.channel, self.truth, self.reading, *self.physical, *self.codes)


def traces_csv(traces: Sequence[Trace]) -> str:
    """Text of the traces of a core's channels as CSV, the same on every run.

    Columns: time_s; channel, if there are several; for each input its physical value (voltage_V, temperature_C, or the
    input's name); for each input its code (``<input>_code``); clearance_mm, called truth unless the core has two
    inputs, and reading (0 or 1), where the traces have them. Rows go by time, then by channel. Numbers read back to the
    same doubles.

    Parameters
    ----------
    traces : sequence of Trace
        One for each channel, all with the same ports, length and parts.

    Raises
    ------
    SpecificationError
        If an input has the name of another column.
    """
    header = _Columns.of(traces[0].ports)
    names = [header.time, *([header.channel] if len(traces) > 1 else []), *header.physical, *header.codes]
    names += [header.truth] if traces[0].truth is not None else []
    names += [header.reading] if traces[0].reading is not None else []
    rows = [_rows(trace, str(channel) if len(traces) > 1 else None) for channel, trace in enumerate(traces)]
    lines = [",".join(names), *(line for together in zip(*rows, strict=True) for line in together)]
    return "\n".join(lines) + "\n"


def _rows(trace: Trace, channel: str | None) -> list[str]:
    columns = [[repr(value) for value in trace.time.tolist()]]
    columns += [] if channel is None else [[channel] * len(trace)]
    columns += [[repr(value) for value in column] for column in trace.values().T.tolist()]
    columns += [[str(code) for code in column] for column in trace.codes.T.tolist()]
    if trace.truth is not None:
        columns.append([repr(value) for value in trace.truth.tolist()])
    if trace.reading is not None:
        columns.append(["1" if value else "0" for value in trace.reading.tolist()])
    return list(map(",".join, zip(*columns, strict=True)))


def write_traces(path: Path, traces: Sequence[Trace]) -> None:
    """Write `traces_csv` to `path`; the file appears complete or not at all.

    Raises
    ------
    SpecificationError
        As `traces_csv`, or if the file cannot be written.
    """
    write_files(path.parent, {path.name: traces_csv(traces)})


def read_traces(path: Path, ports: tuple[Port, ...], sample_rate: Fraction, channels: int = 1) -> tuple[Trace, ...]:
    """Read a trace file for a core with the inputs `ports`, running at `sample_rate` in Hz for each of its `channels`.

    Every input needs its code column or its physical column (see `traces_csv`). Where only the
    physical column is there, the port's format quantizes it as an ADC does: nearest code, saturating at
    the ends of the range. Where both are there, the code counts and the other must agree with it.
    time_s, channel, the truth and reading are optional; a trace has the file's name without its extension.
    Rows of one channel are in the order of time; those of different channels may stand in any order.

    Returns
    -------
    tuple of Trace
        One for each channel, all of the same length; from a file without the column channel, one only.

    Raises
    ------
    SpecificationError
        As `read_csv_table`; if an input has no column; if a code is no integer or out of range, or
        contradicts the physical value; if time_s does not increase by one sample period from row to
        row of a channel within `TIME_TOLERANCE`; if reading is neither 0 nor 1; if a channel is no integer from 0 to
        one less than `channels`, has no row, or more than another.
    """
    columns = _Columns.of(ports)
    table = read_csv_table(path, columns.all)
    parts = _by_channel(table, channels) if columns.channel in table else [table]
    return tuple(_trace(part, columns, ports, sample_rate) for part in parts)


def rows_of_channel(table: CsvTable, channel: int) -> CsvTable:
    """Return the rows of one channel of a table with the column channel.

    Raises
    ------
    SpecificationError
        If it has none.
    """
    number = table.column(CHANNEL)
    own = np.flatnonzero(number == channel)
    if not len(own):
        given = ", ".join(f"{other:g}" for other in np.unique(number)[:8])
        raise SpecificationError(f"{table.path} must have rows of channel {channel}, not only of {given}")
    return table.take(own)


def _by_channel(table: CsvTable, channels: int) -> list[CsvTable]:
    number = table.column(CHANNEL)
    check_rows(
        table,
        (number % 1 != 0) | (number < 0) | (number >= channels),
        lambda k: f"{CHANNEL} must be {_allowed(channels)}, not {number[k]:g}",
    )
    rows = [np.flatnonzero(number == channel) for channel in range(channels)]
    shortest = min(range(channels), key=lambda channel: len(rows[channel]))
    length = len(rows[shortest])
    if not length:
        given = ", ".join(f"{channel:g}" for channel in np.unique(number))
        raise SpecificationError(f"{table.path} must have rows of channel {shortest}, not only of {given}")
    beyond = np.isin(np.arange(len(number)), np.concatenate([some[length:] for some in rows]))
    check_rows(
        table,
        beyond,
        lambda k: f"{CHANNEL} {number[k]:g} must end with its row {length}, as channel {shortest} does, not go on",
    )
    return [table.take(some) for some in rows]


def _allowed(channels: int) -> str:
    return "0, the core's only one" if channels == 1 else f"an integer from 0 to {channels - 1}"


def _trace(table: CsvTable, columns: _Columns, ports: tuple[Port, ...], sample_rate: Fraction) -> Trace:
    if columns.time in table:
        _check_time(table, table.column(columns.time), sample_rate)
    codes = [
        _read_codes(table, port, physical, code)
        for port, physical, code in zip(ports, columns.physical, columns.codes, strict=True)
    ]
    return Trace(
        name=table.path.stem,
        ports=ports,
        sample_rate=sample_rate,
        codes=np.stack(codes, axis=1),
        truth=table.column(columns.truth) if columns.truth in table else None,
        reading=_read_flags(table, columns.reading) if columns.reading in table else None,
    )


def _check_time(table: CsvTable, time: Values, sample_rate: Fraction) -> None:
    period = 1 / float(sample_rate)
    step = np.concatenate([[period], np.diff(time)])
    before = "the row of this channel before" if CHANNEL in table else "the row before"
    check_rows(table, step <= 0, lambda k: f"time_s must be above {time[k - 1]}, {before}, not {time[k]}")
    check_rows(
        table,
        np.abs(step - period) > TIME_TOLERANCE * period,
        lambda k: f"time_s must be {period:.6g} s after {before}, not {step[k]:.6g} s",
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
