"""Makes FIR filters: shares products among taps of one magnitude."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.fir import FirSection, Form, TapProduct, grouped

Row = Sequence[float]

_EQUAL = 2.0**-40
"""Distance of magnitudes, relative to the largest tap, that design in double precision leaves between equal ones.

What is lost is counted as an error of the coefficients, as the exact taps are those stated.
"""


def fir_section(row: Row, form: SectionFormat, name: str, *, structure: Form) -> FirSection:
    """Make an FIR filter from its numerator, b0 and so on, followed by a denominator that is 1.

    Raises
    ------
    ShortfallError
        If all taps are 0.
    """
    taps = row[: len(row) // 2]
    groups = grouped(taps, _EQUAL * max(map(abs, taps)))
    if not groups:
        raise ShortfallError(f"numerator of {name} must not be zero")
    named = [(f"b{members[0][0]}", value, members) for value, members in groups]
    rounded = [(label, *form.rounding(label, value), members) for label, value, members in named]
    products = tuple(TapProduct(*one) for one in rounded if one[1])
    if not products:
        raise ShortfallError(f"coefficients of {name} must not all be rounded to zero")
    return FirSection(name=name, products=products, form=structure, x=form.x)
