"""Gains of filters, proven: the squared gain has its extremes where its derivative has real roots.

The squared magnitude of the gain of any taps is a polynomial in ``x = cos(w)`` with rational coefficients, and that of
a filter a quotient P / Q of two. On a band it is largest and smallest at an end or at a root of ``P' Q - P Q'``, all of
which are isolated in ball arithmetic. So every ripple is seen, however narrow. Where no gain is all but a limit,
tangents decide first, which is quicker (`sosmith.gen.filter.tangents`).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import cast

from flint import acb, arb, ctx, fmpq, fmpq_poly

from sosmith.gen.filter.loss_mask import Band, LossMask
from sosmith.gen.filter.tangents import keeps_by_tangents
from sosmith.model.arithmetic.correct_rounding import ball

_PRECISION = 256
_REAL = {Fraction(0): fmpq(1), Fraction(1, 2): fmpq(-1)}
"""Frequencies at which z is real, and z there."""

_BITS_OF_A_TAP = 4
"""Bits of precision for each tap: Chebyshev polynomials have such coefficients."""


def keeps_to(taps: Sequence[Fraction], mask: LossMask, poles: Sequence[Fraction] = (Fraction(1),)) -> bool:
    """Say whether all gains in pass bands are proven to be within ``-passband_loss..0`` dB, the others low enough.

    Parameters
    ----------
    taps : sequence of Fraction
        Coefficients of 1, 1/z and so on in the numerator.
    mask : LossMask
        Bands and losses.
    poles : sequence of Fraction
        Those in the denominator, which has no zero on the unit circle.

    Examples
    --------
    >>> mean = [Fraction(1, 4), Fraction(1, 2), Fraction(1, 4)]
    >>> bands = ((Fraction(0), Fraction(1, 10)),), ((Fraction(2, 5), Fraction(1, 2)),)
    >>> [keeps_to(mean, LossMask(*bands, Fraction(1), Fraction(loss))) for loss in (20, 21)]
    [True, False]
    """
    decided = keeps_by_tangents(taps, mask) if len(poles) == 1 and poles[0] == 1 else None
    if decided is not None:
        return decided
    with ctx.workprec(_precision(taps, poles)):
        gain = _SquaredGain(taps, poles)
        least, most = (arb(10) ** (-ball(loss) / 10) for loss in (mask.passband_loss, mask.stopband_loss))
        return all(least <= low and high <= 1 for low, high in (gain.limits(band) for band in mask.passbands)) and all(
            high <= most for _, high in (gain.limits(band) for band in mask.stopbands)
        )


def gains_in(taps: Sequence[Fraction], band: Band, poles: Sequence[Fraction] = (Fraction(1),)) -> tuple[float, float]:
    """Return the smallest and the largest magnitude of the gain in a band, enclosed and rounded outward a little."""
    with ctx.workprec(_precision(taps, poles)):
        low, high = _SquaredGain(taps, poles).limits(band)
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


class _SquaredGain:
    """The square of a filter's gain, a quotient of polynomials in the cosine of the angle."""

    def __init__(self, taps: Sequence[Fraction], poles: Sequence[Fraction]) -> None:
        self._over, self._under = squared_gain(taps), squared_gain(poles)
        slope = self._over.derivative() * self._under - self._over * self._under.derivative()
        self._turning_points: list[arb] = []
        if slope.degree() >= 1:
            # The library's type stubs omit multiplicities.
            roots = cast("list[tuple[acb, int]]", slope.numer().complex_roots())
            self._turning_points = [root.real for root, _ in roots if root.imag.contains(0)]

    def limits(self, band: Band) -> tuple[arb, arb]:
        """Return balls around the smallest and the largest squared gain in a band."""
        high, low = (arb.cos_pi(2 * ball(edge)) for edge in band)
        values = [self._at_edge(edge) for edge in band]
        values += [self._at(point) for point in self._turning_points if not (point < low or point > high)]
        least, most = values[0], values[0]
        for value in values[1:]:
            least, most = least.min(value), most.max(value)
        return least, most

    def _at_edge(self, edge: Fraction) -> arb:
        """Return the squared gain at a frequency; exact at 0 and half the sample rate, where it may be its limit."""
        if edge in _REAL:
            return arb(self._over(_REAL[edge]) / self._under(_REAL[edge]))
        return self._at(arb.cos_pi(2 * ball(edge)))

    def _at(self, cosine: arb) -> arb:
        return _horner(self._over, cosine) / _horner(self._under, cosine)


def _horner(polynomial: fmpq_poly, point: arb) -> arb:
    total = arb(0)
    for k in reversed(range(polynomial.degree() + 1)):
        total = total * point + arb(polynomial[k])
    return total


def _precision(*taps: Sequence[Fraction]) -> int:
    return _PRECISION + _BITS_OF_A_TAP * sum(map(len, taps))
