"""Rounding and comparing balls: decided where they can be, at a higher precision otherwise."""

from fractions import Fraction

import pytest
from flint import arb, ctx

from sosmith.model.arithmetic.correct_rounding import (
    UndecidedError,
    ball,
    ceiling,
    evaluate,
    nearest_double,
    nearest_multiple,
    sign,
)

ULP = Fraction(1, 2**52)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (Fraction(1, 3), 1 / 3),
        (Fraction(-1, 3), -1 / 3),
        (1 + ULP / 2, 1.0),  # a tie goes to the even neighbour
        (1 + 3 * ULP / 2, 1 + 2 * float(ULP)),
        (1 + ULP / 2 + Fraction(1, 10**60), 1 + float(ULP)),
        (Fraction(1, 10**400), 0.0),
        (Fraction(3, 2**1075), 2.0**-1073),
    ],
)
def test_the_nearest_double(value: Fraction, expected: float) -> None:
    assert evaluate(lambda: nearest_double(ball(value))) == expected


@pytest.mark.parametrize(("frac", "expected"), [(0, 3), (1, Fraction(7, 2)), (3, Fraction(27, 8))])
def test_the_nearest_multiple(frac: int, expected: Fraction) -> None:
    value = Fraction(17, 5)
    assert evaluate(lambda: nearest_multiple(ball(value), frac)) == expected
    assert evaluate(lambda: nearest_multiple(ball(-value), frac)) == -expected


def test_zero_has_no_sign() -> None:
    assert str(evaluate(lambda: nearest_double(-(arb(2).sqrt() ** 2 - 2)))) == "0.0"


def test_a_ball_across_a_tie_asks_for_more_bits() -> None:
    bits = []

    def near_a_tie() -> float:
        bits.append(ctx.prec)
        return nearest_double(1 + arb(2) ** -53 + arb(3).sqrt() ** -800)

    assert evaluate(near_a_tie) == 1 + float(ULP)
    assert bits == [192, 384, 768]


def test_what_stays_open_counts_as_equal() -> None:
    bits = []

    def tie() -> float:
        bits.append(ctx.prec)
        return nearest_double(1 + arb(2) ** -53 + (arb(2).sqrt() ** 2 - 2))

    assert evaluate(tie) == 1.0
    assert bits == [192, 384, 768, 1536, 3072, 6144]
    assert evaluate(lambda: sign(arb(2).sqrt() ** 2 - 2)) == 0
    assert evaluate(lambda: ceiling(arb(2).sqrt() ** 2)) == 2


def test_signs_and_ceilings() -> None:
    with ctx.workprec(64):
        assert [sign(arb(value)) for value in (-0.5, 0, 3)] == [-1, 0, 1]
        assert [ceiling(arb(value)) for value in (-0.5, 2, 2.25)] == [0, 2, 3]
        for undecided in (
            lambda: sign(arb(0, 1e-9)),
            lambda: ceiling(arb(2, 1e-9)),
            lambda: nearest_double(arb("nan")),
        ):
            with pytest.raises(UndecidedError):
                undecided()


def test_a_value_that_no_precision_gives_is_refused() -> None:
    with pytest.raises(UndecidedError):
        evaluate(lambda: nearest_double(arb(0) / 0))
