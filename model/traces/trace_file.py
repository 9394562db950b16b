"""Trace files: the traces of all channels of a core as one CSV file."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes, Kind, Values
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.model.tables.csv_table import CHUNK, CsvTable, check_rows, read_csv_chunks
from sosmith.model.text_files import write_pieces
from sosmith.model.traces.trace import Trace

CHANNEL = "channel"
"""Column with the channel number of a row, from 0; a file without it has one channel."""

PHYSICAL_COLUMNS = {"voltage": "voltage_V", "temperature": "temperature_C"}
"""Names of the physical columns of the paper's sensors; that of any other input is the input's name."""

TIME_TOLERANCE = 0.01
"""Largest relative deviation of a time step from the sample period in a file."""

LAST_DIGIT_TOLERANCE = 1e-9
"""Largest deviation of a time stamp from a multiple of its last digit, as a share of it, beside that of doubles."""


_WRITTEN = 1 << 14
"""Rows of a piece of text."""


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
    """Return the traces of a core's channels as CSV text, as `trace_pieces` makes it."""
    return "".join(trace_pieces(traces))


def trace_pieces(traces: Sequence[Trace]) -> Iterator[str]:
    """Yield the traces of a core's channels as CSV text, some thousand rows at a time, the same on every run.

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
    yield ",".join(names) + "\n"
    for start in range(0, len(traces[0]), _WRITTEN):
        part = slice(start, start + _WRITTEN)
        rows = [_rows(trace, part, str(k) if len(traces) > 1 else None) for k, trace in enumerate(traces)]
        yield "\n".join(line for together in zip(*rows, strict=True) for line in together) + "\n"


def _rows(trace: Trace, part: slice, channel: str | None) -> list[str]:
    codes = trace.codes[part]
    numbers = np.arange(part.start, part.start + len(codes), dtype=np.float64)
    columns = [[repr(value) for value in (numbers / float(trace.sample_rate)).tolist()]]
    columns += [] if channel is None else [[channel] * len(codes)]
    for port, column in zip(trace.ports, codes.T, strict=True):
        columns.append([repr(value) for value in port.decode(column).tolist()])
    columns += [[str(code) for code in column] for column in codes.T.tolist()]
    if trace.truth is not None:
        columns.append([repr(value) for value in trace.truth[part].tolist()])
    if trace.reading is not None:
        columns.append(["1" if value else "0" for value in trace.reading[part].tolist()])
    return list(map(",".join, zip(*columns, strict=True)))


def write_traces(path: Path, traces: Sequence[Trace]) -> None:
    """Write `trace_pieces` to `path` atomically.

    Raises
    ------
    SpecificationError
        As for `trace_pieces`; if the file cannot be written.
    ToolError
        If the disk is full.
    """
    write_pieces(path, trace_pieces(traces))


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
    gathered: dict[int, _Gathered] = {}
    for chunk in read_csv_chunks(path, columns.all):
        several = columns.channel in chunk
        parts = _by_channel(chunk, channels) if several else {0: chunk}
        for channel, part in parts.items():
            gathered.setdefault(channel, _Gathered(columns, ports)).take(part)
    if several:
        _check_lengths(path, gathered, channels)
    return tuple(gathered[channel].trace(path, sample_rate, several=several) for channel in sorted(gathered))


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


def _by_channel(table: CsvTable, channels: int) -> dict[int, CsvTable]:
    number = table.column(CHANNEL)
    check_rows(
        table,
        (number % 1 != 0) | (number < 0) | (number >= channels),
        lambda k: f"{CHANNEL} must be {_allowed(channels)}, not {number[k]:g}",
    )
    return {int(channel): table.take(np.flatnonzero(number == channel)) for channel in np.unique(number)}


def _check_lengths(path: Path, gathered: Mapping[int, _Gathered], channels: int) -> None:
    """Check that all channels have as many rows."""
    lengths = [len(gathered[channel].lines) if channel in gathered else 0 for channel in range(channels)]
    length = min(lengths)
    shortest = lengths.index(length)
    if not length:
        given = ", ".join(map(str, sorted(gathered)))
        raise SpecificationError(f"{path} must have rows of channel {shortest}, not only of {given}")
    longer = [channel for channel in range(channels) if lengths[channel] > length]
    if longer:
        first = min(longer, key=lambda channel: gathered[channel].lines[length])
        raise SpecificationError(
            f"{path}, line {gathered[first].lines[length]}: {CHANNEL} {first} must end after row {length}, "
            f"like channel {shortest}, not continue"
        )


def _allowed(channels: int) -> str:
    return "0, the core's only channel" if channels == 1 else f"an integer from 0 to {channels - 1}"


class _Gathered:
    """The rows of a channel, chunk by chunk, in as little memory as they take.

    Attributes
    ----------
    lines : array of int
        Line of the file of each row.
    """

    def __init__(self, columns: _Columns, ports: tuple[Port, ...]) -> None:
        self.lines = array("I")
        self._columns, self._ports = columns, ports
        self._time, self._truth = array("d"), array("d")
        self._codes, self._reading = array("q"), bytearray()
        self._limited = [0] * len(ports)

    def take(self, table: CsvTable) -> None:
        """Check the next rows but for their times, and keep what a trace has of them."""
        columns, places = self._columns, list(enumerate(zip(self._columns.physical, self._columns.codes, strict=True)))
        codes = [_read_codes(table, self._ports[k], physical, code) for k, (physical, code) in places]
        self._codes.frombytes(np.stack(codes, axis=1).tobytes())
        self.lines.frombytes(table.lines.tobytes())
        for k, (physical, code) in places:
            if code not in table:
                self._limited[k] += self._ports[k].outside(table.column(physical))
        if columns.time in table:
            self._time.frombytes(table.column(columns.time).tobytes())
        if columns.truth in table:
            self._truth.frombytes(table.column(columns.truth).tobytes())
        if columns.reading in table:
            self._reading += _read_flags(table, columns.reading).tobytes()

    def trace(self, path: Path, sample_rate: Fraction, *, several: bool) -> Trace:
        """Return the trace; `several` tells whether rows of other channels may stand between these."""
        if self._time:
            before = "the previous row of this channel" if several else "the previous row"
            _check_time(path, self.lines, np.frombuffer(self._time), sample_rate, before)
        return Trace(
            name=path.stem,
            ports=self._ports,
            sample_rate=sample_rate,
            codes=_read_only(np.frombuffer(self._codes, dtype=np.int64).reshape(-1, len(self._ports))),
            truth=_read_only(np.frombuffer(self._truth)) if self._truth else None,
            reading=_read_only(np.frombuffer(self._reading, dtype=np.bool_)) if self._reading else None,
            limited=tuple(self._limited),
        )


def _read_only(values: npt.NDArray[Kind]) -> npt.NDArray[Kind]:
    values.setflags(write=False)
    return values


def _check_time(path: Path, lines: Sequence[int], time: Values, sample_rate: Fraction, before: str) -> None:
    period = 1 / float(sample_rate)
    digit = last_digit(time)
    few = digit > period / 2  # stamps of other instants would pass as rounded ones

    def check(bad: npt.NDArray[np.bool_], start: int, what: Callable[[int], str]) -> None:
        if bad.any():
            row = start + int(np.argmax(bad))
            raise SpecificationError(f"{path}, line {lines[row]}: time_s must be {what(row)}")

    for start in range(0, len(time), CHUNK):
        now = time[start : start + CHUNK]
        step = np.diff(now, prepend=time[start - 1] if start else now[0] - period)
        if not start:
            step[0] = period
        check(step <= 0, start, lambda k: f"above {time[k - 1]}, the value in {before}, not {time[k]}")
        check(
            ~is_a_period(step, period, digit),
            start,
            lambda k: f"{period:.6g} s after {before}, not {time[k] - time[k - 1]:.6g} s",
        )
        due = np.arange(start, start + len(now)) * period
        check(
            np.abs(now - time[0] - due) > TIME_TOLERANCE * due + (0.0 if few else digit),
            start,
            lambda k: f"{k * period:.6g} s after the first row at {1 / period:g} Hz, not {time[k] - time[0]:.6g} s",
        )


def is_a_period(step: Values, period: float, digit: float) -> npt.NDArray[np.bool_]:
    """Tell which steps between time stamps that end with `digit` are a sample period, all in s."""
    near: npt.NDArray[np.bool_] = np.abs(step - period) <= TIME_TOLERANCE * period
    if digit > period / 2:  # stamps of other instants would pass as rounded ones
        return near
    # Instants that were rounded or cut to a digit are whole numbers of it apart, next below or next above a period.
    ratio = period / digit
    rounded = (step > (np.floor(ratio) - 0.5) * digit) & (step < (np.ceil(ratio) + 0.5) * digit)
    near |= rounded
    return near


def last_digit(time: Values) -> float:
    """Return the decimal digit that time stamps in s end with, down to a picosecond: 1e-6 for microseconds."""
    doubles = float(np.spacing(max(time.max(), -time.min())))
    blocks = [time[start : start + CHUNK] for start in range(0, len(time), CHUNK)]

    def ends_there(places: int) -> bool:
        tolerance = LAST_DIGIT_TOLERANCE + 2 * doubles * 10.0**places
        scaled = (block * 10.0**places for block in blocks)
        return all(np.all(np.abs(digits - np.round(digits)) < tolerance) for digits in scaled)

    return next((10.0**-places for places in range(12) if ends_there(places)), 1e-12)


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
