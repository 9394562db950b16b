"""Upper bounds of pole radii, from exact coefficients."""

from __future__ import annotations

import math
from fractions import Fraction

Coefficients = tuple[Fraction, ...]
"""Of a polynomial in ``w = z**-1``, dyadic, the constant term first."""

_ROOT_BITS = 80  # fraction bits that pole radii are rounded up to


def pole_radii(denominator: Coefficients) -> list[Fraction]:
    """Upper bounds of the poles' radii, above them by less than ``2**-79``.

    Raises
    ------
    ValueError
        If the degree exceeds 2.
    """
    if len(denominator) == 1:
        return []
    if len(denominator) == 2:
        return [abs(denominator[1])]
    if len(denominator) > 3:
        raise ValueError(f"denominator must have a degree of at most 2, not {len(denominator) - 1}")
    _, a1, a2 = denominator
    discriminant = a1 * a1 - 4 * a2
    if discriminant < 0:
        return [_root_above(a2)] * 2
    root = _root_above(discriminant)
    least = max(root - Fraction(1, 1 << _ROOT_BITS), Fraction(0))
    return [(abs(a1) + root) / 2, max(abs(abs(a1) - root), abs(abs(a1) - least)) / 2]


def _root_above(value: Fraction) -> Fraction:
    """Square root rounded up to a multiple of ``2**-80``."""
    scaled = -(-value.numerator * (1 << (2 * _ROOT_BITS)) // value.denominator)
    root = math.isqrt(scaled)
    return Fraction(root + (root * root < scaled), 1 << _ROOT_BITS)
