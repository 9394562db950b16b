"""Taps of a cascaded integrator-comb (CIC) filter: moving sums of as many samples each, in series."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import accumulate


def impulse_response(factor: int, order: int) -> tuple[int, ...]:
    """Return the taps of `order` moving sums of `factor` samples; their sum is ``factor**order``.

    Examples
    --------
    >>> impulse_response(2, 3)
    (1, 3, 3, 1)
    """
    response = [1]
    for _ in range(order):
        sums = list(accumulate([*response, *[0] * (factor - 1)]))
        response = [a - b for a, b in zip(sums, [*[0] * factor, *sums], strict=False)]
    return tuple(response)


def order_of(taps: Sequence[Fraction] | Sequence[int], factor: int) -> int | None:
    """Return how many moving sums of `factor` samples taps are, times any number; None if they are none.

    Examples
    --------
    >>> order_of([2, 6, 6, 2], 2), order_of([1, 2, 1], 3)
    (3, None)
    """
    if factor < 2 or len(taps) < factor or (len(taps) - 1) % (factor - 1):
        return None
    order = (len(taps) - 1) // (factor - 1)
    alike = all(tap == taps[0] * one for tap, one in zip(taps, impulse_response(factor, order), strict=True))
    return order if taps[0] > 0 and alike else None
