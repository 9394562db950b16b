"""Taps that make up for a droop: they keep to both losses by a calculation of the test's own, and are few."""

from __future__ import annotations

from decimal import Decimal

import numpy as np
import pytest
from scipy import signal

from sosmith.gen.chain.automatic.compensation import Array, compensating


def moving_sums(factor: int, order: int) -> Array:
    taps = np.ones(1)
    for _ in range(order):
        taps = np.convolve(taps, np.ones(factor) / factor)
    return taps


@pytest.mark.parametrize(("edge", "stop", "expected"), [(0.15, 0.3, 30), (0.2, 0.5, 9)])
def test_the_product_keeps_to_both_losses(edge: float, stop: float, expected: int) -> None:
    before = moving_sums(8, 4)

    def droop(frequency: Array) -> Array:
        return np.abs(signal.freqz(before, worN=2 * np.pi * frequency / 8)[1])

    taps = compensating(expected, droop, edge, stop, (0.05, 60.0))
    assert taps is not None
    assert taps == taps[::-1]
    assert all(isinstance(tap, Decimal) for tap in taps)
    values = np.array([float(tap) for tap in taps])
    passed = np.linspace(0, edge, 3001)
    gain = droop(passed) * np.abs(signal.freqz(values, worN=2 * np.pi * passed)[1])
    assert 20 * np.log10(gain.min()) >= -0.0501
    assert gain.max() <= 1 + 1e-6
    assert 20 * np.log10(droop(np.array([edge]))[0]) < -0.5
    if stop < 0.5:
        stopped = np.abs(signal.freqz(values, worN=2 * np.pi * np.linspace(stop, 0.5, 3001))[1])
        assert 20 * np.log10(stopped.max()) <= -59.99
        assert len(taps) < signal.kaiserord(60, 2 * (stop - edge))[0]


def test_a_filter_that_would_be_too_long_is_none() -> None:
    assert compensating(10, lambda frequency: 1 - frequency, 0.2, 0.21, (0.01, 90.0)) is None
