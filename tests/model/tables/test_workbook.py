"""The first worksheet of a workbook: all of its cells whatever it states about itself, and none beyond the limits."""

from __future__ import annotations

import datetime
import io
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import openpyxl
import pytest
from openpyxl.chart import LineChart

from sosmith.model.errors import SpecificationError
from sosmith.model.tables import workbook
from sosmith.model.tables.workbook import MAX_COLUMNS, MAX_ROWS, MAX_TAGS, MAX_UNPACKED, UNCALCULATED, workbook_rows

PATH = Path("m.xlsx")
SHEET = "xl/worksheets/sheet1.xml"
STYLES = "xl/styles.xml"


def saved(book: openpyxl.Workbook) -> bytes:
    buffer = io.BytesIO()
    book.save(buffer)
    return buffer.getvalue()


def written(rows: Sequence[Sequence[Any]]) -> bytes:
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(list(row))
    return saved(book)


def changed(content: bytes, changes: Mapping[str, Callable[[bytes], bytes]]) -> bytes:
    """Return the workbook with some of its parts changed."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, changes.get(name, bytes)(old.read(name)))
    return buffer.getvalue()


def of_xml(rows: str, before: str = "") -> bytes:
    """Return a workbook whose sheet holds this XML of rows."""
    sheet = '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">'
    return changed(written([]), {SHEET: lambda _: f"{sheet}{before}<sheetData>{rows}</sheetData></worksheet>".encode()})


def refused(content: bytes, message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        workbook_rows(PATH, content)


FORTY = [(k, 2 * k, 3 * k) for k in range(1, 41)]


@pytest.mark.parametrize("stated", ["A1:C21", "A1", "B2:C3", "A1:XFD1048576", "nonsense", None])
def test_all_rows_are_read_whatever_range_the_sheet_states(stated: str | None) -> None:
    def dimension(sheet: bytes) -> bytes:
        tag = b"" if stated is None else b'<dimension ref="%s" />' % stated.encode()
        changed_sheet, count = re.subn(rb'<dimension ref="A1:C40" ?/>', tag, sheet)  # the blank depends on the writer
        assert count == 1
        return changed_sheet

    rows = workbook_rows(PATH, changed(written(FORTY), {SHEET: dimension}))
    assert [(number, tuple(values)) for number, values in rows] == list(enumerate(FORTY, start=1))


def test_rows_and_cells_without_an_address_follow_one_another() -> None:
    rows = "<row><c><v>1</v></c><c><v>2</v></c></row><row r='4'><c/><c><v>3</v></c></row><row><c><v>4</v></c></row>"
    assert workbook_rows(PATH, of_xml(rows)) == [(1, [1, 2]), (4, [None, 3]), (5, [4, None])]


def test_a_cell_stands_in_the_column_of_its_address() -> None:
    rows = '<row r="2"><c r="C2"><v>3</v></c><c r="A2"><v>1</v></c></row>'
    assert workbook_rows(PATH, of_xml(rows)) == [(2, [1, None, 3])]


DAMAGED = {
    "rows in disorder": ('<row r="5"><c><v>1</v></c></row><row r="3"/>', "row 3 comes after row 5"),
    "a row twice": ('<row r="5"/><row r="5"/>', "row 5 comes after row 5"),
    "a cell twice": ('<row r="1"><c r="A1"/><c r="A1"/></row>', "cells of row 1 have wrong addresses"),
    "a cell of another row": ('<row r="1"><c r="A2"/></row>', "cells of row 1 have wrong addresses"),
    "far too many cells": (f"<row>{'<c/>' * 16385}</row>", "a row of more than 16384 cells"),
    "no string of that number": ('<row><c t="s"><v>7</v></c></row>', "list index out of range"),
}


@pytest.mark.parametrize(("rows", "what"), DAMAGED.values(), ids=DAMAGED)
def test_cells_that_no_program_writes_so(rows: str, what: str) -> None:
    refused(of_xml(rows), f"m.xlsx must be an XLSX workbook, not damaged ({what})")


def test_one_cell_at_the_far_end_of_a_sheet() -> None:
    last = '<dimension ref="A1:XFD1048576"/>'
    refused(
        of_xml('<row r="1048576"><c r="A1048576"><v>1</v></c></row>', last),
        "m.xlsx must end within 50,000 rows, not go on in row 1,048,576",
    )
    refused(
        of_xml('<row r="7"><c r="XFD7"><v>1</v></c></row>', last),
        "m.xlsx must end within 100 columns, not go on in column XFD of row 7",
    )
    assert workbook_rows(PATH, of_xml('<row r="1048576"><c r="XFD1048576" s="0"/></row>', last)) == []


def test_the_last_row_and_the_last_column_within_the_limits() -> None:
    (row,) = workbook_rows(PATH, of_xml(f'<row r="{MAX_ROWS}"><c r="CV{MAX_ROWS}"><v>1</v></c></row>'))
    assert row == (MAX_ROWS, [*[None] * (MAX_COLUMNS - 1), 1])


TOO_LARGE = (
    "m.xlsx must unpack to at most 16 MiB with 1,500,000 XML tags, not more; "
    "keep the measurements in a workbook of their own, without pictures and other sheets"
)


@pytest.mark.parametrize("part", [SHEET, STYLES, "docProps/core.xml"])
def test_a_small_file_that_unpacks_to_a_large_one(part: str) -> None:
    content = changed(written(FORTY), {part: lambda old: old + b" " * MAX_UNPACKED})
    assert len(content) < 100_000
    refused(content, TOO_LARGE)


def test_a_sheet_of_more_tags_than_one_can_wait_for() -> None:
    content = of_xml("<a/>" * MAX_TAGS)
    assert len(content) < 20_000
    refused(content, TOO_LARGE)


ENTITIES = '<?xml version="1.0" encoding="{}"?><!DOCTYPE x [<!ENTITY a "{}">]>'
TYPED = "m.xlsx must be a workbook of plain XML, not define a document type: no spreadsheet program does"


@pytest.mark.parametrize("part", [SHEET, STYLES, "xl/workbook.xml", "docProps/core.xml", "[Content_Types].xml"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "iso-8859-1"])
def test_a_document_type_in_any_part_and_encoding(part: str, encoding: str) -> None:
    def typed(old: bytes) -> bytes:
        body = old.decode().partition("?>")[2] if old.startswith(b"<?xml") else old.decode()
        return (ENTITIES.format(encoding, "a" * 100) + body).encode(encoding)

    refused(changed(written(FORTY), {part: typed}), TYPED)


def test_entities_that_expand_to_gigabytes_are_not_expanded() -> None:
    cells = "".join(f'<row r="{k}"><c r="A{k}" t="inlineStr"><is><t>{"&a;" * 10}</t></is></c></row>' for k in (1, 2))
    content = of_xml(cells)
    bomb = changed(content, {SHEET: lambda old: ENTITIES.format("utf-8", "a" * 200_000).encode() + old})
    assert len(bomb) < 20_000
    refused(bomb, TYPED)


def test_an_encoding_that_cannot_be_looked_into() -> None:
    part = {STYLES: lambda old: b'<?xml version="1.0" encoding="no-such"?>' + old.partition(b"?>")[2]}
    with pytest.raises(
        SpecificationError, match=r"^m.xlsx must be an XLSX workbook, not damaged \(unknown encoding: .*\)$"
    ):
        workbook_rows(PATH, changed(written(FORTY), part))


def test_a_part_that_is_larger_than_the_archive_states() -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("part", b" " * (MAX_UNPACKED + 1))
    size = (MAX_UNPACKED + 1).to_bytes(4, "little")
    assert buffer.getvalue().count(size) == 2
    refused(
        buffer.getvalue().replace(size, (1000).to_bytes(4, "little")),
        "m.xlsx must be an XLSX workbook, not damaged (Bad CRC-32 for file 'part')",
    )


def test_sizes_are_counted_not_taken_from_the_archive(monkeypatch: pytest.MonkeyPatch) -> None:
    content = written(FORTY)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        unpacked = sum(len(archive.read(name)) for name in archive.namelist())
    monkeypatch.setattr(workbook, "MAX_UNPACKED", unpacked)
    assert len(workbook_rows(PATH, content)) == 40
    monkeypatch.setattr(workbook, "MAX_UNPACKED", unpacked - 1)
    refused(content, TOO_LARGE.replace("16 MiB", "0 MiB"))


def test_compression_that_workbooks_do_not_have() -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("part", b"")
    refused(
        buffer.getvalue(),
        "m.xlsx must be an XLSX workbook, not damaged (part is compressed in a way that workbooks are not)",
    )


def test_chart_sheets_and_hidden_sheets_are_passed_over() -> None:
    book = openpyxl.Workbook()
    book.active.append([1, 2, 3])
    hidden = book.create_sheet("hidden", 0)
    hidden.append([4, 5, 6])
    hidden.sheet_state = "hidden"
    book.create_chartsheet("curve", 0).add_chart(LineChart())
    book.active = 2
    assert workbook_rows(PATH, saved(book)) == [(1, [1, 2, 3])]


def test_a_workbook_of_charts_alone() -> None:
    book = openpyxl.Workbook()
    book.create_chartsheet("curve")
    book.remove(book.active)
    refused(saved(book), "m.xlsx must hold a visible worksheet, not only charts or hidden sheets")


def test_workbooks_of_another_kind() -> None:
    refused(
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(504),
        "m.xlsx must be an XLSX workbook without a password, not an encrypted or older one",
    )


def test_the_stored_value_of_a_formula() -> None:
    rows = (
        "<row><c><f>A2+1</f><v>5.5</v></c><c><f>A2+1</f><v/></c><c><f t='shared' si='0'/></c>"
        "<c t='str'><f>T(A9)</f><v></v></c><c t='str'><f>T(A8)</f><v>x</v></c>"
        "<c t='e'><f>1/0</f><v>#DIV/0!</v></c></row>"
    )
    ((_, values),) = workbook_rows(PATH, of_xml(rows))
    assert values == [5.5, UNCALCULATED, UNCALCULATED, None, "x", "#DIV/0!"]


def test_dates_by_the_format_of_their_cells() -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append([datetime.date(2024, 3, 1), datetime.datetime(2024, 3, 1, 6), datetime.time(6), 45352])
    sheet.append([45352, 45352, 0.25, 45352])
    sheet["A2"].number_format = 'dd"."mm"."yyyy'
    sheet["B2"].number_format = "[h]:mm"
    sheet["C2"].number_format = "0 %"
    first, second = workbook_rows(PATH, saved(book))
    day = datetime.datetime(2024, 3, 1)
    assert first == (1, [day, day.replace(hour=6), datetime.time(6), 45352])
    assert second == (2, [day, datetime.timedelta(days=45352), 0.25, 45352])


def test_dates_of_the_calendar_from_1904() -> None:
    book = openpyxl.Workbook()
    book.epoch = openpyxl.utils.datetime.CALENDAR_MAC_1904
    book.active.append([datetime.datetime(2024, 3, 1)])
    assert workbook_rows(PATH, saved(book)) == [(1, [datetime.datetime(2024, 3, 1)])]


def test_only_the_first_of_merged_cells_has_a_value() -> None:
    book = openpyxl.Workbook()
    book.active.append([1, 2])
    book.active.append([1, 3])
    book.active.merge_cells("A1:A2")
    assert workbook_rows(PATH, saved(book)) == [(1, [1, 2]), (2, [None, 3])]


def test_hidden_rows_and_columns_are_read() -> None:
    book = openpyxl.load_workbook(io.BytesIO(written(FORTY)))
    book.active.row_dimensions[3].hidden = True
    book.active.column_dimensions["B"].hidden = True
    assert [tuple(values) for _, values in workbook_rows(PATH, saved(book))] == FORTY


def test_a_number_stored_as_text_stays_a_text() -> None:
    assert workbook_rows(PATH, written([["5.5", 5.5]])) == [(1, ["5.5", 5.5])]


@pytest.mark.parametrize("part", [STYLES, "docProps/core.xml", "xl/theme/theme1.xml"])
def test_what_does_not_concern_the_cells_need_not_be_right(part: str) -> None:
    def spoilt(content: bytes) -> bytes:
        return content.replace(b'rgb="', b'rgb="no colour').replace(b"2026", b"soon").replace(b"<a:", b"<b:")

    assert len(workbook_rows(PATH, changed(written(FORTY), {part: spoilt}))) == 40


def test_a_workbook_without_styles() -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(written(FORTY))) as old, zipfile.ZipFile(buffer, "w") as new:
        for name in old.namelist():
            if name != STYLES:
                new.writestr(name, old.read(name))
    assert len(workbook_rows(PATH, buffer.getvalue())) == 40
