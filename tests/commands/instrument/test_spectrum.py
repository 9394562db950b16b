"""`sosmith spectrum` as a user meets it: what it prints, writes and refuses."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.commands.invocation import Invocation

from sosmith.gen.filter.design import design
from sosmith.gen.specification.specification import example, load
from sosmith.instrument.sensors.instrument import sensor_voltage
from sosmith.model.errors import ShortfallError

INVOCATION = Invocation("spectrum", columns=120)
run, good, refused = INVOCATION.run, INVOCATION.good, INVOCATION.refused

RATE = 100.0


def write(name: str, columns: dict[str, np.ndarray]) -> Path:  # type: ignore[type-arg]
    rows = np.stack(list(columns.values()), axis=1).tolist()
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    Path(name).write_text("\n".join(lines) + "\n")
    return Path(name)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Start in a folder with an emulated trace, vehicle motion and a specification."""
    monkeypatch.chdir(tmp_path)
    time = np.arange(8000) / RATE
    truth = 4 + time / 80
    motion = 0.4 * np.sin(2 * np.pi * 1.5 * time)
    temperature = np.full(len(time), 50.0)
    measured = truth + motion + np.random.default_rng(1).normal(0, 0.02, len(time))
    voltage = sensor_voltage(measured, temperature)
    columns = {"time_s": time, "voltage_V": voltage, "temperature_C": temperature, "clearance_mm": truth}
    write("ramp.csv", columns)
    write("motion.csv", {"time_s": time, "lateral_mm": motion, "yaw_mrad": 3 * motion})
    Path("my.toml").write_text(example())
    return tmp_path


def test_stdout_has_the_tables_and_the_filter() -> None:
    printed = good("ramp.csv").stdout
    shown = re.sub(r" {2,}", "  ", printed)
    for text in ("ramp.csv: calibrated clearance  measured", "0.4 mm at 1.5 Hz", "group delay", "stopband loss"):
        assert text in shown
    table = tomllib.loads(printed[printed.index("[filter]") :])["filter"]
    assert table["passband_edge"] < table["stopband_edge"] < 1.5


def test_a_filter_does_for_every_channel_of_a_trace_or_for_those_chosen() -> None:
    time = np.repeat(np.arange(8000) / RATE, 2)
    channel = np.tile([0.0, 1.0], 8000)
    truth = 4 + time / 80
    motion = np.where(channel == 1, 0.4, 0.2) * np.sin(2 * np.pi * 1.5 * time)
    write("two.csv", {"time_s": time, "channel": channel, "measured_mm": truth + motion, "truth_mm": truth})
    found = json.loads(good("two.csv", "--json").stdout)
    names = ["two.csv: measured_mm of channel 0", "two.csv: measured_mm of channel 1"]
    assert [one["name"] for one in found["signals"]] == names
    assert [one["trial"] is not None for one in found["signals"]] == [True, True]
    rms = {one["name"]: one["spectra"]["disturbance"]["rms"] for one in found["signals"]}
    assert rms[names[0]] == pytest.approx(0.2 / 2**0.5, rel=0.01)
    second = json.loads(good("two.csv", "--channel", "1", "--json").stdout)
    assert [one["name"] for one in second["signals"]] == names[1:]
    assert second["proposal"]["filter"] == found["proposal"]["filter"]
    refused("two.csv must have rows of channel 2, not only of 0, 1", "two.csv", "--channel", "2")


@pytest.mark.slow
def test_the_copy_of_a_specification_designs_to_what_was_proposed() -> None:
    proposal = json.loads(good("ramp.csv", "--into", "my.toml", "--json").stdout)["proposal"]
    printed = good("ramp.csv", "--into", "my.toml", "-o", "out/new.toml")
    assert "sosmith: wrote out/new.toml\nsosmith: wrote out/new.svg\n" in printed.stderr
    spec = load(Path("out/new.toml"))
    made = design(spec.filter, float(spec.sample_rate))
    assert (made.order, made.cutoff) == (proposal["order"], (proposal["cutoff_hz"],))
    old, new = (tomllib.loads(Path(name).read_text()) for name in ("my.toml", "out/new.toml"))
    assert old | {"filter": new["filter"]} == new
    assert proposal["filter"] == new["filter"]


@pytest.mark.slow
def test_two_runs_write_the_same_bytes() -> None:
    for name in ("a", "b"):
        good("ramp.csv", "-o", f"{name}/f.toml", "--plot", f"{name}/f.svg")
        good("ramp.csv", "--plot", f"{name}/f.png")
    for suffix in ("toml", "svg", "png"):
        assert Path(f"a/f.{suffix}").read_bytes() == Path(f"b/f.{suffix}").read_bytes()
    assert Path("a/f.png").read_bytes().startswith(b"\x89PNG")
    assert "calibrated clearance, disturbance" in Path("a/f.svg").read_text()


def test_json_has_everything() -> None:
    tree = json.loads(good("ramp.csv", "--json").stdout)
    (signal,) = tree["signals"]
    assert set(signal["spectra"]) == {"measured", "true", "disturbance"}
    found = signal["spectra"]["disturbance"]
    assert len(found["frequency_hz"]) == len(found["density"]) == len(found["amplitude"]) == 501
    assert found["peaks"][0]["frequency_hz"] == pytest.approx(1.5)
    assert 2 * signal["trial"]["after"] < 0.1 < signal["trial"]["before"]
    assert tree["settings"]["window"] == "hann"


def test_motion_beside_a_trace_and_spectra_alone() -> None:
    both = json.loads(good("ramp.csv", "motion.csv", "--motion", "--column", "lateral_mm", "--json").stdout)
    assert [one["name"] for one in both["signals"]] == ["ramp.csv: calibrated clearance", "motion.csv: lateral_mm"]
    assert [one["disturbance"] <= 0.05 for one in both["proposal"]["predictions"]] == [True, True]
    tree = json.loads(good("motion.csv", "--column", "lateral_mm", "--motion", "--time-constant", "2", "--json").stdout)
    assert tree["proposal"]["filter"]["passband_edge"] == 0.079577  # 1 / (2 pi 2 s)
    assert tree["proposal"]["predictions"][0]["wanted"] == 0
    alone = good("motion.csv")
    assert "sosmith: no filter is proposed: the signals must have one unit, not mm and mrad" in alone.stderr
    assert "[filter]" not in alone.stdout


def test_the_calibration_is_that_of_the_specification() -> None:
    Path("other.toml").write_text(example().replace("[0.3672, 0.0006618]", "[0.5, 0.0]"))
    one, other = (
        json.loads(good("ramp.csv", "--json", *options, "--passband", "0.1").stdout)["signals"][0]["spectra"][
            "measured"
        ]
        for options in ((), ("--calibration", "other.toml"))
    )
    # slopes at 4 mm and 50 degC
    v = float(sensor_voltage(4.5, 50.0))
    ratio = (0.5 + 2 * 0.05812 * v) / (0.3672 + 0.0006618 * 50 + 2 * 0.05812 * v)
    assert other["rms"] / one["rms"] == pytest.approx(ratio, rel=0.01)


def test_refusals() -> None:
    unknown = "as motion.csv: lateral_mm has no truth to tell what is wanted"
    given = ("motion.csv", "--column", "lateral_mm", "-o", "f.toml")
    refused(f"--passband or --time-constant must be given, {unknown}", *given)
    refused("the passband edge must be given by one of --passband and --time-constant, not both", "ramp.csv",
            "--passband", "1", "--time-constant", "1")  # fmt: skip
    refused("time-constant must be a positive number of seconds, not 0", "ramp.csv", "--time-constant", "0")
    refused("f.pdf: the plot's name must end in .svg or .png, not .pdf", "ramp.csv", "--plot", "f.pdf")
    Path("slow.toml").write_text(example().replace("sample_rate = 100.0", "sample_rate = 6.0"))
    refused("ramp.csv: the sample rate must be the 6 Hz of slow.toml, not 100 Hz", "ramp.csv", "--into", "slow.toml")
    refused("column z_mm must be in one of ramp.csv, motion.csv, not in none", "ramp.csv", "motion.csv",
            "--column", "z_mm")  # fmt: skip
    assert not Path("f.toml").exists()


@pytest.mark.slow
def test_a_specification_with_measurements_is_copied_beside_them_only() -> None:
    text = re.sub(r"coefficients = \[.*?\n\]\n", 'data = "m.csv"\n', example(), flags=re.DOTALL)
    Path("data.toml").write_text(text)
    rows = [(v / 2, t) for v in range(1, 19) for t in (20, 40, 60)]
    lines = [f"{1.16 - 0.0036 * t + (0.3672 + 0.0006618 * t) * v + 0.05812 * v * v},{v},{t}" for v, t in rows]
    Path("m.csv").write_text("clearance_mm,voltage_V,temperature_C\n" + "\n".join(lines) + "\n")
    good("ramp.csv", "--into", "data.toml", "-o", "copy.toml")
    refused(
        "out/copy.toml: the copy must be in the folder of data.toml, whose calibration.data is found from there",
        "ramp.csv", "--into", "data.toml", "-o", "out/copy.toml",
    )  # fmt: skip


@pytest.mark.slow
def test_no_filter_needed_is_a_shortfall() -> None:
    result = run("ramp.csv", "--tolerance", "5", "-o", "none.toml")
    assert "0.4 mm at 1.5 Hz" in result.stdout
    assert (Path("none.toml").exists(), Path("none.svg").exists()) == (False, True)
    assert isinstance(result.exception, ShortfallError)
    assert str(result.exception).startswith("the disturbance must be worth a filter: ")


def test_a_shift_that_lasts_is_not_taken_for_nothing() -> None:
    time = np.arange(8000) / RATE
    write("curve.csv", {"time_s": time, "clearance1_mm": np.where((time > 20) & (time < 60), 1.0, 0.0)})
    result = run("curve.csv", "--motion", "--passband", "0.05", "--tolerance", "0.5")
    assert isinstance(result.exception, ShortfallError)
    assert str(result.exception).startswith("tolerance must be above 2 times the 0.5 rms of the disturbance")
    assert "rms of the disturbance that is slower than segments of 10 s" in str(result.exception)
