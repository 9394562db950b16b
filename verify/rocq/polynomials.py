"""Polynomials in ``w = z**-1`` as lists of rationals, and as terms of Rocq with integer coefficients."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import lcm

Polynomial = list[Fraction]
"""Coefficients of ``w**0, w**1, ...``."""


def added(a: Sequence[Fraction], b: Sequence[Fraction], factor: Fraction | int = 1) -> Polynomial:
    """Return ``a + factor * b``."""
    size = max(len(a), len(b))
    return [(a[k] if k < len(a) else Fraction(0)) + (factor * b[k] if k < len(b) else 0) for k in range(size)]


def product(a: Sequence[Fraction], b: Sequence[Fraction]) -> Polynomial:
    """Return ``a * b``."""
    result = [Fraction(0)] * max(0, len(a) + len(b) - 1)
    for i, x in enumerate(a):
        if x:
            for k, y in enumerate(b):
                result[i + k] += x * y
    return result


def trimmed(a: Iterable[Fraction]) -> Polynomial:
    """Return a polynomial without zeros of its highest powers."""
    result = list(a)
    while result and not result[-1]:
        result.pop()
    return result


def common_denominator(polynomials: Iterable[Sequence[Fraction]]) -> int:
    """Return the smallest number by which all coefficients become integers."""
    return lcm(*(value.denominator for polynomial in polynomials for value in polynomial))


def integers(polynomial: Sequence[Fraction], scale: int) -> list[int]:
    """Return `scale` times a polynomial, which must be integers.

    Raises
    ------
    ValueError
        If they are not.
    """
    values = [value * scale for value in polynomial]
    if any(value.denominator != 1 for value in values):
        raise ValueError("the coefficients must be integers")
    return [value.numerator for value in values]


def number(value: int) -> str:
    """Write an integer as a term of Z."""
    return str(value) if value >= 0 else f"({value})"


def numbers(values: Iterable[int]) -> str:
    """Write integers as a list of Z."""
    return "[" + "; ".join(map(number, values)) + "]"


def rows(lists: Iterable[Iterable[int]]) -> str:
    """Write lists of integers as a list of lists of Z."""
    return "[" + "; ".join(map(numbers, lists)) + "]"
