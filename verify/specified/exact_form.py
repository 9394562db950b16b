"""The exact filter of a certificate, as it follows from the words of a specification: every digit of it.

The filter is rounded to rationals in one form only: its first sample, or the whole numerator of a sampled filter, then
the factors of its numerator and those of its denominator, each in the order of their coefficients, one of both in a
section. Rows that are given stay as they are. All are multiples of ``2**-b``: b is 192 and, for each pole, twice the
smallest k with which the poles of its factor lie within the circle of the radius ``1 - 2**-k``, at most 52.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import zip_longest
from typing import Any

from flint import arb

from sosmith.verify.bounds.grid import fraction_of
from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.certificate_file import SectionEntry
from sosmith.verify.specified.balls import decided
from sosmith.verify.specified.ideal_filter import StatedFilter

_SPARE_BITS = 192
_LARGEST = 52
_ONE = (Fraction(1),)


def exact_sections(stated: StatedFilter) -> tuple[SectionEntry, ...]:
    """Return the sections by which a certificate has to state a filter.

    Raises
    ------
    UndecidedError
        If a number lies so close to the middle between two multiples that it cannot be rounded.
    SpecificationError
        If no supported order meets the stated edges and losses.

    Examples
    --------
    >>> from sosmith.verify.specified.ideal_filter import stated_filter
    >>> section, = exact_sections(stated_filter({"sos": [[1, 0, 0, 1, Fraction(1, 2), 0]]}, Fraction(100)))
    >>> section.numerator, section.denominator
    ((Fraction(1, 1),), (Fraction(1, 1), Fraction(1, 2)))
    """
    table = stated.table
    sections = _rounded_rows(table.rows) if table.rows else decided(lambda: _rounded(stated))
    if stated.correction:
        sections = [*sections, ((1 + stated.correction, -stated.correction), _ONE)]
    return tuple(SectionEntry(numerator=over, denominator=under) for over, under in sections)


_Section = tuple[tuple[Fraction, ...], tuple[Fraction, ...]]


def _rounded_rows(rows: Sequence[Sequence[Fraction]]) -> list[_Section]:
    bits = _SPARE_BITS + sum(_spread(_shortened(row[len(row) // 2 :])[1:]) for row in rows)
    nearest = [[Fraction(round(value * 2**bits), 2**bits) for value in row] for row in rows]
    return [(_shortened(row[: len(row) // 2]), _shortened(row[len(row) // 2 :])) for row in nearest]


def _rounded(stated: StatedFilter) -> list[_Section]:
    factored = stated.factors()
    bits = _SPARE_BITS + sum(map(_spread, factored.poles))
    first = tuple(_nearest(value, bits) for value in factored.first)
    over, under = (
        sorted(_shortened([1, *(_nearest(tap, bits) for tap in taps)]) for taps in factors)
        for factors in (factored.zeros, factored.poles)
    )
    return [(_shortened(first), _ONE), *zip_longest(over, under, fillvalue=_ONE)]


def _nearest(value: arb, bits: int) -> Fraction:
    """Round all of a ball to the nearest multiple of ``2**-bits``."""
    if not value.is_finite():
        raise UndecidedError("the exact filter could not be enclosed")
    ends = {round(fraction_of(end) * 2**bits) for end in (value.lower(), value.upper())}
    if len(ends) > 1:
        raise UndecidedError("the exact filter could not be rounded")
    return Fraction(ends.pop(), 2**bits)


def _spread(taps: Sequence[Any]) -> int:
    """Count the bits for the poles of a factor: the closer to the unit circle, the more a coefficient counts.

    `taps` are balls or fractions.
    """
    k = next((k for k in range(1, _LARGEST) if _within(taps, 1 - Fraction(1, 2**k))), _LARGEST)
    return 2 * k * len(taps)


def _within(taps: Sequence[Any], radius: Fraction) -> bool:
    """Whether all roots of ``z**n + taps[0] z**(n - 1) + ...`` lie within a circle: the conditions of Jury."""
    r, q = radius.numerator, radius.denominator
    if not taps:
        return True
    if len(taps) == 1:
        return _is_positive(r - q * abs(taps[0]))
    first, second = taps
    return _is_positive(r * r - q * q * abs(second)) and _is_positive(r * r + q * q * second - r * q * abs(first))


def _is_positive(value: arb | Fraction) -> bool:
    if isinstance(value, arb) and value.contains(0):
        raise UndecidedError("the poles of the exact filter could not be told from a circle")
    return bool(value > 0)


def _shortened(taps: Sequence[Fraction | int]) -> tuple[Fraction, ...]:
    """Drop trailing zeros, but for the first coefficient."""
    length = max((k + 1 for k, value in enumerate(taps) if value), default=1)
    return tuple(map(Fraction, taps[:length]))
