"""Proves the largest gain of a decimator and its filter in a whole band around a multiple of the lower rate.

With ``x = cos(2 pi p)`` for the frequency p at the output, in units of the lower rate, the square of a filter's gain is
a quotient of polynomials in x, and ``sin(pi p)**2`` is ``(1 - x) / 2``. So the square of the gain from the frequency
``k - p`` at the input is at most G, a gain that is claimed, where::

    ((1 - x) / 2)**N P(x) / Q(x)  <=  G**2 (R sin(pi (k - p) / R))**(2 N)

and what comes from ``k + p`` is less. Of what folds into the pass band, p goes up to its upper edge alone. On an
interval of x, the left side is at most the largest quotient of the two polynomials' Bernstein coefficients, which are
exact, if all of those of the denominator are positive. The right side falls with p, and is the smallest at the
interval's lower end. Intervals are halved until this proves G. Another quotient, in the interval's middle, disproves it
where it is too small.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from operator import mul

from flint import arb, arb_poly, ctx, fmpq, fmpq_poly

from sosmith.verify.bounds.cosine_polynomials import bernstein, cosine_below, exactly, squared_magnitude
from sosmith.verify.bounds.grid import rounded_up
from sosmith.verify.bounds.l1_response import UndecidedError, fraction
from sosmith.verify.certificate_file import BandEntry, DecimationEntry, SectionEntry
from sosmith.verify.graph import require

_PRECISION = 256
"""Bits to which sines are computed."""

_SMALLEST = Fraction(1, 1 << 80)
"""Shortest interval that is tried."""

_PLACES = Fraction(1, 1 << 32)
"""Distance of the places where a gain may be said to be reached, in units of the lower rate."""

_ENDS = 1 << 16
"""Places of the lower rate, at the next one of which the pass band is taken to end."""

_EXCESS = Fraction(1, 1 << 10)
"""Share by which a claimed gain exceeds the one that is reached, which is then rounded up to the grid."""


@dataclass(frozen=True)
class _Interval:
    """Of an interval of x: a bound on the left side or None, its value in the middle, and the two frequencies."""

    most: Fraction | None
    middle: Fraction
    lowest: arb
    central: arb


class _LeftSide:
    """The left side for all bands, on every interval that was asked for."""

    def __init__(self, sections: Sequence[SectionEntry], stages: int) -> None:
        over = [squared_magnitude(section.denominator) for section in sections]
        under = [squared_magnitude(section.numerator) for section in sections]
        self._sections = list(zip(under, over, strict=True))
        self._stages = stages
        half = fmpq_poly([fmpq(1, 2), fmpq(-1, 2)])
        self._over: fmpq_poly = reduce(mul, under, half**stages)
        self._under: fmpq_poly = reduce(mul, over, fmpq_poly([1]))
        self._degree = max(self._over.degree(), self._under.degree())
        self._known: dict[tuple[Fraction, Fraction], _Interval] = {}

    def on(self, low: Fraction, high: Fraction) -> _Interval:
        """Bound it on an interval."""
        interval = self._known.get((low, high))
        if interval is None:
            over, under = (bernstein(each, self._degree, low, high) for each in (self._over, self._under))
            middle = (low + high) / 2
            positive = min(under) > 0
            most = max(fraction(p / q) for p, q in zip(over, under, strict=True)) if positive else None
            at = exactly(middle)
            value = fraction(self._over(at) / self._under(at))
            interval = self._known[low, high] = _Interval(most, value, _frequency(low), _frequency(middle))
        return interval

    def at(self, frequency: Fraction) -> arb:
        """Enclose it at a frequency, section by section."""
        x = arb.cos_pi_fmpq(exactly(2 * frequency))
        value = ((1 - x) / 2) ** self._stages
        for under, over in self._sections:
            value *= arb_poly(under)(x) / arb_poly(over)(x)
        return value


def check_bands(entry: DecimationEntry, sections: Sequence[SectionEntry]) -> None:
    """Check the gains that are claimed of whole bands.

    Each follows to the last digit from the place where it is said to be reached, so that only this place is a choice:
    among those where hardly less than the largest gain is reached, which is what it claims.

    Raises
    ------
    RejectedError
        If one is exceeded at some frequency, or is not what follows from what is reached.
    UndecidedError
        If that cannot be decided.
    """
    left = _LeftSide(sections, entry.stages)
    ends = Fraction(math.ceil(entry.edge * entry.factor * _ENDS), _ENDS)
    _check_claims(left, entry, entry.bands, "from band", Fraction(1, 2))
    _check_claims(left, entry, entry.passing, "into the pass band from band", ends)


def _check_claims(
    left: _LeftSide, entry: DecimationEntry, claims: Sequence[BandEntry], what: str, end: Fraction
) -> None:
    """Check the gains that are claimed of what folds to frequencies up to `end`, in units of the lower rate."""
    count = entry.factor // 2
    where = what.removesuffix("from band")
    require(len(claims) == count, f"largest gains {where}must be given of {count} bands, not {len(claims)}")
    for band, claim in enumerate(claims, start=1):
        require(
            0 <= claim.at <= end,
            f"band {band} must have its largest gain at 0 to {end} of the lower rate, not at {claim.at}",
        )
        require(
            claim.at % _PLACES == 0,
            f"band {band} must have its largest gain at a multiple of {_PLACES} of the lower rate, not at {claim.at}",
        )
        with ctx.workprec(_PRECISION):
            right = _right_side(entry, band, arb(exactly(claim.at)))
            reached = (left.at(claim.at) / right).sqrt()
            wanted = rounded_up(reached * arb(exactly(1 + _EXCESS)), f"the largest gain {what} {band}")
            require(
                claim.gain <= wanted,
                f"the largest gain {what} {band} must be that at {claim.at} of the lower rate, "
                f"{float(reached):.6g}, or little more, not {float(claim.gain):.6g}",
            )
            _check_bound(left, entry, band, claim.gain, f"the largest gain {what} {band}", end)
            require(
                claim.gain == wanted,
                f"the largest gain {what} {band} must be {wanted}, which follows from that at {claim.at} of the "
                f"lower rate, not {claim.gain}",
            )


def _check_bound(left: _LeftSide, entry: DecimationEntry, band: int, gain: Fraction, what: str, end: Fraction) -> None:
    """Prove that no frequency has a larger gain."""
    square = arb(exactly(gain**2))
    left_to_do = [(cosine_below(end), Fraction(1))]
    while left_to_do:
        low, high = left_to_do.pop()
        interval = left.on(low, high)
        least = square * _right_side(entry, band, interval.lowest)
        if interval.most is not None and arb(exactly(interval.most)) <= least:
            continue
        there = _right_side(entry, band, interval.central)
        reached = (arb(exactly(interval.middle)) / there).sqrt()
        require(
            not reached > arb(exactly(gain)),
            f"{what} must be at least {float(reached):.6g}, which "
            f"is reached at {float(interval.central):.6g} of the lower rate, not {float(gain):.6g}",
        )
        if high - low <= _SMALLEST:
            raise UndecidedError(what)
        middle = (low + high) / 2
        left_to_do += [(low, middle), (middle, high)]


def _right_side(entry: DecimationEntry, band: int, frequency: arb) -> arb:
    """Right side for the gain 1: the denominator of the CIC filter's squared gain."""
    return (entry.factor * ((band - frequency) / entry.factor).sin_pi()) ** (2 * entry.stages)


def _frequency(x: Fraction) -> arb:
    """Frequency with the cosine x."""
    return arb(exactly(x)).acos() / (2 * arb.pi())
