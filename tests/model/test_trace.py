"""Traces: validation, CSV round trip, and every refusal of a wrong file."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.model.trace import Trace, read_csv

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


def test_time_and_values_are_physical() -> None:
    trace = Trace(name="t", ports=SENSORS, sample_rate=RATE, codes=np.array([[32768, 8192], [0, 65535]]))
    assert trace.time.tolist() == [0.0, 0.01]
    assert trace.values().tolist() == [[5.0, 16.0], [0.0, 128 - 128 / 65536]]
    assert len(trace) == 2


def test_arrays_are_read_only_copies() -> None:
    codes = np.zeros((2, 2), dtype=np.int64)
    trace = Trace(name="t", ports=SENSORS, sample_rate=RATE, codes=codes, truth=np.ones(2), reading=np.ones(2, bool))
    codes[0, 0] = 7
    assert trace.codes[0, 0] == 0
    for array in (trace.codes, trace.truth, trace.reading):
        assert array is not None
        assert not array.flags.writeable


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sample_rate": Fraction(0)}, "sample_rate must be positive, not 0"),
        ({"codes": np.zeros((0, 2))}, "codes must be of shape (n, 2) with n > 0, not (0, 2)"),
        ({"codes": np.zeros((4, 1))}, "codes must be of shape (n, 2) with n > 0, not (4, 1)"),
        ({"codes": np.array([[0, 0], [0, 65536]])}, "temperature must be in 0..65535, not 65536"),
        ({"codes": np.array([[-1, 0], [0, 0]])}, "voltage must be in 0..65535, not -1"),
        ({"truth": np.ones(3)}, "truth must be 2 finite numbers, not of shape (3,)"),
        ({"truth": np.array([1.0, np.nan])}, "truth must be 2 finite numbers, not of shape (2,)"),
        ({"reading": np.ones(1, bool)}, "reading must be 2 flags, not of shape (1,)"),
    ],
)
def test_construction_refusals(changes: dict[str, object], message: str) -> None:
    arguments = {"name": "t", "ports": SENSORS, "sample_rate": RATE, "codes": np.zeros((2, 2)), **changes}
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Trace(**arguments)


def test_round_trip_of_an_instrument_trace(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    trace = instrument_trace()
    trace.write_csv(path)
    header = path.read_text().splitlines()[0]
    assert header == "time_s,voltage_V,temperature_C,voltage_code,temperature_code,clearance_mm,reading"
    back = read_csv(path, SENSORS, RATE)
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
    Trace(name="t", ports=(AUDIO,), sample_rate=Fraction(48000), codes=codes, truth=np.ones(3)).write_csv(path)
    assert path.read_text().splitlines()[:2] == ["time_s,audio,audio_code,truth", "0.0,-1.0,-32768,1.0"]
    back = read_csv(path, (AUDIO,), Fraction(48000))
    np.testing.assert_array_equal(back.codes, codes)
    assert back.reading is None


def test_writing_is_repeatable_and_leaves_nothing_else(tmp_path: Path) -> None:
    instrument_trace().write_csv(tmp_path / "a.csv")
    instrument_trace().write_csv(tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "b.csv"]


def test_an_old_file_survives_a_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_self: Path, _target: Path) -> None:
        raise OSError(28, "No space left on device")

    path = tmp_path / "a.csv"
    path.write_text("old")
    monkeypatch.setattr(Path, "replace", fail)
    message = f"{tmp_path}: the output folder must be a folder that can be written, not: No space left on device"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        instrument_trace().write_csv(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_writing_refusals(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    message = f"{tmp_path / 'folder'}: the output file must be a file, not a folder"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        instrument_trace().write_csv(tmp_path / "folder")
    assert [entry.name for entry in tmp_path.iterdir()] == ["folder"]
    clash = Port.from_range("truth", 16, Fraction(0), Fraction(1))
    message = "input names must differ from the other columns of a trace file, not give 'truth' twice"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        Trace(name="t", ports=(clash,), sample_rate=RATE, codes=np.zeros((1, 1))).write_csv(tmp_path / "a.csv")


def test_physical_columns_are_quantized_and_saturate_like_an_adc(tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    path.write_text("voltage_V,temperature_C\n5.0,-3\n11,20.0005\n-0.2,500\n")
    trace = read_csv(path, SENSORS, RATE)
    assert trace.codes.tolist() == [[32768, 0], [65535, 10240], [0, 65535]]
    assert trace.truth is None


def test_code_and_physical_column_may_be_mixed(tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    path.write_text("voltage_code,temperature_C\n7,20\n")
    assert read_csv(path, SENSORS, RATE).codes.tolist() == [[7, 10240]]


ALL = "time_s, clearance_mm, reading, voltage_V, temperature_C, voltage_code, temperature_code"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", " must hold a header line and rows of numbers, not nothing"),
        ("voltage_V,temperature_C\n", " must hold rows of numbers below its header, not the header only"),
        ("voltage_V,temp\n1,2\n", f", line 1: column must be one of {ALL}, not 'temp'"),
        ("voltage_V,voltage_V\n1,2\n", ", line 1: column voltage_V must be there once, not 2 times"),
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
            ", line 4: time_s must be above 0.01, the row before, not 0.01",
        ),
        (
            "time_s,voltage_V,temperature_C\n0,1,20\n0.0102,1,20\n",
            ", line 3: time_s must be 0.01 s after the row before, not 0.0102 s",
        ),
        ("voltage_V,temperature_C,reading\n1,20,2\n", ", line 2: reading must be 0 or 1, not 2"),
    ],
)
def test_reading_refusals(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(content)
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(path) + message)}$"):
        read_csv(path, SENSORS, RATE)


def test_time_steps_within_one_per_cent_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("time_s,voltage_V,temperature_C\n1700000000.0,1,20\n1700000000.01,1,20\n1700000000.0199,1,20\n")
    assert len(read_csv(path, SENSORS, RATE)) == 3
