"""Squared gains as polynomials in the cosine of the angle, and their Bernstein coefficients on an interval of it."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import arb, fmpq, fmpq_poly, fmpz_poly

from sosmith.verify.bounds.l1_response import UndecidedError

_BITS = 64
"""Fraction bits of cosines that bound an interval."""


def squared_magnitude(taps: Sequence[Fraction]) -> fmpq_poly:
    """Return the squared magnitude of taps: the cosine of k times the angle is the Chebyshev polynomial T_k."""
    square = fmpq_poly([])
    for k in range(len(taps)):
        apart = sum((one * other for one, other in zip(taps, taps[k:], strict=False)), Fraction(0))
        square += fmpq_poly(fmpz_poly.chebyshev_t(k)) * exactly(apart * min(k + 1, 2))
    return square


def bernstein(polynomial: fmpq_poly, degree: int, low: Fraction, high: Fraction) -> list[fmpq]:
    """Return Bernstein coefficients on an interval, each times a binomial coefficient; `degree` is at least its own."""
    count = degree + 1
    within = polynomial(fmpq_poly([exactly(low), exactly(high - low)])).coeffs()
    mirrored = fmpq_poly((within + [fmpq(0)] * (count - len(within)))[::-1])
    shifted: list[fmpq] = mirrored(fmpq_poly([1, 1])).coeffs()
    return (shifted + [fmpq(0)] * (count - len(shifted)))[::-1]


def cosine_below(frequency: Fraction) -> Fraction:
    """Return a multiple of 2**-64 that is no greater than the cosine of a frequency of 0 to 1/2, exact at both."""
    if frequency in {0, Fraction(1, 2)}:
        return Fraction(1 - 4 * frequency)
    scaled = arb.cos_pi_fmpq(exactly(2 * frequency)) * arb(2) ** _BITS
    whole = scaled.lower().floor().unique_fmpz()
    if whole is None:
        raise UndecidedError("the end of a band")
    return Fraction(int(whole), 1 << _BITS)


def exactly(value: Fraction) -> fmpq:
    """Return the same number in FLINT's type."""
    return fmpq(value.numerator, value.denominator)
