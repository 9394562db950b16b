"""Reads measurements from CSV or XLSX files: the valid rows, and a reason for each rejected row.

`fit.read_measurements`, in contrast, reads a file that must be valid as a whole and stops at the first error.
"""

from __future__ import annotations

import csv
import datetime
import hashlib
import io
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sosmith.gen.calibration.fit import COLUMNS, DATE_COLUMN, UNCERTAINTY_COLUMNS
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES, Range
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import opened
from sosmith.model.tables.csv_table import NUMBER, check_separator, shortened
from sosmith.model.tables.workbook import MAX_ROWS, Uncalculated, workbook_rows

MAX_BYTES = 16 << 20
"""Most bytes of a file: several times what `MAX_ROWS` rows take."""

_SLIPS: dict[str, tuple[tuple[str, Callable[[float], float]], ...]] = {
    "clearance_mm": (("micrometres", lambda x: x / 1000), ("metres", lambda x: x * 1000)),
    "voltage_V": (("millivolts", lambda x: x / 1000), ("microvolts", lambda x: x / 1e6)),
    "temperature_C": (("kelvins", lambda x: x - 273.15), ("degrees Fahrenheit", lambda x: (x - 32) / 1.8)),
}
"""Wrong units that an out-of-range number may be in, each with its conversion to the right one."""


@dataclass(frozen=True)
class Reading:
    """One valid row.

    Attributes
    ----------
    line : int
        Line in the file, or row in the sheet, from 1.
    date : str
        Date of the measurement, such as 2024-03-01.
    values : tuple of float
        Clearance in mm, voltage in V, temperature in degC.
    uncertainty : tuple of float
        Their standard uncertainties in the same units where they are stated, else 0.
    """

    line: int
    date: str
    values: tuple[float, float, float]
    uncertainty: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def key(self) -> tuple[str, tuple[float, ...]]:
        """What no two measurements of a sensor share: date and values. The same values of another day are a repeat."""
        return self.date, self.values

    def sha256(self, sensor: str) -> str:
        """Return the SHA-256 of sensor name, date, exact values, and of uncertainties if any is stated."""
        numbers = self.values + (self.uncertainty if any(self.uncertainty) else ())
        text = "\n".join([sensor, self.date, *(value.hex() for value in numbers)])
        return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class Refusal:
    """A rejected row: its line, and a sentence with the reason."""

    line: int
    reason: str


@dataclass(frozen=True)
class MeasurementFile:
    """The rows of a file.

    Attributes
    ----------
    path : Path
        The file.
    sha256 : str
        SHA-256 of the file, in hexadecimal.
    readings : tuple of Reading
        The valid rows, in the order of the file.
    refusals : tuple of Refusal
        The rejected rows, in the order of the file.
    """

    path: Path
    sha256: str
    readings: tuple[Reading, ...]
    refusals: tuple[Refusal, ...]


def read_measurement_file(
    path: Path,
    date: str,
    ranges: tuple[Range, Range, Range] = DEFAULT_RANGES,
    *,
    content: bytes | None = None,
    uncertainty: float = 0.0,
) -> MeasurementFile:
    """Read the columns clearance_mm, voltage_V and temperature_C from a CSV or XLSX file.

    If present, also those for the date and for uncertainties, whose cells may be empty.

    Of a workbook, the first visible worksheet is read, with the stored values of formulas.

    Parameters
    ----------
    path : Path
        File whose name ends in ``.csv`` (UTF-8) or ``.xlsx``.
    date : str
        Date of measurements that have none in the file.
    ranges : tuple of Range
        Lowest and highest valid clearance in mm, voltage in V and temperature in degC.
    content : bytes or None
        What stands in the file; None to read it.
    uncertainty : float
        Standard uncertainty in mm of clearances that state none; 0 if it is not known.

    Raises
    ------
    SpecificationError
        If the file cannot be read, is of another kind, or its header lacks one of the three columns; if it has more
        than `MAX_BYTES` bytes or a row beyond `MAX_ROWS`. Errors in single rows go to `MeasurementFile.refusals`
        instead.
    """
    try:
        if content is None:
            with opened(path) as file:
                content = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a path with a NUL
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise SpecificationError(f"{path} must be a readable CSV or XLSX file ({reason})") from None
    readers = {".csv": _csv_rows, ".xlsx": workbook_rows}
    if path.suffix.lower() not in readers:
        raise SpecificationError(f"{path}: the file's name must end in .csv or .xlsx, not {path.suffix or 'neither'}")
    if len(content) > MAX_BYTES:
        raise SpecificationError(f"{path} must have at most {MAX_BYTES >> 20} MiB, not more")
    rows = ((line, cells) for line, cells in readers[path.suffix.lower()](path, content) if not _blank(cells))
    line, header = next(rows, (1, ()))
    names = tuple(cell.strip() if isinstance(cell, str) else cell for cell in _trimmed(header, 0))
    _check_header(f"{path}, line {line}", names)
    reader = _Rows(names, date, ranges, uncertainty)
    for line, cells in rows:
        reader.take(line, cells)
    if not reader.readings and not reader.refusals:
        raise SpecificationError(f"{path} must hold rows of numbers below its header, not only the header")
    sha256 = hashlib.sha256(content).hexdigest()
    return MeasurementFile(path, sha256, tuple(reader.readings), tuple(reader.refusals))


def parse_date(text: str) -> str:
    """Return `text` if it is a date such as 2024-03-01.

    Raises
    ------
    SpecificationError
        If it is not.
    """
    try:
        if datetime.date.fromisoformat(text).isoformat() == text:
            return text
    except ValueError:
        pass
    raise SpecificationError(f"date must be a date such as 2024-03-01, not {shortened(text)}")


def _blank(cells: Sequence[Any]) -> bool:
    return all(cell is None or (isinstance(cell, str) and not cell.strip()) for cell in cells)


def _trimmed(cells: Sequence[Any], least: int) -> Sequence[Any]:
    """Drop empty cells at the end of a row, as workbooks have them, but keep at least `least` cells."""
    end = len(cells)
    while end > least and _blank(cells[end - 1 : end]):
        end -= 1
    return cells[:end]


def _csv_rows(path: Path, content: bytes) -> Iterator[tuple[int, Sequence[Any]]]:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise SpecificationError(
            f"{path}, line {line}: text must be UTF-8, not contain the byte 0x{content[error.start]:02x}"
        ) from None
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        for cells in reader:
            if reader.line_num > MAX_ROWS:
                raise SpecificationError(f"{path} must end within {MAX_ROWS:,} rows, not go on in row {MAX_ROWS + 1:,}")
            yield reader.line_num, [float(cell) if NUMBER.fullmatch(cell.strip()) else cell for cell in cells]
    except csv.Error as error:
        raise SpecificationError(
            f"{path}, line {reader.line_num}: row must be valid CSV, not broken ({error})"
        ) from None


def _check_header(where: str, names: Sequence[Any]) -> None:
    known = (*COLUMNS, DATE_COLUMN, *UNCERTAINTY_COLUMNS)
    if not names:
        raise SpecificationError(f"{where}: header must be {','.join(COLUMNS)}, not empty")
    if isinstance(names[0], str):
        check_separator(where, names)
    for name in names:
        if name not in known:
            raise SpecificationError(
                f"{where}: column must be one of {', '.join(known)}, with the unit in its name, "
                f"not {shortened(str(name or ''))}"
            )
        if names.count(name) > 1:
            raise SpecificationError(f"{where}: column {name} must appear once, not {names.count(name)} times")
    for name in COLUMNS:
        if name not in names:
            raise SpecificationError(f"{where}: column {name} must be present, not missing from {', '.join(names)}")


@dataclass
class _Rows:
    """Sorts rows into valid and rejected ones."""

    names: Sequence[Any]
    date: str
    ranges: tuple[Range, Range, Range]
    uncertainty: float
    readings: list[Reading] = field(default_factory=list)
    refusals: list[Refusal] = field(default_factory=list)
    first_lines: dict[tuple[str, tuple[float, ...]], int] = field(default_factory=dict)

    def take(self, line: int, cells: Sequence[Any]) -> None:
        """Add one row to `readings` or to `refusals`."""
        try:
            reading = self._reading(line, cells)
        except SpecificationError as error:
            self.refusals.append(Refusal(line, str(error)))
            return
        first = self.first_lines.setdefault(reading.key, line)
        if first == line:
            self.readings.append(reading)
        else:
            self.refusals.append(Refusal(line, f"row must be a new measurement, not a duplicate of line {first}"))

    def _reading(self, line: int, cells: Sequence[Any]) -> Reading:
        filled = _trimmed(cells, len(self.names))
        if len(filled) != len(self.names):
            raise SpecificationError(f"row must have {len(self.names)} cells, not {len(filled)}")
        row = dict(zip(self.names, filled, strict=True))
        numbers = [_number(name, row[name]) for name in COLUMNS]
        wrong = list(_out_of_range(numbers, self.ranges))
        if wrong:
            raise SpecificationError("; ".join(wrong))
        clearance, voltage, temperature = numbers
        date = _date(row[DATE_COLUMN]) if DATE_COLUMN in row else self.date
        stated = [_stated(name, row.get(name)) for name in UNCERTAINTY_COLUMNS]
        of_clearance = stated[0] or self.uncertainty
        return Reading(line, date, (clearance, voltage, temperature), (of_clearance, stated[1], stated[2]))


def _number(name: str, cell: Any) -> float:
    if cell is None or (isinstance(cell, str) and not cell.strip()):
        raise SpecificationError(f"{name} must be a finite number, not empty")
    if isinstance(cell, bool | str) or not isinstance(cell, int | float) or not abs(cell) <= sys.float_info.max:
        raise SpecificationError(f"{name} must be a finite number, not {_shown(cell)}")
    return float(cell) + 0.0  # turns -0 into 0, so that both are the same measurement


def _stated(name: str, cell: Any) -> float:
    """Return a stated uncertainty; 0 for an empty cell."""
    if cell is None or (isinstance(cell, str) and not cell.strip()):
        return 0.0
    number = _number(name, cell)
    if not number > 0:
        raise SpecificationError(f"{name} must be more than 0, or empty where it is not known, not {number:g}")
    return number


def _shown(cell: Any) -> str:
    return f"the text {shortened(cell.strip())}" if isinstance(cell, str) else str(cell)


def _date(cell: Any) -> str:
    if isinstance(cell, datetime.datetime):
        return cell.date().isoformat()
    if isinstance(cell, Uncalculated):
        raise SpecificationError(f"{DATE_COLUMN} must be a date such as 2024-03-01, not {cell}")
    return parse_date("" if cell is None else str(cell).strip())


def _out_of_range(numbers: Sequence[float], ranges: Iterable[Range]) -> Iterator[str]:
    """Yield a sentence for each number out of its range, with a guess at the cause."""
    ranges = tuple(ranges)
    for k, (name, number, (low, high)) in enumerate(zip(COLUMNS, numbers, ranges, strict=True)):
        if low <= number <= high:
            continue
        unit = name.rpartition("_")[2]
        guess = next((f" (in {slip}?)" for slip, right in _SLIPS[name] if low <= right(number) <= high), "")
        for other, (other_low, other_high) in enumerate(ranges):
            swapped = other != k and ranges[k][0] <= numbers[other] <= ranges[k][1]
            if swapped and other_low <= number <= other_high:
                guess = f" (columns {name} and {COLUMNS[other]} swapped?)"
        yield f"{name} must be {low:g} to {high:g} {unit}, not {number:g}{guess}"
