"""Pure tones: the lines that are called out are these and no others, with amplitudes within 2 %."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from sosmith.instrument.spectrum.peaks import RESOLVED, peaks, unresolved
from sosmith.instrument.spectrum.settings import SpectrumSettings
from sosmith.instrument.spectrum.spectra import SEGMENTS, spectrum
from sosmith.instrument.spectrum.tables import signals_table
from sosmith.model.arrays import Values

RATE = 100.0
OTHERS = 4
"""Lines beyond the tones that would be listed if there were any."""
WITHIN = 0.02
KINDS = ("sweep", "few periods", "between bins", "two", "near", "trend", "noise", "trend and noise")


@dataclass(frozen=True)
class Case:
    """A signal with tones of given frequencies in Hz and amplitudes."""

    values: Values
    tones: tuple[tuple[float, float], ...]
    step: float


def drawn(kind: str, number: int) -> Case:
    """Draw a case: lengths of 60 to 300 s, amplitudes of 1 um to 10 mm, any phases."""
    rng = np.random.default_rng([KINDS.index(kind), number])
    count = int(rng.choice([6000, 12_001, 30_000]))
    step, time = RATE / (count // SEGMENTS), np.arange(count) / RATE
    low, high = 4 * step, 0.49 * RATE
    large = 10 ** rng.uniform(-3, 1)
    first = 10 ** rng.uniform(np.log10(low), np.log10(high))
    tones = [(first, large)]
    if kind == "few periods":
        tones = [(rng.uniform(RESOLVED, 4) * step, large)]
    elif kind == "between bins":
        tones = [((rng.integers(4, round(high / step)) + 0.5) * step, large)]
    elif kind == "two":
        away = rng.uniform(8 * step, high - low)
        tones.append((low + (first - low + away) % (high - low), large * 10 ** rng.uniform(-2, 0)))
    elif kind == "near":
        first = rng.uniform(low, high - 8 * step)
        tones = [(first, large), (first + rng.uniform(5, 8) * step, large * rng.uniform(0.3, 1))]
    values = sum(a * np.sin(2 * np.pi * f * time + rng.uniform(0, 2 * np.pi)) for f, a in tones) + np.zeros(count)
    if kind.startswith("trend"):
        values += rng.uniform(-20, 20) * large * time / time[-1] + rng.uniform(-10, 10)
    if kind.endswith("noise"):
        values += rng.normal(0, large * 10 ** rng.uniform(-2, -0.7), count)
    return Case(values, tuple(tones), step)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "numbers", [range(6), pytest.param(range(6, 60), marks=pytest.mark.slow)], ids=["a few", "the others"]
)
def test_tones_are_the_only_lines_with_their_amplitudes(kind: str, numbers: range) -> None:
    for number in numbers:
        case = drawn(kind, number)
        lines = peaks(spectrum(case.values, RATE, SpectrumSettings()), len(case.tones) + OTHERS)
        assert len(lines) == len(case.tones), (number, lines, case.tones)
        for (frequency, amplitude), (at, height) in zip(sorted(case.tones), sorted(lines), strict=True):
            assert at == pytest.approx(frequency, abs=case.step / 8), (number, lines, case.tones)
            assert height == pytest.approx(amplitude, rel=WITHIN), (number, lines, case.tones)


@pytest.mark.slow
@pytest.mark.parametrize("cycles", [0.6, 0.8, 1.0, 1.3, 1.6, 2.0])
def test_a_tone_of_too_few_cycles_is_told_as_such_and_leaves_no_phantom(cycles: float) -> None:
    """Detrending takes much of it for a line, whose rest would be lines that are not in the signal."""
    count = 30_000
    step, time = RATE / (count // SEGMENTS), np.arange(count) / RATE
    for phase in np.linspace(0, 2 * np.pi, 13):
        found = spectrum(np.sin(2 * np.pi * cycles * step * time + phase), RATE, SpectrumSettings())
        assert peaks(found, 10) == []
        assert 0.05 < unresolved(found) < 1.2
        shown = signals_table(["a"], ["mm"], [{"measured": found}]).rows[0][-1]
        assert shown == f"about {unresolved(found):.2g} mm below {RESOLVED * step:.3g} Hz: --segment is too short"
    longer = spectrum(np.sin(2 * np.pi * cycles * step * time), RATE, SpectrumSettings(segment=4 / (cycles * step)))
    ((at, height),) = peaks(longer, 10)
    assert (at, height) == (pytest.approx(cycles * step, abs=longer.step / 8), pytest.approx(1, rel=WITHIN))


def test_a_steady_trend_hides_no_line() -> None:
    """Its line is the same in all segments: nothing of it is in the spectrum, however steep it is."""
    time = np.arange(30_000) / RATE
    step = RATE / (30_000 // SEGMENTS)
    values = 1000 * time / time[-1] + 0.001 * np.sin(2 * np.pi * 5.3 * step * time)
    ((at, height),) = peaks(spectrum(values, RATE, SpectrumSettings()), 10)
    assert (at, height) == (pytest.approx(5.3 * step, abs=step / 8), pytest.approx(0.001, rel=WITHIN))
    assert unresolved(spectrum(values, RATE, SpectrumSettings())) == 0
