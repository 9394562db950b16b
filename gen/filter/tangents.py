"""Magnitudes of an FIR filter on intervals of frequencies, by tangents, and whether they keep to a mask."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import acb, acb_poly, arb, ctx

from sosmith.gen.filter.largest_gain import Factor
from sosmith.gen.filter.loss_mask import Band, LossMask
from sosmith.model.arithmetic.correct_rounding import ball

_PRECISION = 192
_MOST_PARTS = 1 << 14
"""Intervals after which it stays open whether taps keep to a mask."""

_SMALLEST = Fraction(1, 1 << 40)
"""Shortest interval that is halved."""


class Tangents:
    """Taps ``b_k`` of a filter, by what is known of ``V(w) = sum b_k e**(-i (k - c) w)`` near an angle.

    The centre c takes the delay off, with which V would turn much faster. Within r of w, V is at most
    ``|V''| r**2 / 2 + C r**3 / 6`` away from its tangent, ``C = sum |b_k| |k - c|**3``, whose magnitude is the largest
    at an end. In a stop band, V'' is small like V.
    """

    def __init__(self, taps: Sequence[Fraction]) -> None:
        centre = Fraction(len(taps) - 1, 2)
        self._value = acb_poly([ball(tap) for tap in taps])
        self._slope = acb_poly([ball(tap * (k - centre)) for k, tap in enumerate(taps)])
        self._most = ball(sum(map(abs, taps), Fraction(0)))
        self._bend = acb_poly([ball(tap * (k - centre) ** 2) for k, tap in enumerate(taps)])
        self._third = ball(sum((abs(tap * (k - centre) ** 3) for k, tap in enumerate(taps)), Fraction(0)))

    def on(self, low: Fraction, high: Fraction) -> Factor:
        """Say what is known of the magnitude on an interval of frequencies."""
        u = acb(ball(-(low + high))).exp_pi_i()
        value = self._value(u)
        if low == high:
            return Factor(abs(value), abs(value), arb("inf"))
        reach = arb.pi() * ball(high - low)
        turn = self._slope(u) * acb(0, 1) * reach
        tangent = abs(value + turn).max(abs(value - turn)) + self._beside(u, reach)
        return Factor(abs(value), tangent.min(self._most), arb("inf"))

    def below(self, low: Fraction, high: Fraction) -> tuple[arb, arb]:
        """Return the magnitude in the middle of an interval, and one below which it is nowhere there."""
        u = acb(ball(-(low + high))).exp_pi_i()
        value = self._value(u)
        reach = arb.pi() * ball(high - low)
        turn = self._slope(u) * acb(0, 1) * reach
        least = abs(value) - abs(turn)
        along = value.real * turn.real + value.imag * turn.imag
        if abs(along) > turn.real**2 + turn.imag**2:  # the tangent comes nearest to 0 at an end
            least = abs(value + turn).min(abs(value - turn))
        return abs(value), least - self._beside(u, reach)

    def around(self, low: Fraction, high: Fraction) -> tuple[arb, arb, arb]:
        """Return the magnitude in the middle of an interval, and what it is at most and at least on all of it."""
        middle, least = self.below(low, high)
        return middle, self.on(low, high).everywhere, least

    def logarithm(self, low: Fraction, high: Fraction) -> tuple[arb, arb, arb] | None:
        """Return the magnitude in the middle, how its logarithm changes from there to the end, and what that is off by.

        All filters have the same sign of the change, so that it is known of products and quotients. None where the
        value may be 0.
        """
        u = acb(ball(-(low + high))).exp_pi_i()
        value, slope, reach = self._value(u), self._slope(u) * acb(0, 1), arb.pi() * ball(high - low)
        first, second = abs(slope), abs(self._bend(u))
        least = abs(value) - first * reach - self._beside(u, reach)
        if not least > 0:
            return None
        steep, bent = first + second * reach + self._third * reach**2 / 2, second + self._third * reach
        along = (value.real * slope.real + value.imag * slope.imag) / (value.real**2 + value.imag**2)
        return abs(value), along * reach, (bent / least + (steep / least) ** 2) * reach**2 / 2

    def _beside(self, u: acb, reach: arb) -> arb:
        """Bound how far the value is from its tangent at u, within an angle."""
        return abs(self._bend(u)) * reach**2 / 2 + self._third * reach**3 / 6


def keeps_by_tangents(taps: Sequence[Fraction], mask: LossMask) -> bool | None:
    """Say whether taps are proven to keep to the losses of a mask, or proven not to; None if that stays open.

    It stays open where a gain is hardly another than its limit.
    """
    with ctx.workprec(_PRECISION):
        own = Tangents(taps)
        least, most = (arb(10) ** (-ball(loss) / 20) for loss in (mask.passband_loss, mask.stopband_loss))
        limits = [(band, least, arb(1)) for band in mask.passbands]
        limits += [(band, arb(-1), most) for band in mask.stopbands]
        verdicts = [_lies_between(own, *limit) for limit in limits]
    if False in verdicts:
        return False
    return None if None in verdicts else True


def _lies_between(own: Tangents, band: Band, least: arb, most: arb) -> bool | None:
    left = [band]
    for _ in range(_MOST_PARTS):
        if not left:
            return True
        low, high = left.pop()
        middle, above, below = own.around(low, high)
        if below >= least and above <= most:
            continue
        if middle < least or middle > most:
            return False
        if high - low < _SMALLEST:
            return None
        halfway = (low + high) / 2
        left += [(low, halfway), (halfway, high)]
    return None
