"""Worst-case peak gains with a guarantee: limits of a sum of responses, each driven within a range.

With a drive in [low, high] from reset on, the largest contribution of a response's sample h is
``max(h low, h high) = c h + r |h|``, with the centre c and the radius r of the range. The upper limit of several drives
together is the largest sum of these, over all responses, up to any sample. If every range contains zero, no
contribution is negative, and the limit is that of all samples together: c times the gain at zero frequency, which is
exact, and r times the sum of magnitudes (`sosmith.gen.proof.sums`). If one does not, as that of a constant, sums up to
some sample may be larger, but seldom are: what is still to come of the drives without zero is a response with the same
poles, and that of all others has no negative term. Only where the first is not proven to stay below the second one,
sums are followed from sample to sample.

Drives whose responses are multiples of one another act as one. The half that rounds to nearest and the error of the
quantizer behind it make such a pair: together, their range contains zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from operator import mul

from flint import fmpq, fmpq_poly

from sosmith.gen.proof.nodes import polynomial
from sosmith.gen.proof.poles import Coefficients
from sosmith.gen.proof.response import IMPULSE, Response, common
from sosmith.gen.proof.sums import Numerators, Recursion, Weighted, recursion

ZERO = Fraction(0)
ACCURACY = 40
"""Approximate relative accuracy of a sum in bits, unless another one is asked for."""
CLOSER = 72
"""That of responses whose difference is looked for."""


@dataclass(frozen=True)
class Drive:
    """A response and the range of what drives it, at every sample from reset on."""

    response: Response
    low: Fraction
    high: Fraction


@dataclass(frozen=True)
class Extent:
    """Proven limits of a sum of driven responses: never below `low`, never above `high`, at any sample."""

    low: Fraction
    high: Fraction

    @property
    def magnitude(self) -> Fraction:
        """Largest absolute value."""
        return max(-self.low, self.high)


def extent(drives: Sequence[Drive], accuracy: int = ACCURACY) -> Extent:
    """Limits of the sum of `drives`, all of which are zero before reset.

    The upper limit is the maximum over all n of ``sum over drives of sum over k <= n of max(h_k low, h_k high)``, and
    the lower limit likewise. Intervals that are not symmetric about zero are used as they are, and drives may cancel
    at each n.

    Parameters
    ----------
    drives : sequence of Drive
    accuracy : int
        Bits to which the limits are computed, relative to the size of the responses.

    Raises
    ------
    ShortfallError
        If a pole does not lie inside the unit circle, or a response lasts too long.
    """
    live = [drive for drive in drives if drive.low or drive.high]
    if not live:
        return Extent(ZERO, ZERO)
    under = common([drive.response for drive in live])
    sums = recursion((under,), accuracy)
    joined = _joined([(drive.response.over(under), drive.low, drive.high) for drive in live])
    driven = [((n,), Response(n, under).at_zero_frequency, low, high) for n, low, high in joined]
    return _extent(sums, driven, under, accuracy)


def difference(one: Response, other: Response, low: Fraction, high: Fraction, accuracy: int = CLOSER) -> Extent:
    """Limits of one response minus another, both driven by the same value in [low, high], as in `extent`.

    Each keeps its own denominator. `accuracy` is relative to the size of the two, not of their difference.
    """
    if not one.minus(other).numerator:
        return Extent(ZERO, ZERO)
    # The other one goes first and chooses the length of blocks: it is the filter wanted, whatever is tried.
    sums = recursion((common([other]), common([one])), accuracy)
    gain = one.at_zero_frequency - other.at_zero_frequency
    return _extent(sums, [((-other.numerator, one.numerator), gain, low, high)], None, accuracy)


_Driven = tuple[Numerators, Fraction, Fraction, Fraction]
"""A response, its gain at zero frequency, and the range of what drives it."""


def _extent(
    sums: Recursion, driven: Sequence[_Driven], under: tuple[Coefficients, ...] | None, accuracy: int
) -> Extent:
    """Limits of a sum of responses, over one denominator with the factors `under`, or over several."""
    numerators = [one[0] for one in driven]
    centres = [(low + high) / 2 for *_, low, high in driven]
    radii = [(high - low) / 2 for *_, low, high in driven]
    sizes = [total.magnitude + total.uncertainty for total in sums.totals(numerators)]
    middle = sum((c * gain for (_, gain, *_), c in zip(driven, centres, strict=True)), ZERO)
    reach = sum((r * size for r, size in zip(radii, sizes, strict=True)), ZERO)
    if all(low <= 0 <= high for *_, low, high in driven):
        return Extent(middle - reach, middle + reach)
    more = None if under is None else _overshoot(sums, driven, under, sizes)
    if more is not None and more <= reach / (1 << accuracy):
        return Extent(min(middle - reach - more, ZERO), max(middle + reach + more, ZERO))
    above, below = (
        sums.highest([Weighted(n, side * c, r) for n, c, r in zip(numerators, centres, radii, strict=True)])
        for side in (1, -1)
    )
    return Extent(-below, above)


def _overshoot(
    sums: Recursion, driven: Sequence[_Driven], under: tuple[Coefficients, ...], sizes: Sequence[Fraction]
) -> Fraction | None:
    """Bound on how far sums up to some sample leave the limits of the whole sums; None if nothing is known."""
    steady = fmpq_poly([0])
    others = []
    for ((numerator, *_), _, low, high), size in zip(driven, sizes, strict=True):
        if low <= 0 <= high:
            others.append(((high - low) * size, numerator, low, high))
        else:
            steady += numerator * _rational((low + high) / 2)
    if not others:
        return None
    # What is still to come after sample n is sample n of (gain - steady/D) / (1 - w).
    denominator = reduce(mul, map(polynomial, under), fmpq_poly([1]))
    falling = (denominator * (steady(1) / denominator(1)) - steady) / fmpq_poly([1, -1])
    _, rising, *ends = max(others, key=lambda one: one[0])
    return sums.excess((falling,), (rising,), *ends)


def _rational(value: Fraction) -> fmpq:
    return fmpq(value.numerator, value.denominator)


def _joined(
    drives: Sequence[tuple[fmpq_poly, Fraction, Fraction]],
) -> list[tuple[fmpq_poly, Fraction, Fraction]]:
    """Join drives whose numerators are multiples of one another; drop those with a numerator of zero."""
    by_shape: dict[tuple[str, ...], tuple[fmpq_poly, Fraction, Fraction]] = {}
    for numerator, low, high in drives:
        leading = numerator.leading_coefficient()
        if not leading:
            continue
        key = tuple(map(str, (numerator / leading).coeffs()))
        if key not in by_shape:
            by_shape[key] = numerator, low, high
            continue
        first, before_low, before_high = by_shape[key]
        ratio = leading / first.leading_coefficient()
        ends = [Fraction(int(ratio.p), int(ratio.q)) * end for end in (low, high)]
        by_shape[key] = first, before_low + min(ends), before_high + max(ends)
    return list(by_shape.values())


def peak_gain(sections: Sequence[tuple[Coefficients, Coefficients]]) -> Fraction:
    """Upper bound of the worst-case peak gain ``sum |h_k|`` of a product of sections (numerator, denominator).

    It exceeds the exact value by a relative amount in the order of ``2**-40``.
    """
    response = IMPULSE
    for numerator, denominator in sections:
        response = response.all_pole(denominator).taps(numerator)
    return extent([Drive(response, Fraction(-1), Fraction(1))]).high
