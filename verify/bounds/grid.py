"""Numbers of the grid of a certificate's claims that follow from balls."""

from __future__ import annotations

from fractions import Fraction

from flint import arb

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.certificate_file import on_grid


def fraction_of(point: arb) -> Fraction:
    """Return what a ball without a radius holds.

    >>> fraction_of(arb(0.75))
    Fraction(3, 4)
    """
    mantissa, exponent = point.man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def rounded_up(value: arb, what: str) -> Fraction:
    """Round what a ball encloses up to the grid.

    Raises
    ------
    UndecidedError
        If all of the ball does not round to one number; `what` says of what.

    Examples
    --------
    >>> rounded_up(arb(0.5), "half") - Fraction(1, 2) == Fraction(1, 2**64)
    True
    """
    ends = {on_grid(fraction_of(end)) for end in (value.lower(), value.upper())}
    if len(ends) > 1:
        raise UndecidedError(f"{what} could not be rounded")
    return ends.pop()
