"""The gate for files of others: bytes, texts, lines and JSON within limits, and a sentence for what is beyond."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sosmith.model import foreign_files
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import read_bytes, read_json, read_lines, read_text


@pytest.fixture(autouse=True)
def pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Read some bytes at a time, so that pieces end everywhere."""
    monkeypatch.setattr(foreign_files, "_PIECE", 3)


def refused(path: Path) -> str:
    with pytest.raises(SpecificationError) as told:
        list(read_lines(path, what="CSV file"))
    return str(told.value).removeprefix(str(path))


@pytest.mark.parametrize(
    ("content", "lines"),
    [
        ("", []),
        ("a", ["a"]),
        ("a\nb\n", ["a\n", "b\n"]),
        ("abc\r\ndef\r\n\r\n", ["abc\r\n", "def\r\n", "\r\n"]),
        ("a\rb\rcdef", ["a\r", "b\r", "cdef"]),
        ("\ufeffäöü\n€\u2028x\n", ["äöü\n", "€\u2028x\n"]),
    ],
)
def test_lines_are_those_of_the_text(content: str, lines: list[str], tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(content.encode())
    assert list(read_lines(path, what="CSV file")) == lines


def test_what_no_line_may_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b"one\ntwo\nth\xffree\n")
    assert refused(path) == ", line 3: text must be UTF-8, not contain the byte 0xff"
    path.write_bytes("one\nä".encode()[:-1])
    assert refused(path) == ", line 2: text must be UTF-8, not contain the byte 0xc3"
    monkeypatch.setattr(foreign_files, "MAX_LINE", 5)
    path.write_bytes(b"1234\n12345\n")
    assert refused(path) == ", line 2: a line must have at most 5 characters, not more"
    path.write_bytes(b"1234\n" * 3)
    monkeypatch.setattr(foreign_files, "MAX_LINES", 3)
    assert len(list(read_lines(path, what="CSV file"))) == 3
    path.write_bytes(b"1234\n" * 3 + b"1")
    assert refused(path) == " must end within 3 lines, not go on"
    assert refused(tmp_path / "none") == " must be a readable CSV file (no such file or directory)"


def test_bytes_and_texts(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"\xef\xbb\xbfa\r\n")
    assert read_bytes(path, what="the file", max_bytes=6) == b"\xef\xbb\xbfa\r\n"
    assert read_text(path, what="the file", max_bytes=6) == "\ufeffa\r\n"
    for place, message in {
        path: f"{path}: the file must be at most 5 bytes, not longer",
        tmp_path: f"{tmp_path}: the file must be a readable file, not: is a directory",
        Path("\0"): "'\\x00' must be the path of a file, not an impossible one",
    }.items():
        with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
            read_bytes(place, what="the file", max_bytes=5)
    path.write_bytes(b"a\n\xff")
    with pytest.raises(SpecificationError, match=r"a: line 2 must be UTF-8 text, not the byte 0xff$"):
        read_text(path, what="the file", max_bytes=6)


@pytest.mark.parametrize("text", ["", "[1", "[" * 100_000, "1" * 5000])
def test_what_is_no_json_is_nothing(text: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(text)
    assert read_json(path, what="the file") is None
    path.write_text('{"a": [1]}')
    assert read_json(path, what="the file") == {"a": [1]}
