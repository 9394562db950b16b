"""Sums of magnitudes from responses in pieces, against approximate inverses; and what must not pass."""

from fractions import Fraction
from math import prod

import pytest
from flint import fmpq, fmpq_poly

from sosmith.gen.verifier import piecewise
from sosmith.gen.verifier.l1_response import UndecidedError, inverse, response
from sosmith.gen.verifier.piecewise import Pieces

SLOW = fmpq_poly([1, fmpq(-63, 32), fmpq(497, 512)])
DENOMINATORS = {
    "none": fmpq_poly([1]),
    "one pole": fmpq_poly([1, fmpq(-15, 16)]),
    "a pair": SLOW,
    "the same pair three times": SLOW**3,
    "every other sample is zero": fmpq_poly([1, 0, fmpq(31, 32)]),
    "twelve pairs close to each other": prod(fmpq_poly([1, fmpq(-499, 256), fmpq(975 + k, 1024)]) for k in range(12)),
    "slow and fast": SLOW * fmpq_poly([1, fmpq(-1, 16)]),
}
NUMERATORS = (
    fmpq_poly([1]),
    fmpq_poly([1, -2, 1]),
    fmpq_poly([0, 0, fmpq(1, 2), -3, 0, 1]),
    fmpq_poly([fmpq(1, 2**40)]),
)


@pytest.mark.parametrize("name", DENOMINATORS)
def test_sums_agree_with_an_approximate_inverse(name: str) -> None:
    made = Pieces(DENOMINATORS[name])
    over = inverse(DENOMINATORS[name])
    for numerator in NUMERATORS:
        other = response(numerator, over)
        found = made.norm(numerator)
        assert other.gain - 2 * other.error <= found < other.gain + max(other.gain, 1) / 2**80


@pytest.mark.parametrize("part", ["_forms", "_step"])
def test_forms_that_do_not_solve_the_recursion_are_not_taken(part: str) -> None:
    """The residual is exact: one weight that is off in its last but a few bits is seen, and counted."""
    made = Pieces(SLOW)
    before, sum_before = made._residual, made.norm(fmpq_poly([1, -1]))
    getattr(made, part)[-1, 0] += 1 << 100
    assert not made._check_forms()
    assert made._residual > before + Fraction(1 << 99, 1 << made._bits)
    made._found.clear()
    assert made.norm(fmpq_poly([1, -1])) > sum_before + Fraction(1, 1 << made._bits - 99)


def test_signs_close_to_zero_come_from_the_long_integers(monkeypatch: pytest.MonkeyPatch) -> None:
    before = Pieces(SLOW).norm(fmpq_poly([1, -1]))
    monkeypatch.setattr(piecewise, "_ROUNDED", 1000.0)
    assert Pieces(SLOW).norm(fmpq_poly([1, -1])) == before


@pytest.mark.parametrize("denominator", [[1, 0, 1], [1, -1], [1, fmpq(-5, 4)]])
def test_responses_that_do_not_decay_are_refused(denominator: list[fmpq]) -> None:
    with pytest.raises(UndecidedError, match=r"^the responses of a denominator do not decay$"):
        Pieces(fmpq_poly(denominator))


@pytest.mark.parametrize("distance", [18, 24])
def test_a_response_too_long_is_refused(distance: int) -> None:
    with pytest.raises(UndecidedError, match=r"^a response does not die away within 16777216 samples$"):
        Pieces(fmpq_poly([1, -1 + fmpq(1, 2**distance)]))


def test_a_response_of_the_longest_length_is_summed(monkeypatch: pytest.MonkeyPatch) -> None:
    """In 32 pieces of 512 samples, which are as many as there may be."""
    monkeypatch.setattr(piecewise, "_LONGEST", 1 << 14)
    pole = fmpq(round(2 ** (40 - 114 / ((1 << 14) - 30))), 2**40)
    exact = 1 / (1 - Fraction(int(pole.p), int(pole.q)))
    assert exact <= Pieces(fmpq_poly([1, -pole])).norm(fmpq_poly([1])) < exact + Fraction(1, 2**80)


def test_a_coefficient_that_is_no_binary_fraction_is_refused() -> None:
    with pytest.raises(UndecidedError, match=r"^a coefficient is no binary fraction$"):
        Pieces(fmpq_poly([1, fmpq(-1, 3)]))
