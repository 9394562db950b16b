"""Error against the true value, delay, settling: measures against closed forms, and where they are said."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import signal
from tests.gen.report.behaviours import told
from tests.gen.report.evidences import F7, LSB, bandpass, changed, evidence, facts, plain, words_of

from sosmith.cli import cli
from sosmith.commands.options import print_tables
from sosmith.gen.filter import response
from sosmith.gen.filter.step_response import step_response
from sosmith.gen.output.core_facts import SettlingFacts
from sosmith.gen.report.behaviour import behaviour
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.figures.report_figures import histogram_caption
from sosmith.gen.report.headlines import report_table
from sosmith.gen.report.report import summarise

FIRST_ORDER = np.array([[0.1, 0.0, 0.0, 1.0, -0.9, 0.0]])
"""y(n) = 0.9 y(n-1) + 0.1 x(n): a step leaves 0.9**(n+1) to go."""


@pytest.fixture(scope="module")
def words() -> str:
    """Words of the page of a run with all that is told about it."""
    files = {"wear.sv": "1" * 64, "wear.certificate.json": "2" * 64}
    return words_of(evidence(provenance=told(), specification="wear.toml", date="2026-11-23", files=files))


def tiles_of(run: Evidence) -> str:
    """Words of the tiles of `run`."""
    words = []
    for group in summarise(run)["facts"]:
        words.append(group["title"])
        words += [fact[key] for fact in group["facts"] for key in ("name", "text", "sentence")]
    return " ".join(words)


# the step response


def test_a_first_order_filter_settles_when_its_power_says_so() -> None:
    step = step_response(FIRST_ORDER, 10.0, 1e-6)
    assert step is not None
    assert (step.final, step.overshoot) == (pytest.approx(1.0), 0.0)
    for tolerance in (0.01, 1e-6):
        assert step.samples_to(tolerance) == math.ceil(math.log(tolerance) / math.log(0.9) - 1)


def test_overshoot_of_a_resonance() -> None:
    """Poles matched to those of an oscillator of damping z: its step peaks exp(-pi z / sqrt(1 - z^2)) above the end."""
    damping, samples = 0.4, 50
    angle = math.pi / samples
    radius = math.exp(-angle * damping / math.sqrt(1 - damping**2))
    a1, a2 = -2 * radius * math.cos(angle), radius**2
    step = step_response(np.array([[0.0, 1 + a1 + a2, 0.0, 1.0, a1, a2]]), 1.0, 1e-6)
    assert step is not None
    expected = math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
    assert step.overshoot == pytest.approx(expected, rel=0.05)


def test_a_band_pass_settles_at_zero_and_does_not_overshoot() -> None:
    step = step_response(signal.butter(2, (8, 12), btype="bandpass", fs=100, output="sos"), 100.0, 1e-6)
    assert step is not None
    assert not step.passes_constants
    assert step.overshoot is None
    assert np.all(np.abs(step.values[step.samples_to(0.01) :]) <= 0.01 * np.max(np.abs(step.values)))


def test_no_step_response_of_what_never_settles() -> None:
    assert step_response(np.array([[1.0, 0.0, 0.0, 1.0, -1.0, 0.0]]), 1.0, 1e-6) is None
    assert step_response(np.array([[1.0, 0.0, 0.0, 1.0, -0.9999999, 0.0]]), 1.0, 1e-6) is None


# the figures of a run


def test_error_against_the_true_value_counts_the_readings() -> None:
    ones = np.ones(4)
    run = evidence(
        time=np.arange(4.0), golden=ones, hardware=np.array([9.0, 1.5, 0.9, 9.0]), truth=ones, unfiltered=ones,
        reading=np.array([False, True, True, False]),
    )  # fmt: skip
    assert summarise(run)["true_error"] == {
        "max_abs": 0.5,
        "rms": pytest.approx(math.sqrt(0.13)),
        "mean": pytest.approx(0.2),
        "readings": 2,
    }
    assert summarise(changed(run, reading=None))["true_error"]["readings"] == 4
    assert summarise(plain())["true_error"] is None


def test_delay_is_where_signals_pass() -> None:
    """Of the paper's filter 2.76 s at zero frequency; of a band-pass in the middle of its band."""
    low, middle = summarise(evidence())["delay"], summarise(bandpass())["delay"]
    assert low == {"seconds": pytest.approx(2.764, abs=1e-3), "frequency": 0.0}
    assert middle["frequency"] == pytest.approx(math.sqrt(9 * 11))
    assert summarise(plain())["delay"] is None


def test_settling_is_told_to_one_percent_and_to_half_a_step_of_the_output() -> None:
    told = summarise(evidence(filter=facts(quantized_sos=FIRST_ORDER, ideal_sos=FIRST_ORDER)))["settling"]
    fine = math.ceil(math.log(LSB / 2 / 16) / math.log(0.9) - 1)
    assert told == {"seconds": 0.43, "half_lsb_seconds": fine / 100, "overshoot_percent": 0.0}
    unstable = facts(quantized_sos=F7 * [1, 1, 1, 1, 1, 1.1])
    assert summarise(evidence(filter=unstable))["settling"] is None


def test_the_transient_is_what_the_hardware_flags_at_the_beginning() -> None:
    assert behaviour(evidence()).transient == 0
    samples = np.arange(len(evidence().run.time))
    assert behaviour(evidence(unsettled=samples < 1250)).transient == 1250
    assert behaviour(evidence(unsettled=(samples < 1250) | (samples == 2000))).transient == 1250
    assert behaviour(evidence(unsettled=samples >= 0)).transient == len(samples)
    ones = np.ones((3, 2))
    several = plain(
        filter=facts(), time=np.arange(3.0), golden=ones, hardware=ones,
        unsettled=np.array([[True, True], [False, True], [False, False]]),
    )  # fmt: skip
    assert behaviour(several).transient == 2


# the page


@pytest.mark.slow
def test_the_measurement_comes_first_and_the_speed_last(words: str) -> None:
    titles = ("Passed", "The measurement", "The arithmetic", "The hardware", "The measured signal", "The error")
    titles += ("The filter", "How this was made", "speed 6.00 kHz", "Evidence date")
    places = [words.index(title) for title in titles]
    assert places == sorted(places)
    first = words[words.index("The measurement") : words.index("The arithmetic")]
    for name in (
        "Largest error against the true value",
        "Delay of the filter 2.76 s",
        "Settling time",
        "overshoot 15.4 %",
    ):
        assert name in first


def test_without_a_true_value_the_gain_stands_in_its_place() -> None:
    assert tiles_of(bandpass()).startswith("The measurement Largest error against the true value")
    assert tiles_of(changed(bandpass(), truth=None)).startswith("The measurement Change of the gain in the passband")
    assert tiles_of(plain()).startswith("The arithmetic Largest error of the arithmetic")
    latency = "Latency of the hardware 1.92 µs 23 clock cycles at 12.0 MHz, from an input sample to its result The sim"
    assert latency in tiles_of(plain())


def test_figures_of_the_speed_agree() -> None:
    """9,007 cycles at 6,005 a second are 1.5 s; the run around them took longer."""
    told = tiles_of(evidence(wall_seconds=105.0))
    assert "6.00 kHz clock 9,007 clock cycles with verilator in 1.50 s" in told
    assert told.endswith("took 1 min 45 s")
    assert "not measured" in tiles_of(evidence(cycles_per_second=math.inf))


def test_the_histogram_says_how_many_errors_rounding_the_output_explains() -> None:
    told = "One LSB is 244 nm. All samples lie between the dotted lines at ±½ LSB, where rounding the output alone"
    run = evidence()
    assert histogram_caption(run).replace("\u00a0", " ").startswith(told)
    moved = run.run.hardware.copy()
    moved[::10] += LSB
    some = histogram_caption(changed(run, hardware=moved))
    assert " 90 % of the samples lie between the dotted lines" in some
    moved = run.run.hardware.copy()
    moved[0] += LSB
    assert " More than 99 % of the samples" in histogram_caption(changed(run, hardware=moved))


@pytest.mark.slow
def test_errors_have_one_unit(words: str) -> None:
    """A limit of 200 nm sets it for tile, legend and tables."""
    assert "122 nm" in words
    assert "part at most in nm in LSB output 122 0.5000" in words
    assert "df1 400,000 1,638 100,000" in words


@pytest.mark.slow
def test_settling_is_shaded(words: str) -> None:
    assert "settled after" in words
    shaded = words_of(evidence(settling=SettlingFacts(samples=1250, seconds=12.5, limit=LSB / 2)))
    assert "settling from the start at zero, 12.5 s" in shaded
    assert "settling from the start at zero" not in words
    assert "date not given" in shaded


@pytest.mark.slow
def test_evidence_is_named_with_digests(words: str) -> None:
    for row in (f"specification wear.toml {'s' * 64}", f"certificate wear.certificate.json {'2' * 64}"):
        assert row in words
    assert f"generated files wear.sv {'1' * 64}" in words
    assert words.count("2026-11-23") == 2


# the terminal


def test_the_table_says_the_same(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "120")
    print_tables([report_table(summarise(evidence()))])
    shown = [line.strip() for line in capsys.readouterr().out.splitlines()]
    order = [re.split(r"\s{2,}", line)[0] for line in shown if re.search(r"\S\s{2,}\S", line)]
    assert order == [
        "Largest error against the true value",
        "Accuracy",
        "Delay of the filter",
        "Settling time",
        "Largest error of the arithmetic",
        "Typical error (RMS)",
        "Samples equal to the integer model",
        "Signal to error",
        "Latency of the hardware",
        "Largest error with df1 at the same widths",
        "Speed",
    ]
    assert any("2.76 s" in line for line in shown)
    assert any("9,007 clock cycles with verilator in 1.50 s; the whole" in line for line in shown)


@pytest.mark.parametrize("date", ["2026-13-01", "today", "2026-1-1"])
def test_a_date_must_be_one(date: str, tmp_path: Path) -> None:
    spec = str(Path(__file__).parents[3] / "examples" / "audio_lowpass.toml")
    result = CliRunner().invoke(cli, ["simulate", spec, "--date", date, "-o", str(tmp_path / "out")])
    assert str(result.exception) == f"date must be a date such as 2024-03-01, not '{date}'"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("kind", "passes"), [("lowpass", 0.0), ("highpass", 50.0)])
def test_the_cutoff_of_a_second_kind_is_no_edge_of_the_passband(kind: str, passes: float) -> None:
    """At its cut-off the loss is that of the stopband already."""
    sos = signal.cheby2(6, 60, 12.5, btype=kind, fs=100, output="sos")
    made = facts(ideal_sos=sos, quantized_sos=sos, kind=kind, cutoff=(12.5,), cutoff_of_stopband=True)
    ((low, high),) = response.passbands(made)
    assert passes in {low, high}
    assert response.stopbands(made) == ([(12.5, 50.0)] if kind == "lowpass" else [(0.0, 12.5)])
    measured = response.measure_response(made)
    assert measured.passband_loss_db == pytest.approx(3.01, abs=0.05)
    assert measured.stopband_attenuation_db == pytest.approx(60.0, abs=0.01)


def test_what_a_stopband_leaves_of_a_constant_is_no_end_to_overshoot() -> None:
    step = step_response(signal.cheby2(6, 60, 12.5, btype="highpass", fs=100, output="sos"), 100.0, 1e-6)
    assert step is not None
    assert abs(step.final) == pytest.approx(0.001)
    assert (step.passes_constants, step.overshoot) == (False, None)
    assert step.scale == pytest.approx(float(np.max(np.abs(step.values))))
