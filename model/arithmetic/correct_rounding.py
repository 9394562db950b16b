"""Results that do not depend on the machine: ball arithmetic at rising precision until every number is decided.

A ball encloses the exact value of an expression. Where all of a ball rounds to one double, that is the correctly
rounded value, whatever the precision, the library's version and the machine. Where it does not, `evaluate` starts again
with twice the bits.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TypeVar

from flint import arb, ctx, fmpq

T = TypeVar("T")

_FIRST_PRECISION = 192
"""Bits: enough for nearly all filters of low order."""

_MAX_PRECISION = 6144
"""Bits: far beyond what any filter needs that a specification allows. What is open here is an equality."""


class UndecidedError(Exception):
    """The balls are too wide to round or compare what they enclose."""


def evaluate(function: Callable[[], T]) -> T:
    """Evaluate `function` in ball arithmetic with as many bits as its results need.

    Parameters
    ----------
    function : callable
        Makes its results with the functions of this module, each of which raises `UndecidedError` where the precision
        does not decide. Called again, from the beginning, with twice the bits.
    """
    bits = _FIRST_PRECISION
    while True:
        try:
            with ctx.workprec(bits):
                return function()
        except UndecidedError:
            if bits >= _MAX_PRECISION:
                raise
            bits *= 2


def ball(value: Fraction | int | float) -> arb:
    """Ball around a rational number or a double; exact where its denominator is a power of two."""
    exact = Fraction(value)
    return arb(fmpq(exact.numerator, exact.denominator))


def nearest_double(value: arb) -> float:
    """Round to the nearest double, ties to even.

    A ball that keeps a tie or an overflow open at the last precision counts as its midpoint.

    Raises
    ------
    UndecidedError
        If the ball does not lie between two neighbouring ties.
    """
    return _rounded(value, float) + 0.0  # zero has no sign here


def nearest_multiple(value: arb, frac: int) -> Fraction:
    """Round to the nearest multiple of ``2**-frac``; ties and errors as for `nearest_double`."""
    return Fraction(_rounded(value, lambda exact: round(exact * 2**frac)), 2**frac)


def _rounded(value: arb, rounding: Callable[[Fraction], T]) -> T:
    if not value.is_finite():
        raise UndecidedError
    low, high = rounding(_fraction(value.lower())), rounding(_fraction(value.upper()))
    if low == high:
        return low
    if ctx.prec >= _MAX_PRECISION:
        return rounding(_fraction(value.mid()))
    raise UndecidedError


def sign(value: arb) -> int:
    """Sign of the enclosed value, -1, 0 or 1; a ball around zero at the last precision counts as zero.

    Raises
    ------
    UndecidedError
        If the ball holds zero and other values.
    """
    if value > 0:
        return 1
    if value < 0:
        return -1
    if value.is_zero() or (value.is_finite() and ctx.prec >= _MAX_PRECISION):
        return 0
    raise UndecidedError


def ceiling(value: arb) -> int:
    """Smallest integer that is not below the enclosed value.

    Raises
    ------
    UndecidedError
        If the ball holds an integer and values above it.
    """
    if not value.is_finite():
        raise UndecidedError
    whole = round(_fraction(value.mid()))
    return whole + (1 if sign(value - whole) > 0 else 0)


def _fraction(exact: arb) -> Fraction:
    mantissa, exponent = exact.man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
