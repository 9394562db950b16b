"""The curve to design hardware with in whose coefficients any curve near by fits.

`parallel` hardware that can be loaded has for every coefficient as many bits as its own takes and one more
(`sosmith.model.reload.constants`). Curves of days that are hardly apart may differ much in their coefficients, and in
the signs of these: in a polynomial of order 6 by thousands of times as much as in their values. How much is known. A
polynomial of order n that is at most R on [0, 1] has coefficients of at most ``R |t_k|``, those of the Chebyshev
polynomial of order n on [0, 1] (V. A. Markov, Mathematische Annalen 77, 1916, pages 213 to 258), and in two variables,
one after the other, of at most ``R |t_i| |t_j|``. So a curve that is off by a multiple of that very product has
coefficients that are wide enough, although its own values are near by as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import comb

from sosmith.model.polynomial import Polynomial

_SPARE = 2
"""Times a coefficient that fit its bits, which are one more than it takes."""

_FOR_ROUNDING = Fraction(65, 64)
"""Times the room that is asked for: coefficients are rounded."""

Interval = tuple[Fraction, Fraction]
"""Lowest and highest value."""


def chebyshev(order: int) -> tuple[int, ...]:
    """Return the coefficients of the Chebyshev polynomial on [0, 1], the constant first: at most 1 there.

    Examples
    --------
    >>> chebyshev(2)
    (1, -8, 8)
    """
    before: tuple[int, ...] = (1,)
    this: tuple[int, ...] = (-1, 2)
    if order == 0:
        return before
    for _ in range(order - 1):  # T_(n+1) = 2 (2 x - 1) T_n - T_(n-1)
        doubled = [4 * low - 2 * high for low, high in zip((0, *this), (*this, 0), strict=True)]
        before, this = this, tuple(a - b for a, b in zip(doubled, (*before, 0, 0), strict=True))
    return this


def with_day_room(polynomial: Polynomial, ranges: Sequence[Interval], room: Fraction) -> tuple[Polynomial, Fraction]:
    """Return the curve to design hardware with, and how far it is from `polynomial`.

    Every polynomial of the same orders, or lower ones, that differs from `polynomial` by at most `room` over the ranges
    fits the coefficients of hardware whose ports have those ranges.

    Parameters
    ----------
    polynomial : Polynomial
        A curve of the highest orders that the hardware shall have.
    ranges : sequence of (Fraction, Fraction)
        Ranges of the ports of its variables.
    room : Fraction
        In the unit of the polynomial's values; more than 0.

    Raises
    ------
    ValueError
        If there is no room.
    """
    if room <= 0:
        raise ValueError(f"room must be more than 0, not {float(room):g}")
    m, n = polynomial.orders
    wide = [[a * b for b in chebyshev(n)] for a in chebyshev(m)]
    own = _on_unit(polynomial.coefficients, ranges, (m, n))
    distances = {sign: _distance(own, wide, sign, room * _FOR_ROUNDING) for sign in (1, -1)}
    sign = min(distances, key=distances.__getitem__)
    far = distances[sign]
    sums = [[a + sign * far * t for a, t in zip(row, steps, strict=True)] for row, steps in zip(own, wide, strict=True)]
    return Polynomial(_physical(sums, ranges)), far


def _distance(own: list[list[Fraction]], wide: list[list[int]], sign: int, room: Fraction) -> Fraction:
    """Return what multiple of `wide` gives every coefficient, spare bit included, the width for all that may be."""
    least = Fraction(0)
    for row, steps in zip(own, wide, strict=True):
        for a, t in zip(row, steps, strict=True):
            needed = (abs(a) + room * abs(t)) / _SPARE
            opposite = a * t * sign < 0
            least = max(least, (needed + (abs(a) if opposite else -abs(a))) / abs(t))
    return least


def _on_unit(
    rows: Sequence[Sequence[Fraction]], ranges: Sequence[Interval], orders: tuple[int, int]
) -> list[list[Fraction]]:
    """Return the coefficients for variables that are 0 and 1 at the ends of the ranges."""
    return _substituted(rows, [(low, high - low) for low, high in ranges], orders)


def _physical(rows: Sequence[Sequence[Fraction]], ranges: Sequence[Interval]) -> tuple[tuple[Fraction, ...], ...]:
    """Return the coefficients for the variables themselves."""
    steps = [(-low / (high - low), 1 / (high - low)) for low, high in ranges]
    return tuple(map(tuple, _substituted(rows, steps, (len(rows) - 1, len(rows[0]) - 1))))


def _substituted(
    rows: Sequence[Sequence[Fraction]], steps: Sequence[Interval], orders: tuple[int, int]
) -> list[list[Fraction]]:
    """Return the coefficients with ``start + step * x`` for each variable."""
    (u0, u), (t0, t) = steps
    found = [[Fraction(0)] * (orders[1] + 1) for _ in range(orders[0] + 1)]
    for i, row in enumerate(rows):
        for j, a in enumerate(row):
            for p in range(i + 1):
                for q in range(j + 1):
                    weight = comb(i, p) * u0 ** (i - p) * u**p * comb(j, q) * t0 ** (j - q) * t**q
                    found[p][q] += a * weight
    return found
