"""Strict reader for CSV files of numbers; every error names the file and the line."""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import read_lines

# float() would also accept "nan", "1_000" and digits of other scripts.
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)

_PLAIN = re.compile(r"[0-9+\-.eE,\n ]*", re.ASCII)
"""Text in which float() takes nothing that `NUMBER` does not."""

LARGEST = 1e100
"""Largest magnitude of a number; sums of squares below it do not overflow, and no physical value is above it."""

CHUNK = 1 << 14
"""Rows of a chunk."""

MAX_CELLS = 1 << 26
"""Most cells of a table that is read as a whole, which takes half a gigabyte."""

MAX_SHOWN = 60
"""Longest cell, in characters, that a message quotes in full."""


@dataclass(frozen=True, eq=False)
class CsvTable:
    """Named columns of finite numbers.

    Attributes
    ----------
    path : Path
        File that the table was read from.
    header : tuple of str
        Column names, all different.
    values : ndarray, shape (n_rows, n_columns)
        Cells; at least one row.
    lines : ndarray of uint32, shape (n_rows,)
        Line of the file, from 1, on which each row ends.
    """

    path: Path
    header: tuple[str, ...]
    values: Values
    lines: npt.NDArray[np.uint32]

    def __contains__(self, column: str) -> bool:
        """Whether the table has a column of that name."""
        return column in self.header

    def column(self, name: str) -> Values:
        """Return the cells of column `name`, shape (n_rows,)."""
        return np.asarray(self.values[:, self.header.index(name)])

    def take(self, rows: npt.NDArray[np.intp]) -> CsvTable:
        """Return a table of the rows with these indices, in their order."""
        return CsvTable(self.path, self.header, self.values[rows], self.lines[rows])

    def refuse(self, row: int, what: str) -> SpecificationError:
        """Return an error about row index `row`; `what` is the sentence after file and line."""
        return SpecificationError(f"{self.path}, line {self.lines[row]}: {what}")


Reader = Callable[[str], float]
"""Converts a cell to a number; raises ValueError with what the cell must be."""


def read_csv_table(
    path: Path, known: Sequence[str], required: Sequence[str] = (), readers: Mapping[str, Reader] | None = None
) -> CsvTable:
    """Read a CSV file of numbers with one header line.

    Blank lines, spaces around cells and a byte order mark are ignored.

    Parameters
    ----------
    path : Path
        File to read, UTF-8.
    known : sequence of str
        Permitted column names.
    required : sequence of str
        Required column names.
    readers : mapping of str to Reader, optional
        Readers for columns whose cells are not plain numbers.

    Raises
    ------
    SpecificationError
        As for `read_lines`; if the file is empty or has only a header; if a column is unknown, missing or repeated; if
        a row has too few or too many cells; if a cell is not a finite number of magnitude up to `LARGEST`; if there are
        more than `MAX_CELLS`. The message is one sentence with the file and, if there is one, the line.
    """
    cells, lines = array("d"), array("I")
    for chunk in read_csv_chunks(path, known, required, readers):
        cells.frombytes(chunk.values.tobytes())
        lines.frombytes(chunk.lines.tobytes())
        if len(cells) > MAX_CELLS:
            raise chunk.refuse(-1, f"the table must have at most {MAX_CELLS:,} cells, not go on")
    values = np.frombuffer(cells).reshape(len(lines), -1)
    return CsvTable(path, chunk.header, values, np.frombuffer(lines, dtype=np.uint32))


def read_csv_chunks(
    path: Path, known: Sequence[str], required: Sequence[str] = (), readers: Mapping[str, Reader] | None = None
) -> Iterator[CsvTable]:
    """Yield a CSV file of numbers as tables of up to `CHUNK` rows, at least one, which take little memory at a time.

    Parameters and errors are those of `read_csv_table`, but for the number of cells.
    """
    lines = read_lines(path, what="CSV file")
    header, done = _header(path, lines, known, required)
    readers = {name: reader for name, reader in (readers or {}).items() if name in header}
    any_rows = False
    while block := list(islice(lines, CHUNK)):
        values = None if readers else _plain_numbers(block, len(header))
        if values is None:
            values, numbers, taken = _rows(path, header, done, block, lines, readers)
        else:
            taken = len(block)
            numbers = np.arange(done + 1, done + taken + 1, dtype=np.uint32)
        done += taken
        if len(numbers):
            any_rows = True
            yield CsvTable(path, header, values, numbers)
    if not any_rows:
        raise SpecificationError(f"{path} must hold rows of numbers below its header, not only the header")


def _header(
    path: Path, lines: Iterator[str], known: Sequence[str], required: Sequence[str]
) -> tuple[tuple[str, ...], int]:
    """Take the header from the lines; return it, and how many lines it took."""
    reader = csv.reader(lines, strict=True)
    try:
        for cells in reader:
            if not _blank(cells):
                header = tuple(cell.strip() for cell in cells)
                _check_header(f"{path}, line {reader.line_num}", header, known, required)
                return header, reader.line_num
    except csv.Error as error:
        raise _broken(path, reader.line_num, error) from None
    raise SpecificationError(f"{path} must hold a header line and rows of numbers, not be empty")


def _plain_numbers(lines: Sequence[str], columns: int) -> Values | None:
    """Read lines of numbers and commas at once, shape (lines, columns); None if there is anything else or amiss."""
    text = "".join(lines).replace("\r\n", "\n")
    if not _PLAIN.fullmatch(text) or any(line.count(",") != columns - 1 for line in lines):
        return None
    try:
        values = np.array(list(map(float, text.removesuffix("\n").replace("\n", ",").split(","))))
    except ValueError:
        return None
    return values.reshape(len(lines), columns) if max(values.max(), -values.min()) <= LARGEST else None


def _rows(
    path: Path,
    header: tuple[str, ...],
    done: int,
    block: Sequence[str],
    lines: Iterator[str],
    readers: Mapping[str, Reader],
) -> tuple[Values, npt.NDArray[np.uint32], int]:
    """Read the rows that begin in `block`, behind `done` lines; return their numbers, lines, and how many they took."""
    reader = csv.reader(chain(block, lines), strict=True)
    values, numbers = array("d"), array("I")
    try:
        while reader.line_num < len(block) and (cells := next(reader, None)) is not None:
            if _blank(cells):
                continue
            line = done + reader.line_num
            if len(cells) != len(header):
                expected = "1 cell" if len(header) == 1 else f"{len(header)} cells"
                raise SpecificationError(f"{path}, line {line}: row must have {expected}, not {len(cells)}")
            values.extend(_number(path, line, *each, readers) for each in zip(header, cells, strict=True))
            numbers.append(line)
    except csv.Error as error:
        raise _broken(path, done + reader.line_num, error) from None
    return np.array(values).reshape(-1, len(header)), np.array(numbers, dtype=np.uint32), reader.line_num


def _blank(cells: Sequence[str]) -> bool:
    return len(cells) <= 1 and not any(cell.strip() for cell in cells)


def _broken(path: Path, line: int, error: csv.Error) -> SpecificationError:
    return SpecificationError(f"{path}, line {line}: row must be valid CSV, not broken ({error})")


def csv_header(path: Path) -> list[str]:
    """Return the names in the first line that is not blank; none if unreadable, which `read_csv_table` then reports."""
    try:
        for cells in csv.reader(read_lines(path, what="CSV file"), strict=True):
            if any(cell.strip() for cell in cells):
                check_separator(str(path), cells)
                return [cell.strip() for cell in cells]
    except (csv.Error, SpecificationError):
        pass
    return []


def check_separator(where: str, header: Sequence[str]) -> None:
    """Reject a header with a single cell because another character than the comma separates the names.

    Raises
    ------
    SpecificationError
        If so; the message begins with `where`.
    """
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and separator in header[0]:
            raise SpecificationError(f"{where}: cells must be separated by commas, with decimal points, not by {name}")


def check_rows(table: CsvTable, bad: npt.NDArray[np.bool_], what: Callable[[int], str]) -> None:
    """Reject the first row marked in `bad`, with the message that `what` returns for its index.

    Raises
    ------
    SpecificationError
        If `bad` marks a row.
    """
    if bad.any():
        row = int(np.argmax(bad))
        raise table.refuse(row, what(row))


def _check_header(where: str, header: Sequence[str], known: Sequence[str], required: Sequence[str]) -> None:
    check_separator(where, header)
    for name, count in Counter(header).items():
        if name not in known:
            raise SpecificationError(f"{where}: column must be one of {', '.join(known)}, not {name!r}")
        if count > 1:
            raise SpecificationError(f"{where}: column {name} must appear once, not {count} times")
    for name in required:
        if name not in header:
            raise SpecificationError(f"{where}: column {name} must be present, not missing from {', '.join(header)}")


def _number(path: Path, line: int, column: str, cell: str, readers: Mapping[str, Reader]) -> float:
    text = cell.strip()
    if column not in readers and NUMBER.fullmatch(text) and abs(number := float(text)) <= LARGEST:
        return number
    where = f"{path}, line {line}"
    if column in readers:
        try:
            return readers[column](text)
        except ValueError as error:
            raise SpecificationError(f"{where}: {column} must be {error}, not {shortened(text)}") from None
    if not NUMBER.fullmatch(text) or float(text) in {math.inf, -math.inf}:
        raise SpecificationError(f"{where}: {column} must be a finite number, not {shortened(text)}")
    raise SpecificationError(f"{where}: {column} must be from -{LARGEST:g} to {LARGEST:g}, not {shortened(text)}")


def shortened(text: str) -> str:
    """Quote `text` for a message; of more than `MAX_SHOWN` characters, only the beginning."""
    return repr(text) if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 4]!r} ..."
