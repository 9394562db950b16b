"""Samples far from the beginning of a response, against the response in rationals."""

import math
import random
from fractions import Fraction

import pytest
from flint import arb, arb_mat, ctx, fmpq, fmpq_poly

from sosmith.gen.proof import nodes
from sosmith.gen.proof.decimation import decimated
from sosmith.gen.proof.nodes import Nodes, polynomial
from sosmith.gen.proof.poles import Coefficients

ACCURACY = 40
COEFFICIENT_BITS = 20


def rounded(*values: float) -> Coefficients:
    return tuple(Fraction(round(math.ldexp(value, COEFFICIENT_BITS)), 1 << COEFFICIENT_BITS) for value in values)


def section(radius: float, angle: float) -> Coefficients:
    return rounded(1, -2 * radius * math.cos(angle), radius * radius)


def factors(degree: int, seed: int) -> tuple[Coefficients, ...]:
    """Poles near 1: pairs close to each other, real and complex, and a real one if the degree is odd."""
    rng = random.Random(seed)
    found = [rounded(1, rng.uniform(-0.98, -0.9))] * (degree % 2)
    angle = rng.uniform(0.02, 0.1)
    for _ in range(degree // 2):
        if rng.random() < 0.25:
            near, far = (rng.uniform(0.9, 0.98) for _ in range(2))
            found.append(rounded(1, -near - far, near * far))
        else:
            found.append(section(rng.uniform(0.96, 0.98), angle + rng.uniform(0, 2.0**-8)))
    return tuple(found)


def product(denominators: tuple[Coefficients, ...]) -> fmpq_poly:
    return math.prod(map(polynomial, denominators), start=fmpq_poly([1]))


def exact(denominator: fmpq_poly, length: int) -> list[int]:
    """Response of 1/D; sample n in units of ``2**-(n bits)``, where every coefficient is a multiple of ``2**-bits``."""
    bits = int(denominator.denom()).bit_length() - 1
    weights = [int(c * fmpq(1 << bits * k)) for k, c in enumerate(denominator.coeffs())][1:]
    made = [1]
    while len(made) < length:
        made.append(-sum(w * v for w, v in zip(weights, reversed(made), strict=False)))
    return made


def response(denominator: fmpq_poly, length: int) -> list[Fraction]:
    bits = int(denominator.denom()).bit_length() - 1
    return [Fraction(value, 1 << bits * n) for n, value in enumerate(exact(denominator, length))]


def enclosed(ball: arb, value: Fraction) -> bool:
    return bool(ball.contains(arb(fmpq(value.numerator, value.denominator))))


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 8, 16])
def test_balls_enclose_the_samples_at_even_distances(degree: int) -> None:
    rng = random.Random(degree)
    denominator = product(factors(degree, degree))
    length, width = 256, degree + 3
    samples = response(denominator, length)
    for doublings in (0, 1, 3, 5):
        count = length >> doublings
        with ctx.workprec(2000):
            rows = decimated(denominator, doublings, count, width)
        with ctx.workprec(20_000):
            for n, i in [
                (0, 0),
                (0, 1),
                (count - 1, 0),
                *((rng.randrange(count), rng.randrange(width)) for _ in "12345678"),
            ]:
                at = (n << doublings) - i
                assert enclosed(rows[n][i], samples[at] if at >= 0 else Fraction(0))
                assert not rows[n][i].rad() > arb(2) ** -1000


@pytest.mark.parametrize("seed", [1, 2])
def test_samples_far_away_are_those_of_the_recursion(seed: int) -> None:
    """At up to half a million, against powers of the companion matrix."""
    rng = random.Random(seed)
    denominator = product((section(1 - 2.0**-19, 0.001), section(1 - 2.0**-18, 0.001 + 2.0**-12), rounded(1, -0.9999)))
    doublings, count, width = 13, 64, 8
    with ctx.workprec(600):
        rows = decimated(denominator, doublings, count, width)
    with ctx.workprec(4000):
        entries = [-denominator[k + 1] if j == 0 else fmpq(int(j == k + 1)) for k in range(5) for j in range(5)]
        companion = arb_mat(5, 5, list(map(arb, entries)))
        for n, i in [(rng.randrange(1, count), rng.randrange(width)) for _ in range(4)]:
            value = (companion ** ((n << doublings) - i))[0, 0]
            assert rows[n][i].contains(value)
            assert rows[n][i].rad() < arb(2) ** -350


@pytest.mark.parametrize(
    "denominators", [(section(0.998, 0.005),), *(factors(degree, degree) for degree in (4, 8, 11))], ids=len
)
def test_samples_around_a_node_far_away_are_within_the_bound(denominators: tuple[Coefficients, ...]) -> None:
    made = Nodes(denominators, ACCURACY, ACCURACY + 72)
    more = made.block
    denominator = product(denominators)
    bits = int(denominator.denom()).bit_length() - 1
    samples = exact(denominator, max(made.places) + more + 1)
    assert max(made.places) > 64
    for place in made.places:
        found = made.samples_at(place, more)
        assert len(found) == made.degree + more
        for at, value in enumerate(found, start=place - made.degree + 1):
            if at < 0:
                assert value == 0
            else:
                assert abs((value << bits * at) - (samples[at] << made.fine)) <= made.spread << bits * at


def test_balls_too_wide_are_computed_again_at_a_higher_precision(monkeypatch: pytest.MonkeyPatch) -> None:
    denominators = factors(4, 4)
    plain = Nodes(denominators, ACCURACY, ACCURACY + 72)
    precisions: list[int] = []

    def wide(denominator: fmpq_poly, doublings: int, count: int, width: int) -> list[list[arb]]:
        precisions.append(ctx.prec)
        rows = decimated(denominator, doublings, count, width)
        blur = arb(0, arb(2) ** -plain.fine) if len(precisions) < 3 else arb(0)
        return [[value + blur for value in row] for row in rows]

    monkeypatch.setattr(nodes, "decimated", wide)
    again = Nodes(denominators, ACCURACY, ACCURACY + 72)
    first, second, third = (precision - plain.fine for precision in precisions)
    assert (second, third) == (2 * first, 4 * first)
    assert again.places == plain.places
    assert (again.weights == plain.weights).all()
