"""The recording of a monitor: runs and sessions told apart, times by the session, continued by the same board."""

import csv
from pathlib import Path

import numpy as np
import pytest
from tests.host.lines import device_of, plain_device
from tests.interface.small import instrument_design

from sosmith.host.board import Results
from sosmith.host.monitor import Received
from sosmith.host.run_recording import RunRecording
from sosmith.model.errors import SpecificationError
from sosmith.model.link.identity import Identity

ABOUT = device_of(instrument_design())._identity


def event(first: int, start: float, session: int = 1) -> Received:
    shown = np.full((1, 2), 1.5)
    return Received(session, first, Results(shown, shown.astype(np.int64), np.zeros((1, 2), np.uint8), {}), start)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_runs_and_sessions_are_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "week.csv"
    with RunRecording(path, ABOUT) as made:
        made.add(event(100, 1000.0))
        made.add(event(101, 5000.0, 2))
    with RunRecording(path, ABOUT) as made:
        made.add(event(0, 0.0))
    header = "utc,time_s,run,session,channel,clearance_mm,clearance_code,status,board"
    first, *lines = path.read_text().splitlines()
    assert first == header
    assert lines == [
        f"1970-01-01T00:16:41.000000Z,1.0,1,1,0,1.5,1,0,{ABOUT.digest}",
        f"1970-01-01T00:16:41.000000Z,1.0,1,1,1,1.5,1,0,{ABOUT.digest}",
        f"1970-01-01T01:23:21.010000Z,1.01,1,2,0,1.5,1,0,{ABOUT.digest}",
        f"1970-01-01T01:23:21.010000Z,1.01,1,2,1,1.5,1,0,{ABOUT.digest}",
        f"1970-01-01T00:00:00.000000Z,0.0,2,1,0,1.5,1,0,{ABOUT.digest}",
        f"1970-01-01T00:00:00.000000Z,0.0,2,1,1,1.5,1,0,{ABOUT.digest}",
    ]


def test_a_run_without_rows_leaves_no_trace(tmp_path: Path) -> None:
    for _ in range(2):
        with RunRecording(tmp_path / "week.csv", ABOUT) as made:
            pass
    with RunRecording(tmp_path / "week.csv", ABOUT) as made:
        made.add(event(0, 0.0))
    assert {row["run"] for row in rows(tmp_path / "week.csv")} == {"1"}


@pytest.mark.parametrize("suffix", ["csv", "parquet.rows.csv"])
def test_another_board_does_not_continue_it(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / "week.csv"
    other = Identity.model_validate(ABOUT.model_dump() | {"design": "0" * 64})
    with RunRecording(path, ABOUT) as made:
        made.add(event(0, 0.0))
    before = path.read_bytes()
    if suffix != "csv":
        pytest.importorskip("pyarrow", reason="pyarrow is not installed")
        path.rename(tmp_path / f"week.{suffix}")
        path = tmp_path / "week.parquet"
    expected = f"{path}: the recording must be of the board {other.digest} to be continued, not of {ABOUT.digest}"
    with pytest.raises(SpecificationError) as caught:
        RunRecording(path, other)
    assert str(caught.value) == expected
    assert (tmp_path / f"week.{suffix}").read_bytes() == before
    with RunRecording(path, ABOUT) as made:  # what was refused has not kept it
        made.add(event(0, 0.0))


def test_a_core_with_other_columns_does_not_continue_it(tmp_path: Path) -> None:
    with RunRecording(tmp_path / "week.csv", ABOUT) as made:
        made.add(event(0, 0.0))
    with pytest.raises(SpecificationError, match=r"the columns must be utc,time_s,run,session,y,y_code,status,board "):
        RunRecording(tmp_path / "week.csv", plain_device()._identity)


def test_a_last_row_that_was_edited_is_told(tmp_path: Path) -> None:
    path = tmp_path / "week.csv"
    with RunRecording(path, ABOUT) as made:
        made.add(event(0, 0.0))
    good = path.read_text()
    path.write_text(good.replace(",1,1,1,", ",one,1,1,"))
    with pytest.raises(SpecificationError, match=r"week.csv: the run of the last row must be a number, not one$"):
        RunRecording(path, ABOUT)
    path.write_text(good + "1,2\n")
    expected = r"week.csv: the last row must have 9 values to be continued, not 2$"
    with pytest.raises(SpecificationError, match=expected):
        RunRecording(path, ABOUT)


def test_identities_that_differ_in_anything_have_other_digests() -> None:
    changes = ({"sosmith": "9"}, {"clock": 1.0}, {"flags": {}}, {"sample_rate": 99.0}, {"baud": 5})
    others = [Identity.model_validate(ABOUT.model_dump() | change) for change in changes]
    assert len({ABOUT.digest, *(other.digest for other in others)}) == 6
    assert Identity.model_validate(ABOUT.model_dump()).digest == ABOUT.digest
