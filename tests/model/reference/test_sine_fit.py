"""The sine in a signal, and what is left beside it: known residues, known quantizers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sosmith.model.reference.sine_fit import sine_fit

RATE = 48000.0
PHASE = 2 * np.pi * 997 / RATE * np.arange(16000) + 0.3


def test_a_harmonic_is_told_in_db_of_the_fundamental() -> None:
    found = sine_fit(0.5 * np.sin(PHASE) + 0.0005 * np.sin(3 * PHASE) + 0.1, 997, RATE)
    assert found is not None
    assert found.amplitude == pytest.approx(0.5, rel=1e-6)
    assert found.thd_n_db == pytest.approx(-60, abs=0.01)


@pytest.mark.parametrize("bits", [8, 16, 24])
def test_a_quantizer_leaves_what_theory_says(bits: int) -> None:
    """A sine over the whole scale has 6.02 B + 1.76 dB over the noise of rounding (IEEE Std 1241)."""
    found = sine_fit(np.rint((2 ** (bits - 1) - 1) * np.sin(PHASE)).astype(np.int64), 997, RATE)
    assert found is not None
    assert found.thd_n_db == pytest.approx(-(6.02 * bits + 1.76), abs=0.3)


def test_what_cannot_be_measured() -> None:
    assert sine_fit(np.sin(PHASE[:190]), 997, RATE) is None
    assert sine_fit(np.sin(PHASE[:15]), 20000, RATE) is None
    silence = sine_fit(np.zeros(1000, np.int16), 997, RATE)
    assert silence is not None
    assert (silence.amplitude, silence.thd_n_db) == (0, None)
    other = sine_fit(np.sin(1.01 * PHASE), 997, RATE)
    assert other is not None
    assert other.thd_n_db is not None
    assert other.thd_n_db > 0
    assert math.isfinite(other.thd_n_db)
