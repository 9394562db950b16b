"""Whether a filter with poles keeps to the edges and losses of a specification, by the signs of polynomials.

With ``x = cos(w)``, the square of its gain is a quotient P / Q of polynomials with Q above 0, so that ``P <= g Q`` says
that no gain is above the square root of g, and ``P >= g Q`` that none is below it. On an interval of x, a polynomial
has no value above 0 if none of its Bernstein coefficients has; otherwise the interval is halved.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import reduce
from operator import mul

from flint import arb, ctx, fmpq_poly

from sosmith.verify.bounds.cosine_polynomials import bernstein, cosine_below, exactly, squared_magnitude
from sosmith.verify.bounds.l1_response import UndecidedError, fraction
from sosmith.verify.certificate_file import SectionEntry
from sosmith.verify.specified.balls import ball
from sosmith.verify.specified.filter_table import FilterTable

_Band = tuple[Fraction, Fraction]
_PRECISION = 256
_LIMIT_BITS = 192
"""Fraction bits of limits of squared gains, which are rounded to the safe side."""

_SMALLEST = Fraction(1, 1 << 80)
"""Shortest interval that is tried."""


def sections_keep_to_losses(sections: Sequence[SectionEntry], table: FilterTable) -> bool:
    """Say whether gains are from ``-passband_loss`` to 0 dB in pass bands, and at most ``-stopband_loss`` in others.

    Parameters
    ----------
    sections : sequence of SectionEntry
        Exact, with all poles inside the unit circle.
    table : FilterTable
        Edges and losses.

    Raises
    ------
    UndecidedError
        If a gain is too close to its limit.
    """
    over, under = (
        reduce(mul, (squared_magnitude(getattr(section, part)) for section in sections), fmpq_poly([1]))
        for part in ("numerator", "denominator")
    )
    with ctx.workprec(_PRECISION):
        passing, stopping = ([(cosine_below(high), _above(low)) for low, high in bands] for bands in bands_of(table))
        least = _multiple(-table.losses["passband_loss"], up=True)
        most = _multiple(-table.losses["stopband_loss"], up=False)
    return (
        all(_is_nowhere_positive(over - under, *interval) for interval in passing)
        and all(_is_nowhere_positive(exactly(least) * under - over, *interval) for interval in passing)
        and all(_is_nowhere_positive(over - exactly(most) * under, *interval) for interval in stopping)
    )


def bands_of(table: FilterTable) -> tuple[list[_Band], list[_Band]]:
    """Return the pass bands and the stop bands, in units of the sample rate."""
    zero, half = Fraction(0), Fraction(1, 2)
    passband, stopband = table.passband_edge, table.stopband_edge
    if table.kind == "lowpass":
        return [(zero, passband[0])], [(stopband[0], half)]
    if table.kind == "highpass":
        return [(passband[0], half)], [(zero, stopband[0])]
    if table.kind == "bandpass":
        return [(passband[0], passband[1])], [(zero, stopband[0]), (stopband[1], half)]
    return [(zero, passband[0]), (passband[1], half)], [(stopband[0], stopband[1])]


def _above(frequency: Fraction) -> Fraction:
    """Return a number that is no less than the cosine of a frequency, exact at 0 and 1/2."""
    return -cosine_below(Fraction(1, 2) - frequency)


def _multiple(level: Fraction, *, up: bool) -> Fraction:
    """Return a multiple near the square of a gain given in dB, above it or below."""
    scaled = arb(10) ** (ball(level) / 10) * arb(2) ** _LIMIT_BITS
    whole = (scaled.upper().ceil() if up else scaled.lower().floor()).unique_fmpz()
    if whole is None:
        raise UndecidedError("a limit of the gain")
    return Fraction(int(whole), 1 << _LIMIT_BITS)


def _is_nowhere_positive(polynomial: fmpq_poly, low: Fraction, high: Fraction) -> bool:
    degree = max(0, polynomial.degree())
    parts = [(low, high)]
    while parts:
        start, end = parts.pop()
        if max(bernstein(polynomial, degree, start, end)) <= 0:
            continue
        middle = (start + end) / 2
        if any(fraction(polynomial(exactly(x))) > 0 for x in (start, middle, end)):
            return False
        if end - start <= _SMALLEST:
            raise UndecidedError("the gains of the filter could not be told from their limits")
        parts += [(start, middle), (middle, end)]
    return True
