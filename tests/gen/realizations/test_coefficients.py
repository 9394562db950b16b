"""Coefficients as integers: to so many significant bits, in lowest terms, or as they were chosen."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sosmith.gen.realizations.coefficients import Rounding, lowest_terms, round_significant

BITS = st.integers(1, 50)
VALUES = st.floats(2.0**-60, 2.0**20) | st.floats(-(2.0**20), -(2.0**-60))


def exact(integer: int, frac: int) -> Fraction:
    return integer * Fraction(2) ** -frac


def in_lowest_terms(integer: int, frac: int) -> bool:
    return frac == 0 or (frac > 0 and integer % 2 == 1)


@given(VALUES, BITS)
def test_no_value_of_so_many_significant_bits_is_nearer(value: float, bits: int) -> None:
    integer, frac = round_significant(value, bits)
    last_place = Fraction(2) ** (math.frexp(value)[1] - bits)
    assert abs(exact(integer, frac) - Fraction(value)) <= last_place / 2
    assert in_lowest_terms(integer, frac)


@given(VALUES, BITS)
def test_there_are_no_more_significant_bits_than_asked_for(value: float, bits: int) -> None:
    integer, _ = round_significant(value, bits)
    digits = f"{abs(integer):b}".rstrip("0")  # below the binary point nothing is left to drop
    assert 1 <= len(digits) <= bits


@given(VALUES, BITS)
def test_the_sign_changes_nothing_else(value: float, bits: int) -> None:
    integer, frac = round_significant(value, bits)
    assert round_significant(-value, bits) == (-integer, frac)


@pytest.mark.parametrize(
    ("value", "bits", "expected"),
    [
        (0.0, 8, (0, 0)),
        (0.75, 8, (3, 2)),
        (0.7, 4, (11, 4)),
        (0.97, 4, (1, 0)),  # rounds up to the next power of two
        (12.0, 2, (12, 0)),  # whole numbers keep their zeros
        (13.9, 2, (12, 0)),
        (-0.3, 3, (-5, 4)),
    ],
)
def test_round_significant(value: float, bits: int, expected: tuple[int, int]) -> None:
    assert round_significant(value, bits) == expected


@given(st.integers(-(2**40), 2**40).filter(bool), st.integers(-20, 60))
def test_lowest_terms_keep_the_value(integer: int, frac: int) -> None:
    shorter = lowest_terms(integer, frac)
    assert exact(*shorter) == exact(integer, frac)
    assert in_lowest_terms(*shorter)


def test_rounding_takes_what_was_chosen_and_the_nearest_else() -> None:
    rounding = Rounding(4, {"A1": (5, 3)})
    assert rounding("A1", 0.7) == (5, 3)
    assert rounding("A2", 0.7) == (11, 4)
    assert Rounding(4)("A1", 0.7) == (11, 4)
