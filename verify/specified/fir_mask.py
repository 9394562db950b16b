"""Whether an FIR filter keeps to the edges and losses of a specification, by bisection of its bands.

Taps that are symmetric about their middle c have the gain ``|A(w)|``, ``A(w) = sum b_k cos((k - c) w)``. Within r of an
angle w, A differs from its value there by at most ``|A'(w)| r + sum |b_k| (k - c)**2 r**2 / 2``. A band is halved
until that shows of each part that its gains are allowed, or of one frequency that they are not. Where a gain is its
limit, as one of 1 at 0 often is, no part around it is small enough: then signs of polynomials decide, which can take
longer.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import arb, ctx

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.certificate_file import SectionEntry
from sosmith.verify.specified.balls import ball
from sosmith.verify.specified.filter_table import FilterTable
from sosmith.verify.specified.section_mask import bands_of, sections_keep_to_losses

_PRECISION = 192
_DEEPEST = 40
_MOST_PARTS = 1 << 18

_Band = tuple[Fraction, Fraction]


def keeps_to_losses(taps: Sequence[Fraction], table: FilterTable) -> bool:
    """Say whether gains are from ``-passband_loss`` to 0 dB in pass bands, and at most ``-stopband_loss`` in others.

    Parameters
    ----------
    taps : sequence of Fraction
        Coefficients of 1, 1/z and so on.
    table : FilterTable
        Edges and losses.

    Raises
    ------
    UndecidedError
        If a gain is too close to its limit.
    """
    # Zeros at the ends delay the filter, or nothing.
    nonzero = [k for k, tap in enumerate(taps) if tap]
    taps = taps[nonzero[0] : nonzero[-1] + 1] if nonzero else taps
    if list(taps) != list(taps)[::-1]:
        return False
    try:
        return _keeps_by_bisection(taps, table)
    except UndecidedError:
        return sections_keep_to_losses([SectionEntry(numerator=tuple(taps), denominator=(Fraction(1),))], table)


def _keeps_by_bisection(taps: Sequence[Fraction], table: FilterTable) -> bool:
    with ctx.workprec(_PRECISION):
        least, most = (arb(10) ** (-ball(loss) / 20) for loss in table.losses.values())
        passing, stopping = bands_of(table)
        amplitude = _Amplitude(taps)
        return all(amplitude.is_within(band, least, arb(1)) for band in passing) and all(
            amplitude.is_within(band, arb(0), most) for band in stopping
        )


class _Amplitude:
    """The amplitude of symmetric taps."""

    def __init__(self, taps: Sequence[Fraction]) -> None:
        middle = Fraction(len(taps) - 1, 2)
        # Of each pair of taps, and of that in the middle: its distance from there in half samples, and its weight.
        self._terms = [
            (int(2 * (k - middle)), ball(tap * (1 if k == middle else 2)))
            for k, tap in enumerate(taps)
            if k >= middle and tap
        ]
        self._curvature = sum((abs(weight) * distance**2 / 4 for distance, weight in self._terms), start=arb(0))

    def is_within(self, band: _Band, least: arb, most: arb) -> bool:
        """Say whether all magnitudes in a band are between two limits; False only if one is not."""
        parts = [(*band, 0)]
        for _ in range(_MOST_PARTS):
            if not parts:
                return True
            low, high, depth = parts.pop()
            middle = (low + high) / 2
            value, slope = self._at(middle)
            reach = 2 * arb.pi() * ball((high - low) / 2)
            apart = abs(slope) * reach + self._curvature * reach**2 / 2
            if abs(value) + apart <= most and (least.is_zero() or least <= abs(value) - apart):
                continue
            if abs(value) > most or abs(value) < least:
                return False
            if depth == _DEEPEST:
                break
            parts += [(low, middle, depth + 1), (middle, high, depth + 1)]
        raise UndecidedError("the gains of the filter could not be told from their limits")

    def _at(self, frequency: Fraction) -> tuple[arb, arb]:
        """Return the amplitude and its derivative by the angle."""
        half_angle = arb.pi() * ball(frequency)
        value, slope = arb(0), arb(0)
        for distance, weight in self._terms:
            sine, cosine = (half_angle * distance).sin_cos()
            value += weight * cosine
            slope -= weight * sine * distance / 2
        return value, slope
