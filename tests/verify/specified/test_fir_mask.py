"""Bands of FIR filters told from a limit by bisection: as their gains on a fine grid say, however far bands reach."""

from fractions import Fraction

import numpy as np
import pytest

from sosmith.verify.specified.filter_table import FilterTable
from sosmith.verify.specified.fir_mask import keeps_to_losses
from sosmith.verify.specified.section_mask import bands_of

EDGES = {
    "lowpass": ((Fraction(1, 10),), (Fraction(1, 5),)),
    "highpass": ((Fraction(1, 5),), (Fraction(1, 10),)),
    "bandpass": ((Fraction(1, 5), Fraction(3, 10)), (Fraction(1, 10), Fraction(2, 5))),
    "bandstop": ((Fraction(1, 10), Fraction(2, 5)), (Fraction(1, 5), Fraction(3, 10))),
}


def table(kind: str, losses: tuple[float, float], edges: tuple[tuple[Fraction, ...], ...] | None = None) -> FilterTable:
    passband, stopband = edges or EDGES[kind]
    named = dict(zip(("passband_loss", "stopband_loss"), map(Fraction, losses), strict=True))
    return FilterTable(family="kaiser", kind=kind, passband_edge=passband, stopband_edge=stopband, losses=named)


@pytest.mark.parametrize("kind", EDGES)
def test_limits_a_hair_beyond_the_gains_are_kept_and_others_not(kind: str) -> None:
    """Random taps about a larger one, so that no gain is near 0, scaled so that the largest is just below 1."""
    half = np.random.default_rng(1).uniform(-1, 1, 6) / 2
    taps = np.concatenate([half, [5], half[::-1]])
    angles = 2j * np.pi * np.linspace(0, 0.5, 6001)  # edges among them
    gains = np.abs(np.exp(-angles[:, np.newaxis] * np.arange(len(taps))) @ taps)
    scale = 1.0001 * gains.max()
    given = tuple(map(Fraction, (taps / scale).tolist()))
    passing, stopping = (
        np.concatenate([gains[round(12000 * float(low)) : round(12000 * float(high)) + 1] for low, high in bands])
        for bands in bands_of(table(kind, (1, 1)))
    )
    losses = -20 * np.log10(passing.min() / scale), -20 * np.log10(stopping.max() / scale)
    assert keeps_to_losses(given, table(kind, (losses[0] + 0.001, losses[1] - 0.001)))
    assert not keeps_to_losses(given, table(kind, (losses[0] - 0.001, losses[1] - 0.001)))
    assert not keeps_to_losses(given, table(kind, (losses[0] + 0.001, losses[1] + 0.001)))
    assert not keeps_to_losses([4 * tap for tap in given], table(kind, (losses[0] + 0.001, 0.001)))
    # Zeros at the ends delay it, or nothing: as of every L-th tap of a filter, the last may be missing.
    assert keeps_to_losses([Fraction(0), *given], table(kind, (losses[0] + 0.001, losses[1] - 0.001)))
    assert not keeps_to_losses([Fraction(0), *given], table(kind, (losses[0] - 0.001, losses[1] - 0.001)))


def test_a_band_is_not_judged_by_its_middle() -> None:
    """The gain ``0.45 (1 - cos 8 w)`` is 0 in the middle of the stop band, flat there, and 0.9 on both sides."""
    taps = [Fraction(tap) for tap in (-0.225, *[0] * 7, 0.45, *[0] * 7, -0.225)]
    edges = (Fraction(15, 256), Fraction(17, 256)), (Fraction(1, 1024), Fraction(1, 4))
    assert not keeps_to_losses(taps, table("bandpass", (3, 20), edges))
    assert keeps_to_losses(taps, table("bandpass", (3, 0.5), edges))


def test_a_gain_may_be_its_limit() -> None:
    taps = [Fraction(1, 4), Fraction(1, 2), Fraction(1, 4)]
    losses = table("lowpass", (1.0, 2.0), ((Fraction(1, 10),), (Fraction(2, 5),)))
    assert keeps_to_losses(taps, losses)
    assert keeps_to_losses([-tap for tap in taps], losses)
    assert not keeps_to_losses([tap * (1 + Fraction(1, 1 << 60)) for tap in taps], losses)
