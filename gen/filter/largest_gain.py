"""Largest gain of a filter at any frequency, of what a decimator before it lets through, by branch and bound in balls.

Of a sine at the frequency ``k - p`` or ``k + p``, in units of the rate at which the filter works, the samples that a
decimator hands on are those of a sine at p, from 0 to 1/2, and its gain is that of the CIC filter times that of the
filter at p. From below the multiple k more comes through than from above: the numerators ``sin(pi p)`` of the CIC
filter are the same, and up to half the rate of its input the denominator ``R sin(pi (k - p) / R)`` is the smaller one.
So one variable is left, p.

On a short interval of it, the gain is at most that in the middle times ``exp(s d / 2)``, with the length d and a bound
s on the logarithmic derivative, which is all but 0 where the gain is largest. Where a pole or zero is so close that
there is no such bound, balls around all frequencies of the interval enclose the gain. The interval with the largest
bound is halved again and again, until no bound exceeds the largest gain found by more than `TOLERANCE`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from heapq import heappop, heappush

from flint import acb, arb, ctx

from sosmith.gen.filter.exact_form import Exact
from sosmith.model.arithmetic.correct_rounding import ball, evaluate, nearest_multiple

TOLERANCE = Fraction(1, 1 << 10)
"""Share by which a bound exceeds a gain that is reached."""

CLOSE = Fraction(1, 1 << 20)
"""The same where gains in a pass band are compared, in dB some millionths."""

_PRECISION = 192
"""Bits of the balls."""

_GAIN_BITS = 192
"""Fraction bits of bounds."""

_HALF = Fraction(1, 2)
_NOTHING = 2.0**-30


@dataclass(frozen=True, kw_only=True)
class Peak:
    """A largest gain.

    Attributes
    ----------
    at : Fraction
        Where a gain is reached that is less than `gain` by the share `TOLERANCE` at most: the frequency at the output,
        in units of the rate there.
    gain : Fraction
        No frequency has more.
    """

    at: Fraction
    gain: Fraction


@dataclass(frozen=True)
class Factor:
    """Of a factor of the gain on an interval: itself in the middle and everywhere, and its logarithmic derivative."""

    middle: arb
    everywhere: arb
    slope: arb

    def times(self, other: Factor) -> Factor:
        """Return the product of two factors on the same interval."""
        return Factor(self.middle * other.middle, self.everywhere * other.everywhere, self.slope + other.slope)

    def bound(self, length: Fraction) -> arb:
        """Bound the gain on an interval of this length from above; infinite where nothing is known of it."""
        steep = self.middle * (abs(self.slope) * ball(length / 2)).exp()
        bounds = [bound.upper() for bound in (self.everywhere, steep) if bound.is_finite()]
        return min(bounds, default=arb("inf"))


class LargestGain:
    """Largest gains of one filter; what is known of it on an interval serves all bands.

    Parameters
    ----------
    sections : sequence of Exact
        Numerators and denominators of the filter in ``1/z``; no pole on the unit circle.
    factor, stages : int
        R and N of the decimator before it; 1 and 0 without one.
    """

    def __init__(self, sections: Sequence[Exact], factor: int = 1, stages: int = 0) -> None:
        self._sections = sections
        self._factor = factor
        self._stages = stages
        self._known: dict[tuple[Fraction, Fraction], Factor] = {}

    def of_band(self, band: int) -> Peak:
        """Bound the gain from the multiple `band` of the filter's rate, half the rate to both sides of it.

        The multiple is at least 1, and at most half of R, where the band ends.
        """
        return self._largest(Fraction(0), _HALF, band)

    def into_passband(self, band: int, edge: Fraction) -> Peak:
        """Bound the gain of what folds from there to frequencies up to `edge`, in units of the filter's rate."""
        return self._largest(Fraction(0), edge, band)

    def from_frequency(self, low: Fraction) -> Peak:
        """Bound the gain of the filter alone from a frequency in units of its rate on."""
        return self._largest(low, _HALF, None)

    def on_interval(self, low: Fraction, high: Fraction, band: int | None) -> tuple[arb, arb]:
        """Enclose the gain in the middle of an interval of output frequencies, and bound it on all of it.

        At the present precision of FLINT, from a band or of the filter alone.
        """
        factor = self._on(low, high, band)
        return factor.middle, factor.bound(high - low)

    def _largest(self, low: Fraction, high: Fraction, band: int | None) -> Peak:
        return largest(lambda one, other: self._on(one, other, band), [(low, high)])

    def _on(self, low: Fraction, high: Fraction, band: int | None) -> Factor:
        filter_ = self._known.get((low, high)) if low < high else None
        if filter_ is None:
            filter_ = self._known[low, high] = gain_of_sections(self._sections, low, high)
        return filter_ if band is None else _cic(self._factor, self._stages, band, low, high).times(filter_)


def largest(
    gain_on: Callable[[Fraction, Fraction], Factor],
    bands: Sequence[tuple[Fraction, Fraction]],
    tolerance: Fraction = TOLERANCE,
) -> Peak:
    """Bound the largest gain on any of some intervals, at least one, by branch and bound.

    Parameters
    ----------
    gain_on : callable
        Says what is known of the gain on an interval, at the present precision of FLINT.
    bands : sequence of (Fraction, Fraction)
        The intervals.
    tolerance : Fraction
        Share by which the bound may exceed a gain that is reached.
    """
    with ctx.workprec(_PRECISION):
        at, best = bands[0][0], arb(0)
        open_: list[tuple[float, Fraction, Fraction, arb]] = [(-math.inf, *band, arb("inf")) for band in bands]
        while True:
            _, start, end, most = heappop(open_)
            if most <= best * ball(1 + tolerance):
                break
            middle = (start + end) / 2
            for one, other in ((start, middle), (middle, end)):
                factor = gain_on(one, other)
                reached, bound = factor.middle, factor.bound(other - one)
                if reached.lower() > best:
                    at, best = (one + other) / 2, reached.lower()
                heappush(open_, (-float(bound), one, other, bound))

    def gain() -> Fraction:
        return nearest_multiple(gain_on(at, at).middle * ball(1 + tolerance), _GAIN_BITS)

    return Peak(at=at, gain=evaluate(gain) + Fraction(1, 1 << _GAIN_BITS))


def smallest(
    gain_on: Callable[[Fraction, Fraction], tuple[arb, arb]], band: tuple[Fraction, Fraction], tolerance: Fraction
) -> Peak:
    """Bound the smallest gain on an interval from below, by branch and bound; one below `_NOTHING` counts as 0.

    Parameters
    ----------
    gain_on : callable
        Returns the gain in the middle of an interval, and a bound from below on all of it.
    band : (Fraction, Fraction)
        The interval.
    tolerance : Fraction
        Share by which the bound may be below a gain that is reached.
    """
    with ctx.workprec(_PRECISION):
        at, best = band[0], arb("inf")
        open_: list[tuple[float, Fraction, Fraction, arb]] = [(-math.inf, *band, arb("-inf"))]
        while True:
            _, start, end, least = heappop(open_)
            if best < _NOTHING:
                return Peak(at=at, gain=Fraction(0))
            if least >= best * ball(1 - tolerance):
                break
            middle = (start + end) / 2
            for one, other in ((start, middle), (middle, end)):
                reached, bound = gain_on(one, other)
                if reached.upper() < best:
                    at, best = (one + other) / 2, reached.upper()
                heappush(open_, (float(bound.lower()), one, other, bound.lower()))

    def gain() -> Fraction:
        return nearest_multiple(gain_on(at, at)[0] * ball(1 - tolerance), _GAIN_BITS)

    return Peak(at=at, gain=evaluate(gain) - Fraction(1, 1 << _GAIN_BITS))


@lru_cache(maxsize=16)
def band_gains(sections: tuple[Exact, ...], factor: int, stages: int) -> tuple[Peak, ...]:
    """Return the largest gain from the band around each multiple of the lower rate, the lowest first."""
    gains = LargestGain(sections, factor, stages)
    return tuple(gains.of_band(band) for band in range(1, factor // 2 + 1))


@lru_cache(maxsize=64)
def passband_gains(
    sections: tuple[Exact, ...], factor: int, stages: int, edge: Fraction, bands: int
) -> tuple[Peak, ...]:
    """Return the largest gain into frequencies up to `edge` from each of the first `bands` multiples."""
    gains = LargestGain(sections, factor, stages)
    return tuple(gains.into_passband(band, edge) for band in range(1, bands + 1))


def _between(low: Fraction, high: Fraction) -> arb:
    return ball(low).union(ball(high))


def _cic(factor: int, stages: int, band: int, low: Fraction, high: Fraction) -> Factor:
    """Gain of the CIC filter at `band` less a frequency in an interval."""
    middle, p = ball((low + high) / 2), _between(low, high)
    slope = stages * arb.pi() * (p.cot_pi() + ((band - p) / factor).cot_pi() / factor)
    gains = [(q.sin_pi() / (factor * ((band - q) / factor).sin_pi())) ** stages for q in (middle, p)]
    return Factor(gains[0], gains[1], slope)


def gain_of_sections(sections: Sequence[Exact], low: Fraction, high: Fraction) -> Factor:
    """Gain of sections on an interval of frequencies, of which ``d ln |B| / dp = 2 pi Im(u B'(u) / B(u))``."""
    u, everywhere = (acb(-2 * q).exp_pi_i() for q in (ball((low + high) / 2), _between(low, high)))
    product = Factor(arb(1), arb(1), arb(0))
    for numerator, denominator in sections:
        for taps, power in ((numerator, 1), (denominator, -1)):
            b = [ball(tap) for tap in taps]
            value = _horner(b, everywhere)
            slope = 2 * arb.pi() * (everywhere * _horner([k * c for k, c in enumerate(b)][1:], everywhere) / value).imag
            product = product.times(Factor(abs(_horner(b, u)) ** power, abs(value) ** power, power * slope))
    return product


def _horner(taps: Sequence[arb], u: acb) -> acb:
    total = acb(0)
    for tap in reversed(taps):
        total = total * u + tap
    return total
