"""The exact response of a chain's stages in series: gains to the end, images and aliases.

A stage puts zeros between samples, filters, hands on every R-th of its results, or a part of these. By the noble
identities, filtering before zeros is filtering with ``z**L`` behind them, and filtering behind what leaves results out
is the same with ``z**R`` before it. So stages of which none interpolates behind one that decimates, a segment, are one
filter at the highest of their rates, L being the product of the first, M of the second::

    |> L1 -> H1(z) -> H2(z) -> M2 -> H3(z)  =  L1 -> H1(z) H2(z) H3(z**M2) -> M2

A result is a sum over taps ``h(p), h(p + L), ..`` alone, as only one sample in L is not 0, and its phase p is a
multiple of what L and M have in common. So the largest sum of magnitudes over these p is how much of an error before
the segment reaches its end at most, and the product over segments how much reaches the end of the chain. Of a sine of
the amplitude 1, a frequency f at the highest rate has the amplitude ``|H(f)| / L``, if it is one of its images, and
comes out at the frequency that f folds to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import gcd, lcm, prod

from flint import arb, ctx, fmpq, fmpq_poly

from sosmith.gen.filter.exact_form import Exact
from sosmith.gen.filter.largest_gain import CLOSE, Factor, Peak, gain_of_sections, largest, smallest
from sosmith.gen.filter.tangents import Tangents
from sosmith.gen.proof.nodes import polynomial
from sosmith.gen.proof.peak_gain import Drive, extent
from sosmith.gen.proof.response import Response
from sosmith.model.arithmetic.correct_rounding import ball
from sosmith.model.dataflow.cic import impulse_response

_ACCURACY = 128
"""Bits of gains, so that whoever computes them by another method rounds to the same multiple."""

_PRECISION = 256
"""Bits of the taps; dyadic ones of fewer bits are exact."""

_HALF = Fraction(1, 2)


@dataclass(frozen=True)
class Part:
    """Sections behind `rise` - 1 zeros for each sample, of whose results every `factor`-th leaves."""

    sections: tuple[Exact, ...]
    factor: int = 1
    rise: int = 1


@dataclass(frozen=True)
class Segment:
    """Parts in series of which none interpolates behind one that decimates.

    Attributes
    ----------
    parts : tuple of Part
    rate : Fraction
        Of the samples that enter, in units of the rate of the chain's.
    """

    parts: tuple[Part, ...]
    rate: Fraction = Fraction(1)

    @property
    def rise(self) -> int:
        """By how much the rate goes up, to the highest."""
        return prod(part.rise for part in self.parts)

    @property
    def factor(self) -> int:
        """By how much it goes down from there."""
        return prod(part.factor for part in self.parts)

    @property
    def highest(self) -> Fraction:
        """The highest rate, in units of that of the chain's samples."""
        return self.rate * self.rise

    @property
    def spreads(self) -> list[int]:
        """Samples at the highest rate for each one of a part's filter."""
        spreads, rise, factor = [], 1, 1
        for part in self.parts:
            rise *= part.rise
            spreads.append(self.rise * factor // rise)
            factor *= part.factor
        return spreads


def segments_of(parts: Sequence[Part]) -> list[Segment]:
    """Split parts before each one that interpolates behind one that decimates."""
    segments, own, rate = list[Segment](), list[Part](), Fraction(1)
    for part in parts:
        if part.rise > 1 and any(each.factor > 1 for each in own):
            segments.append(Segment(tuple(own), rate))
            rate *= Fraction(segments[-1].rise, segments[-1].factor)
            own = []
        own.append(part)
    return [*segments, Segment(tuple(own), rate)] if own else segments


def cic(factor: int, stages: int) -> Part:
    """Return a CIC decimator with the gain 1 at zero frequency."""
    taps = tuple(Fraction(tap, factor**stages) for tap in impulse_response(factor, stages))
    return Part(((taps, (Fraction(1),)),), factor)


def factor_of(parts: Sequence[Part]) -> int:
    """Return by how much parts decimate: the number of samples for each result, if none interpolates."""
    return prod(part.factor for part in parts)


def rise_of(parts: Sequence[Part]) -> int:
    """Return by how much parts interpolate."""
    return prod(part.rise for part in parts)


def peak_gain(parts: Sequence[Part], *, steady: bool) -> Fraction:
    """How much of an error before parts in series reaches their end at most, rounded up a little.

    With `steady`, each part starts as if its first sample had been there for ever, also behind one that interpolates,
    whose results of a constant differ. The first sample alone knows of that. By how much the results of a constant 1,
    from such a start on, differ from what they are when it really was there for ever, is added: a part of the gain N
    makes at most ``N (d + s)`` of d before it, and of the differences s between the first result before it and all
    others. If the product of all gains is less, that is a bound as well.
    """
    of_each = _gain_from_steady if steady else _peak_gain
    return prod((of_each(segment) for segment in segments_of(parts)), start=Fraction(1))


def _gain_from_steady(segment: Segment) -> Fraction:
    together = _peak_gain(segment)
    if segment.rise == 1 or len(segment.parts) == 1:
        return together
    off, spread, product = Fraction(0), Fraction(0), Fraction(1)
    for part in segment.parts:
        gain = _peak_gain(Segment((part,)))
        off = gain * (off + spread)
        spread = 2 * gain * spread + product * _unevenness(part)
        product *= gain
    return min(product, together + off)


def _unevenness(part: Part) -> Fraction:
    """How far results of a constant 1 are from the first of them at most."""
    if part.rise == 1:
        return Fraction(0)
    ((taps, _),) = part.sections
    first, *others = (sum(taps[phase :: part.rise], Fraction(0)) for phase in range(part.rise))
    return max(abs(other - first) for other in others)


@lru_cache(maxsize=64)  # while word lengths are searched for, the response stays
def _peak_gain(segment: Segment) -> Fraction:
    """Largest sum of the magnitudes of a phase of a segment's response, rounded up a little.

    All denominators are made polynomials in one power of z, that of the slowest stage with poles. Then the samples that
    are so many apart are a response of their own, of few poles that are far from each other.
    """
    rise, over = segment.rise, fmpq_poly([1])
    steps = [step for part, step in zip(segment.parts, segment.spreads, strict=True) if _has_poles(part)]
    apart = lcm(rise, *steps) if steps else rise
    under = list[tuple[Fraction, ...]]()
    for part, spread in zip(segment.parts, segment.spreads, strict=True):
        for numerator, denominator in part.sections:
            over *= polynomial(_spread(numerator, spread))
            if len(denominator) > 1:
                under.append(_of_powers(denominator, apart // spread))
                # Both have the same zeros.
                over *= polynomial(_spread(under[-1], apart)) // polynomial(_spread(denominator, spread))
    taps, poles = over.coeffs(), tuple(under)
    phases = range(0, rise, gcd(rise, segment.factor))
    return max(sum((_size(taps[n::apart], poles) for n in range(k, apart, rise)), Fraction(0)) for k in phases)


def _has_poles(part: Part) -> bool:
    return any(len(denominator) > 1 for _, denominator in part.sections)


def _size(taps: Sequence[fmpq], poles: tuple[tuple[Fraction, ...], ...]) -> Fraction:
    """Sum of the magnitudes of a response, rounded up a little."""
    response = Response(fmpq_poly(list(taps)), poles)
    return (
        extent([Drive(response, Fraction(-1), Fraction(1))], _ACCURACY).magnitude if response.numerator else Fraction(0)
    )


def _of_powers(denominator: Sequence[Fraction], times: int) -> tuple[Fraction, ...]:
    """Return the polynomial with the constant term 1, and the `times`-th powers of the poles; its degree is 1 or 2."""
    if times == 1:
        return tuple(denominator)
    _, first, second = (*denominator, Fraction(0))[:3]
    sums = [Fraction(2), -first]  # of the powers of both poles
    for _ in range(times - 1):
        sums.append(-first * sums[-1] - second * sums[-2])
    return (Fraction(1), -sums[times], second**times)[: len(denominator)]


def _spread(taps: Sequence[Fraction], step: int) -> tuple[Fraction, ...]:
    """Return a polynomial in ``z**step``."""
    spread = [Fraction(0)] * ((len(taps) - 1) * step + 1)
    spread[::step] = taps
    return tuple(spread)


def folding_gain(segment: Segment) -> Peak:
    """Largest gain of what comes out at another frequency than it went in, in units of the highest rate."""
    return _largest(segment, [(Fraction(1, 2 * max(segment.rise, segment.factor)), _HALF)])


def gain_into_passband(segment: Segment, edge: Fraction) -> Peak:
    """Largest gain of what comes out at another frequency, and went in, or comes out, at one up to `edge`."""
    bands = [band for each in {segment.rise, segment.factor} for band in bands_into_passband(each, edge)]
    return _largest(segment, sorted(bands))


def _largest(segment: Segment, bands: Sequence[tuple[Fraction, Fraction]]) -> Peak:
    with ctx.workprec(_PRECISION):
        gain = _Gain(segment)
    return largest(gain.most, bands)


def gain_from(segment: Segment, stop: Fraction) -> Peak:
    """Largest gain from the frequency `stop` on."""
    return _largest(segment, [(stop, _HALF)])


def gains_in_passband(segment: Segment, edge: Fraction) -> tuple[Peak, Peak]:
    """Smallest and largest gain at frequencies up to `edge`, each to a millionth."""
    with ctx.workprec(_PRECISION):
        gain = _Gain(segment)
    band = (Fraction(0), edge)
    return smallest(gain.least, band, CLOSE), largest(gain.most, [band], CLOSE)


def bands_into_passband(factor: int, edge: Fraction) -> list[tuple[Fraction, Fraction]]:
    """Bands that fold to frequencies up to `edge`, both in units of the rate before decimation by `factor`."""
    centres = (Fraction(k, factor) for k in range(1, factor // 2 + 1))
    return [(centre - edge, min(centre + edge, _HALF)) for centre in centres if centre - edge < _HALF]


class _Gain:
    """What is known of the gain of a segment on an interval of frequencies, in units of its highest rate."""

    def __init__(self, segment: Segment) -> None:
        self._taps: list[tuple[Tangents, int]] = []
        self._poles: list[tuple[Exact, int]] = []
        self._under: list[tuple[Tangents, int]] = []
        self._share = ball(Fraction(1, segment.rise))
        for part, step in zip(segment.parts, segment.spreads, strict=True):
            for numerator, denominator in part.sections:
                self._taps.append((Tangents(numerator), step))
                if len(denominator) > 1:
                    self._under.append((Tangents(denominator), step))
                    self._poles.append((((Fraction(1),), denominator), step))

    def __call__(self, low: Fraction, high: Fraction) -> Factor:
        product = Factor(self._share, self._share, arb(0))
        for taps, step in self._taps:
            product = product.times(taps.on(low * step, high * step))
        for section, step in self._poles:
            product = product.times(gain_of_sections([section], low * step, high * step))
        return product

    def least(self, low: Fraction, high: Fraction) -> tuple[arb, arb]:
        """Return the gain in the middle of an interval, and one below which it is nowhere there."""
        middle, spread = self._logarithm(low, high)
        return middle, middle * (-spread).exp() if spread.is_finite() else arb(0)

    def most(self, low: Fraction, high: Fraction) -> Factor:
        """Say what is known of the gain: by its logarithm, unless it may be far less than in the middle."""
        middle, spread = self._logarithm(low, high)
        return Factor(middle, middle * spread.exp(), arb("inf")) if spread < 1 else self(low, high)

    def _logarithm(self, low: Fraction, high: Fraction) -> tuple[arb, arb]:
        """Return the gain in the middle, and by how much its logarithm differs from there at most.

        Slopes of sections cancel each other, which bounds of each by itself would not know.
        """
        middle, change, off = self._share, arb(0), arb(0)
        for factors, sign in ((self._taps, 1), (self._under, -1)):
            for taps, step in factors:
                found = taps.logarithm(low * step, high * step)
                if found is None:
                    return self(low, high).middle, arb("inf")
                middle, change, off = middle * found[0] ** sign, change + sign * found[1], off + found[2]
        return middle, abs(change) + off
