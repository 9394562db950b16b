"""Transposed sections: their difference equations in rationals, their equivalents in direct form, refusals."""

import re
from dataclasses import replace
from fractions import Fraction
from math import floor

import numpy as np
import pytest
from tests.model.datapaths import butterworth, sections_of

from sosmith.model.dataflow.graph import Range
from sosmith.model.sections.direct_form import Product
from sosmith.model.sections.transposed_form import TransposedForm

F7 = butterworth(7, 0.002588)
WIDE = (-(1 << 90), 1 << 90)
GENERAL = (
    Product("A1", 5, 5, (0, 0, 0), (-1, 1)),
    Product("A2", 3, 6, (0, 1, 0), (0, -1)),
    Product("b0", 7, 4, (1, 1, 1), (0, 0)),  # three times b0 in powers of z - 1
    Product("b1", -9, 5, (0, 1, 0), (0, 0), 1),
)
"""A numerator without symmetry, all of whose taps need another weight in each operator."""

FIRST = (Product("A1", 11, 7, (0, 1, 0), (-1, 0)), Product("b0", 3, 3, (1, -1, 0), (0, 0)))


def section(products: tuple[Product, ...], operator: int, **options: object) -> TransposedForm:
    second = any(product.y[1] for product in products)
    made = TransposedForm(
        name="section",
        products=products,
        integer_part=(-2, 1) if second else (-1, 0),
        operator=operator,
        delta_exponent=-3,
        x=Range(1, -(1 << 15), (1 << 15) - 1),
        y_frac=4,
        state_fracs=(6, 5),
        v_range=WIDE,
        t1_range=WIDE,
        t2_range=WIDE,
    )
    return replace(made, **options)


def difference_equation(form: TransposedForm, codes: list[int]) -> list[Fraction]:
    """Compute the module's equations in rationals, from (b, a) of the direct form."""
    b, (a1, a2), g = form.direct.numerator, form.direct.denominator, form.operator
    second = any(product.y[1] for product in form.products)
    if second:
        numerator = (b[0], 2 * g * b[0] + b[1], g * g * b[0] + g * b[1] + b[2])
        denominator = (2 * g + a1, g * g + g * a1 + a2)
    else:
        numerator, denominator = (b[0], g * b[0] + b[1], Fraction(0)), (g + a1, Fraction(0))
    delta = Fraction(2) ** form.delta_exponent
    s1 = s2 = Fraction(0)
    result = []
    for code in codes:
        x = Fraction(code, 1 << form.x.frac)
        y = quantized(numerator[0] * x + s1, form.y_frac, centred=g != 1)
        t1 = g * s1 + numerator[1] * x - denominator[0] * y + delta * s2
        t2 = g * s2 + (numerator[2] * x - denominator[1] * y) / delta
        s1 = quantized(t1, form.state_fracs[0], centred=g != 1 or not second)
        s2 = quantized(t2, form.state_fracs[1], centred=True)
        result.append(y)
    return result


def quantized(value: Fraction, frac: int | None, *, centred: bool) -> Fraction:
    if frac is None:
        return value
    unit = Fraction(1, 1 << frac)
    return floor((value + unit / 2 * centred) / unit) * unit


@pytest.mark.parametrize("state_fracs", [(6, 5), (3, 9), (None, None)])
@pytest.mark.parametrize("operator", [-1, 0, 1])
@pytest.mark.parametrize("products", [GENERAL, FIRST], ids=["second order", "first order"])
def test_section_computes_its_difference_equation(
    products: tuple[Product, ...], operator: int, state_fracs: tuple[int | None, int | None]
) -> None:
    form = section(products, operator, state_fracs=state_fracs)
    codes = np.random.default_rng(4).integers(-(1 << 15), 1 << 15, 300).tolist()
    found = [Fraction(code, 1 << form.y_frac) for (code,) in form.graph.run([[code] for code in codes])]
    assert found == difference_equation(form, codes)


@pytest.mark.slow
@pytest.mark.parametrize("operator", [0, 1])
def test_exact_states_make_the_direct_form_bit_for_bit(operator: int) -> None:
    """THEORY 3.5: keeping s1 and s2 exact, only y's quantizer is left, and its error is fed back as by (-2, 1)."""
    x = [[code] for code in np.random.default_rng(6).integers(-32768, 32768, 3000).tolist()]
    for direct in sections_of(F7, guard=3):
        form = TransposedForm(
            name=direct.name,
            products=direct.products,
            integer_part=direct.integer_part,
            operator=operator,
            delta_exponent=-7,
            x=Range(0, -32768, 32767),
            y_frac=3,
            state_fracs=(None, None),
            v_range=WIDE,
            t1_range=WIDE,
            t2_range=WIDE,
        )
        assert form.direct.feedback == (((-2, 1) if form.order == 2 else (-1, 0)) if operator else (0, 0))
        assert form.graph.run(x) == form.direct.graph.run(x)


def test_a_state_keeps_no_more_bits_than_there_are() -> None:
    exact, padded = (section(GENERAL, 1, state_fracs=fracs) for fracs in ((None, None), (80, 80)))
    assert exact.graph == padded.graph


def test_refusals() -> None:
    with pytest.raises(ValueError, match=r"^operator must be -1, 0 or 1, not 2$"):
        section(GENERAL, 2)
    with pytest.raises(ValueError, match=re.escape("products must not be empty")):
        section((), 0)
    unstable = (Product("A1", -1, 4, (0, 0, 0), (-1, 1)), *GENERAL[1:])
    with pytest.raises(ValueError, match=r"^poles must lie inside the unit circle, not at a1 = .*, a2 = .*$"):
        section(unstable, 0)
