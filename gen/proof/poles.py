"""Upper bounds of pole radii, from exact coefficients."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from flint import fmpz

Coefficients = tuple[Fraction, ...]
"""Of a polynomial in ``w = z**-1``, dyadic, the constant term first."""

_ROOT_BITS = 80  # fraction bits that pole radii are rounded up to


def pole_radii(denominator: Coefficients) -> list[Fraction]:
    """Upper bounds of the poles' radii, above them by less than ``2**-79``.

    Raises
    ------
    ValueError
        If it is not of degree 1 or 2 in w, or in a power of w.
    """
    step = power_of(denominator)
    radii = _radii(denominator[::step])
    return radii if step == 1 else [_root_above(radius, step) for radius in radii for _ in range(step)]


def power_of(denominator: Sequence[Fraction] | Sequence[float]) -> int:
    """Return the largest step for which a polynomial in w is one in ``w**step``; 1 for a constant."""
    return math.gcd(*(k for k, value in enumerate(denominator) if value)) or 1


def _radii(denominator: Coefficients) -> list[Fraction]:
    if len(denominator) == 1:
        return []
    if len(denominator) == 2:
        return [abs(denominator[1])]
    if len(denominator) > 3:
        raise ValueError(
            f"denominator must be of degree 1 or 2 in w or in a power of w, not of degree {len(denominator) - 1}"
        )
    _, a1, a2 = denominator
    discriminant = a1 * a1 - 4 * a2
    if discriminant < 0:
        return [_root_above(a2)] * 2
    root = _root_above(discriminant)
    least = max(root - Fraction(1, 1 << _ROOT_BITS), Fraction(0))
    return [(abs(a1) + root) / 2, max(abs(abs(a1) - root), abs(abs(a1) - least)) / 2]


def _root_above(value: Fraction, degree: int = 2) -> Fraction:
    """Root of a degree, rounded up to a multiple of ``2**-80``."""
    scaled = -(-value.numerator * (1 << (degree * _ROOT_BITS)) // value.denominator)
    root = int(fmpz(scaled).root(degree))
    return Fraction(root + (root**degree < scaled), 1 << _ROOT_BITS)
