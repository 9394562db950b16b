"""What a report tells of sound: levels in dB of full scale, distortion and noise of a tone, the spectrum."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from tests.gen.report.evidences import words_of

import sosmith
from sosmith.gen.report.comparison.rows import compare
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.figures.filter_plots import lowest_gain_db, phase, phase_figure
from sosmith.gen.report.figures.spectrum_plot import levels
from sosmith.gen.report.report import summarise
from sosmith.gen.report.run import run_of
from sosmith.instrument.scenarios.traces import default_scenario, traces_for
from sosmith.model.full_scale import is_sound, peak_dbfs, rms_dbfs
from sosmith.model.port import Port

BASS = {
    "name": "bass",
    "sample_rate": 48000,
    "input": {"x": {"bits": 16, "range": [-1.0, 1.0], "signed": True}},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 1000.0},
    "output": {"bits": 16, "range": [-1.0, 1.0], "signed": True},
    "hardware": {"realization": "df1_ef1", "architecture": "parallel"},
}


@cache
def bass() -> sosmith.Design:
    return sosmith.design(BASS)


@cache
def played(source: str) -> Evidence:
    core = bass().core
    traces = traces_for(core, source, seed=1, seconds=0.1)
    return Evidence(
        facts=bass().facts, run=run_of(core, traces), simulator="none", seed=1, tools={}, wall_seconds=1.0,
        cycles_per_second=1.0,
    )  # fmt: skip


def facts_of(evidence: Evidence) -> dict[str, str]:
    told = [fact for group in summarise(evidence)["facts"] for fact in group["facts"]]
    return {fact["name"]: f"{fact['text']}; {fact['sentence']}" for fact in told}


def test_levels_are_those_of_the_codes() -> None:
    assert peak_dbfs(1.0) == 0
    assert peak_dbfs(0.0) is rms_dbfs(0.0) is None
    assert rms_dbfs(np.sqrt(0.5)) == pytest.approx(0)
    run, told = played("tone").run, summarise(played("tone"))["sound"]
    codes = run.received.astype(float) / 32768
    assert told["peak_dbfs"] == pytest.approx(20 * np.log10(np.abs(codes).max()))
    assert told["rms_dbfs"] == pytest.approx(10 * np.log10(2 * np.mean(codes**2)))
    assert told["error_peak_dbfs"] == pytest.approx(20 * np.log10(np.abs(codes - run.golden).max()))
    assert told["error_rms_dbfs"] == pytest.approx(10 * np.log10(2 * np.mean((codes - run.golden) ** 2)))


def test_a_tone_has_its_distortion_and_noise() -> None:
    """Rounding to 16 bits is at -98.1 dBFS, so at 94 dB below a tone that the filter lets through at -4 dBFS."""
    evidence = played("tone")
    tone = summarise(evidence)["sound"]["tone"]
    assert tone["frequency"] == 997
    assert tone["level_dbfs"] == pytest.approx(-1 - 3, abs=0.05)
    assert tone["thd_n_db"] == pytest.approx(-94, abs=1)
    assert tone["exact_thd_n_db"] < -104  # of the input's rounding, what the low-pass lets through
    broken = evidence.run.received.copy()
    broken[::100] += 40
    lsb = evidence.facts.lsb
    worse = replace(evidence, run=replace(evidence.run, received=broken, values=broken * lsb))
    assert summarise(worse)["sound"]["tone"]["thd_n_db"] > tone["thd_n_db"] + 15
    told = [summarise(each) for each in (evidence, worse)]
    rows, facts = {row.title: row.cells for row in compare(told)}, facts_of(evidence)
    assert rows["distortion and noise (THD+N)"][0] == facts["Distortion and noise (THD+N)"].partition(";")[0]
    assert rows["largest error in dBFS"][0].endswith(" dBFS")
    late = replace(evidence.run, tone=replace(evidence.run.tone, settled=len(evidence.run) - 100))
    assert summarise(replace(evidence, run=late))["sound"]["tone"] is None


def test_the_figures_say_it() -> None:
    facts = facts_of(played("tone"))
    assert re.match(r"−9[345]\.\d\d dB; 997 Hz at −4.0 dBFS; the exact", facts["Distortion and noise (THD+N)"])
    assert re.match(r"−4\.\d dBFS; RMS; the largest value is at −3\.\d dBFS", facts["Level of the output"])
    assert ", −94." in facts["Largest error of the arithmetic"]


@pytest.mark.slow
def test_so_does_the_page() -> None:
    words = words_of(played("tone"))
    assert "Beside the tone of 997 Hz, distortion and noise are at −9" in words
    assert "Spectrum hardware hardware minus exact calculation" in words
    assert "the largest input leaves half an LSB" in words
    assert re.search(r"limit ±\S+ × 10⁻⁶, −\d\d\.\d dBFS", words)


def test_what_has_a_unit_or_another_full_scale_is_not_sound() -> None:
    x = Port.from_range("x", 16, Fraction(-1), Fraction(1), signed=True)
    assert is_sound([x], x)
    assert is_sound([x], Port.from_range("y", 24, Fraction(-2), Fraction(2), signed=True))
    for other in (
        replace(x, unit="V"),
        Port.from_range("x", 16, Fraction(-2), Fraction(2), signed=True),
        Port.from_range("x", 16, Fraction(0), Fraction(1)),
    ):
        assert not is_sound([other], x)
    assert not is_sound([x, x], x)
    assert not is_sound([x], replace(x, unit="V"))
    volts = {**BASS, "output": {**BASS["output"], "unit": "V"}}
    assert default_scenario(sosmith.design(volts).core) == "sweep"
    assert default_scenario(bass().core) == "passband_sweep"


def test_a_sine_over_the_whole_scale_is_at_0_dbfs_in_the_spectrum() -> None:
    frequency, level = levels(np.sin(2 * np.pi * 1000.5 / 4096 * np.arange(20000)), 4096.0)
    assert frequency[np.argmax(level)] in {1000, 1001}
    assert -0.45 < level.max() <= 0
    assert level[np.abs(frequency - 1000.5) > 20].max() < -200


def test_the_stop_band_is_drawn_down_to_what_can_be_seen() -> None:
    facts = bass().facts.filter
    assert facts is not None
    for bits in (12, 16, 24):
        least = -6.02 * bits
        assert lowest_gain_db(facts, least) == pytest.approx(min(-60, least - 12), abs=0.1)
    assert lowest_gain_db(replace(facts, stopband_loss=150.0), -98) == pytest.approx(-170, abs=0.1)


def test_the_phase_of_a_low_pass_falls_by_a_right_angle_for_each_pole() -> None:
    facts = bass().facts.filter
    assert facts is not None
    drawn = phase_figure(facts, -98)
    for degrees in ("0", "−45", "−90", "−135", "−180"):
        assert f">{degrees}</text>" in drawn
    frequency = np.array([1.0, 1000.0, 20000.0])
    assert phase(facts.ideal_sos, frequency, 48000.0) == pytest.approx([0, -90, -175], abs=4)
    two_samples = np.array([[0.0, 0.0, 1.0, 1.0, 0.0, 0.0]])
    frequency = np.linspace(0, 24000, 100)
    assert phase(two_samples, frequency, 48000.0) == pytest.approx(-720 * frequency / 48000)
