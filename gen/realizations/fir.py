"""Makes FIR filters: shares products among taps of one magnitude, with coefficients in one grid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.fir import FirSection, Form, TapProduct, grouped

Row = Sequence[float]

_EQUAL = 2.0**-40
"""Distance of magnitudes, relative to the largest tap, that design in double precision leaves between equal ones.

What is lost is counted as an error of the coefficients, as the exact taps are those stated.
"""


class Coefficient(NamedTuple):
    """A coefficient before it is rounded.

    Attributes
    ----------
    name : str
        After its first tap.
    value : float
        Value of this tap.
    taps : tuple of (int, int)
        As in `sosmith.model.sections.fir.TapProduct`.
    """

    name: str
    value: float
    taps: tuple[tuple[int, int], ...]


def coefficients_of(row: Row) -> list[Coefficient]:
    """Return the coefficients of a filter, given as its taps followed by a denominator that is 1."""
    taps = row[: len(row) // 2]
    groups = grouped(taps, _EQUAL * max(map(abs, taps)))
    return [Coefficient(f"b{members[0][0]}", value, members) for value, members in groups]


def fir_section(row: Row, form: SectionFormat, name: str, *, structure: Form) -> FirSection:
    """Make an FIR filter from its taps, followed by a denominator that is 1.

    All coefficients are multiples of the same power of two, such that the largest has the significant bits of `form`;
    those that it lists are taken from there, and others then are 0.

    Raises
    ------
    ShortfallError
        If all taps are 0, or become so.
    """
    ideal = coefficients_of(row)
    if not ideal:
        raise ShortfallError(f"numerator of {name} must not be zero")
    chosen = form.coefficients or on_grid(
        ideal, form.coefficient_bits - math.frexp(max(abs(c.value) for c in ideal))[1]
    )
    products = tuple(TapProduct(c.name, *chosen[c.name], c.taps) for c in ideal if chosen.get(c.name, (0, 0))[0])
    if not products:
        raise ShortfallError(f"coefficients of {name} must not all be rounded to zero")
    return FirSection(name=name, products=products, form=structure, x=form.x)


def on_grid(ideal: Sequence[Coefficient], frac: int) -> dict[str, tuple[int, int]]:
    """Round coefficients to `frac` fraction bits; return integers and fraction bits, not in lowest terms.

    >>> on_grid([Coefficient("b0", 0.26, ((0, 1),)), Coefficient("b1", 0.5, ((1, 1),))], 4)
    {'b0': (4, 4), 'b1': (8, 4)}
    """
    return {c.name: (round(math.ldexp(c.value, frac)), frac) for c in ideal}
