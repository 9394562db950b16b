"""Worst-case peak gains with a guarantee: limits of a sum of responses, each driven within a range.

With a drive in [low, high] from reset on, the largest contribution of a response's sample h is
``max(h low, h high) = c h + r |h|``, with the centre c and the radius r of the range. The upper limit of several drives
together is the largest sum of these, over all responses, up to any sample. If every range contains zero, no
contribution is negative, and the limit is that of all samples together: c times the gain at zero frequency, which is
exact, and r times the sum of magnitudes (`sosmith.gen.proof.sums`).

Drives whose responses are multiples of one another act as one. The half that rounds to nearest and the error of the
quantizer behind it make such a pair: together, their range contains zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import fmpq_poly

from sosmith.gen.proof.poles import Coefficients
from sosmith.gen.proof.response import IMPULSE, Response, common
from sosmith.gen.proof.sums import Weighted, recursion

ZERO = Fraction(0)
ACCURACY = 40
"""Approximate relative accuracy of a sum in bits, unless another one is asked for."""


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
        return Extent(Fraction(0), Fraction(0))
    under = common([drive.response for drive in live])
    made = recursion(under, accuracy)
    joined = _joined([(drive.response.over(under), drive.low, drive.high) for drive in live])
    numerators = [numerator for numerator, _, _ in joined]
    centres = [(low + high) / 2 for _, low, high in joined]
    radii = [(high - low) / 2 for _, low, high in joined]
    if all(low <= 0 <= high for _, low, high in joined):
        middle = sum((c * Response(n, under).at_zero_frequency for n, c in zip(numerators, centres, strict=True)), ZERO)
        sizes = [total.magnitude + total.uncertainty for total in made.totals(numerators)]
        reach = sum((r * size for r, size in zip(radii, sizes, strict=True)), ZERO)
        return Extent(middle - reach, middle + reach)
    above, below = (
        made.highest([Weighted(n, side * c, r) for n, c, r in zip(numerators, centres, radii, strict=True)])
        for side in (1, -1)
    )
    return Extent(-below, above)


def _joined(
    drives: Sequence[tuple[fmpq_poly, Fraction, Fraction]],
) -> list[tuple[fmpq_poly, Fraction, Fraction]]:
    """Join drives whose numerators are multiples of one another; drop those with a numerator of zero."""
    found: dict[tuple[str, ...], tuple[fmpq_poly, Fraction, Fraction]] = {}
    for numerator, low, high in drives:
        leading = numerator.leading_coefficient()
        if not leading:
            continue
        key = tuple(map(str, (numerator / leading).coeffs()))
        if key not in found:
            found[key] = numerator, low, high
            continue
        first, before_low, before_high = found[key]
        ratio = leading / first.leading_coefficient()
        ends = [Fraction(int(ratio.p), int(ratio.q)) * end for end in (low, high)]
        found[key] = first, before_low + min(ends), before_high + max(ends)
    return list(found.values())


def peak_gain(sections: Sequence[tuple[Coefficients, Coefficients]]) -> Fraction:
    """Upper bound of the worst-case peak gain ``sum |h_k|`` of a product of sections (numerator, denominator).

    It exceeds the exact value by a relative amount in the order of ``2**-40``.
    """
    response = IMPULSE
    for numerator, denominator in sections:
        response = response.all_pole(denominator).taps(numerator)
    return extent([Drive(response, Fraction(-1), Fraction(1))]).high
