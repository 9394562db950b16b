"""Balls around rational numbers, and rational limits of balls."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TypeVar

from flint import arb, ctx, fmpq

from sosmith.verify.bounds.grid import fraction_of
from sosmith.verify.bounds.l1_response import UndecidedError

T = TypeVar("T")

_FIRST_PRECISION = 512
_MAX_PRECISION = 1 << 13  # bits


def ball(value: Fraction | int) -> arb:
    """Enclose a rational number; exact where its denominator is a power of two.

    >>> ball(Fraction(1, 3)) * 3 == 1, ball(Fraction(1, 4)) == 0.25
    (False, True)
    """
    exact = Fraction(value)
    return arb(fmpq(exact.numerator, exact.denominator))


def upper_limit(value: arb) -> Fraction:
    """Return a short fraction just above the upper end of a finite ball.

    >>> Fraction(7, 2) <= upper_limit(arb(3, 0.5)) < Fraction(351, 100)
    True
    """
    with ctx.workprec(64):
        return fraction_of(value.upper())


def decided(compute: Callable[[], T]) -> T:
    """Compute something with as many bits as decide it.

    Raises
    ------
    UndecidedError
        If 8192 bits do not.
    """
    bits = _FIRST_PRECISION
    while True:
        try:
            with ctx.workprec(bits):
                return compute()
        except UndecidedError:
            if bits >= _MAX_PRECISION:
                raise
            bits *= 2
