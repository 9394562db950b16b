"""How far the filter of a certificate is from the one that the specification states.

The distance is the worst-case peak gain of the difference, the sum of the absolute values of its impulse response. It
has no unit: times the largest magnitude of the input, it bounds how far apart the two outputs can ever be.

With ``h`` the impulse response of the difference and S0, S1, S2 the sums of ``h**2``, ``n h**2`` and ``n**2 h**2``,
Cauchy's inequality gives for any m and any t > 0

    sum(|h|)**2 <= sum(1 / (t**2 + (n - m)**2)) * (t**2 S0 + S2 - 2 m S1 + m**2 S0),

where the first sum is at most ``pi coth(pi t) / t``, its limit over all integers n in the worst case of m. With the
mean and the deviation of ``h**2`` as m and t, this is hardly more than the distance itself: 1.25 times for a decaying
exponential, less for what begins and ends smoothly. The three sums follow from polynomials without any sample, by the
recursion of Åström, Jury and Agniel, which also proves stability.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import prod

from flint import arb, arb_poly, ctx

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.certificate_file import SectionEntry
from sosmith.verify.specified.balls import ball, upper_limit
from sosmith.verify.specified.ideal_filter import StatedFilter, TransferFunction

_FIRST_PRECISION = 256
_MAX_PRECISION = 1 << 13  # bits
_ACCURACY = 16  # bits of a distance that have to be right
_EQUAL = Fraction(1, 1 << 1024)  # a distance below this needs no right bit


def distance(stated: StatedFilter, sections: Sequence[SectionEntry]) -> Fraction:
    """Bound the peak gain of the difference between the stated filter and the product of `sections` from above.

    Parameters
    ----------
    stated : StatedFilter
    sections : sequence of SectionEntry
        Of a certificate's `ideal.sections`.

    Returns
    -------
    Fraction
        Usually 1.1 to 1.7 times the true peak gain of the difference; below 2**-1024 if the filters are equal.

    Raises
    ------
    UndecidedError
        If either filter is unstable, or the arithmetic is too coarse to show that it is stable.
    SpecificationError
        If no supported order meets the stated edges and losses.

    Examples
    --------
    >>> from sosmith.verify.specified.ideal_filter import stated_filter
    >>> stated = stated_filter({"sos": [[1, 0, 0, 1, 0, 0]]}, Fraction(100))
    >>> section = SectionEntry(numerator=(Fraction(3, 4),), denominator=(Fraction(1),))
    >>> Fraction(1, 4) <= distance(stated, [section]) < Fraction(1, 2)
    True
    """
    bits = _FIRST_PRECISION
    while True:
        try:
            bound = _bound(stated, sections, bits)
        except UndecidedError:
            if bits >= _MAX_PRECISION:
                raise
        else:
            settled = bound.rel_accuracy_bits() >= _ACCURACY or bits >= _MAX_PRECISION
            if settled or upper_limit(bound) < _EQUAL:
                return upper_limit(bound)
        bits *= 2


def _bound(stated: StatedFilter, sections: Sequence[SectionEntry], bits: int) -> arb:
    """Enclose the bound; the ball is narrow if the precision suffices."""
    true = stated.at(bits)
    with ctx.workprec(bits):
        certified = TransferFunction(
            _product(section.numerator for section in sections), _product(section.denominator for section in sections)
        )
        over = true.numerator * certified.denominator - certified.numerator * true.denominator
        s0, s1, s2 = _moments(over, true.denominator * certified.denominator)
        mean = s1 / s0
        m, t = _exact(mean), _exact((s2 / s0 - mean * mean).nonnegative_part().sqrt())
        t = t.max(arb(2) ** -10)
        square = arb.pi() * (arb.pi() * t).coth() / t * (t**2 * s0 + s2 - 2 * m * s1 + m**2 * s0)
        bound = square.nonnegative_part().sqrt()
        if not bound.is_finite():
            raise UndecidedError("the distance of the ideal filter from the specification could not be bounded")
        return bound


def _product(factors: Iterable[Sequence[Fraction]]) -> arb_poly:
    return prod((arb_poly([ball(value) for value in factor]) for factor in factors), start=arb_poly([1]))


def _exact(value: arb) -> arb:
    """Middle of a ball, or 1 if it has none: a choice that only makes the bound better or worse."""
    return value.mid() if value.is_finite() else arb(1)


def _moments(over: arb_poly, under: arb_poly) -> tuple[arb, arb, arb]:
    """Return the sums of ``h**2``, ``n h**2`` and ``n**2 h**2`` over the impulse response of ``over / under``.

    The response ``n h`` is that of w times the derivative of the transfer function.
    """
    plain = over * under
    ramped = arb_poly([0, 1]) * (over.derivative() * under - over * under.derivative())
    return _inner_products(plain, ramped, under * under)


def _inner_products(first: arb_poly, second: arb_poly, under: arb_poly) -> tuple[arb, arb, arb]:
    """Inner products of the impulse responses of ``first / under`` and ``second / under``: 1 1, 1 2 and 2 2.

    Raises
    ------
    UndecidedError
        If `under` has, or may have, a zero in the closed unit disk.
    """
    length = max(polynomial.length() for polynomial in (first, second, under))
    a, b, c = ([polynomial[i] for i in range(length)] for polynomial in (under, first, second))
    leading = a[0]
    bb, bc, cc = arb(0), arb(0), arb(0)
    for k in reversed(range(length)):
        if not a[0] > 0:
            raise UndecidedError("the stability of the ideal filter and the stated one could not be decided")
        bb, bc, cc = (total + x * y / a[0] for total, x, y in ((bb, b[k], b[k]), (bc, b[k], c[k]), (cc, c[k], c[k])))
        back = a[k::-1]
        a, b, c = (
            [value - row[k] / a[0] * other for value, other in zip(row[:k], back, strict=False)] for row in (a, b, c)
        )
    return bb / leading, bc / leading, cc / leading
