"""`sosmith emulate` and `simulate` with scenario files: traces, measurements, notes, refusals."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from tests.commands.command_line import FILTER, INSTRUMENT
from tests.instrument.scenarios.scenario_texts import CALIBRATION, PLAIN

from sosmith.cli import cli
from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import load
from sosmith.instrument.scenarios.file import load_scenario, range_notes
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.instrument.scenarios.vehicle_clearance import vehicle_clearance
from sosmith.model.errors import SpecificationError

SHORT = PLAIN.replace("seconds = 60", "seconds = 20")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    files = {"spec.toml": INSTRUMENT, "plain.toml": FILTER, "day.toml": SHORT, "depot.toml": SHORT + CALIBRATION}
    files["hot.toml"] = SHORT.replace("temperature = 20.0", "temperature = 20.0\ntemperature_to = 200.0")
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def run(*arguments: str) -> Result:
    return CliRunner(env={"COLUMNS": "120"}).invoke(cli, arguments)


def test_a_trace_from_a_file(folder: Path) -> None:
    result = run("emulate", "spec.toml", "day.toml", "--seed", "3")
    assert result.exit_code == 0
    header, first, *rest = result.stdout.splitlines()
    assert header == "time_s,voltage_V,temperature_C,voltage_code,temperature_code,clearance_mm,reading"
    assert first.endswith(",3.0,0")
    assert rest[-1].endswith(",3.0,1")
    assert run("emulate", "spec.toml", "day.toml", "--seed", "3").stdout == result.stdout
    assert run("emulate", "spec.toml", "day.toml", "--seed", "4").stdout != result.stdout
    written = run("emulate", "spec.toml", "day.toml", "--seed", "3", "-o", "day.csv")
    assert (folder / "day.csv").read_text(encoding="utf-8") == result.stdout
    assert "note:" not in written.stderr


def test_a_note_where_the_temperature_leaves_the_inputs_range(folder: Path) -> None:
    result = run("emulate", "spec.toml", "hot.toml", "-o", "hot.csv")
    assert result.exit_code == 0
    assert (
        "note: hot.toml: excerpt[0] reaches 200 degC, but the range of the core's temperature input ends at"
        in result.stderr
    )
    assert (folder / "hot.csv").exists()


def test_measurements_that_the_store_takes(folder: Path) -> None:
    shown = run("emulate", "spec.toml", "depot.toml", "--measurements")
    assert shown.exit_code == 0
    assert shown.stdout.splitlines()[0] == "clearance_mm,voltage_V,temperature_C,date"
    assert len(shown.stdout.splitlines()) == 1 + 72
    written = run("emulate", "spec.toml", "depot.toml", "--measurements", "-o", "m.csv")
    assert (folder / "m.csv").read_text(encoding="utf-8") == shown.stdout
    assert "wrote m.csv: 72 measurements" in written.stderr
    added = run("calibrate", "add", "m.csv", "--method", "paper", "--required-r", "0.9")
    assert added.exit_code == 0, added.output
    assert "stored 72 measurements" in added.stderr


def test_the_list_tells_about_files(folder: Path) -> None:
    listed = run("emulate", "spec.toml")
    assert "bench_43_50" in listed.stdout
    assert "a scenario file can be given instead of a name: sosmith init --list names examples" in listed.stderr


@pytest.mark.sweep(3)
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("emulate", "spec.toml", "none.toml"),
            "none.toml: the file must be a readable file, not: no such file or directory",
        ),
        (
            ("emulate", "spec.toml", "day.toml", "--seconds", "5"),
            "--seconds must come with a scenario's name, not with the file day.toml",
        ),
        (
            ("emulate", "plain.toml", "day.toml"),
            "day.toml: the core must be an instrument with a voltage input, not a plain filter",
        ),
        (
            ("emulate", "spec.toml", "day.toml", "--measurements"),
            "day.toml: calibration must be a table with the depot's measurements, not missing",
        ),
        (
            ("emulate", "spec.toml", "depot.toml", "--measurements", "--seconds", "5"),
            "--seconds must come with a scenario's name, not with --measurements",
        ),
        (
            ("emulate", "spec.toml", "--measurements"),
            "--measurements must come with a scenario file (TOML), not without one",
        ),
        (
            ("emulate", "spec.toml", "wear_ramp", "--measurements"),
            "--measurements must come with a scenario file (TOML), not wear_ramp",
        ),
        (
            ("simulate", "spec.toml", "--trace", "spec.toml"),
            "spec.toml: name must be one of the keys description, start, sensors, wear, channel, calibration, excerpt, "
            "not an unknown one",
        ),
    ],
)
@pytest.mark.usefixtures("folder")
def test_refusals(arguments: tuple[str, ...], message: str) -> None:
    result = run(*arguments)
    assert isinstance(result.exception, SpecificationError)
    assert re.match(f"^{re.escape(message)}", str(result.exception))


def test_every_channel_has_noise_of_its_own_and_its_own_wear(folder: Path) -> None:
    assert "channels" not in INSTRUMENT
    spec = folder / "spec.toml"
    spec.write_text(INSTRUMENT.replace("[input.voltage]", "channels = 2\n[input.voltage]", 1), encoding="utf-8")
    made = design_core(load(spec))
    first, second = traces_for(made, "day.toml", seed=1)
    (alone, _) = traces_for(made, "day.toml", seed=2)
    assert first.truth is not None
    assert second.truth is not None
    assert (second.codes[1:] == alone.codes[:-1]).all()
    assert (first.codes != second.codes).any()
    assert (first.truth == second.truth).all()
    two = SHORT.replace("[wear]", "[[channel]]").replace(
        "[[excerpt]]", "[[channel]]\ninitial_clearance = 4.0\nrate = 0.0\n\n[[excerpt]]"
    )
    (folder / "two.toml").write_text(two, encoding="utf-8")
    clearances = [trace.truth for trace in traces_for(made, "two.toml", seed=1)]
    assert [float(truth[-1]) for truth in clearances if truth is not None] == [3.0, 4.0]


@pytest.mark.slow
def test_the_bench_of_the_paper_in_hardware(folder: Path) -> None:
    examples = Path(__file__).parents[2] / "examples"
    scenario = examples / "scenarios" / "bench_43_50.toml"
    result = run("simulate", str(examples / "flange_wear_bench.toml"), "--trace", str(scenario), "--json", "-o", "out")
    assert result.exit_code == 0, result.output
    report = json.loads((folder / "out" / "report.json").read_text(encoding="utf-8"))
    assert (report["bit_exact"], report["passed"], report["samples"]) == (True, True, 630)
    accuracy = report["accuracy_percent"]
    assert accuracy["hardware"] == pytest.approx(accuracy["golden"], abs=0.01)
    assert 80 < accuracy["unfiltered"] < 100


def test_a_specification_for_tread_braking_shows_all_of_its_temperatures() -> None:
    examples = Path(__file__).parents[2] / "examples" / "scenarios"
    spec = load(examples / "specifications" / "flange_wear_tread_braking.toml")
    assert spec.name == "flange_wear_tread_braking"
    scenario = load_scenario(examples / "tread_braking_200.toml")
    assert range_notes(scenario, spec.inputs) == ()
    assert range_notes(scenario, load(examples.parent / "flange_wear_locomotive.toml").inputs) != ()


@pytest.mark.slow
def test_the_vehicles_motion_reaches_the_trace(folder: Path) -> None:
    rest = SHORT.replace("seconds = 20", "seconds = 8")
    (folder / "rest.toml").write_text(rest, encoding="utf-8")
    (folder / "ride.toml").write_text(rest.replace('"depot"', '"curve"\nmotion_from = "vehicle"'), encoding="utf-8")
    made = design_core(load(folder / "spec.toml"))
    (moving,) = traces_for(made, "ride.toml", seed=1)
    (at_rest,) = traces_for(made, "rest.toml", seed=1)
    difference = moving.values()[:, 0] - at_rest.values()[:, 0]
    motion = vehicle_clearance("paper", moving.time, 1)
    # Noise and truth are the same, so that the voltages differ by the motion alone, at some 1.3 V/mm.
    assert np.corrcoef(difference, motion)[0, 1] > 0.98
    assert np.std(difference) > 0.2


def test_a_trace_of_several_channels_is_run_as_it_was_written(folder: Path) -> None:
    spec = INSTRUMENT.replace("[input.voltage]", "channels = 3\n[input.voltage]", 1)
    (folder / "spec.toml").write_text(spec, encoding="utf-8")
    written = run("emulate", "spec.toml", "day.toml", "--seed", "3", "-o", "day.csv")
    assert re.search(r"wrote day.csv: \d+ samples of each of 3 channels at [\d.]+ Hz\n", written.stderr)
    made = design_core(load(folder / "spec.toml"))
    given, again = traces_for(made, "day.toml", seed=3), traces_for(made, "day.csv", seed=1)
    assert len(given) == len(again) == 3
    for one, other in zip(given, again, strict=True):
        assert np.array_equal(one.codes, other.codes)
        assert one.truth is not None
        assert np.array_equal(one.truth, np.array(other.truth))


def test_a_trace_without_channels_goes_to_all_of_them(folder: Path) -> None:
    assert run("emulate", "spec.toml", "day.toml", "-o", "day.csv").exit_code == 0
    spec = INSTRUMENT.replace("[input.voltage]", "channels = 3\n[input.voltage]", 1)
    (folder / "spec.toml").write_text(spec, encoding="utf-8")
    first, second, third = traces_for(design_core(load(folder / "spec.toml")), "day.csv", seed=1)
    assert np.array_equal(first.codes[:-1], second.codes[1:])
    assert np.array_equal(first.codes[:-2], third.codes[2:])
