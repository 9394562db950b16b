"""Taps of CIC filters: against a product of polynomials, and told from others."""

from fractions import Fraction

import numpy as np
import pytest

from sosmith.model.dataflow.cic import impulse_response, order_of


@pytest.mark.parametrize(("factor", "order"), [(2, 1), (3, 4), (8, 3), (64, 2)])
def test_taps_are_a_power_of_a_moving_sum(factor: int, order: int) -> None:
    taps = np.ones(1, dtype=np.int64)
    for _ in range(order):
        taps = np.convolve(taps, np.ones(factor, dtype=np.int64))
    assert list(impulse_response(factor, order)) == taps.tolist()
    assert order_of([Fraction(int(tap), factor**order) for tap in taps], factor) == order


@pytest.mark.parametrize(
    ("taps", "factor"),
    [
        ([1, 2, 1], 1),
        ([1], 2),
        ([1, 2, 1], 4),
        ([1, 3, 1], 2),
        ([-1, -2, -1], 2),
        ([0, 0, 0], 2),
        ([1, 2, 3, 2, 1], 2),
        ([1, 2, 1, 0], 2),
    ],
)
def test_other_taps_are_none(taps: list[int], factor: int) -> None:
    assert order_of(taps, factor) is None
