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
"""Column with the channel number of a row, from 0; a file without it has one channel."""

PHYSICAL_COLUMNS = {"voltage": "voltage_V", "temperature": "temperature_C"}
"""Names of the physical columns of the paper's sensors; that of any other input is the input's name."""

TIME_TOLERANCE = 0.01
"""Largest relative deviation of a time step from the sample period in a file."""

LAST_DIGIT_TOLERANCE = 1e-9
"""Largest deviation of a time stamp from a multiple of its last digit, as a share of it, beside that of doubles."""


@dataclass(frozen=True)
class _Columns:
    """Column names of a trace file."""

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
                    f"input names must differ from the other columns of a trace file, not repeat {name!r}"
                )
        return columns

    @property
    def all(self) -> tuple[str, ...]:
        return (self.time, self.channel, self.truth, self.reading, *self.physical, *self.codes)


def traces_csv(traces: Sequence[Trace]) -> str:
    """Return the traces of a core's channels as CSV text, the same on every run.

    Columns: time_s; channel, if there are several; the physical value of each input (voltage_V, temperature_C, or the
    input's name); the code of each input (``<input>_code``); if the traces have them, the true value (clearance_mm for
    two inputs, truth for one) and reading (0 or 1). Rows are sorted by time, then by channel. Numbers are written so
    that they read back exactly.

    Parameters
    ----------
    traces : sequence of Trace
        One per channel, all with the same ports and length, and all with or without truth and reading.

    Raises
    ------
    SpecificationError
        If an input's name is that of another column.
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
    """Write `traces_csv` to `path` atomically.

    Raises
    ------
    SpecificationError
        As for `traces_csv`; if the file cannot be written.
    ToolError
        If the disk is full.
    """
    write_files(path.parent, {path.name: traces_csv(traces)})


def read_traces(path: Path, ports: tuple[Port, ...], sample_rate: Fraction, channels: int = 1) -> tuple[Trace, ...]:
    """Read a trace file for a core with the inputs `ports` and the `sample_rate` in Hz of each of its `channels`.

    Every input needs its code column or its physical column (see `traces_csv`). A physical column alone is quantized
    as by an ADC: to the nearest code, saturated to the range. If both are present, the code is used, and the physical
    value must agree with it. The columns time_s, channel, truth or clearance_mm, and reading are optional. A trace is
    named after its file, without the extension. Rows of one channel must be in chronological order; channels may be
    interleaved in any order.

    Returns
    -------
    tuple of Trace
        One per channel, all of equal length; a single one if the file has no column channel.

    Raises
    ------
    SpecificationError
        As for `read_csv_table`; if an input has no column; if a code is not an integer, is out of range, or contradicts
        the physical value; if time_s does not increase by one sample period per row of a channel, within
        `TIME_TOLERANCE` or the last digit of the time stamps; if reading is neither 0 nor 1; if a channel number is not
        an integer from 0 to ``channels - 1``; if a channel has no row, or more rows than another.
    """
    columns = _Columns.of(ports)
    table = read_csv_table(path, columns.all)
    parts = _by_channel(table, channels) if columns.channel in table else [table]
    return tuple(_trace(part, columns, ports, sample_rate) for part in parts)


def rows_of_channel(table: CsvTable, channel: int) -> CsvTable:
    """Return the rows of one channel from a table with the column channel.

    Raises
    ------
    SpecificationError
        If the channel has no row.
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
        lambda k: f"{CHANNEL} {number[k]:g} must end after row {length}, like channel {shortest}, not continue",
    )
    return [table.take(some) for some in rows]


def _allowed(channels: int) -> str:
    return "0, the core's only channel" if channels == 1 else f"an integer from 0 to {channels - 1}"


def _trace(table: CsvTable, columns: _Columns, ports: tuple[Port, ...], sample_rate: Fraction) -> Trace:
    if columns.time in table:
        _check_time(table, table.column(columns.time), sample_rate)
    codes = [
        _read_codes(table, port, physical, code)
        for port, physical, code in zip(ports, columns.physical, columns.codes, strict=True)
    ]
    coded = [code in table for code in columns.codes]
    limited = [
        0 if given else port.outside(table.column(physical))
        for given, port, physical in zip(coded, ports, columns.physical, strict=True)
    ]
    return Trace(
        name=table.path.stem,
        ports=ports,
        sample_rate=sample_rate,
        codes=np.stack(codes, axis=1),
        truth=table.column(columns.truth) if columns.truth in table else None,
        reading=_read_flags(table, columns.reading) if columns.reading in table else None,
        limited=tuple(limited),
    )


def _check_time(table: CsvTable, time: Values, sample_rate: Fraction) -> None:
    period = 1 / float(sample_rate)
    step = np.concatenate([[period], np.diff(time)])
    before = "the previous row of this channel" if CHANNEL in table else "the previous row"
    check_rows(table, step <= 0, lambda k: f"time_s must be above {time[k - 1]}, the value in {before}, not {time[k]}")
    digit = _last_digit(time)
    few = digit > period / 2  # stamps of other instants would pass as rounded ones
    # Instants that were rounded or cut to a digit are whole numbers of it apart, next below or next above a period.
    ratio = period / digit
    rounded = (step > (np.floor(ratio) - 0.5) * digit) & (step < (np.ceil(ratio) + 0.5) * digit) & (not few)
    check_rows(
        table,
        (np.abs(step - period) > TIME_TOLERANCE * period) & ~rounded,
        lambda k: f"time_s must be {period:.6g} s after {before}, not {step[k]:.6g} s",
    )
    passed, due = time - time[0], np.arange(len(time)) * period
    check_rows(
        table,
        np.abs(passed - due) > TIME_TOLERANCE * due + (0.0 if few else digit),
        lambda k: f"time_s must be {due[k]:.6g} s after the first row at {1 / period:g} Hz, not {passed[k]:.6g} s",
    )


def _last_digit(time: Values) -> float:
    """Return the decimal digit that time stamps in s end with, down to a picosecond: 1e-6 for microseconds."""
    doubles = float(np.spacing(np.abs(time).max()))
    for places in range(12):
        digits, tolerance = time * 10.0**places, LAST_DIGIT_TOLERANCE + 2 * doubles * 10.0**places
        if np.all(np.abs(digits - np.round(digits)) < tolerance):
            return 10.0**-places
    return 1e-12


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
