"""The first visible worksheet of an XLSX workbook: its rows as values, within limits of size.

A workbook is a ZIP archive of XML. openpyxl reads the strings and the cells; its own iterator over a sheet is not used,
because that one trusts the range that the sheet states and drops whatever lies outside, and its reader of styles is not
used either, because it refuses workbooks for a colour or a font.
"""

from __future__ import annotations

import io
import warnings
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, Any
from xml.etree import ElementTree
from xml.parsers import expat

from openpyxl.reader.excel import ExcelReader
from openpyxl.styles.numbers import BUILTIN_FORMATS, is_date_format, is_timedelta_format
from openpyxl.utils import get_column_letter
from openpyxl.worksheet._reader import WorkSheetParser

from sosmith.model.errors import SpecificationError

MAX_ROWS = 50_000
"""Last row of a sheet that may hold anything."""

MAX_COLUMNS = 100
"""Last column of a sheet that may hold anything."""

MAX_UNPACKED = 16 << 20
"""Most bytes that all parts of a workbook may have when unpacked; `MAX_ROWS` rows of measurements fit."""

MAX_TAGS = 1_500_000
"""Most XML tags that all parts of a workbook may have: reading them takes seconds, however few bytes they are."""

_MAX_CELLS = 16_384  # in a row: the most columns that the format has, formatted ones without a value included
_XML = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
_OLE = b"\xd0\xcf\x11\xe0"  # begins workbooks of the older kind, and those with a password


class Uncalculated:
    """The value of a formula that was never calculated: some programs write only the formula."""

    def __repr__(self) -> str:
        return "a formula without a stored value (open the workbook in a spreadsheet program and save it)"


UNCALCULATED = Uncalculated()


def workbook_rows(path: Path, content: bytes) -> list[tuple[int, Sequence[Any]]]:
    """Return the rows of the first visible worksheet that hold anything, each with its number from 1.

    Chart sheets are passed over, hidden rows and columns are not. Each row holds one value for each column from A to
    the last one with a value in any row: a number, a text, a bool, a date or time, None for an empty cell, or
    `UNCALCULATED`. Of a formula, the stored value is taken; of merged cells, only the first one has a value.

    Parameters
    ----------
    path : Path
        File that `content` was read from, for messages.
    content : bytes
        The workbook.

    Raises
    ------
    SpecificationError
        If the workbook is damaged, has no visible worksheet, defines a document type in any part, unpacks to more than
        `MAX_UNPACKED` bytes or `MAX_TAGS` tags, or has a value beyond `MAX_ROWS` or `MAX_COLUMNS`.
    """
    if content.startswith(_OLE):
        raise SpecificationError(f"{path} must be an XLSX workbook without a password, not an encrypted or older one")
    try:
        with warnings.catch_warnings(), zipfile.ZipFile(io.BytesIO(content)) as archive:
            warnings.simplefilter("ignore")  # warnings about dates out of range, which become error cells
            _check_unpacked(path, archive)
            rows = list(_rows(path, content))
    except SpecificationError:
        raise
    except Exception as error:  # damaged files raise errors of zipfile, of XML, or any other
        what = " ".join(str(error).split()) or type(error).__name__
        raise SpecificationError(f"{path} must be an XLSX workbook, not damaged ({what})") from None
    width = max((len(values) for _, values in rows), default=0)
    return [(number, [*values, *[None] * (width - len(values))]) for number, values in rows]


def _check_unpacked(path: Path, archive: zipfile.ZipFile) -> None:
    """Unpack all parts, piece by piece, and count: what the archive states about their sizes may be false."""
    unpacked = tags = 0
    for entry in archive.infolist():
        if entry.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:
            raise ValueError(f"{entry.filename} is compressed in a way that workbooks are not")
        check = _TypeCheck(path)
        with archive.open(entry) as part:
            while piece := part.read(1 << 20):
                check.feed(piece)
                unpacked += len(piece)
                tags += piece.count(b"<")
                if unpacked > MAX_UNPACKED or tags > MAX_TAGS:
                    raise SpecificationError(
                        f"{path} must unpack to at most {MAX_UNPACKED >> 20} MiB with {MAX_TAGS:,} XML tags, not more; "
                        "keep the measurements in a workbook of their own, without pictures and other sheets"
                    )


class _TypeCheck:
    """Refuses a part with a document type, in whatever encoding: its entities expand to any size when they are read."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._parser: expat.XMLParserType | None = expat.ParserCreate()
        self._parser.StartDoctypeDeclHandler = self._refuse

    def feed(self, piece: bytes) -> None:
        """Read on; what is no XML is read no further."""
        if self._parser is None:
            return
        try:
            self._parser.Parse(piece, False)
        except expat.ExpatError as error:
            # Another parser might know an encoding that this one does not.
            if error.code == expat.errors.codes[expat.errors.XML_ERROR_UNKNOWN_ENCODING]:
                raise
            self._parser = None

    def _refuse(self, *_declared: object) -> None:
        raise SpecificationError(
            f"{self._path} must be a workbook of plain XML, not define a document type: no spreadsheet program does"
        )


def _rows(path: Path, content: bytes) -> Iterator[tuple[int, list[Any]]]:
    """Yield number and values of each row with a value, up to the last one."""
    book = ExcelReader(io.BytesIO(content), read_only=True, data_only=True, keep_links=False)
    book.read_manifest()
    book.read_strings()
    book.read_workbook()
    dates, durations = _date_styles(book.archive)
    with book.archive.open(_first_worksheet(path, book)) as source:
        parser = _Parser(
            source,
            book.shared_strings,
            data_only=True,
            epoch=book.wb.epoch,
            date_formats=dates,
            timedelta_formats=durations,
        )
        last = 0
        for number, cells in _parsed(source, parser):
            if number <= last:
                raise ValueError(f"row {number} comes after row {last}")
            last = number
            values = _in_columns(number, cells)
            if not values:
                continue
            if number > MAX_ROWS:
                raise SpecificationError(f"{path} must end within {MAX_ROWS:,} rows, not go on in row {number:,}")
            if len(values) > MAX_COLUMNS:
                raise SpecificationError(
                    f"{path} must end within {MAX_COLUMNS} columns, "
                    f"not go on in column {get_column_letter(len(values))} of row {number:,}"
                )
            yield number, values


def _first_worksheet(path: Path, book: ExcelReader) -> str:
    """Return the part that holds the first visible sheet of cells."""
    for sheet, relation in book.parser.find_sheets():
        if relation.Type.endswith("/worksheet") and sheet.state == "visible":
            return str(relation.target)
    raise SpecificationError(f"{path} must hold a visible worksheet, not only charts or hidden sheets")


def _date_styles(archive: zipfile.ZipFile) -> tuple[set[int], set[int]]:
    """Return the numbers of the cell styles that show a number as a date or time, and of those for durations."""
    if "xl/styles.xml" not in archive.namelist():
        return set(), set()
    formats = dict(BUILTIN_FORMATS)
    styles: list[str] = []
    with archive.open("xl/styles.xml") as source:
        for _, element in ElementTree.iterparse(source):
            if element.tag == f"{_XML}numFmt":
                formats[int(element.get("numFmtId", "0"))] = element.get("formatCode", "")
            elif element.tag == f"{_XML}cellXfs":
                styles = [formats.get(int(style.get("numFmtId", "0")), "") for style in element]
    return (
        {number for number, code in enumerate(styles) if is_date_format(code)},
        {number for number, code in enumerate(styles) if is_timedelta_format(code)},
    )


class _Parser(WorkSheetParser):  # type: ignore[misc]
    """Tells a formula without a stored value from an empty cell."""

    def parse_cell(self, element: ElementTree.Element) -> dict[str, Any]:
        cell: dict[str, Any] = super().parse_cell(element)
        # A text formula with an empty value is calculated: it gives an empty text.
        if cell["value"] is None and element.get("t") != "str" and element.find(f"{_XML}f") is not None:
            cell["value"] = UNCALCULATED
        return cell


def _parsed(source: IO[bytes], parser: WorkSheetParser) -> Iterator[tuple[int, list[dict[str, Any]]]]:
    """Yield number and cells of each row, from the XML as it is read."""
    count = 0
    for event, element in ElementTree.iterparse(source, events=("start", "end")):
        if event == "start" and element.tag == f"{_XML}c":
            count += 1
            if count > _MAX_CELLS:
                raise ValueError(f"a row of more than {_MAX_CELLS} cells")
        elif event == "end" and element.tag == f"{_XML}row":
            yield parser.parse_row(element)
            element.clear()
            count = 0


def _in_columns(number: int, cells: Sequence[dict[str, Any]]) -> list[Any]:
    """Return the values of a row in their columns, up to the last one with a value."""
    values = {cell["column"]: cell["value"] for cell in cells}
    if len(values) < len(cells) or any(cell["row"] != number for cell in cells):
        raise ValueError(f"cells of row {number} have wrong addresses")
    end = max((column for column, value in values.items() if value is not None), default=0)
    return [values.get(column) for column in range(1, end + 1)]
