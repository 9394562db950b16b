"""`sosmith vehicle` as a user meets it: what it prints, what it refuses, what it writes."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from tests.commands.invocation import Invocation

from sosmith.instrument.vehicle.parameters import built_in, built_in_text

INVOCATION = Invocation("vehicle", columns=110)
run, good, refused = INVOCATION.run, INVOCATION.good, INVOCATION.refused


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Start in an empty folder with the parameters of a short track in short.toml."""
    monkeypatch.chdir(tmp_path)
    text = built_in_text().replace("curve = { value = 300.0", "curve = { value = 20.0")
    Path("short.toml").write_text(text.replace("run_out = { value = 200.0", "run_out = { value = 0.0"))
    return tmp_path


@pytest.mark.slow
def test_it_answers_in_half_a_screen() -> None:
    result = good("short.toml")
    shown = re.sub(r" {2,}", "  ", result.stdout)
    assert len(shown.splitlines()) < 16
    for row in (
        "Co-Co locomotive, paper track at 20 m/s, smooth track, nonlinear contacts",
        "  beyond the flange, mm  +",
        "  flange force, kN  ",
        "  creep force / friction  1.000  ",
        "  Y/Q, climbs at 1.34  0.",
        "  change of clearance, mm  ",
        "The body feels up to ",
    ):
        assert row in shown
    assert "modes" not in shown
    assert re.search(r"^sosmith: 130 m of track took \d+\.\d s of processor time$", result.stderr, flags=re.MULTILINE)
    assert "exceeds the limits" not in result.stderr


@pytest.mark.slow
def test_details_show_modes_motions_and_the_paper() -> None:
    shown = re.sub(r" {2,}", "  ", good("short.toml", "--details").stdout)
    for row in (
        "nonlinear contacts",
        "Lateral modes at 20 m/s",
        "  0.538  0.154  -0.525  body lateral",
        "Vertical modes at 20 m/s",
        "Largest motion of the wheelsets",
        "  sliding, % of the time  ",
        "Largest motion of frames and body",
        "Comparison with the paper's tables 5 to 8",
        "5: the scale of the paper's transform is not told",
    ):
        assert row in shown
    assert re.search(r"7  yaw, wheelset 1 to bogie 1  rad  0.012578  0.0\d+  differs  4", shown)


@pytest.mark.slow
def test_the_linear_model_tells_what_it_exceeds() -> None:
    result = good("short.toml", "--model", "linear")
    assert "smooth track, linear contacts" in result.stdout
    assert re.search(
        r"^sosmith: this run exceeds the limits of the linear model: wheelset 1 moves [\d.]+ mm past the flange and "
        r"the creep force of wheelset 1 is [\d.]+ times the available friction$",
        result.stderr,
        flags=re.MULTILINE,
    )


@pytest.mark.slow
def test_a_wheel_that_would_climb_is_told() -> None:
    """With so much friction that the slope of the cones is steep enough to climb on."""
    text = Path("short.toml").read_text()
    Path("rough.toml").write_text(text.replace("friction = { value = 0.3,", "friction = { value = 1.9,"))
    result = good("rough.toml")
    assert re.search(
        r"^sosmith: this run exceeds the limits of the nonlinear model: wheelset \d climbs the rail, "
        r"with a Y/Q of [\d.]+ against 0\.14",
        result.stderr,
        flags=re.MULTILINE,
    )


@pytest.mark.slow
def test_json_holds_figures_limits_and_sources() -> None:
    printed = good("short.toml", "--json").stdout
    found = json.loads(printed)
    assert (found["track"], found["speed_m_s"], found["irregularities"], found["seed"]) == ("paper", 20.0, "none", 1)
    assert found["samples"] == 651
    assert all(mode["growth_per_s"] < 0 for mode in found["modes"]["lateral"] + found["modes"]["vertical"])
    assert found["model"] == "nonlinear"
    assert 14 < found["largest"]["wheelset1_lateral_mm"] < 25
    assert len(found["limits"]) == 6
    assert max(one["friction_used"] for one in found["limits"]) == 1
    assert max(one["derailment_quotient"] for one in found["limits"]) < found["nadal_limit"]
    assert found["within_limits"] is True
    assert len(found["comparison"]) == 41
    radius = found["parameters"]["track.radius"]
    assert (radius["value"], radius["unit"]) == (350.0, "m")
    assert radius["source"].startswith("[assumed]")
    assert found["parameters"]["track.curve"]["value"] == 20.0
    assert len(found["parameters"]) == len(built_in().sources)
    assert good("short.toml", "--json").stdout == printed


@pytest.mark.slow
def test_motion_goes_to_a_csv_file() -> None:
    options = ["--irregularities", "low", "--seed", "3", "--sample-rate", "50", "--model", "linear"]
    good("short.toml", "-o", "out/motion.csv", *options)
    with Path("out/motion.csv").open(newline="") as stream:
        header, *rows = csv.reader(stream)
    assert header[:3] == ["time_s", "distance_m", "wheelset1_lateral_mm"]
    assert header[-1] == "clearance6_mm"
    values = np.array(rows, dtype=float)
    assert values.shape == (326, 47)
    assert values[:, 0] == pytest.approx(np.arange(326) / 50)
    assert values[:, 1] == pytest.approx(0.4 * np.arange(326))
    assert "-0.000000" not in Path("out/motion.csv").read_text()
    first = Path("out/motion.csv").read_bytes()
    good("short.toml", "-o", "out/motion.csv", *options)
    assert Path("out/motion.csv").read_bytes() == first


@pytest.mark.slow
@pytest.mark.parametrize("name", ["motion.svg", pytest.param("motion.PNG", marks=pytest.mark.slow)])
def test_a_plot_is_the_same_bytes_every_time(name: str) -> None:
    arguments = ("short.toml", "--plot", name, "--irregularities", "high", "--model", "linear")
    assert f"sosmith: wrote {name}\n" in good(*arguments).stderr
    first = Path(name).read_bytes()
    assert first.startswith(b"\x89PNG" if name.endswith("PNG") else b"<?xml")
    good(*arguments)
    assert Path(name).read_bytes() == first


@pytest.mark.slow
def test_a_tangent_track_can_be_within_the_limits() -> None:
    text = Path("short.toml").read_text().replace("irregularity = { value = 0.02,", "irregularity = { value = 0.002,")
    Path("calm.toml").write_text(text)
    result = good("calm.toml", "--track", "tangent", "--model", "linear", "--details")
    assert "this run exceeds" not in result.stderr
    assert "Comparison with the paper" not in result.stdout


def test_the_built_in_parameters_can_be_written_and_changed() -> None:
    assert "sosmith: wrote mine.toml\n" in good("--write-parameters", "mine.toml").stderr
    assert Path("mine.toml").read_text() == built_in_text()


def test_slips_are_refused() -> None:
    refused("the speed must be from 1 to 100 m/s, not 0", "--speed", "0")
    refused("the seed must be 0 or more, not -1", "--seed", "-1", "--irregularities", "low")
    refused("a.pdf: the plot's name must end in .svg or .png, not .pdf", "--plot", "a.pdf")
    refused("a: the plot's name must end in .svg or .png, not neither", "--plot", "a")
    refused("none.toml: the file of parameters must be a readable file, not: no such file or directory", "none.toml")
    Path("broken.toml").write_text(built_in_text().replace('unit = "kg"', 'unit = "t"', 1))
    refused("broken.toml: wheelset.mass must be in the unit 'kg', not 't'", "broken.toml")
    assert run("--irregularities", "medium").exit_code == 2
    assert "did you mean linear?" in run("--model", "liner").stderr
