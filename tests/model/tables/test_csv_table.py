"""Strict CSV reading: every way a file can be wrong is refused with file, line and cure."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sosmith.model.errors import SpecificationError
from sosmith.model.tables import csv_table
from sosmith.model.tables.csv_table import read_csv_table


def test_reads_numbers_in_any_column_order(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes("\ufeffb, a\r\n1, -2.5e-1\r\n\r\n.5,3.\r\n \t\r\n".encode())
    table = read_csv_table(path, ["a", "b", "c"], required=["a"])
    assert table.column("a").tolist() == [-0.25, 3.0]
    assert table.column("b").tolist() == [1.0, 0.5]
    assert table.lines.tolist() == [2, 4]
    assert "b" in table
    assert "c" not in table


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", " must hold a header line and rows of numbers, not be empty"),
        (b"\n\n", " must hold a header line and rows of numbers, not be empty"),
        (b"a,b\n", " must hold rows of numbers below its header, not only the header"),
        (b"a,x\n1,2\n", ", line 1: column must be one of a, b, c, not 'x'"),
        (
            b"a;b\n1,5;2\n",
            ", line 1: cells must be separated by commas, with decimal points, not by semicolons",
        ),
        (b"a\tb\n1\t2\n", ", line 1: cells must be separated by commas, with decimal points, not by tabs"),
        (b"a,\n1,2\n", ", line 1: column must be one of a, b, c, not ''"),
        (b"a,b,a\n1,2,3\n", ", line 1: column a must appear once, not 2 times"),
        (b"b\n1\n", ", line 1: column a must be present, not missing from b"),
        (b"a,b\n1,2\n1,2,3\n", ", line 3: row must have 2 cells, not 3"),
        (b"a,b\n1,2\n1\n", ", line 3: row must have 2 cells, not 1"),
        (b"a,b\n1,two\n", ", line 2: b must be a finite number, not 'two'"),
        (b"a,b\n1,\n", ", line 2: b must be a finite number, not ''"),
        (b"a,b\n1,2\n,\n", ", line 3: a must be a finite number, not ''"),
        (b"a,b\n ,\n1,2\n", ", line 2: a must be a finite number, not ''"),
        (b",\na,b\n1,2\n", ", line 1: column must be one of a, b, c, not ''"),
        (b"a,b\n1,nan\n", ", line 2: b must be a finite number, not 'nan'"),
        (b"a,b\n1,2\n-inf,2\n", ", line 3: a must be a finite number, not '-inf'"),
        (b"a,b\n1,1e999\n", ", line 2: b must be a finite number, not '1e999'"),
        (b"a,b\n1,1e101\n", ", line 2: b must be from -1e+100 to 1e+100, not '1e101'"),
        (b"a,b\n1," + b"9" * 400 + b"\n", f", line 2: b must be a finite number, not '{'9' * 56}' ..."),
        (b"a,b\n1_0,2\n", ", line 2: a must be a finite number, not '1_0'"),
        ("a,b\n1,٣\n".encode(), ", line 2: b must be a finite number, not '٣'"),
        (b"a,b\n1;5,2\n", ", line 2: a must be a finite number, not '1;5'"),
        (b"a,b\n1,2\n3,\xb5\n", ", line 3: text must be UTF-8, not contain the byte 0xb5"),
        (b'a,b\n1,"2\n', ", line 2: row must be valid CSV, not broken (unexpected end of data)"),
    ],
)
def test_refusals(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(path) + message)}$"):
        read_csv_table(path, ["a", "b", "c"], required=["a"])


def test_a_long_cell_is_quoted_in_part_by_the_reader_of_its_column(tmp_path: Path) -> None:
    def reader(text: str) -> float:
        raise ValueError("a date")

    path = tmp_path / "t.csv"
    path.write_text(f"a\n{'9' * 400}\n")
    message = f"^{re.escape(str(path))}, line 2: a must be a date, not '9{{56}}' \\.\\.\\.$"
    with pytest.raises(SpecificationError, match=message):
        read_csv_table(path, ["a"], readers={"a": reader})


def test_missing_file_and_folder(tmp_path: Path) -> None:
    for path, reason in ((tmp_path / "none.csv", "no such file or directory"), (tmp_path, "is a directory")):
        message = f"{path} must be a readable CSV file ({reason})"
        with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
            read_csv_table(path, ["a"])


TEXTS = [
    "a\n1\n2\n3\n4\n5",
    "a,b\n1,2\n\n3,4\n  \n5,6\n",
    'a,b\r\n1,2\r\n"3",4\r\n5, 6\r\n',
    'a,b\n1,2\n"3\n",4\n5,6\n7,8\n',
    "a,b\n1,2\n3,4,5,6\n7\n",
    "a,b\n1,2,3\n4\n",
    "a\n1\n2\nnan\n4\n",
    "a\n1\n1_0\n",
    "a\n1\n1e101\n",
    "a\n1 2\n",
    "a\n1\n+-1\n",
]


def outcome(path: Path) -> object:
    try:
        table = read_csv_table(path, ["a", "b"])
    except SpecificationError as error:
        return str(error)
    return table.header, table.values.tolist(), table.lines.tolist()


@pytest.mark.parametrize("text", TEXTS)
def test_rows_are_the_same_however_many_are_read_at_once(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode())
    found = []
    for chunk in (1, 2, 3, 100):
        monkeypatch.setattr(csv_table, "CHUNK", chunk)
        found.append(outcome(path))
    monkeypatch.setattr(csv_table, "_plain_numbers", lambda lines, columns: None)
    assert found == [outcome(path)] * 4
