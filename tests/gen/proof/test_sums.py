"""Sums over long responses from a few of their samples, against responses in rationals, sample by sample."""

import math
from fractions import Fraction
from itertools import accumulate, pairwise

import numpy as np
import pytest
from flint import arb, arb_mat, ctx, fmpq_poly

from sosmith.gen.proof import nodes
from sosmith.gen.proof.nodes import LONGEST, Nodes, polynomial
from sosmith.gen.proof.poles import Coefficients
from sosmith.gen.proof.response import IMPULSE, common
from sosmith.gen.proof.sums import Recursion, Weighted
from sosmith.model.errors import ShortfallError

ACCURACY = 40


def dyadic(*values: float) -> Coefficients:
    return tuple(map(Fraction, values))


SLOW = dyadic(1, -1.96875, 0.970703125)
DENOMINATORS = {
    "one pole": (dyadic(1, -0.9375),),
    "two real poles": (dyadic(1, -1.5, 0.5390625),),
    "the same pair three times": (SLOW, SLOW, SLOW),
    "every other sample is zero": (dyadic(1, 0, 0.96875),),
    "at half the sample rate": (dyadic(1, 1.9375, 0.94140625),),
    "slow and fast": (SLOW, dyadic(1, -0.0625)),
    "close to each other": (SLOW, dyadic(1, -1.96875, 0.970703125 + 2.0**-30)),
}
NUMERATORS = (dyadic(1), dyadic(1, -2, 1), dyadic(0, 0, 0.5, -3, 1, 0.25, -2), dyadic(2.0**-30, 2.0**-31))


def exact(numerator: Coefficients, denominators: tuple[Coefficients, ...], length: int) -> list[Fraction]:
    """Response in rationals, cut to 300 bits, which is more than its sums are compared to."""
    bits = 300
    under = math.prod(map(polynomial, denominators), start=fmpq_poly([1]))
    weights = [Fraction(int(c.p), int(c.q)) for c in under.coeffs()]
    made: list[int] = []
    for n in range(length):
        value = numerator[n] * (1 << bits) if n < len(numerator) else Fraction(0)
        made.append(math.floor(value - sum(w * made[n - k] for k, w in enumerate(weights) if 0 < k <= n)))
    return [Fraction(value, 1 << bits) for value in made]


@pytest.mark.parametrize("name", DENOMINATORS)
def test_the_nodes_determine_every_sample_and_the_next_nodes(name: str) -> None:
    made = Nodes(DENOMINATORS[name], ACCURACY, 100)
    step = made.powers[0]
    samples = exact(dyadic(1), DENOMINATORS[name], max(made.places) + 2 * made.block + 1)
    nodes = [samples[at] for at in made.places]
    near = 2 * sum(map(abs, nodes)) / 2**100 + Fraction(1, 2**200)
    for at in range(made.block):
        assert abs(sum(w * v for w, v in zip(made.weights[at], nodes, strict=True)) / 2**100 - samples[at]) < near
    for k, at in enumerate(made.places):
        after = sum(w * v for w, v in zip(step[k], nodes, strict=True)) / 2**100
        assert abs(after - samples[at + made.block]) < near
    assert made.residue < Fraction(1, 2**ACCURACY)
    assert abs(made.weights).max() < 2**103


@pytest.mark.parametrize("name", DENOMINATORS)
def test_there_are_no_more_blocks_than_needed(name: str) -> None:
    """The next smaller number of four binary digits does not let responses decay far enough."""
    made = Nodes(DENOMINATORS[name], ACCURACY, 400)
    unit = 1 << max(0, (made.blocks - 1).bit_length() - 4)
    target = arb(2) ** -(ACCURACY + 16)
    assert made.blocks % unit == 0
    with ctx.workprec(1000):
        step = arb_mat(made.powers[0].tolist()) * (arb(2) ** -400)
        powers = [(step**blocks).tolist() for blocks in (made.blocks, made.blocks - unit)]
        after, before = (max(sum(map(abs, row), arb(0)) for row in power) for power in powers)
    assert after < target < before


@pytest.mark.slow
def test_responses_that_take_turns_each_have_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of eight, neighbours of four places far from the beginning would miss half, however precise they are."""
    monkeypatch.setattr(nodes, "_MOST_BITS", 2000)
    pairs = [(1.5 - k / 16, -0.625 + k / 32) for k in range(6)]
    denominators = [dyadic(1, *[0] * 7, -a, *[0] * 7, -b) for a, b in pairs]
    made = Nodes(denominators, ACCURACY, 100)
    assert {place % 8: sum(at % 8 == place % 8 for at in made.places) for place in made.places} == dict.fromkeys(
        range(8), 12
    )
    samples = exact(dyadic(1), tuple(denominators), max(made.places) + made.block + 1)
    held = [samples[at] for at in made.places]
    for at in range(made.block):
        found = sum(w * v for w, v in zip(made.weights[at], held, strict=True)) / 2**100
        assert abs(found - samples[at]) < 2 * sum(map(abs, held)) / 2**100


def test_a_precision_that_never_suffices_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """With all pivots said to be 0, the precision rises by what is missing and half the guard bits, up to 65,536.

    The first one leaves room for the gain, for the error of the samples, and the guard bits.
    """
    tried: list[int] = []

    def flat(matrix: nodes.Integers, bits: int) -> tuple[list[int], int]:
        tried.append(bits)
        return list(range(matrix.shape[1])), 0

    monkeypatch.setattr(nodes, "_pivots", flat)
    with pytest.raises(ShortfallError, match=r"^the poles must not lie so close to each other that a response cannot"):
        Nodes((dyadic(1, -0.5),), ACCURACY, 20_000)
    gain = 2
    spread = 2 * (1 + 2) * gain
    assert tried[0] == 20_000 + gain.bit_length() + spread.bit_length() + 64
    missing = 20_000 + spread.bit_length() + 16
    assert [b - a for a, b in pairwise(tried)] == [missing + 32] * 3
    assert tried[-2] <= 1 << 16 < tried[-1]


def test_errors_that_grow_without_end_are_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """With nodes in the worst places, however far apart: sums would leave the range of doubles."""
    monkeypatch.setattr(nodes, "_MOST_GROWTH", 1)
    Nodes((dyadic(1, -0.5),), ACCURACY, 100)
    with pytest.raises(ShortfallError, match=f"^{nodes._TOO_CLOSE}$"):
        Nodes((SLOW, SLOW, SLOW), ACCURACY, 100)


def test_a_response_may_last_longer_for_sums_of_more_bits() -> None:
    """As long as it decays to the accuracy of the word-length search in time; blocks do not grow without end."""
    slow = (dyadic(1, -(1 - 2.0**-15)),)
    for accuracy in (ACCURACY, 128):
        made = Nodes(slow, accuracy, accuracy + 72)
        assert made.block == 2048
        assert (made.block * made.blocks > LONGEST) == (accuracy == 128)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("name", DENOMINATORS)
def test_totals_enclose_the_sum_of_magnitudes(name: str) -> None:
    made = Recursion([DENOMINATORS[name]], ACCURACY)
    for numerator, found in zip(NUMERATORS, made.totals([(polynomial(one),) for one in NUMERATORS]), strict=True):
        total = sum(map(abs, exact(numerator, DENOMINATORS[name], 4000)), Fraction(0))
        assert abs(found.magnitude - total) <= found.uncertainty < max(total, Fraction(1)) / 2**30


@pytest.mark.parametrize(
    ("name", "uncertainties"),
    [
        ("one pole", (1.843897939e-17, 2.469602135e-26)),
        ("the same pair three times", (5.347282073e-08, 7.488816524e-17)),
        ("every other sample is zero", (1.436070738e-16, 2.006581797e-25)),
    ],
)
def test_the_uncertainty_of_a_sum_is_what_it_was(name: str, uncertainties: tuple[float, float]) -> None:
    """Its parts lie far apart, and it is larger than needed: of a mistake in a small part, nothing else would tell.

    Whoever changes the bound gives the figures that it has now.
    """
    found = Recursion([DENOMINATORS[name]], ACCURACY).totals([(polynomial(NUMERATORS[k]),) for k in (0, -1)])
    assert [float(one.uncertainty) for one in found] == pytest.approx(list(uncertainties), rel=1e-9, abs=0)


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [40, 128])
@pytest.mark.parametrize("name", DENOMINATORS)
def test_the_largest_sum_up_to_any_sample(name: str, accuracy: int) -> None:
    """Three responses, one with a constant drive, which may cancel; weights with many bits, as of ranges in codes."""
    parts = [
        (dyadic(1, -2, 1), Fraction(1, 2), Fraction(1, 2)),
        (dyadic(0, 1), Fraction(3, 4) + Fraction(1, 1 << 50), Fraction(0)),
        (dyadic(0, 0, 0, 0.5), Fraction(-1), Fraction(1, 8)),
    ]
    responses = [exact(n, DENOMINATORS[name], 6000) for n, _, _ in parts]
    steps = [
        sum(c * h + r * abs(h) for h, (_, c, r) in zip(hs, parts, strict=True)) for hs in zip(*responses, strict=True)
    ]
    largest = max(accumulate(steps, initial=Fraction(0)))
    found = Recursion([DENOMINATORS[name]], accuracy).highest([Weighted((polynomial(n),), c, r) for n, c, r in parts])
    assert largest <= found < largest + max(largest, 1) * Fraction(1, 2 ** (accuracy - 16))


def test_the_last_sample_above_a_limit() -> None:
    made = Recursion([DENOMINATORS["slow and fast"]], ACCURACY)
    samples = exact(dyadic(1, -1), DENOMINATORS["slow and fast"], 4000)
    for limit in (Fraction(1, 100), Fraction(1, 10**6)):
        last = max(k for k, value in enumerate(samples) if 3 * abs(value) > limit)
        assert made.last_above([((polynomial(dyadic(1, -1)),), Fraction(3))], limit) == last
    assert made.last_above([((polynomial(dyadic(1, -1)),), Fraction(3))], Fraction(1000)) == 0
    assert made.last_above([((polynomial(dyadic(1, -1)),), Fraction(3))], Fraction(1, 2**200)) is None


@pytest.mark.parametrize("name", ["one pole", "close to each other"])
def test_without_responses_there_is_nothing(name: str) -> None:
    made = Recursion([DENOMINATORS[name]], ACCURACY)
    assert made.totals([]) == []
    assert made.last_above([], Fraction(1)) == 0


def test_a_response_without_poles_is_summed_as_it_is() -> None:
    made = Recursion([()], ACCURACY)
    (found,) = made.totals([(polynomial(dyadic(3, -0.5, 0, -2)),)])
    assert abs(found.magnitude - Fraction(11, 2)) <= found.uncertainty < Fraction(1, 2**60)
    largest = made.highest([Weighted((polynomial(dyadic(3, -0.5, 0, -2)),), Fraction(1), Fraction(0))])
    assert 3 <= largest < 3 + Fraction(1, 2**60)


@pytest.mark.parametrize("name", ["the same pair three times", "slow and fast"])
def test_samples_too_close_to_zero_for_doubles_get_their_sign_from_integers(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With weights of six bits and a bound to match, all signs near zero are looked at again: the sums are the same."""
    numerators = [(polynomial(one),) for one in NUMERATORS]
    before = Recursion([DENOMINATORS[name]], ACCURACY).totals(numerators)
    monkeypatch.setattr("sosmith.gen.proof.sums._ROUNDING", 2.0**-6)
    made = Recursion([DENOMINATORS[name]], ACCURACY)
    mantissas, exponents = np.frexp(made._weights)
    made._weights = np.ldexp(np.round(mantissas * 2.0**6), exponents - 6)
    assert made.totals(numerators) == before


def test_sums_of_responses_share_what_they_have_in_common() -> None:
    one = IMPULSE.all_pole(SLOW).taps(dyadic(1, 1))
    other = IMPULSE.all_pole(SLOW).all_pole(dyadic(1, -0.5))
    assert common([one, other]) == tuple(sorted([SLOW, dyadic(1, -0.5)]))
    difference = one.plus(other).minus(one)
    assert difference.denominators == common([one, other])
    assert difference.over(difference.denominators) == other.over(difference.denominators)
    assert one.at_zero_frequency == 2 / sum(SLOW)


def test_poles_beyond_the_limit_are_refused() -> None:
    with pytest.raises(ShortfallError, match=r"^every pole must lie inside the unit circle, and one does not$"):
        Nodes((dyadic(1, -1),), ACCURACY, 100)


@pytest.mark.parametrize("name", DENOMINATORS)
def test_a_sum_does_not_depend_on_what_was_summed_with_it(name: str) -> None:
    """Certificates are the same bytes whatever was designed before in the same process."""
    together = Recursion([DENOMINATORS[name]], ACCURACY).totals([(polynomial(one),) for one in NUMERATORS])
    alone = [Recursion([DENOMINATORS[name]], ACCURACY).totals([(polynomial(one),)])[0] for one in NUMERATORS]
    assert together == alone


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", DENOMINATORS)
def test_in_doubles_a_sum_is_enclosed_as_well(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """As it is for long responses, here for short ones."""
    monkeypatch.setattr("sosmith.gen.proof.sums._SHORT", 0)
    made = Recursion([DENOMINATORS[name]], ACCURACY)
    for numerator, found in zip(NUMERATORS, made.totals([(polynomial(one),) for one in NUMERATORS]), strict=True):
        total = sum(map(abs, exact(numerator, DENOMINATORS[name], 4000)), Fraction(0))
        assert abs(found.magnitude - total) <= found.uncertainty < max(total, Fraction(1)) / 2**20


@pytest.mark.sweep(1)
@pytest.mark.parametrize("pair", [("one pole", "close to each other"), ("close to each other", "slow and fast")])
@pytest.mark.parametrize("accuracy", [40, 128])
def test_responses_over_different_denominators_are_added(pair: tuple[str, str], accuracy: int) -> None:
    """Their nodes lie side by side: the shorter one is zero, with a bound, in the blocks of the longer one."""
    under = [DENOMINATORS[name] for name in pair]
    numerators = (dyadic(0, 0, 0.5, -3, 1), dyadic(-1, 2, -1))
    both = [exact(numerator, one, 12000) for numerator, one in zip(numerators, under, strict=True)]
    (found,) = Recursion(under, accuracy).totals([tuple(map(polynomial, numerators))])
    total = sum((abs(a + b) for a, b in zip(*both, strict=True)), Fraction(0))
    assert abs(found.magnitude - total) <= found.uncertainty < total / 2**30


@pytest.mark.slow
@pytest.mark.parametrize("name", ["one pole", "slow and fast", "every other sample is zero"])
def test_how_far_a_response_exceeds_what_is_still_to_come_of_another(name: str) -> None:
    under = DENOMINATORS[name]
    for factor in (Fraction(1, 8), Fraction(1), Fraction(64)):
        numerators = dyadic(1, -0.5, 0.25), dyadic(0, float(factor), float(-factor) / 4)
        falling, rising = (exact(numerator, under, 4000) for numerator in numerators)
        for low, high in ((Fraction(-1), Fraction(1)), (Fraction(0), Fraction(2)), (Fraction(-3), Fraction(1))):
            most = Fraction(0)
            for ends in ((low, high), (-high, -low)):
                steps = [max(ends[0] * r, ends[1] * r) for r in rising]
                behind = list(accumulate(steps[::-1], initial=Fraction(0)))[-2::-1]
                most = max(most, *(abs(f) - rest for f, rest in zip(falling, behind, strict=True)))
            taken = (polynomial(numerators[0]),), (polynomial(numerators[1]),)
            found = Recursion([under], ACCURACY).excess(*taken, low, high)
            assert most <= found <= most + max(map(abs, rising)) * 4000 / 2**20
