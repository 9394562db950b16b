"""Gains of FIR filters, proven: the squared gain has its extremes where its derivative has real roots.

The squared magnitude of the gain of any taps is a polynomial P in ``x = cos(w)`` with rational coefficients. On a band
it is largest and smallest at an end or at a root of P', all of which are isolated in ball arithmetic. So every ripple
is seen, however narrow.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import cast

from flint import acb, arb, ctx, fmpq, fmpq_poly

Band = tuple[Fraction, Fraction]

_PRECISION = 256
_BITS_OF_A_TAP = 4
"""Bits of precision for each tap: Chebyshev polynomials have such coefficients."""


def keeps_to(
    taps: Sequence[Fraction],
    passbands: Sequence[Band],
    stopbands: Sequence[Band],
    passband_loss: Fraction,
    stopband_loss: Fraction,
) -> bool:
    """Say whether all gains in pass bands are proven to be within ``-passband_loss..0`` dB, the others low enough.

    Parameters
    ----------
    taps : sequence of Fraction
        Coefficients of 1, 1/z and so on.
    passbands, stopbands : sequence of Band
        In units of the sample rate, from 0 to 1/2.
    passband_loss, stopband_loss : Fraction
        In dB.

    Examples
    --------
    >>> mean = [Fraction(1, 4), Fraction(1, 2), Fraction(1, 4)]
    >>> bands = [(Fraction(0), Fraction(1, 10))], [(Fraction(2, 5), Fraction(1, 2))]
    >>> keeps_to(mean, *bands, Fraction(1), Fraction(20)), keeps_to(mean, *bands, Fraction(1), Fraction(21))
    (True, False)
    """
    with ctx.workprec(_PRECISION + _BITS_OF_A_TAP * len(taps)):
        square = squared_gain(taps)
        turning_points = _turning_points(square)
        least, most = (arb(10) ** (-_ball(loss) / 10) for loss in (passband_loss, stopband_loss))
        return all(
            least <= low and high <= 1 for low, high in (_limits(square, turning_points, band) for band in passbands)
        ) and all(high <= most for _, high in (_limits(square, turning_points, band) for band in stopbands))


def gains_in(taps: Sequence[Fraction], band: Band) -> tuple[float, float]:
    """Return the smallest and the largest magnitude of the gain in a band, enclosed and rounded outward a little."""
    with ctx.workprec(_PRECISION + _BITS_OF_A_TAP * len(taps)):
        square = squared_gain(taps)
        low, high = _limits(square, _turning_points(square), band)
        return float(low.nonnegative_part().sqrt().lower()), float(high.sqrt().upper())


def squared_gain(taps: Sequence[Fraction]) -> fmpq_poly:
    """Return the squared magnitude of the gain as a polynomial in the cosine of the angle; exact.

    >>> squared_gain([Fraction(1, 2), Fraction(1, 2)])
    1/2*x + 1/2
    """
    exact = [fmpq(tap.numerator, tap.denominator) for tap in taps]
    product = fmpq_poly(exact) * fmpq_poly(exact[::-1])
    lags = [product[len(exact) - 1 + k] for k in range(len(exact))]
    before, now, twice = fmpq_poly([1]), fmpq_poly([0, 1]), fmpq_poly([0, 2])
    total = fmpq_poly([lags[0]])
    for lag in lags[1:]:
        total += 2 * lag * now
        before, now = now, twice * now - before
    return total


def _turning_points(square: fmpq_poly) -> list[arb]:
    slope = square.derivative()
    if slope.degree() < 1:
        return []
    roots = cast("list[tuple[acb, int]]", slope.numer().complex_roots())  # the library's type stubs omit multiplicities
    return [root.real for root, _ in roots if root.imag.contains(0)]


def _limits(square: fmpq_poly, turning_points: Sequence[arb], band: Band) -> tuple[arb, arb]:
    """Return balls around the smallest and the largest squared gain in a band."""
    high, low = (arb.cos_pi(2 * _ball(edge)) for edge in band)
    points = [low, high, *(point for point in turning_points if not (point < low or point > high))]
    values = [_at(square, point) for point in points]
    least, most = values[0], values[0]
    for value in values[1:]:
        least, most = least.min(value), most.max(value)
    return least, most


def _at(square: fmpq_poly, point: arb) -> arb:
    total = arb(0)
    for k in reversed(range(square.degree() + 1)):
        total = total * point + arb(square[k])
    return total


def _ball(value: Fraction) -> arb:
    return arb(fmpq(value.numerator, value.denominator))
