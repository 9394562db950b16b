"""Sums of magnitudes from responses in pieces, against approximate inverses; and what must not pass."""

from fractions import Fraction
from itertools import accumulate, zip_longest
from math import prod

import pytest
from flint import fmpq, fmpq_poly

from sosmith.verify.bounds import driven_responses, piecewise, summed_forms
from sosmith.verify.bounds.l1_response import BITS, UndecidedError, inverse, response
from sosmith.verify.bounds.piecewise import Pieces

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


@pytest.mark.sweep(3)
@pytest.mark.parametrize("name", DENOMINATORS)
def test_sums_agree_with_an_approximate_inverse(name: str) -> None:
    made = Pieces(DENOMINATORS[name])
    over = inverse(DENOMINATORS[name])
    for numerator in NUMERATORS:
        other = response(numerator, over)
        found = made.norm(numerator)
        assert other.gain - 2 * other.error <= found < other.gain + max(other.gain, 1) / 2**80


def test_multiples_and_delays_have_the_multiple_of_one_sum(monkeypatch: pytest.MonkeyPatch) -> None:
    made, over = Pieces(SLOW), inverse(SLOW)
    first = made.norm(NUMERATORS[1])
    monkeypatch.setattr(made, "_sequence", None)
    for factor in (fmpq_poly([fmpq(-3, 4)]), fmpq_poly([0, 0, 5]), fmpq_poly([0, fmpq(1, 2**20)])):
        found, exact = made.norm(NUMERATORS[1] * factor), response(NUMERATORS[1] * factor, over)
        assert found == first * abs(Fraction(str(factor.leading_coefficient())))
        assert exact.gain - 2 * exact.error <= found < exact.gain + Fraction(1, 2**80)
    assert made.norm(fmpq_poly([0])) == 0


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


def test_forms_whose_last_bits_count_get_more_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the large ones of many poles close to each other; here the bits that are asked for beyond these are few."""
    denominator = DENOMINATORS["the same pair three times"]
    before = Pieces(denominator).norm(fmpq_poly([1]))
    monkeypatch.setattr(piecewise, "_MARGIN", 4)
    assert abs(Pieces(denominator).norm(fmpq_poly([1])) - before) < before / 2**80


def test_signs_close_to_zero_come_from_the_long_integers(monkeypatch: pytest.MonkeyPatch) -> None:
    before = Pieces(SLOW).norm(fmpq_poly([1, -1]))
    monkeypatch.setattr(summed_forms, "_UNIT", 2.0**-10)
    assert Pieces(SLOW).norm(fmpq_poly([1, -1])) == before


@pytest.mark.sweep(3)
@pytest.mark.parametrize("name", DENOMINATORS)
def test_a_rough_sum_is_above_the_close_one_by_little(name: str) -> None:
    for numerator in NUMERATORS:
        close, rough = (Pieces(DENOMINATORS[name]).norm(numerator, rough=rough) for rough in (False, True))
        assert close - max(close, 1) / 2**90 <= rough < close + max(close, 1) / 2**36


def test_a_rough_sum_is_as_close_as_one_that_is_known() -> None:
    made = Pieces(SLOW)
    assert (
        made.norm(NUMERATORS[1]) == made.norm(NUMERATORS[1], rough=True) < Pieces(SLOW).norm(NUMERATORS[1], rough=True)
    )


@pytest.mark.parametrize("name", ["one pole", "a pair", "slow and fast"])
def test_the_difference_of_two_responses_from_pieces_side_by_side(name: str) -> None:
    """The other one has a pole that is a little off, and a numerator that begins later."""
    other = DENOMINATORS[name] + fmpq_poly([0, fmpq(1, 2**20)])
    ideal = Pieces(DENOMINATORS[name])
    made = Pieces(other, ideal)
    for numerator in NUMERATORS[:3]:
        found = made.distance(numerator * fmpq_poly([0, 0, 1]), ideal, numerator)
        assert found is not None
        first = response(numerator * fmpq_poly([0, 0, 1]), inverse(other))
        second = response(numerator, inverse(DENOMINATORS[name]))
        exact = sum(abs(a - b) for a, b in zip_longest(first.samples, second.samples, fillvalue=0))
        exact, error = Fraction(exact, 1 << BITS), first.error + second.error
        assert exact - error <= found < exact + error + max(exact, 1) / 2**80


def test_one_response_may_last_for_more_pieces_than_the_other() -> None:
    wanted = DENOMINATORS["slow and fast"]
    ideal = Pieces(wanted)
    found = Pieces(wanted + fmpq_poly([0, fmpq(1, 8)]), ideal).distance(fmpq_poly([1]), ideal, fmpq_poly([1]))
    one, other = (response(fmpq_poly([1]), inverse(each)) for each in (wanted + fmpq_poly([0, fmpq(1, 8)]), wanted))
    exact = sum(abs(a - b) for a, b in zip_longest(one.samples, other.samples, fillvalue=0))
    assert found == pytest.approx(exact / 2**BITS)


def test_pieces_of_different_lengths_have_no_difference() -> None:
    fast, slow = Pieces(DENOMINATORS["one pole"]), Pieces(fmpq_poly([1, -1 + fmpq(1, 2**12)]))
    assert slow.distance(fmpq_poly([1]), fast, fmpq_poly([1])) is None


@pytest.mark.parametrize("denominator", [[1, 0, 1], [1, -1], [1, fmpq(-5, 4)]])
def test_responses_that_do_not_decay_are_refused(denominator: list[fmpq]) -> None:
    with pytest.raises(UndecidedError, match=r"^the responses of a denominator do not decay$"):
        Pieces(fmpq_poly(denominator))


@pytest.mark.parametrize("distance", [18, 24])
def test_a_response_too_long_is_refused(distance: int) -> None:
    with pytest.raises(UndecidedError, match=r"^a response does not die away within 16777216 samples$"):
        Pieces(fmpq_poly([1, -1 + fmpq(1, 2**distance)]))


def test_a_response_of_the_longest_length_is_summed(monkeypatch: pytest.MonkeyPatch) -> None:
    """In 8 pieces of 2048 samples, which are as many as there may be."""
    monkeypatch.setattr(piecewise, "_LONGEST", 1 << 14)
    pole = fmpq(round(2 ** (40 - 114 / ((1 << 14) - 30))), 2**40)
    exact = 1 / (1 - Fraction(int(pole.p), int(pole.q)))
    assert exact <= Pieces(fmpq_poly([1, -pole])).norm(fmpq_poly([1])) < exact + Fraction(1, 2**80)


def test_a_coefficient_that_is_no_binary_fraction_is_refused() -> None:
    with pytest.raises(UndecidedError, match=r"^a coefficient is no binary fraction$"):
        Pieces(fmpq_poly([1, fmpq(-1, 3)]))


@pytest.mark.sweep(2)
@pytest.mark.parametrize("name", ["one pole", "a pair", "the same pair three times", "slow and fast"])
def test_what_one_response_exceeds_the_rest_of_another(name: str) -> None:
    made, over = Pieces(DENOMINATORS[name]), inverse(DENOMINATORS[name])
    falling, rising = NUMERATORS[2], NUMERATORS[1]
    f = [abs(value) for value in response(falling, over).samples]
    signs = set()
    for share in (fmpq(1, 8), fmpq(1), fmpq(1000)):
        r = [abs(value) for value in response(rising * share, over).samples]
        whole = sum(r)
        rest = [whole - before for before in accumulate(r)]
        exact = Fraction(max(0, *(a - b for a, b in zip_longest(f, rest, fillvalue=0))), 1 << BITS)
        found, also = made.excess(falling, rising * share, Fraction(-1), Fraction(1))
        assert found == also
        assert exact - Fraction(1, 1 << 80) <= found <= exact + Fraction(max(f) + whole, 1 << BITS + 16)
        signs.add(found > Fraction(1, 1 << 60))
    assert signs == {False, True}
    one_sided = [value / 2**BITS for value in response(rising * 1000, over).samples]
    rests = []
    for sign in (1, -1):
        parts = [max(sign * value, 0.0) for value in one_sided]
        rests.append([sum(parts) - before for before in accumulate(parts)])
    whole = sum(map(abs, one_sided))
    for rest, limit in zip(rests, made.excess(falling, rising * 1000, Fraction(0), Fraction(1)), strict=True):
        most = max(0.0, *(a / 2**BITS - b for a, b in zip_longest(f, rest, fillvalue=0)))
        assert most - whole / 2**40 <= limit <= most + whole / 2**16


def test_a_response_that_has_ended_exceeds_nothing() -> None:
    """Its numbers are 0 from some piece on, and then have no magnitude that a doubt could be a share of."""
    made = Pieces(DENOMINATORS["slow and fast"])
    assert max(made.excess(SLOW, fmpq_poly([1000]), Fraction(-1), Fraction(1))) < Fraction(1, 1 << 80)


LONG = fmpq_poly([1, fmpq(-2045, 1024), fmpq(1023 * 1023, 1 << 20)])
"""Poles at an angle of about 0.04, which decay by a thousandth a sample."""


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("constant", "low", "summed_up"),
    [
        (fmpq(1000), -3, True),
        (fmpq(1, 1 << 20), -3, False),
        (fmpq(-1, 1 << 20), -3, False),
        (fmpq(1), Fraction(-1, 1 << 20), False),
    ],
)
def test_limits_with_a_constant_are_those_of_the_sums_up_to_every_sample(
    constant: fmpq, low: Fraction, summed_up: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A small one does not reach beyond what a large signal can still do; a large one overshoots."""
    over, value = driven_responses.Denominator(LONG), Fraction(int(constant.p), int(constant.q))
    driven = [
        (fmpq_poly([0, 1, 1]), Fraction(low), Fraction(5)),
        (fmpq_poly([1, -2, 1]), Fraction(-1, 1 << 21), Fraction(0)),
        (fmpq_poly([1]), value, value),
    ]
    exact = driven_responses._running_extremes(over, driven)
    calls = []
    monkeypatch.setattr(driven_responses, "_running_extremes", lambda *given: calls.append(given) or exact)
    found = driven_responses.extremes(over, driven)
    assert bool(calls) == summed_up
    assert found[0] <= exact[0] + Fraction(1, 1 << 80)
    assert exact[1] - Fraction(1, 1 << 80) <= found[1]
    assert all(abs(a - b) < Fraction(1, 1 << 50) for a, b in zip(found, exact, strict=True))
