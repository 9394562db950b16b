"""Jacobi's elliptic functions of real arguments by Landen's descending transformation, in ball arithmetic.

A modulus k comes with its complement ``k' = sqrt(1 - k**2)``, since either may be too close to 1 to tell the other.
Arguments are fractions u of the quarter period K. One step down leads from k to ``(k / (1 + k'))**2``, and

    sn(u K, k) = (1 + l) s / (1 + l s**2)    with l the next modulus and s = sn(u L, l).

At the bottom the modulus is as small as the precision. There ``sn(u K, k)`` is sin(pi u / 2) but for less than
``2 k**2``, as the amplitude lies between ``k'`` and ``1 / k'`` times pi u / 2.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

from flint import arb, ctx

from sosmith.verify.bounds.l1_response import UndecidedError


class Modulus(NamedTuple):
    """A modulus and its complement, both in 0..1."""

    k: arb
    complement: arb

    @property
    def turned(self) -> Modulus:
        """The complementary modulus, with this one as its complement."""
        return Modulus(self.complement, self.k)


def sn(u: arb, modulus: Modulus) -> arb:
    """Return ``sn(u K, k)`` for u in 0..1, where it rises from 0 to 1.

    Raises
    ------
    UndecidedError
        If the modulus is not known well enough.

    Examples
    --------
    >>> from flint import arb
    >>> half = sn(arb(0.5), Modulus(arb(0.6), (1 - arb(0.6) ** 2).sqrt()))
    >>> abs(half * half - 1 / (1 + (1 - arb(0.6) ** 2).sqrt())) < 1e-14
    True
    """
    path = _descent(modulus)
    value = (u / 2).sin_pi() + _bottom_error(path[-1].k)
    for below in reversed(path[1:]):
        value = (1 + below.k) * value / (1 + below.k * value * value)  # FLINT gives no power of a ball around 0
    return value


def inverse_sn(value: arb, modulus: Modulus) -> arb:
    """Return the fraction u of the quarter period with ``sn(u K, k) = value``, for a value in 0..1.

    Raises
    ------
    UndecidedError
        If the modulus is not known well enough.

    Examples
    --------
    >>> from flint import arb
    >>> modulus = Modulus(arb(0.6), (1 - arb(0.6) ** 2).sqrt())
    >>> abs(inverse_sn(sn(arb(0.3), modulus), modulus) - arb(0.3)) < 1e-12
    True
    """
    path = _descent(modulus)
    for above, below in pairwise(path):
        value = 2 * value / ((1 + below.k) * (1 + (1 - (above.k * value) ** 2).sqrt()))
    return 2 * value.asin() / arb.pi() + _bottom_error(path[-1].k)


def _descent(modulus: Modulus) -> list[Modulus]:
    """Moduli from the given one downward; the last one's square is below the precision."""
    path = [modulus]
    while not path[-1].k ** 2 < arb(2) ** -ctx.prec:
        k, complement = path[-1]
        if not (k.is_finite() and complement > 0 and k < 2):
            raise UndecidedError("the modulus of an elliptic function could not be enclosed")
        path.append(Modulus((k / (1 + complement)) ** 2, 2 * complement.sqrt() / (1 + complement)))
    return path


def _bottom_error(k: arb) -> arb:
    """Ball around zero that contains the error of the sine at the last modulus, in value and in fraction."""
    return arb(0, 2 * k**2)
