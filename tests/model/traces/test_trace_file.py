"""Trace files: round trip of one channel and of several, and every refusal of a wrong file."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.port import Port
from sosmith.model.traces.trace import Trace
from sosmith.model.traces.trace_file import read_traces, traces_csv, write_traces

VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
TEMPERATURE = Port.from_range("temperature", 16, Fraction(0), Fraction(128), unit="degC")
AUDIO = Port.from_range("audio", 16, Fraction(-1), Fraction(1), signed=True)
SENSORS = (VOLTAGE, TEMPERATURE)
RATE = Fraction(100)


def instrument_trace(samples: int = 50) -> Trace:
    rng = np.random.default_rng(3)
    return Trace(
        name="made",
        ports=SENSORS,
        sample_rate=RATE,
        codes=rng.integers(0, 65536, (samples, 2)),
        truth=rng.uniform(1, 10, samples),
        reading=rng.integers(0, 2, samples).astype(bool),
        seed=3,
    )


def test_round_trip_of_an_instrument_trace(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    trace = instrument_trace()
    write_traces(path, [trace])
    header = path.read_text().splitlines()[0]
    assert header == "time_s,voltage_V,temperature_C,voltage_code,temperature_code,clearance_mm,reading"
    (back,) = read_traces(path, SENSORS, RATE)
    np.testing.assert_array_equal(back.codes, trace.codes)
    assert back.truth is not None
    assert trace.truth is not None
    np.testing.assert_array_equal(back.truth, trace.truth)
    assert back.reading is not None
    assert trace.reading is not None
    np.testing.assert_array_equal(back.reading, trace.reading)
    assert (back.name, back.seed, back.sample_rate) == ("run", None, RATE)


def test_round_trip_of_a_plain_filter_trace(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    codes = np.array([[-32768], [0], [32767]])
    trace = Trace(name="t", ports=(AUDIO,), sample_rate=Fraction(48000), codes=codes, truth=np.ones(3))
    write_traces(path, [trace])
    assert path.read_text().splitlines()[:2] == ["time_s,audio,audio_code,truth", "0.0,-1.0,-32768,1.0"]
    (back,) = read_traces(path, (AUDIO,), Fraction(48000))
    np.testing.assert_array_equal(back.codes, codes)
    assert back.reading is None


def test_writing_is_repeatable_and_leaves_nothing_else(tmp_path: Path) -> None:
    write_traces(tmp_path / "a.csv", [instrument_trace()])
    write_traces(tmp_path / "b.csv", [instrument_trace()])
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "b.csv"]


def test_an_old_file_survives_a_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_self: Path, _target: Path) -> None:
        raise OSError(28, "No space left on device")

    path = tmp_path / "a.csv"
    path.write_text("old")
    monkeypatch.setattr(Path, "replace", fail)
    message = f"{tmp_path}: the disk must take the output files, not: No space left on device"
    with pytest.raises(ToolError, match=f"^{re.escape(message)}$"):
        write_traces(path, [instrument_trace()])
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_writing_refusals(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    message = f"{tmp_path / 'folder'}: the output file must be a file, not a folder"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        write_traces(tmp_path / "folder", [instrument_trace()])
    assert [entry.name for entry in tmp_path.iterdir()] == ["folder"]
    clash = Port.from_range("truth", 16, Fraction(0), Fraction(1))
    message = "input names must differ from the other columns of a trace file, not repeat 'truth'"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        traces_csv([Trace(name="t", ports=(clash,), sample_rate=RATE, codes=np.zeros((1, 1)))])


def test_physical_columns_are_quantized_and_saturate_like_an_adc(tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    path.write_text("voltage_V,temperature_C\n5.0,-3\n11,20.0005\n-0.2,500\n")
    (trace,) = read_traces(path, SENSORS, RATE)
    assert trace.codes.tolist() == [[32768, 0], [65535, 10240], [0, 65535]]
    assert trace.truth is None


def test_code_and_physical_column_may_be_mixed(tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    path.write_text("voltage_code,temperature_C\n7,20\n")
    assert read_traces(path, SENSORS, RATE)[0].codes.tolist() == [[7, 10240]]


ALL = "time_s, channel, clearance_mm, reading, voltage_V, temperature_C, voltage_code, temperature_code"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", " must hold a header line and rows of numbers, not be empty"),
        ("voltage_V,temperature_C\n", " must hold rows of numbers below its header, not only the header"),
        ("voltage_V,temp\n1,2\n", f", line 1: column must be one of {ALL}, not 'temp'"),
        ("voltage_V,voltage_V\n1,2\n", ", line 1: column voltage_V must appear once, not 2 times"),
        ("voltage_V\n1\n", " must have the column temperature_code or temperature_C, not only voltage_V"),
        ("voltage_V,temperature_C\n1,20\n2\n", ", line 3: row must have 2 cells, not 1"),
        ("voltage_V,temperature_C\n1,hot\n", ", line 2: temperature_C must be a finite number, not 'hot'"),
        ("voltage_V,temperature_C\n1,NaN\n", ", line 2: temperature_C must be a finite number, not 'NaN'"),
        ("voltage_code,temperature_code\n1,2\n1.5,2\n", ", line 3: voltage_code must be an integer, not 1.5"),
        (
            "voltage_code,temperature_code\n1,65536\n",
            ", line 2: temperature_code must be in 0..65535, not 65536",
        ),
        ("voltage_code,temperature_code\n-1,0\n", ", line 2: voltage_code must be in 0..65535, not -1"),
        (
            "voltage_code,voltage_V,temperature_C\n0,0,20\n32768,6,20\n",
            ", line 3: voltage_code must be 39322 to agree with voltage_V, not 32768",
        ),
        (
            "time_s,voltage_V,temperature_C\n0,1,20\n0.01,1,20\n0.01,1,20\n",
            ", line 4: time_s must be above 0.01, the value in the previous row, not 0.01",
        ),
        (
            "time_s,voltage_V,temperature_C\n0,1,20\n0.0102,1,20\n",
            ", line 3: time_s must be 0.01 s after the previous row, not 0.0102 s",
        ),
        ("voltage_V,temperature_C,reading\n1,20,2\n", ", line 2: reading must be 0 or 1, not 2"),
    ],
)
def test_reading_refusals(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(content)
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(path) + message)}$"):
        read_traces(path, SENSORS, RATE)


def test_time_steps_within_one_per_cent_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("time_s,voltage_V,temperature_C\n1700000000.0,1,20\n1700000000.01,1,20\n1700000000.0199,1,20\n")
    assert len(read_traces(path, SENSORS, RATE)[0]) == 3


def same(one: Trace, other: Trace) -> bool:
    parts = ((one.codes, other.codes), (one.truth, other.truth), (one.reading, other.reading))
    return all((a is None and b is None) or np.array_equal(np.array(a), np.array(b)) for a, b in parts)


def _stamped(tmp_path: Path, stamps: list[str], rate: int) -> Trace:
    path = tmp_path / "t.csv"
    path.write_text("time_s,audio_code\n" + "".join(f"{stamp},0\n" for stamp in stamps), encoding="utf-8")
    return read_traces(path, (AUDIO,), Fraction(rate))[0]


@pytest.mark.parametrize(("rate", "places"), [(48000, 6), (44100, 5), (44100, 6), (192000, 6), (3, 1), (1, 0)])
def test_time_stamps_may_be_rounded_or_cut_to_their_last_digit(tmp_path: Path, rate: int, places: int) -> None:
    for rounded in (round, math.floor):
        stamps = [rounded(Fraction(k, rate) * 10**places) for k in range(7, 1000)]
        texts = [f"{stamp / 10**places:.{places}f}" for stamp in stamps] if places else [*map(str, stamps)]
        assert len(_stamped(tmp_path, texts, rate)) == 993


@pytest.mark.parametrize(
    ("rate", "stamps", "message"),
    [
        (1, ["0", "1", "3"], "line 4: time_s must be 1 s after the previous row, not 2 s"),
        (48000, ["0.000000", "0.000021", "0.000062"], r"line 4: time_s must be 2.08333e-05 s after .*, not 4.1e-05 s"),
        (
            48000,
            [f"{k * 20e-6:.6f}" for k in range(100)],
            "line 19: time_s must be 0.000354167 s after the first row at 48000 Hz, not 0.00034 s",
        ),
        (48000, ["0.0000", "0.0000", "0.0000"], "line 3: time_s must be above 0.0, the value in .*, not 0.0"),
    ],
    ids=["a second late", "a sample missing", "50 kHz", "a digit longer than the period"],
)
def test_time_stamps_that_do_not_fit_the_rate(tmp_path: Path, rate: int, stamps: list[str], message: str) -> None:
    with pytest.raises(SpecificationError, match=message):
        _stamped(tmp_path, stamps, rate)


def test_time_stamps_since_1970_are_as_fine_as_doubles_are(tmp_path: Path) -> None:
    assert len(_stamped(tmp_path, [f"{1700000000 + k / 48000:.6f}" for k in range(1000)], 48000)) == 1000


def test_channels_go_by_time_and_come_back_in_any_order(tmp_path: Path) -> None:
    path = tmp_path / "three.csv"
    whole = instrument_trace(30)
    assert whole.truth is not None
    assert whole.reading is not None
    cut = [slice(0, 10), slice(10, 20), slice(20, 30)]
    traces = [replace(whole, codes=whole.codes[k], truth=whole.truth[k], reading=whole.reading[k]) for k in cut]
    write_traces(path, traces)
    header, *rows = path.read_text().splitlines()
    assert header == "time_s,channel,voltage_V,temperature_C,voltage_code,temperature_code,clearance_mm,reading"
    assert [row.split(",")[:2] for row in rows[:4]] == [["0.0", "0"], ["0.0", "1"], ["0.0", "2"], ["0.01", "0"]]
    back = read_traces(path, SENSORS, RATE, 3)
    assert [same(one, other) for one, other in zip(back, traces, strict=True)] == [True] * 3
    grouped = sorted(rows, key=lambda row: -int(row.split(",")[1]))  # channel 2 first
    path.write_text("\n".join([header, *grouped]))
    again = read_traces(path, SENSORS, RATE, 3)
    assert [same(one, other) for one, other in zip(again, traces, strict=True)] == [True] * 3


def test_a_file_of_channel_0_fits_a_core_with_one(tmp_path: Path) -> None:
    path = tmp_path / "one.csv"
    path.write_text("channel,voltage_code,temperature_code\n0,7,8\n0,9,10\n")
    (trace,) = read_traces(path, SENSORS, RATE)
    assert trace.codes.tolist() == [[7, 8], [9, 10]]


def test_a_file_without_channels_is_one_trace_whatever_the_core_has(tmp_path: Path) -> None:
    path = tmp_path / "one.csv"
    write_traces(path, [instrument_trace()])
    assert "channel" not in path.read_text()
    assert len(read_traces(path, SENSORS, RATE, 3)) == 1


@pytest.mark.parametrize(
    ("channels", "rows", "message"),
    [
        (2, "0,0\n2,0", ", line 3: channel must be an integer from 0 to 1, not 2"),
        (2, "0,0\n-1,0", ", line 3: channel must be an integer from 0 to 1, not -1"),
        (2, "0,0\n0.5,0", ", line 3: channel must be an integer from 0 to 1, not 0.5"),
        (2, "0,0\nleft,0", ", line 3: channel must be a finite number, not 'left'"),
        (1, "0,0\n1,0", ", line 3: channel must be 0, the core's only channel, not 1"),
        (3, "0,0\n2,0", " must have rows of channel 1, not only of 0, 2"),
        (
            2,
            "0,0\n1,0\n1,0.01\n0,0.01\n1,0.02",
            ", line 6: channel 1 must end after row 2, like channel 0, not continue",
        ),
        (
            3,
            "2,0\n0,0\n0,0.01\n1,0\n1,0.01",
            ", line 4: channel 0 must end after row 1, like channel 2, not continue",
        ),
        (
            2,
            "0,0\n1,5\n0,0.01\n1,5.02",
            ", line 5: time_s must be 0.01 s after the previous row of this channel, not 0.02 s",
        ),
        (
            2,
            "0,0\n1,0\n1,0.01\n0,0",
            ", line 5: time_s must be above 0.0, the value in the previous row of this channel, not 0.0",
        ),
    ],
)
def test_refusals_of_channels(tmp_path: Path, channels: int, rows: str, message: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text("channel,time_s,voltage_code,temperature_code\n" + rows.replace("\n", ",1,1\n") + ",1,1\n")
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(path) + message)}$"):
        read_traces(path, SENSORS, RATE, channels)
