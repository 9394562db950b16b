"""Recordings: every row in the file at once, continued after a kill, complete Parquet files."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from sosmith.host.recording import recording
from sosmith.model.errors import SpecificationError

COLUMNS = ("time_s", "clearance_mm", "status")
TEXT = "time_s,clearance_mm,status\n0.0,1.5,0\n0.01,1.25,4\n"


def test_rows_are_in_the_file_at_once(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    with recording(path, COLUMNS) as made:
        made.add([(0.0, 1.5, 0), (0.01, 1.25, 4)])
        assert path.read_text() == TEXT
    assert path.read_text() == TEXT


@pytest.mark.parametrize("torn", ["", "0.02,1.", "0.02" * 3000, "\n"])
def test_a_recording_is_continued_behind_its_last_whole_row(tmp_path: Path, torn: str) -> None:
    path = tmp_path / "rows.csv"
    path.write_text(TEXT + torn if torn != "\n" else TEXT)
    with recording(path, COLUMNS) as made:
        made.add([(0.02, 1.0, 0)])
    assert path.read_text() == TEXT + "0.02,1.0,0\n"


@pytest.mark.parametrize("torn", ["", "time_s,clear"])
def test_a_recording_that_has_only_begun(tmp_path: Path, torn: str) -> None:
    path = tmp_path / "rows.csv"
    path.write_text(torn)
    with recording(path, COLUMNS) as made:
        made.add([(0.0, 1.5, 0), (0.01, 1.25, 4)])
    assert path.read_text() == TEXT


def test_other_columns_are_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    path.write_text("time_s,y\n0,0\n")
    with pytest.raises(SpecificationError) as caught:
        recording(path, COLUMNS)
    assert str(caught.value) == (
        f"{path}: the columns must be time_s,clearance_mm,status to be continued, not time_s,y"
    )
    assert path.read_text() == "time_s,y\n0,0\n"


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    expected = r"none/rows.csv: the recording must be a file that can be written, not: No such file or directory$"
    with pytest.raises(SpecificationError, match=expected):
        recording(tmp_path / "none" / "rows.csv", COLUMNS)


def test_a_kill_leaves_every_row(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    code = """
import sys, pathlib
from sosmith.host.recording import recording
with recording(pathlib.Path(sys.argv[1]), ("n", "value")) as made:
    for n in range(10**9):
        made.add([(n, n / 3)])
        print(n, flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if int(line) == 500:
                os.kill(process.pid, signal.SIGKILL)
                break
        told = [500, *(int(line) for line in process.stdout if line.endswith("\n"))]
    lines = path.read_text().splitlines()
    assert lines[: told[-1] + 2] == ["n,value", *(f"{n},{n / 3!r}" for n in range(told[-1] + 1))]


def test_parquet_has_the_rows_and_leaves_nothing_beside_it(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    path = tmp_path / "rows.parquet"
    with recording(path, COLUMNS) as made:
        made.add([(0.0, 1.5, 0), (0.01, 1.25, 4)])
        assert (tmp_path / "rows.parquet.rows.csv").read_text() == TEXT
    assert parquet.read_table(path).to_pydict() == {
        "time_s": [0.0, 0.01],
        "clearance_mm": [1.5, 1.25],
        "status": [0, 4],
    }
    assert [entry.name for entry in tmp_path.iterdir()] == ["rows.parquet"]
    with pytest.raises(
        SpecificationError, match=r"rows.parquet: the recording must be a new file, not one that is complete$"
    ):
        recording(path, COLUMNS)


def test_parquet_after_a_kill_has_the_rows_before_it(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    path = tmp_path / "rows.parquet"
    (tmp_path / "rows.parquet.rows.csv").write_text(TEXT + "0.0")
    with recording(path, COLUMNS) as made:
        made.add([(0.02, 1.0, 0)])
    assert parquet.read_table(path).column("time_s").to_pylist() == [0.0, 0.01, 0.02]


def test_an_interruption_leaves_a_complete_recording(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    path = tmp_path / "rows.parquet"

    def record() -> None:
        with recording(path, COLUMNS) as made:
            made.add([(0.0, 1.5, 0)])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record()
    assert parquet.read_table(path).num_rows == 1
