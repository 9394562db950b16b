"""Signals from CSV files: what is read, and what is refused with file and line."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A
from sosmith.model.traces.signal_file import CALIBRATED, SignalFile, read_signal_file


def write(path: Path, header: str, row: Callable[[int], str], rows: int = 100) -> Path:
    path.write_text("\n".join([header, *map(row, range(rows))]) + "\n")
    return path


def read(path: Path, *columns: str, truth: str | None = None, channels: Sequence[int] = ()) -> SignalFile:
    return read_signal_file(path, EQUATION_5A, columns, truth, channels)


def test_the_calibration_makes_the_clearance_of_an_emulated_trace(tmp_path: Path) -> None:
    header = "time_s,voltage_V,temperature_C,voltage_code,temperature_code,clearance_mm,reading"
    path = write(tmp_path / "t.csv", header, lambda k: f"{k / 6:.4f},{k / 20},20,1,2,{k / 10},{k % 2}")
    file = read(path)
    assert file.sample_rate == pytest.approx(6, rel=1e-4)
    assert file.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    (one,) = file.signals
    assert (one.name, one.unit) == (CALIBRATED, "mm")
    v = 99 / 20
    assert one.values[99] == pytest.approx(1.16 - 0.0036 * 20 + (0.3672 + 0.0006618 * 20) * v + 0.05812 * v * v)
    assert one.truth is not None
    assert one.truth[99] == 9.9
    assert one.reading is not None
    assert one.reading.tolist() == [k % 2 == 1 for k in range(100)]


def test_units_come_from_the_names_and_the_truth_goes_with_its_own(tmp_path: Path) -> None:
    path = write(tmp_path / "t.csv", "time_s,a_um,b_m,c_deg,truth_mm,distance_m", lambda k: f"{k},{k},{k},180,{k},{k}")
    signals = {one.name: one for one in read(path).signals}
    assert {name: one.unit for name, one in signals.items()} == {"a_um": "mm", "b_m": "mm", "c_deg": "mrad"}
    assert signals["a_um"].values[50] == pytest.approx(0.05)
    assert signals["b_m"].values[50] == 50_000
    assert signals["c_deg"].values[0] == pytest.approx(1000 * np.pi)
    assert signals["c_deg"].truth is None
    assert signals["a_um"].truth is not None


def test_columns_can_be_chosen(tmp_path: Path) -> None:
    path = write(tmp_path / "t.csv", "time_s,a,b_mm,c_mm", lambda k: f"{k},1,2,3")
    assert [one.name for one in read(path, "b_mm").signals] == ["b_mm"]
    (one,) = read(path, "a", truth="c_mm").signals
    assert (one.unit, one.truth) == ("", None)
    (one,) = read(path, "b_mm", truth="c_mm").signals
    assert one.truth is not None
    assert one.truth.tolist() == [3.0] * 100


@pytest.mark.parametrize(
    ("header", "row", "rows", "message"),
    [
        ("a_mm", lambda k: "1", 100, ", line 1: column time_s must be present, not missing from a_mm"),
        ("time_s", str, 100, " must have a column of values besides time_s, not only time_s"),
        ("time_s,a_mm", lambda k: f"{k},1", 63, " must hold at least 64 rows, not 63"),
        ("time_s,a_mm", lambda k: f"{k},nan", 100, ", line 2: a_mm must be a finite number, not 'nan'"),
        (
            "time_s,a_mm",
            lambda k: f"{k + (k > 70)},1",
            100,
            ", line 73: time_s must be 1 s after the previous row, like most rows, not 2 s",
        ),
        (
            "time_s,a_mm",
            lambda k: f"{k - 2 * (k == 70)},1",
            100,
            ", line 72: time_s must be above the 69 s of the previous row, not 68 s",
        ),
        (
            "time_s,speed",
            lambda k: f"{k},1",
            100,
            ": column must end in its unit (_mm, _um, _m, _V, _mV, _C, _degC, _rad, _mrad, _deg) or be selected by "
            "--column, not 'speed'",
        ),
        (
            "time_s,channel,a_mm",
            lambda k: f"{k},{k % 2 / 2},1",
            100,
            ", line 3: channel must be an integer of 0 or more, not 0.5",
        ),
        (
            "time_s,channel,a_mm",
            lambda k: f"{k},{k // 64},1",
            100,
            " must hold at least 64 rows of channel 1, not 36",
        ),
        (
            "time_s,channel,a_mm",
            lambda k: f"{k if k < 64 else 2 * k},{k // 64},1",
            128,
            ": the sample rate of channel 1 must be the 1 Hz of channel 0, not 0.5 Hz",
        ),
        ("time_s,a_mm,reading", lambda k: f"{k},1,2", 100, ", line 2: reading must be 0 or 1, not 2"),
    ],
)
def test_refusals(tmp_path: Path, header: str, row: Callable[[int], str], rows: int, message: str) -> None:
    path = write(tmp_path / "t.csv", header, row, rows)
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(path) + message)}$"):
        read(path)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("time_s,channel,a_mm", " must have rows of channel 4, not only of 0, 3"),
        ("time_s,b_mm,a_mm", " must have the column channel for channels above 0, not only time_s, b_mm, a_mm"),
    ],
)
def test_channels_asked_for_must_be_there(tmp_path: Path, header: str, message: str) -> None:
    path = write(tmp_path / "t.csv", header, lambda k: f"{k // 2},{k % 2 * 3},1", 128)
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(path) + message)}$"):
        read(path, channels=(4, 0))


def test_each_channel_has_signals_of_its_own(tmp_path: Path) -> None:
    header = "time_s,channel,a_mm,truth,reading"
    path = write(tmp_path / "t.csv", header, lambda k: f"{k // 2},{k % 2 * 3},{k},{-k},{k % 2}", 128)
    one, two = read(path).signals
    assert [one.name, two.name] == ["a_mm of channel 0", "a_mm of channel 3"]
    assert two.values.tolist() == list(range(1, 128, 2))
    assert two.truth is not None
    assert two.truth.tolist() == list(range(-1, -128, -2))
    assert one.reading is None
    assert two.reading is not None
    assert two.reading.all()
    (chosen,) = read(path, channels=(3, 3)).signals
    assert chosen.values.tolist() == two.values.tolist()


def test_a_file_without_the_column_holds_channel_0(tmp_path: Path) -> None:
    path = write(tmp_path / "t.csv", "time_s,a_mm", lambda k: f"{k},1")
    (one,) = read(path, channels=(0,)).signals
    assert one.name == "a_mm"


def test_columns_asked_for_must_be_there(tmp_path: Path) -> None:
    path = write(tmp_path / "t.csv", "time_s,a_mm", lambda k: f"{k},1")
    for columns, truth in ((("b_mm",), None), ((), "b_mm")):
        message = f"{path} must have the column b_mm, not only time_s, a_mm"
        with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
            read(path, *columns, truth=truth)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    path = tmp_path / "none.csv"
    message = f"{path} must be a readable CSV file (no such file or directory)"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        read(path)


@pytest.mark.parametrize("cut", [round, math.floor])
def test_times_are_rounded_to_their_last_digit(cut: Callable[[float], int], tmp_path: Path) -> None:
    """Microseconds at 48 kHz: 20 or 21 of them a sample."""
    path = write(tmp_path / "t.csv", "time_s,a_mm", lambda k: f"{cut(k * 1e6 / 48000) / 1e6:.6f},1", 2401)
    assert read(path).sample_rate == pytest.approx(48000, rel=1e-6)


def test_a_gap_among_rounded_times_is_told(tmp_path: Path) -> None:
    path = write(
        tmp_path / "t.csv", "time_s,a_mm", lambda k: f"{round((k + (k > 70)) * 1e6 / 48000) / 1e6:.6f},1", 2000
    )
    message = "line 73: time_s must be .* s after the previous row, like most rows, not 4.2e-05 s"
    with pytest.raises(SpecificationError, match=message):
        read(path)
