"""Records of clearance over days, from CSV files."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.tables.csv_table import check_rows, csv_header, read_csv_table
from sosmith.model.traces.signal_file import unit_of
from sosmith.model.traces.trace_file import CHANNEL, rows_of_channel
from sosmith.model.wear.record_columns import CLEARANCES, TIMES

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
        Column of the clearance.
    time : ndarray, shape (n,)
        Days; from 1970-01-01 on (UTC) where the file has dates.
    clearance : ndarray, shape (n,)
        mm.
    dated : bool
        Whether the file has dates.
    channels : bool
        Whether the file tells channels apart.
    """

    path: Path
    column: str
    time: Values
    clearance: Values
    dated: bool
    channels: bool


def parse_moment(text: str) -> float:
    """Days from 1970-01-01 to a date or a date with a time, ISO 8601; without a zone it is UTC.

    Raises
    ------
    ValueError
        With what was expected, if it is neither.

    Examples
    --------
    >>> parse_moment("1970-01-02"), parse_moment("1970-01-01T06:00:00"), parse_moment("1970-01-01T08:00+02:00")
    (1.0, 0.25, 0.25)
    """
    try:
        moment = datetime.datetime.fromisoformat(text)
    except ValueError:
        raise ValueError("a date as 2024-03-01 or 2024-03-01T06:30") from None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=datetime.UTC)
    return (moment - _EPOCH).total_seconds() / SECONDS_A_DAY


def moment_text(days: float) -> str:
    """Write a time of a file with dates as a date, with hours and minutes; undoes `parse_moment` to the minute."""
    moment = _EPOCH + datetime.timedelta(minutes=round(days * 1440))
    return moment.strftime("%Y-%m-%d %H:%M")


def read_wear_record(path: Path, column: str | None = None, channel: int = 0) -> WearRecord:
    """Read a CSV file with one column of times and one of clearances; other columns do not matter.

    Parameters
    ----------
    path : Path
        The file, UTF-8.
    column : str, optional
        Column of the clearance in mm; without it the first of `CLEARANCES` that is there.
    channel : int
        Channel whose rows count in a file with the column channel; in any other all count.

    Raises
    ------
    SpecificationError
        As `read_csv_table`; if there is no such column, its name ends in another unit, or times go back; if no row is
        of the channel. One sentence with the file and the line.
    """
    header = csv_header(path)
    time_column = _first(path, header, ("time_s", *TIMES), "a column of times")
    clearance_column = _first(path, header, CLEARANCES if column is None else (column,), "a column of clearances")
    if clearance_column == time_column:
        raise SpecificationError(
            f"{path}: the column of clearances must be another than that of the time, {time_column}"
        )
    unit, factor = unit_of(clearance_column)
    if unit and (unit, factor) != ("mm", 1.0):
        raise SpecificationError(f"{path}: the column of clearances must be in mm, not {clearance_column}")
    ignored = {name: _nothing for name in header if name not in {time_column, clearance_column, CHANNEL}}
    readers = ignored | ({time_column: parse_moment} if time_column == "date" else {})
    table = read_csv_table(path, header, readers=readers)
    if CHANNEL in table:
        table = rows_of_channel(table, channel)
    raw = table.column(time_column)
    check_rows(
        table,
        np.concatenate([[False], np.diff(raw) < 0]),
        lambda k: f"{time_column} must not be before that of the row before",
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
    return names[0]  # the file cannot be read, or is empty: `read_csv_table` says so


def _nothing(text: str) -> float:
    return 0.0
