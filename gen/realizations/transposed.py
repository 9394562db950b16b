"""Makes transposed direct form II sections: chooses the operator and its scaling."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from sosmith.gen.realizations.coefficients import Rounding
from sosmith.gen.realizations.direct_form import pole_side, products
from sosmith.gen.realizations.tied_row import TiedRow
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.transposed_form import Limits, TransposedForm

Row = Sequence[float]


def transposed_form(
    row: Row,
    *,
    name: str,
    delta: bool,
    rounding: Rounding,
    x: Range,
    fracs: Mapping[str, int],
    ranges: Mapping[str, Limits],
    wide: Limits,
) -> TransposedForm:
    """Make a section.

    Parameters
    ----------
    row : sequence of float
        b0, b1, b2, 1, a1, a2.
    name : str
        Its name.
    delta : bool
        Whether to use the delta operator, about the side of the unit circle where the poles lie, instead of the shift
        operator.
    rounding : Rounding
        Rounds the coefficients.
    x : Range
        Fraction bits and range of the input's code.
    fracs : mapping of str to int
        Fraction bits kept by the quantizers of v, t1 and t2. If the mapping is empty, all keep as many as the input
        has; otherwise a missing one keeps all, because it had nothing to drop.
    ranges : mapping of str to tuple of int
        Ranges of the codes of v, t1 and t2.
    wide : tuple of int
        Range of a code that `ranges` does not name.

    Raises
    ------
    ShortfallError
        If the section passes nothing, or its rounded coefficients are unstable.
    """
    # In transposed form, x is multiplied by each coefficient separately: unity gain on the other side saves nothing.
    side = pole_side(row)
    made, integer_part = products(row, rounding, name, side)
    operator = side if delta else 0
    tied = row.delta_exponent if isinstance(row, TiedRow) and delta else None
    exponent = _delta_exponent(row, operator) if tied is None else tied
    state_fracs = (fracs.get("t1"), fracs.get("t2")) if fracs else (x.frac, x.frac)
    # If y(n) does not depend on x(n), it is s1, which is already quantized.
    output = "v" if any(product.x[0] for product in made) else "t1"
    try:
        return TransposedForm(
            name=name,
            products=made,
            integer_part=integer_part,
            operator=operator,
            delta_exponent=exponent,
            x=x,
            y_frac=fracs.get(output, _exact_frac(x.frac, fracs, exponent)),
            state_fracs=state_fracs,
            v_range=ranges.get("v", wide),
            t1_range=ranges.get("t1", wide),
            t2_range=ranges.get("t2", wide),
        )
    except ValueError as error:
        raise ShortfallError(f"{name} must be stable with coefficients of {rounding.bits} bits: {error}") from None


def _exact_frac(x_frac: int, fracs: Mapping[str, int], delta_exponent: int) -> int:
    """Fraction bits of y, which is a sum of integer multiples of x and of the quantized states."""
    if not fracs:
        return x_frac
    return max(x_frac, fracs.get("t1", 0), fracs.get("t2", 0) - delta_exponent)


def common_exponent(rows: Sequence[Row]) -> int:
    """Return the exponent of sections with the delta operator that suits several of them: the middle of theirs."""
    each = [_delta_exponent(row, pole_side(row)) for row in rows]
    return round((min(each) + max(each)) / 2)


def _delta_exponent(row: Row, operator: int) -> int:
    """Exponent of the power of two nearest to the ratio of the states' rms values.

    With A1 and A2 in powers of ``z - g``, ``Delta s2`` is approximately the derivative of y plus A1 y. For noise in a
    narrow band about the poles, these two are uncorrelated, with powers of A2 and A1**2 times that of y.
    """
    if operator == 0:
        return 0
    a1, a2 = row[4:]
    first, second = 2 * operator + a1, 1 + operator * a1 + a2
    return round(math.log2(math.sqrt(first**2 + second)))
