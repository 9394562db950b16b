"""Clearance records over days, from CSV files."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sosmith.instrument.wear.record_columns import CLEARANCES, TIMES
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.tables.csv_table import check_rows, csv_header, read_csv_table
from sosmith.model.traces.signal_file import unit_of
from sosmith.model.traces.trace_file import CHANNEL, rows_of_channel

SECONDS_A_DAY = 86400.0

_EPOCH = datetime.datetime(1970, 1, 1, tzinfo=datetime.UTC)


@dataclass(frozen=True, eq=False, kw_only=True)
class WearRecord:
    """Clearance over time.

    Attributes
    ----------
    path : Path
        The file.
    column : str
        Name of the clearance column.
    time : ndarray, shape (n,)
        Time in days; since 1970-01-01 UTC if the file has dates.
    clearance : ndarray, shape (n,)
        Clearance in mm.
    dated : bool
        Whether the file has dates.
    channels : bool
        Whether the file has the column channel.
    """

    path: Path
    column: str
    time: Values
    clearance: Values
    dated: bool
    channels: bool


def parse_moment(text: str) -> float:
    """Return the days from 1970-01-01 to an ISO 8601 date, with or without a time; without a time zone it is UTC.

    Raises
    ------
    ValueError
        If it is not such a date; the message is what was expected.

    Examples
    --------
    >>> parse_moment("1970-01-02"), parse_moment("1970-01-01T06:00:00"), parse_moment("1970-01-01T08:00+02:00")
    (1.0, 0.25, 0.25)
    """
    try:
        moment = datetime.datetime.fromisoformat(text)
    except ValueError:
        raise ValueError("a date such as 2024-03-01 or 2024-03-01T06:30") from None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=datetime.UTC)
    return (moment - _EPOCH).total_seconds() / SECONDS_A_DAY


def moment_text(days: float) -> str:
    """Return days since 1970-01-01 as a date with hours and minutes: the inverse of `parse_moment`, to the minute."""
    moment = _EPOCH + datetime.timedelta(minutes=round(days * 1440))
    return moment.strftime("%Y-%m-%d %H:%M")


def read_wear_record(path: Path, column: str | None = None, channel: int = 0) -> WearRecord:
    """Read a CSV file with a time column and a clearance column; other columns are ignored.

    Parameters
    ----------
    path : Path
        The file, UTF-8.
    column : str, optional
        Name of the clearance column in mm; by default the first of `CLEARANCES` that is present.
    channel : int
        Channel whose rows are read from a file with the column channel; other files are read completely.

    Raises
    ------
    SpecificationError
        As for `read_csv_table`; if there is no such column, its name ends in another unit, times decrease, or the
        channel has no row. The message is one sentence with the file and the line.
    """
    header = csv_header(path)
    time_column = _first(path, header, ("time_s", *TIMES), "a time column")
    clearance_column = _first(path, header, CLEARANCES if column is None else (column,), "a clearance column")
    if clearance_column == time_column:
        raise SpecificationError(
            f"{path}: the clearance column must differ from the time column, not be {time_column} too"
        )
    unit, factor = unit_of(clearance_column)
    if unit and (unit, factor) != ("mm", 1.0):
        raise SpecificationError(f"{path}: the clearance column must be in mm, not {clearance_column}")
    ignored = {name: _nothing for name in header if name not in {time_column, clearance_column, CHANNEL}}
    readers = ignored | ({time_column: parse_moment} if time_column == "date" else {})
    table = read_csv_table(path, header, readers=readers)
    if CHANNEL in table:
        table = rows_of_channel(table, channel)
    raw = table.column(time_column)
    check_rows(
        table,
        np.concatenate([[False], np.diff(raw) < 0]),
        lambda k: f"{time_column} must be no earlier than in the previous row, not go back",
    )
    return WearRecord(
        path=path,
        column=clearance_column,
        time=raw / SECONDS_A_DAY if time_column == "time_s" else raw * TIMES[time_column],
        clearance=table.column(clearance_column),
        dated=time_column == "date",
        channels=CHANNEL in header,
    )


def _first(path: Path, header: Sequence[str], names: Sequence[str], what: str) -> str:
    for name in names:
        if name in header:
            return name
    if header:
        raise SpecificationError(f"{path} must have {what} ({', '.join(names)}), not only {', '.join(header)}")
    return names[0]  # the file is unreadable or empty; `read_csv_table` reports that


def _nothing(text: str) -> float:
    return 0.0
