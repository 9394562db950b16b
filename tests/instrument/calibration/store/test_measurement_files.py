"""Files of measurements: each bad row is refused with its line and the reason, in CSV and XLSX alike."""

from __future__ import annotations

import datetime
import re
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import openpyxl
import pytest

from sosmith.instrument.calibration.store.measurement_files import (
    MAX_BYTES,
    MeasurementFile,
    parse_date,
    read_measurement_file,
)
from sosmith.model.errors import SpecificationError
from sosmith.model.tables.workbook import MAX_ROWS

HEADER = ("clearance_mm", "voltage_V", "temperature_C")
DAY = "2024-03-01"
GOOD = (5.0, 5.5, 20.5)


def write(path: Path, rows: Sequence[Sequence[Any]]) -> Path:
    if path.suffix == ".csv":
        texts = [",".join("" if cell is None else str(cell) for cell in row) for row in rows]
        path.write_text("\n".join([*texts, ""]))
    else:
        book = openpyxl.Workbook()
        for row in rows:
            book.active.append(list(row))
        book.save(path)
    return path


def read(path: Path, rows: Sequence[Sequence[Any]]) -> MeasurementFile:
    return read_measurement_file(write(path, rows), DAY)


@pytest.fixture(params=["m.csv", "m.xlsx"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return tmp_path / str(request.param)


def test_good_rows_of_columns_in_any_order(path: Path) -> None:
    rows = [("temperature_C", "clearance_mm", "voltage_V"), (20, 0, 0.5), (None, None, None), (98.25, 10, 9.4)]
    file = read(path, rows)
    assert [(one.line, one.date, one.values) for one in file.readings] == [
        (2, DAY, (0.0, 0.5, 20.0)),
        (4, DAY, (10.0, 9.4, 98.25)),
    ]
    assert file.refusals == ()


def test_dates_of_their_own(path: Path) -> None:
    day = "2023-12-31" if path.suffix == ".csv" else datetime.datetime(2023, 12, 31, 14, 5)
    file = read(path, [(*HEADER, "date"), (*GOOD, day), (6, 6, 21, "31.12.2023"), (7, 7, 21, None)])
    assert [one.date for one in file.readings] == ["2023-12-31"]
    assert [(one.line, one.reason) for one in file.refusals] == [
        (3, "date must be a date such as 2024-03-01, not '31.12.2023'"),
        (4, "date must be a date such as 2024-03-01, not ''"),
    ]


BAD = {
    "millivolts": ((5, 5500, 20), "voltage_V must be 0 to 10 V, not 5500 (in millivolts?)"),
    "micrometres": ((5250, 5.5, 20), "clearance_mm must be 0 to 16 mm, not 5250 (in micrometres?)"),
    "kelvins": ((5, 5.5, 293.15), "temperature_C must be 0 to 128 C, not 293.15 (in kelvins?)"),
    "Fahrenheit": ((5, 5.5, 176), "temperature_C must be 0 to 128 C, not 176 (in degrees Fahrenheit?)"),
    "swapped": (
        (5, 20.5, 5.5),
        "voltage_V must be 0 to 10 V, not 20.5 (columns voltage_V and temperature_C swapped?)",
    ),
    "text": (("five", 5.5, 20), "clearance_mm must be a finite number, not the text 'five'"),
    "unit": ((5, "5.5 V", 20), "voltage_V must be a finite number, not the text '5.5 V'"),
    "not a number": ((5, "nan", 20), "voltage_V must be a finite number, not the text 'nan'"),
    "empty": ((5, None, 20), "voltage_V must be a finite number, not empty"),
    "negative": ((-0.5, 5.5, 20), "clearance_mm must be 0 to 16 mm, not -0.5"),
    "far out of two ranges": (
        (5, -1, 1000),
        "voltage_V must be 0 to 10 V, not -1; temperature_C must be 0 to 128 C, not 1000",
    ),
    "duplicate": ((5.0, 5.5, "20.5"), "row must be a new measurement, not a duplicate of line 2"),
    "too long": ((5, 5.5, 20, 1), "row must have 3 cells, not 4"),
}


@pytest.mark.parametrize(("row", "reason"), BAD.values(), ids=BAD)
def test_a_bad_row_is_refused_and_the_others_are_not(row: Sequence[Any], reason: str, path: Path) -> None:
    if path.suffix == ".xlsx" and row[2] == "20.5":
        row = (5, 5.5, 20.5)
    file = read(path, [HEADER, GOOD, row, (1, 1.5, 30)])
    assert [(one.line, one.reason) for one in file.refusals] == [(3, reason)]
    assert [one.line for one in file.readings] == [2, 4]


@pytest.mark.parametrize(
    ("cell", "shown"),
    [
        ("5.5", "the text '5.5'"),
        (True, "True"),
        (datetime.datetime(2024, 3, 1), "2024-03-01 00:00:00"),
        ("#DIV/0!", "the text '#DIV/0!'"),
        ("=5+A1", "a formula without a stored value (open the workbook in a spreadsheet program and save it)"),
    ],
)
def test_cells_of_a_workbook_that_are_no_numbers(cell: Any, shown: str, tmp_path: Path) -> None:
    file = read(tmp_path / "m.xlsx", [HEADER, GOOD, (1, cell, 20)])
    assert [one.reason for one in file.refusals] == [f"voltage_V must be a finite number, not {shown}"]


def replace_in_parts(path: Path, old: bytes, new: bytes) -> None:
    """Replace bytes wherever they stand in the parts of a workbook."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    assert any(old in content for content in parts.values())
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content.replace(old, new))


def test_rows_beyond_the_range_that_a_sheet_states(tmp_path: Path) -> None:
    good = [(k / 4, k / 5, 20 + k) for k in range(40)]
    path = write(tmp_path / "m.xlsx", [HEADER, *good, ("five", 5.5, 20)])
    replace_in_parts(path, b'ref="A1:C42"', b'ref="A1:C21"')
    file = read_measurement_file(path, DAY)
    assert [one.values for one in file.readings] == good
    assert [(one.line, one.reason) for one in file.refusals] == [
        (42, "clearance_mm must be a finite number, not the text 'five'")
    ]


def test_a_formula_for_a_date_without_a_stored_value(tmp_path: Path) -> None:
    file = read(tmp_path / "m.xlsx", [(*HEADER, "date"), (*GOOD, "=TODAY()")])
    assert [one.reason for one in file.refusals] == [
        "date must be a date such as 2024-03-01, not a formula without a stored value "
        "(open the workbook in a spreadsheet program and save it)"
    ]


def test_formulas_without_values_are_no_blank_row(tmp_path: Path) -> None:
    file = read(tmp_path / "m.xlsx", [HEADER, GOOD, ("=A2", "=B2", "=C2")])
    assert [one.line for one in file.refusals] == [3]


def test_cells_below_the_first_of_merged_ones_are_empty(tmp_path: Path) -> None:
    path = write(tmp_path / "m.xlsx", [HEADER, GOOD, (1, 1.5, 20.5), (2, 2.5, 30)])
    book = openpyxl.load_workbook(path)
    book.active.merge_cells("C2:C3")
    book.save(path)
    file = read_measurement_file(path, DAY)
    assert [one.line for one in file.readings] == [2, 4]
    assert [(one.line, one.reason) for one in file.refusals] == [
        (3, "temperature_C must be a finite number, not empty")
    ]


def test_a_workbook_with_a_number_that_no_double_holds(tmp_path: Path) -> None:
    path = write(tmp_path / "m.xlsx", [HEADER, GOOD, (1, 12345, 20)])
    digits = "9" * 400
    replace_in_parts(path, b"<v>12345</v>", f"<v>{digits}</v>".encode())
    file = read_measurement_file(path, DAY)
    assert [one.reason for one in file.refusals] == [f"voltage_V must be a finite number, not {digits}"]


def refused(path: Path, message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(path) + message)}$"):
        read_measurement_file(path, DAY)


HEADERS = {
    "nameless": (
        ("clearance_mm", None, "voltage_V", "temperature_C"),
        ", line 1: column must be one of clearance_mm, voltage_V, temperature_C, date, uncertainty_mm, uncertainty_V, "
        "uncertainty_C, with the unit in its name, "
        "not ''",
    ),
    "no unit": (
        ("clearance", "voltage_V", "temperature_C"),
        ", line 1: column must be one of clearance_mm, voltage_V, temperature_C, date, uncertainty_mm, uncertainty_V, "
        "uncertainty_C, with the unit in its name, "
        "not 'clearance'",
    ),
    "other unit": (
        ("clearance_mm", "voltage_mV", "temperature_C"),
        ", line 1: column must be one of clearance_mm, voltage_V, temperature_C, date, uncertainty_mm, uncertainty_V, "
        "uncertainty_C, with the unit in its name, "
        "not 'voltage_mV'",
    ),
    "semicolons": (
        ("clearance_mm;voltage_V;temperature_C",),
        ", line 1: cells must be separated by commas, with decimal points, not by semicolons",
    ),
    "missing": (
        ("clearance_mm", "voltage_V"),
        ", line 1: column temperature_C must be present, not missing from clearance_mm, voltage_V",
    ),
    "twice": (
        ("clearance_mm", "voltage_V", "voltage_V"),
        ", line 1: column voltage_V must appear once, not 2 times",
    ),
}


@pytest.mark.parametrize(("header", "message"), HEADERS.values(), ids=HEADERS)
def test_headers_that_say_something_else(header: Sequence[str], message: str, path: Path) -> None:
    refused(write(path, [header, GOOD]), message)


def test_nothing_to_read(path: Path) -> None:
    refused(path, " must be a readable CSV or XLSX file (no such file or directory)")
    refused(write(path, [HEADER]), " must hold rows of numbers below its header, not only the header")
    refused(write(path, []), ", line 1: header must be clearance_mm,voltage_V,temperature_C, not empty")


def test_other_kinds_of_files(tmp_path: Path) -> None:
    refused(
        write(tmp_path / "m.csv", [HEADER]).rename(tmp_path / "m.ods"),
        ": the file's name must end in .csv or .xlsx, not .ods",
    )
    latin = tmp_path / "latin.csv"
    latin.write_bytes(b"clearance_mm,voltage_V,temperature_C\n1,2,20\xb0\n")
    refused(latin, ", line 2: text must be UTF-8, not contain the byte 0xb0")
    broken = tmp_path / "quote.csv"
    broken.write_text(",".join(HEADER) + '\n1,"2,3\n')
    refused(broken, ", line 2: row must be valid CSV, not broken (unexpected end of data)")


def test_damaged_workbooks(tmp_path: Path) -> None:
    path = tmp_path / "m.xlsx"
    path.write_bytes(b"no workbook")
    refused(path, " must be an XLSX workbook, not damaged (File is not a zip file)")
    whole = write(path, [HEADER, *((k, k, 20) for k in range(9))]).read_bytes()
    for length in range(0, len(whole), 97):
        path.write_bytes(whole[:length])
        with pytest.raises(SpecificationError, match=r" must be an XLSX workbook, not damaged \("):
            read_measurement_file(path, DAY)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("word/document.xml", "<a/>")
    with pytest.raises(SpecificationError, match=r" must be an XLSX workbook, not damaged \("):
        read_measurement_file(path, DAY)


@pytest.mark.slow
def test_files_of_more_than_anyone_measures(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    header = ",".join(HEADER) + "\n"
    rows = "".join(f"5,5.5,{k}\n" for k in range(1, MAX_ROWS))
    path.write_text(header + rows)
    file = read_measurement_file(path, DAY)
    assert len(file.readings) + len(file.refusals) == MAX_ROWS - 1
    path.write_text(header + rows + "5,5.5,20\n")
    refused(path, " must end within 50,000 rows, not go on in row 50,001")
    with path.open("wb") as file_of_zeros:
        file_of_zeros.truncate(MAX_BYTES + 1)
    refused(path, " must have at most 16 MiB, not more")


def test_a_long_text_is_quoted_in_part(tmp_path: Path) -> None:
    file = read(tmp_path / "m.csv", [HEADER, ("x" * 1000, 5.5, 20)])
    assert [one.reason for one in file.refusals] == [
        f"clearance_mm must be a finite number, not the text '{'x' * 56}' ..."
    ]


def test_minus_zero_is_zero_and_hashes_tell_sensors_and_days_apart(tmp_path: Path) -> None:
    one = read(tmp_path / "m.csv", [HEADER, ("-0.0", "0", "20"), ("0", "-0", "20")])
    assert [refusal.line for refusal in one.refusals] == [3]
    (reading,) = one.readings
    hashes = {
        reading.sha256("a"),
        reading.sha256("b"),
        read_measurement_file(one.path, "2024-03-02").readings[0].sha256("a"),
    }
    assert len(hashes) == 3


@pytest.mark.parametrize("text", ["", "2024-3-1", "20240301", "2024-02-30", "today"])
def test_days_are_written_one_way(text: str) -> None:
    with pytest.raises(
        SpecificationError, match=f"^{re.escape(f'date must be a date such as 2024-03-01, not {text!r}')}$"
    ):
        parse_date(text)
