"""Files made to take all memory, or for ever, of each format that is read: each ends in a sentence, in little."""

from __future__ import annotations

import io
import json
import os
import re
import struct
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sosmith.gen.calibration.fit import read_measurements
from sosmith.gen.report.comparison.report_file import load_report
from sosmith.gen.specification import specification
from sosmith.gen.specification.coefficients.filter_file import read_filter_file
from sosmith.host.identity_check import check_files
from sosmith.host.loading import read_set
from sosmith.instrument.calibration import measurement_store
from sosmith.instrument.calibration.store.measurement_files import read_measurement_file
from sosmith.instrument.scenarios.file import load_scenario
from sosmith.instrument.wear.record_file import read_wear_record
from sosmith.model import foreign_files
from sosmith.model.errors import SosmithError, SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.model.tables import csv_table
from sosmith.model.traces import wav_file
from sosmith.model.traces.signal_file import read_signal_file
from sosmith.model.traces.trace_file import read_traces
from sosmith.sim.exploration import record
from tests.host.lines import plain_device

LIMIT = 64 << 20
"""Most bytes that a reader may take for a bomb of its format."""

PORT = Port(name="x", bits=16, signed=True, lsb=Fraction(1), zero=Fraction(0), unit="")


@contextmanager
def little_memory(limit: int = LIMIT) -> Iterator[None]:
    """Hold what Python and NumPy take within against `limit`, in bytes."""
    tracemalloc.start()
    try:
        yield
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < limit


def npy(shape: str, kind: str = "<f8", extra: int = 0) -> bytes:
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(117 + extra) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header


def npz(content: bytes, way: int = zipfile.ZIP_DEFLATED) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", way) as archive:
        archive.writestr("sos.npy", content)
    return file.getvalue()


def mat(count: int, size: int) -> bytes:
    """Make a MAT file of `count` variables that unpack to `size` bytes each."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    parts = []
    for k in range(count):
        numbers = element(9, bytes(size))
        names = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<ii", size // 8, 1))
        packed = zlib.compress(element(14, names + element(1, b"v%03d" % k) + numbers), 1)
        parts.append(struct.pack("<II", 15, len(packed)) + packed)
    return b"MATLAB 5.0".ljust(124) + struct.pack("<H", 0x0100) + b"IM" + b"".join(parts)


SLOW = pytest.mark.slow
LARGE = {"one line as long as may be.csv", "a million"}
"""Bombs of the largest size that is read, with smaller ones of their kind beside them."""

DEEP = b"[" * 100_000
LONG = b"1" * 5_000
KEYS = b".".join([b"a"] * 40_000)
FILTERS: dict[str, bytes | Callable[[], bytes]] = {
    "more numbers than there are.npy": npy("(1000000000, 6)"),
    "a number of a gigabyte.npy": npy("(1, 6)", "<V1000000000"),
    "more numbers than there are.npz": npz(npy("(1000000000, 6)")),
    "zeros.npz": lambda: npz(npy("(600, 6)") + bytes(80 << 20)),
    "zeros by another way.npz": lambda: npz(npy("(600, 6)") + bytes(8 << 20), zipfile.ZIP_BZIP2),
    "many variables.mat": lambda: mat(25, 4_000_000),
    "one variable.mat": lambda: mat(1, 80 << 20),
    "depth.json": DEEP,
    "digits.json": b'{"sos": [[' + LONG + b"]]}",
    "exponent.json": b'{"sos": [[1e999999999, 0, 0, 1, 0, 0]]}',
    "depth.toml": b"poles = " + DEEP,
    "digits.toml": b"gain = " + LONG,
    "exponent.toml": b"gain = 1e999999999\npoles = []",
    "keys.toml": KEYS + b" = 1",
    "digits.txt": LONG,
    "one line.csv": b"1," * 50_000,
    "one line as long as may be.csv": b"1," * 500_000,
    "exponent.csv": b"1e999999999,0,0,1,0,0\n",
    "a gigabyte.csv": b"",
}


def write(path: Path, content: bytes | Callable[[], bytes]) -> None:
    """Write a file; one of nothing becomes a gigabyte of zeros, as a hole, which takes no room."""
    path.write_bytes(content() if callable(content) else content)
    if not content:
        os.truncate(path, 1 << 30)


@pytest.mark.sweep(6)
@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW if name in LARGE else ()) for name in FILTERS])
def test_filters(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    write(path, FILTERS[name])
    with little_memory(), pytest.raises(SpecificationError) as told:
        read_filter_file(path)
    one_sentence(told.value, path)


def one_sentence(error: SosmithError, path: Path) -> None:
    text = str(error)
    assert text.startswith(str(path))
    assert " must " in text
    assert len(text) < 2000
    assert all(line.isprintable() for line in text.split("\n"))  # a specification has a line for each error


ROWS = b"".join(b"%d\n" % (n % 1000) for n in range(20_000))
TABLES: dict[str, bytes] = {
    "a line without an end": b"x_code\n" + b"1," * 100_000,
    "a quote without an end": b'x_code\n"' + b"1\n" * 200_000,
    "a header without an end": b"x_code," * 100_000,
    "digits": b"x_code\n" + LONG * 10,
    "more rows than may be": b"x_code\n" + ROWS,
    "zeros": b"",
}
READERS: dict[str, Callable[[Path], Any]] = {
    "trace": lambda path: read_traces(path, (PORT,), Fraction(100)),
    "signals": lambda path: read_signal_file(path, Polynomial.from_numbers([[1.0]]), ["x_code"]),
    "record of wear": lambda path: read_wear_record(path, "x_code"),
    "measurements to fit": read_measurements,
}


@pytest.mark.sweep(5)
@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("name", TABLES)
def test_tables(name: str, reader: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreign_files, "MAX_LINES", 10_000)
    path = tmp_path / "bomb.csv"
    write(path, TABLES[name])
    with little_memory(16 << 20), pytest.raises(SpecificationError) as told:
        READERS[reader](path)
    one_sentence(told.value, path)


def test_the_last_row_that_may_be_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreign_files, "MAX_LINES", 20_001)
    path = tmp_path / "trace.csv"
    path.write_bytes(TABLES["more rows than may be"])
    (trace,) = read_traces(path, (PORT,), Fraction(100))
    assert len(trace) == 20_000
    path.write_bytes(TABLES["more rows than may be"] + b"1\n")
    with pytest.raises(SpecificationError, match=r"trace\.csv must end within 20,001 lines, not go on$"):
        read_traces(path, (PORT,), Fraction(100))


def test_tables_that_are_kept_whole_have_a_limit_of_cells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_table, "MAX_CELLS", 100)
    path = tmp_path / "signals.csv"
    path.write_text("a,b\n" + "1,2\n" * 51)
    with pytest.raises(SpecificationError, match=r"csv, line 52: the table must have at most 100 cells, not go on$"):
        csv_table.read_csv_table(path, ["a", "b"])


def wav(*chunks: bytes) -> bytes:
    body = b"WAVE" + b"".join(chunks)
    return b"RIFF" + struct.pack("<I", len(body)) + body


FORMAT = b"fmt " + struct.pack("<IHHIIHH", 16, 1, 1, 100, 300, 3, 24)
SOUNDS: dict[str, bytes] = {
    "more samples than there are": wav(FORMAT, b"data\xff\xff\xff\xff", bytes(3)),
    "sizes of 64 bits": wav(b"ds64" + struct.pack("<IQQQI", 28, 1 << 62, 1 << 62, 1 << 60, 0), FORMAT).replace(
        b"RIFF", b"RF64"
    ),
    "chunks": wav(b"LIST\0\0\0\0" * 500_000, FORMAT, b"data\3\0\0\0", bytes(3)),
    "channels": wav(
        FORMAT[:10] + b"\xff\xff" + FORMAT[12:20] + b"\xfd\xff" + FORMAT[22:], b"data\0\0\1\0", bytes(65536)
    ),
    "zeros": b"",
}


@pytest.mark.parametrize("name", SOUNDS)
def test_sounds(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wav_file, "MAX_BYTES", 16 << 20)
    path = tmp_path / "bomb.wav"
    write(path, SOUNDS[name])
    with little_memory(), pytest.raises(SpecificationError) as told:
        wav_file.read_wav(path, (PORT,), Fraction(100))
    one_sentence(told.value, path)


def test_each_byte_of_a_sound_and_each_end(tmp_path: Path) -> None:
    content, path = wav(FORMAT, b"LIST\1\0\0\0xx", b"data\6\0\0\0", bytes(6)), tmp_path / "spoilt.wav"
    changed = [content[:k] + bytes([value]) + content[k + 1 :] for k in range(len(content)) for value in (0, 255)]
    read = 0
    for spoilt in changed + [content[:k] for k in range(len(content))]:
        path.write_bytes(spoilt)
        try:
            wav_file.read_wav(path, (PORT,), Fraction(100))
            read += 1
        except SpecificationError as error:
            one_sentence(error, path)
    assert 0 < read < len(changed)


TREES: dict[str, bytes] = {
    "depth": DEEP,
    "objects in objects": b'{"a":' * 100_000,
    "digits": b'{"a": ' + LONG + b"}",
    "no text": b"\xff\xfe",
    "many": b"[" + b"[]," * 100_000 + b"[]]",
    "a million": b"[" + b"[]," * 1_000_000 + b"[]]",
    "zeros": b"",
}


DOCUMENTS: dict[str, Callable[[Path], Any]] = {
    "report": load_report,
    "set": read_set,
    "manifest": lambda path: check_files(plain_device()._identity, path.parent),
}


@pytest.mark.sweep(6)
@pytest.mark.parametrize("reader", DOCUMENTS)
@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW if name in LARGE else ()) for name in TREES])
def test_json(name: str, reader: str, tmp_path: Path) -> None:
    path = tmp_path / f"{plain_device()._identity.name}.json"
    write(path, TREES[name])
    with little_memory(2 * foreign_files.MAX_JSON), pytest.raises(SpecificationError) as told:
        DOCUMENTS[reader](path)
    one_sentence(told.value, path)


TOML: dict[str, bytes] = {
    "depth": b"a = " + DEEP,
    "digits": b"a = " + LONG,
    "exponent": b"sample_rate = 1e999999999",
    "keys": KEYS + b" = 1",
    "tables": b"".join(b"[" + b".".join(b"a%d" % k for k in range(n % 50)) + b"b%d]\n" % n for n in range(2000)),
    "strings": b"a = '''" + b"x" * (1 << 20),
    "zeros": b"",
}
SPECIFICATIONS: dict[str, Callable[[Path], Any]] = {
    "specification": specification.load,
    "scenario": load_scenario,
}


@pytest.mark.parametrize("reader", SPECIFICATIONS)
@pytest.mark.parametrize("name", TOML)
def test_toml(name: str, reader: str, tmp_path: Path) -> None:
    path = tmp_path / "bomb.toml"
    write(path, TOML[name])
    with little_memory(), pytest.raises(SpecificationError) as told:
        SPECIFICATIONS[reader](path)
    one_sentence(told.value, path)


def workbook(parts: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return file.getvalue()


BOOKS: dict[str, Callable[[], bytes]] = {
    "zeros": lambda: workbook({"xl/worksheets/sheet1.xml": bytes(100 << 20)}),
    "tags": lambda: workbook({"xl/worksheets/sheet1.xml": b"<a/>" * 2_000_000}),
    "entities": lambda: workbook(
        {"xl/workbook.xml": b'<!DOCTYPE a [<!ENTITY b "bbbb"><!ENTITY c "&b;&b;">]><a>&c;</a>'}
    ),
    "a text instead": lambda: json.dumps([[]] * 1000).encode(),
}


@pytest.mark.parametrize("name", BOOKS)
def test_workbooks(name: str, tmp_path: Path) -> None:
    path = tmp_path / "bomb.xlsx"
    path.write_bytes(BOOKS[name]())
    with little_memory(), pytest.raises(SpecificationError) as told:
        read_measurement_file(path, "2024-03-01")
    one_sentence(told.value, path)


def test_arrays_within_the_limits_are_read(tmp_path: Path) -> None:
    rows = np.array([[1.0, 2.0, 1.0, 1.0, -0.5, 0.25]])
    np.save(tmp_path / "f.npy", rows)
    np.savez_compressed(tmp_path / "f.npz", sos=rows)
    assert read_filter_file(tmp_path / "f.npy").rows == read_filter_file(tmp_path / "f.npz").rows  # type: ignore[union-attr]


def test_a_store_of_more_than_anyone_measures(tmp_path: Path) -> None:
    path, size = tmp_path / "a.db", measurement_store.LARGEST + 1
    with path.open("wb") as file:
        file.truncate(size)
    sentence = f"{path}: the store must be at most {measurement_store.LARGEST} bytes, not {size}"
    with (
        pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$"),
        measurement_store.open_store(path),
    ):
        pass


def test_a_record_of_more_than_anyone_explores(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(record, "LARGEST", 1000)
    path = tmp_path / record.FILE
    path.write_bytes(b'{"key": "a"}\n' * 100)
    sentence = f"{path}: the record must be at most 1000 bytes, not longer"
    with pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$"):
        record.Record(0, path)
