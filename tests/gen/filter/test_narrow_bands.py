"""Linear-phase filters with narrow pass bands, where scipy's exchange has few frequencies, and gains by tangents."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from sosmith.gen.filter import gain_limits
from sosmith.gen.filter.design import _kind_and_reference, _kind_of, fir_row
from sosmith.gen.filter.fir_design import designed_taps
from sosmith.gen.filter.gain_limits import keeps_to
from sosmith.gen.filter.loss_mask import LossMask
from sosmith.gen.filter.tangents import Tangents, keeps_by_tangents
from sosmith.model.arithmetic.correct_rounding import evaluate

HALF = Fraction(1, 2)


def mask(edge: Fraction, stop: Fraction, passed: str, stopped: int) -> LossMask:
    return LossMask(((Fraction(0), edge),), ((stop, HALF),), Fraction(passed), Fraction(stopped))


@pytest.mark.parametrize("family", ["halfband", "equiripple"])
@pytest.mark.parametrize("edge", [Fraction(1, 128), Fraction(1, 6400)])
def test_a_narrow_pass_band_takes_few_taps(edge: Fraction, family: str) -> None:
    """In the grid that scipy takes by itself there are fewer frequencies than coefficients, and it crashed."""
    narrow = mask(edge, HALF - edge, "0.01", 60)
    taps = designed_taps(family, narrow)
    assert len(taps) < 10
    assert keeps_to(taps, narrow)


@pytest.mark.parametrize("seed", range(12))
def test_tangents_decide_what_the_exact_gains_say(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = random.Random(f"tangents {seed}")
    half = [Fraction(rng.randint(-64, 64), 256) for _ in range(rng.randint(2, 9))]
    taps = [*half, Fraction(1, 2), *half[::-1]]
    gain = np.abs(np.fft.rfft([float(tap) for tap in taps], 4096))[1600:]
    limit = round(-20 * float(np.log10(gain.max())) + rng.choice([-1, 1]) * 0.01, 4)
    asked = LossMask((), ((Fraction(1600, 4096), HALF),), Fraction(1), Fraction(str(limit)))
    decided = keeps_by_tangents(taps, asked)
    monkeypatch.setattr(gain_limits, "keeps_by_tangents", lambda taps, mask: None)
    assert decided is keeps_to(taps, asked)


def test_a_gain_that_is_its_limit_stays_open_to_tangents() -> None:
    asked = LossMask(((Fraction(0), Fraction(1, 8)),), (), Fraction(10), Fraction(10))
    at_most_one = [Fraction(k, 16) for k in (-1, 8, 2, 8, -1)]
    assert keeps_by_tangents(at_most_one, asked) is None
    assert keeps_to(at_most_one, asked)


@pytest.mark.parametrize("taps", [[1, -3, 2], [0.5, 0.1, -0.3, 0.7, 0.2, 0.9]])
def test_no_magnitude_on_an_interval_is_beyond_its_bounds(taps: list[float]) -> None:
    own, edges = Tangents([Fraction(tap) for tap in taps]), [Fraction(k, 40) for k in range(21)]
    for low, high in pairwise(edges):
        middle, most, least = own.around(low, high)
        z = np.exp(-2j * np.pi * np.linspace(float(low), float(high), 101))
        gain = np.abs(np.polyval(taps[::-1], z))
        assert float(least) <= gain.min() + 1e-12
        assert gain.max() <= float(most) + 1e-12
        assert float(middle) == pytest.approx(gain[50])


@pytest.mark.parametrize(
    "taps", [[1], [1, 1], [1, -1], [1, 0, -1], [1, 0, 1], [2, 1], [1, 2, 1], [1, -2, 1], [-1, 2, -1], [3, 0, 1]]
)
def test_the_kind_of_taps_is_that_of_their_exact_gains(taps: list[int]) -> None:
    row = tuple(float(value) for value in fir_row([Fraction(tap) for tap in taps]))
    assert _kind_of(row) == evaluate(lambda: _kind_and_reference([row]))[0]
