"""Spectra: levels of noise and sine waves, degrees of freedom and intervals against their distribution."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from tests.documents.shown import ROOT

from sosmith.instrument.spectrum.peaks import FALSE_LINES, peaks
from sosmith.instrument.spectrum.settings import WINDOWS, SpectrumSettings
from sosmith.instrument.spectrum.spectra import FINER, degrees_of_freedom, slow_rms, spectrum
from sosmith.model.errors import SpecificationError

RATE = 50.0
PLAIN = SpectrumSettings()


@pytest.mark.sweep(1)
@pytest.mark.parametrize("window", WINDOWS)
def test_the_density_of_white_noise_is_its_power_over_the_band(window: str) -> None:
    noise = np.random.default_rng(1).normal(0, 0.2, 100_000)
    found = spectrum(noise, RATE, SpectrumSettings(window=window, segment=10.0))
    assert np.mean(found.density[3:-3]) == pytest.approx(0.04 / (RATE / 2), rel=0.02)
    assert found.rms == pytest.approx(0.2, rel=0.02)
    assert found.step == pytest.approx(0.1)


@pytest.mark.parametrize("window", WINDOWS)
def test_the_amplitude_of_a_sine_wave_is_read_off(window: str) -> None:
    time = np.arange(5000) / RATE
    found = spectrum(0.3 * np.sin(2 * np.pi * 4.0 * time), RATE, SpectrumSettings(window=window, segment=10.0))
    assert found.frequency[int(np.argmax(found.amplitude))] == pytest.approx(4.0)
    assert np.max(found.amplitude) == pytest.approx(0.3, rel=1e-3)
    assert found.rms == pytest.approx(0.3 / np.sqrt(2), rel=1e-3)


@pytest.mark.parametrize("window", WINDOWS)
def test_a_wave_at_half_the_sample_rate_has_its_amplitude_and_is_called_out(window: str) -> None:
    alternating = 0.3 * np.cos(np.pi * np.arange(5000))
    found = spectrum(alternating, RATE, SpectrumSettings(window=window, segment=10.0))
    assert found.amplitude[-1] == pytest.approx(0.3, rel=1e-3)
    assert peaks(found)[0] == (RATE / 2, found.amplitude[-1])
    assert found.rms == pytest.approx(0.3, rel=1e-3)


def test_at_zero_frequency_the_amplitude_is_the_mean() -> None:
    found = spectrum(np.full(1000, -2.0), RATE, SpectrumSettings(detrend="none"))
    assert found.amplitude[0] == pytest.approx(2)


def test_a_line_is_no_part_of_the_spectrum() -> None:
    slope = 3 + 0.5 * np.arange(1000) / RATE
    assert spectrum(slope, RATE, PLAIN).rms < 1e-12
    assert spectrum(slope, RATE, SpectrumSettings(detrend="constant")).rms > 0.1


@pytest.mark.slow
@pytest.mark.parametrize(("overlap", "window"), [(0.5, "hann"), (0.75, "hann"), (0.5, "boxcar"), (0.0, "hann")])
def test_degrees_of_freedom_and_interval_are_those_of_the_estimates(overlap: float, window: str) -> None:
    settings = SpectrumSettings(window=window, overlap=overlap, confidence=0.9)
    drawn = [spectrum(np.random.default_rng(k).normal(size=1024), RATE, settings) for k in range(200)]
    density = np.array([found.density[3:-3] for found in drawn])
    truth, first = 1 / (RATE / 2), drawn[0]
    # a chi-square variable of nu degrees of freedom over nu has the variance 2 / nu
    assert 2 * truth**2 / np.var(density) == pytest.approx(first.degrees_of_freedom, rel=0.1)
    inside = (first.lower * density < truth) & (truth < first.upper * density)
    assert np.mean(inside) == pytest.approx(0.9, abs=0.012)


def test_what_is_slower_than_a_segment_is_counted_apart() -> None:
    time = np.arange(10_000) / RATE
    slow, fast = np.sin(2 * np.pi * time / 200), np.sin(2 * np.pi * 3 * time)
    assert slow_rms(5 + slow, 500) == pytest.approx(np.sqrt(0.5), rel=0.01)
    assert slow_rms(fast, 500) < 0.05
    assert slow_rms(np.random.default_rng(1).normal(size=10_000), 500) == pytest.approx(np.sqrt(3.3 / 500), rel=0.3)
    # together they are all of the signal but its mean
    rest = spectrum(slow + fast, RATE, SpectrumSettings(segment=10.0, window="boxcar", overlap=0.0))
    assert np.hypot(slow_rms(slow + fast, 500), rest.rms) == pytest.approx(1, rel=0.01)


def test_degrees_of_freedom_of_percival_and_walden() -> None:
    # Hann, half overlap: rho = 1/6, so nu -> 2 K / (1 + 2 / 36) for many segments
    assert degrees_of_freedom(np.hanning(4097)[:-1], 2048, 10_000) == pytest.approx(20_000 / (1 + 1 / 18), rel=1e-3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"window": "kaiser"}, f"window must be one of {', '.join(WINDOWS)}, not 'kaiser'"),
        ({"detrend": "all"}, "detrend must be one of linear, constant, none, not 'all'"),
        ({"segment": -1.0}, "segment must be a positive number of seconds, not -1"),
        ({"segment": float("nan")}, "segment must be a positive number of seconds, not nan"),
        ({"overlap": 1.0}, "overlap must be 0 to 0.95 of a segment, not 1"),
        ({"confidence": 1.0}, "confidence must be between 0 and 1, not 1"),
        ({"segment": 0.2}, "segment must be 0.32 to 20 s (16 to 1000 samples), not 0.2 s"),
        ({"segment": 21.0}, "segment must be 0.32 to 20 s (16 to 1000 samples), not 21 s"),
    ],
)
def test_refusals(given: dict[str, Any], message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        spectrum(np.zeros(1000), RATE, SpectrumSettings(**given))


# Lines that are called out.


@pytest.mark.sweep(1)
@pytest.mark.parametrize("window", WINDOWS)
def test_a_pure_tone_is_one_line_with_its_amplitude(window: str) -> None:
    """Whatever its frequency and phase: nothing else is called out, as the trend that it resembles in a segment."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        frequency, amplitude, phase = rng.uniform(0.5, 24), 10 ** rng.uniform(-3, 1), rng.uniform(0, 2 * np.pi)
        time = np.arange(int(rng.integers(2000, 5000))) / RATE
        found = spectrum(
            amplitude * np.sin(2 * np.pi * frequency * time + phase), RATE, SpectrumSettings(window=window)
        )
        ((at, height),) = peaks(found, 10)
        assert at == pytest.approx(frequency, abs=found.step)  # the top of flattop is that wide
        assert height == pytest.approx(amplitude, rel=0.02)


def test_a_tone_leaves_no_phantom_below_it() -> None:
    """1 mm at 1.2 Hz in segments of 37.5 s: a line that was fitted without weights left 0.01 mm at 0.0267 Hz."""
    time = np.arange(15_000) / RATE
    tone = np.sin(2 * np.pi * 1.2 * time + 0.3)
    found = spectrum(tone, RATE, SpectrumSettings(segment=37.5))
    assert np.max(found.amplitude[:40]) < 1e-6
    assert slow_rms(tone, 1875) < 1e-4


def test_tones_far_below_another_are_called_out_and_its_leakage_is_not() -> None:
    time = np.arange(20_000) / RATE
    tones = np.sin(2 * np.pi * 3.03 * time) + 2e-4 * np.sin(2 * np.pi * 7.77 * time)
    lines = peaks(spectrum(tones, RATE, PLAIN), 10)
    assert [(round(at, 2), round(height, 5)) for at, height in lines] == [(3.03, 1.0), (7.77, 2e-4)]


@pytest.mark.slow
def test_noise_has_no_lines() -> None:
    noise = [np.random.default_rng(k).normal(size=4000) for k in range(100)]
    assert sum(len(peaks(spectrum(one, RATE, PLAIN), 10)) for one in noise) <= 3


def test_a_tone_in_noise_is_called_out() -> None:
    time = np.arange(20_000) / RATE
    noisy = 0.1 * np.sin(2 * np.pi * 2.5 * time) + np.random.default_rng(1).normal(0, 0.3, len(time))
    ((at, height),) = peaks(spectrum(noisy, RATE, PLAIN), 10)
    assert at == pytest.approx(2.5, abs=0.01)
    assert height == pytest.approx(0.1, rel=0.2)


def test_the_document_states_the_loss_of_amplitude_and_the_share_of_false_lines() -> None:
    """The worst place for a wave is in the middle between two frequencies at which amplitudes are read."""
    text = " ".join((ROOT / "docs" / "spectrum.md").read_text(encoding="utf-8").split())
    time = np.arange(20_000) / RATE
    step = RATE / 2000
    wave = np.sin(2 * np.pi * (400 + 1 / (2 * FINER)) * step * time)
    ((_, height),) = peaks(spectrum(wave, RATE, SpectrumSettings(segment=40.0)))
    assert f"a Hann window loses at most {math.ceil(1000 * (1 - height)) / 10:g} %" in text
    assert f"(one false line in {round(1 / FALSE_LINES)} spectra of noise is expected)" in text
