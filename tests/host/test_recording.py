"""Recordings: every row in the file at once, continued after a kill, complete Parquet files."""

import csv
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.suite.extras import needed

from sosmith.host.recording import check_output, recording
from sosmith.model.errors import SpecificationError, ToolError

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


def test_nobody_else_records_to_a_file_that_is_recorded(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    expected = f"{path}: the recording must be a file that nobody else writes, not: written by another process"
    with recording(path, COLUMNS) as made:
        made.add([(0.0, 1.5, 0)])
        code = """
import sys, pathlib
from sosmith.host.recording import check_output, recording
try:
    recording(pathlib.Path(sys.argv[1]), ("time_s", "clearance_mm", "status"))
except Exception as error:
    print(error)
"""
        said = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
        with pytest.raises(SpecificationError) as caught:
            recording(path, COLUMNS)
        made.add([(0.01, 1.25, 4)])
    assert (said.stdout.rstrip(), str(caught.value)) == (expected, expected)
    assert path.read_text() == TEXT
    with recording(path, COLUMNS):
        pass


@pytest.mark.parametrize("suffix", ["", ".csv"])
def test_what_is_no_regular_file_is_refused(tmp_path: Path, suffix: str) -> None:
    fifo, folder = tmp_path / f"fifo{suffix}", tmp_path / f"folder{suffix}"
    os.mkfifo(fifo)
    folder.mkdir()
    cases = ((fifo, "a pipe"), (folder, "a folder"), (Path("/dev/full"), "a device"), (Path("/dev/null"), "a device"))
    for path, kind in cases:
        with pytest.raises(SpecificationError) as caught:
            check_output(path)
        assert str(caught.value) == f"{path}: the output must be a regular file, not {kind}"
        with pytest.raises(SpecificationError, match=f"^{path}: the recording must be a (regular )?file"):
            recording(path, COLUMNS)


def test_an_output_is_none_of_the_inputs(tmp_path: Path) -> None:
    trace = tmp_path / "trace.csv"
    check_output(trace, trace, None)  # none of them exists
    trace.write_text("x\n")
    (tmp_path / "link.csv").symlink_to(trace)
    for output in (trace, tmp_path / "link.csv"):
        with pytest.raises(SpecificationError) as caught:
            check_output(output, trace)
        assert str(caught.value) == f"{output}: the output must be another file than the input {trace}, not the same"
    check_output(tmp_path / "other.csv", trace)


def test_a_full_disk_is_told_with_the_file(tmp_path: Path) -> None:
    """By the limit of a file's size, at which the system refuses to write as on a full disk."""
    code = """
import resource, sys, pathlib
from sosmith.host.recording import check_output, recording
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
with recording(pathlib.Path(sys.argv[1]), ("n", "value")) as made:
    try:
        for n in range(1000):
            made.add([(n, n / 3)])
    except Exception as error:
        print(type(error).__name__, error)
"""
    path = tmp_path / "rows.csv"
    said = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert said.stdout == f"ToolError {path}: the disk must take the recording, not: File too large\n"
    with recording(path, ("n", "value")):
        pass
    assert path.read_text().splitlines()[1:] == [
        f"{n},{n / 3!r}" for n in range(len(path.read_text().splitlines()) - 1)
    ]


def test_names_and_texts_are_quoted(tmp_path: Path) -> None:
    columns = ("time, s", 'a "b"', "c\nd")
    path = tmp_path / "rows.csv"
    with recording(path, columns) as made:
        made.add([(0.5, "x,y", 1)])
    with path.open(newline="") as file:
        assert list(csv.reader(file)) == [list(columns), ["0.5", "x,y", "1"]]


def test_a_kill_leaves_every_row(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    code = """
import sys, pathlib
from sosmith.host.recording import check_output, recording
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
    parquet = needed("pyarrow.parquet")
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
    parquet = needed("pyarrow.parquet")
    path = tmp_path / "rows.parquet"
    (tmp_path / "rows.parquet.rows.csv").write_text(TEXT + "0.0")
    with recording(path, COLUMNS) as made:
        made.add([(0.02, 1.0, 0)])
    assert parquet.read_table(path).column("time_s").to_pylist() == [0.0, 0.01, 0.02]


def test_an_interruption_leaves_a_complete_recording(tmp_path: Path) -> None:
    parquet = needed("pyarrow.parquet")
    path = tmp_path / "rows.parquet"

    def record() -> None:
        with recording(path, COLUMNS) as made:
            made.add([(0.0, 1.5, 0)])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record()
    assert parquet.read_table(path).num_rows == 1


def test_in_parquet_what_a_row_looks_like_decides_no_type(tmp_path: Path) -> None:
    """A digest may look like a number, and a clock may be set to any year, after as many rows as there are."""
    parquet = needed("pyarrow.parquet")
    path = tmp_path / "rows.parquet"
    first, last = ("2026-01-01T00:00:00.500000Z", "0123456789e1"), ("9999-12-31T23:59:59.000000Z", "012345678901")
    with recording(path, ("utc", "board")) as made:
        made.add([first] * 30_000)
        made.add([last])
    found = parquet.read_table(path)
    assert found.column("board").to_pylist() == [first[1]] * 30_000 + [last[1]]
    assert found.column("utc").to_pylist()[-1].isoformat() == "9999-12-31T23:59:59+00:00"


def test_rows_that_somebody_has_changed_are_told(tmp_path: Path) -> None:
    needed("pyarrow.parquet")
    path = tmp_path / "rows.parquet"

    def record() -> None:
        with recording(path, ("utc", "board")) as made:
            made.add([("yesterday", "a")])

    with pytest.raises(ToolError) as caught:
        record()
    assert str(caught.value).startswith(f"{path}: the rows in {path}.rows.csv must be those that were recorded, not: ")
    assert "\n" not in str(caught.value)
    assert (tmp_path / "rows.parquet.rows.csv").read_text() == "utc,board\nyesterday,a\n"
    assert not path.exists()


@pytest.mark.parametrize("kind", ["link", "pipe", "file"])
def test_what_lies_where_a_parquet_file_is_made_is_not_written_to(kind: str, tmp_path: Path) -> None:
    needed("pyarrow.parquet")
    place = tmp_path / "rows.parquet.part"
    (tmp_path / "other").write_text("of others")
    if kind == "link":
        place.symlink_to("other")
    elif kind == "pipe":
        os.mkfifo(place)
    else:
        place.write_text("of a kill")
    with recording(tmp_path / "rows.parquet", COLUMNS) as made:
        made.add([(0.0, 1.5, 0)])
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["other", "rows.parquet"]
    assert (tmp_path / "other").read_text() == "of others"
