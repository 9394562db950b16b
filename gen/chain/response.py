"""The exact response of stages in series, at the rate of the first: gains to the end, and aliasing.

A stage filters, hands on every R-th of its results, or both. By the noble identity, filtering after that is the same as
filtering with ``z**R`` before it. So stages together are one filter at the rate of the first of them, of which every
R-th result leaves, R being the product of all their factors:

    |> H1(z) -> R1 -> H2(z) -> R2  =  H1(z) H2(z**R1) -> R1 R2

A result is a sum of all taps of it, whatever its phase. So the sum of their magnitudes is how much of an error before
the stages reaches the end at most. A sine of the frequency f comes out with its gain at f, at the frequency that f
folds to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import acb, acb_poly, arb, ctx

from sosmith.gen.filter.exact_form import Exact
from sosmith.gen.filter.largest_gain import Factor, Peak, gain_of_sections, largest
from sosmith.gen.proof.peak_gain import Drive, extent
from sosmith.gen.proof.response import IMPULSE
from sosmith.model.arithmetic.correct_rounding import ball
from sosmith.model.dataflow.decimator import impulse_response

_ACCURACY = 128
"""Bits of gains, so that whoever computes them by another method rounds to the same multiple."""

_PRECISION = 256
"""Bits of the taps; dyadic ones of fewer bits are exact."""

_HALF = Fraction(1, 2)


@dataclass(frozen=True)
class Part:
    """Sections, of whose results every `factor`-th leaves."""

    sections: tuple[Exact, ...]
    factor: int = 1


def cic(factor: int, stages: int) -> Part:
    """Return a CIC decimator with the gain 1 at zero frequency."""
    taps = tuple(Fraction(tap, factor**stages) for tap in impulse_response(factor, stages))
    return Part(((taps, (Fraction(1),)),), factor)


def factor_of(parts: Sequence[Part]) -> int:
    """Return the number of samples for each result."""
    product = 1
    for part in parts:
        product *= part.factor
    return product


def peak_gain(parts: Sequence[Part]) -> Fraction:
    """Sum of the magnitudes of the response of parts in series, rounded up a little."""
    response, step = IMPULSE, 1
    for part in parts:
        for numerator, denominator in part.sections:
            response = response.all_pole(_spread(denominator, step)).taps(_spread(numerator, step))
        step *= part.factor
    return extent([Drive(response, Fraction(-1), Fraction(1))], _ACCURACY).magnitude


def _spread(taps: Sequence[Fraction], step: int) -> tuple[Fraction, ...]:
    """Return a polynomial in ``z**step``."""
    spread = [Fraction(0)] * ((len(taps) - 1) * step + 1)
    spread[::step] = taps
    return tuple(spread)


def folding_gain(parts: Sequence[Part]) -> Peak:
    """Largest gain of a frequency that does not come out as itself, in units of the rate of the first part."""
    factor = factor_of(parts)
    return _largest(parts, [(Fraction(1, 2 * factor), _HALF)])


def gain_into_passband(parts: Sequence[Part], edge: Fraction) -> Peak:
    """Largest gain of what comes out at a frequency up to `edge` and is no such frequency itself."""
    return _largest(parts, bands_into_passband(factor_of(parts), edge))


def _largest(parts: Sequence[Part], bands: Sequence[tuple[Fraction, Fraction]]) -> Peak:
    with ctx.workprec(_PRECISION):
        gain = _Gain(parts)
    return largest(gain, bands)


def bands_into_passband(factor: int, edge: Fraction) -> list[tuple[Fraction, Fraction]]:
    """Bands that fold to frequencies up to `edge`, both in units of the rate before decimation by `factor`."""
    centres = (Fraction(k, factor) for k in range(1, factor // 2 + 1))
    return [(centre - edge, min(centre + edge, _HALF)) for centre in centres if centre - edge < _HALF]


class _Taps:
    """Taps ``b_k`` of a filter, by what is known of ``V(w) = sum b_k e**(-i (k - c) w)`` near an angle.

    The centre c takes the delay off, with which V would turn much faster. Within r of w, V is at most ``C r**2 / 2``
    away from its tangent, ``C = sum |b_k| (k - c)**2``, whose magnitude is the largest at an end.
    """

    def __init__(self, taps: Sequence[Fraction]) -> None:
        centre = Fraction(len(taps) - 1, 2)
        self._value = acb_poly([ball(tap) for tap in taps])
        self._slope = acb_poly([ball(tap * (k - centre)) for k, tap in enumerate(taps)])
        self._most = ball(sum(map(abs, taps), Fraction(0)))
        self._curvature = ball(sum((abs(tap) * (k - centre) ** 2 for k, tap in enumerate(taps)), Fraction(0)))

    def on(self, low: Fraction, high: Fraction) -> Factor:
        """Say what is known of the magnitude on an interval of frequencies."""
        u = acb(ball(-(low + high))).exp_pi_i()
        value = self._value(u)
        if low == high:
            return Factor(abs(value), abs(value), arb("inf"))
        reach = arb.pi() * ball(high - low)
        turn = self._slope(u) * acb(0, 1) * reach
        tangent = abs(value + turn).max(abs(value - turn)) + self._curvature * reach**2 / 2
        return Factor(abs(value), tangent.min(self._most), arb("inf"))


class _Gain:
    """What is known of the gain of parts on an interval of frequencies, in units of the rate of the first one."""

    def __init__(self, parts: Sequence[Part]) -> None:
        self._taps: list[tuple[_Taps, int]] = []
        self._poles: list[tuple[Exact, int]] = []
        step = 1
        for part in parts:
            for numerator, denominator in part.sections:
                self._taps.append((_Taps(numerator), step))
                if len(denominator) > 1:
                    self._poles.append((((Fraction(1),), denominator), step))
            step *= part.factor

    def __call__(self, low: Fraction, high: Fraction) -> Factor:
        product = Factor(arb(1), arb(1), arb(0))
        for taps, step in self._taps:
            product = product.times(taps.on(low * step, high * step))
        for section, step in self._poles:
            product = product.times(gain_of_sections([section], low * step, high * step))
        return product
