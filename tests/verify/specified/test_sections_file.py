"""The verifier's own reader of files of sections finds the rows that were written, in each kind of file."""

import io
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from sosmith.verify.graph import RejectedError
from sosmith.verify.specified.sections_file import sections_in

ROWS = [[0.25, 0.5, 0.25, 1.0, -1.5, 0.75], [1.0, -2.0, 1.0, 2.0, -3.0, 1.5]]
SECTIONS = tuple(tuple(Fraction(value) / Fraction(row[3]) for value in row) for row in ROWS)


def npy() -> bytes:
    file = io.BytesIO()
    np.save(file, ROWS)
    return file.getvalue()


def mat(*, compressed: bool) -> bytes:
    """Make a MAT file whose scale values undo what its first row was divided by."""
    file = io.BytesIO()
    rows = np.array(ROWS)
    rows[0, :3] /= 0.25
    scipy.io.savemat(file, {"SOS": rows, "G": [0.25, 0.5, 2.0]}, do_compression=compressed)
    return file.getvalue()


TEXT = "b0,b1,b2,a0,a1,a2\n# two sections\n" + "".join(",".join(map(repr, row)) + "\n" for row in ROWS)
NEGATED = "".join(" ".join(map(repr, [*row[:4], -row[4], -row[5]])) + "\n" for row in ROWS)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("f.npy", npy()),
        ("f.mat", mat(compressed=False)),
        ("f.mat", mat(compressed=True)),
        ("f.csv", TEXT.encode()),
        ("f.txt", NEGATED.encode()),
    ],
)
def test_rows(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    assert sections_in(tmp_path / name) == SECTIONS


@pytest.mark.parametrize("cell", ["nan", "1e401", "1e-401", "x"])
def test_a_number_that_is_none_is_refused(cell: str, tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_text(f"1,{cell},0,1,-0.5,0\n")
    with pytest.raises(RejectedError, match=r"^filter\.sos_file must be a file of sections that can be read, not: "):
        sections_in(tmp_path / "f.csv")


def test_rows_of_another_length_are_refused(tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_text("1,0,0,-0.5,0\n")
    with pytest.raises(RejectedError, match=r"^filter\.sos_file must have rows of six numbers to be compared, "):
        sections_in(tmp_path / "f.csv")
