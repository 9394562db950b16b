"""Analog prototypes in balls, against scipy, closed forms, and the equations that define the families."""

from fractions import Fraction

import numpy as np
import pytest
from flint import acb, arb, ctx
from scipy import signal

from sosmith.verify.specified.analog_prototypes import (
    AnalogPrototype,
    analog_prototype,
    ripple_squared,
    selectivity,
)

PASS, STOP = Fraction(1, 2), Fraction(40)
SCIPYS = {
    "butterworth": signal.buttap,
    "chebyshev1": lambda order: signal.cheb1ap(order, float(PASS)),
    "chebyshev2": lambda order: signal.cheb2ap(order, float(STOP)),
    "elliptic": lambda order: signal.ellipap(order, float(PASS), float(STOP)),
    "bessel": lambda order: signal.besselap(order, norm="mag"),
}
ORDERS = range(1, 21)


def response(made: AnalogPrototype, frequency: arb | int) -> acb:
    s = acb(0, frequency)
    value = acb(made.gain)
    for zero in made.zeros:
        value *= 1 - s / zero
    for pole in made.poles:
        value /= 1 - s / pole
    return value


def power(made: AnalogPrototype, frequency: arb | int) -> arb:
    return abs(response(made, frequency)) ** 2


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("family", SCIPYS)
def test_the_response_is_scipys(family: str, order: int) -> None:
    zeros, poles, gain = SCIPYS[family](order)
    frequencies = np.logspace(-2, 1, 40)
    with ctx.workprec(300):
        made = analog_prototype(family, order, PASS, STOP)
        ours = [complex(response(made, arb(w))) for w in frequencies]
    theirs = [gain * np.prod(1j * w - zeros) / np.prod(1j * w - poles) for w in frequencies]
    assert ours == pytest.approx(theirs, rel=1e-10)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("family", SCIPYS)
def test_the_balls_narrow_with_the_precision(family: str, order: int) -> None:
    made = {}
    for bits in (300, 900):
        with ctx.workprec(bits):
            made[bits] = analog_prototype(family, order, PASS, STOP)
    assert all(pole.real < 0 for pole in made[300].poles)
    assert len(made[300].poles) == order
    for coarse, fine in zip(
        [*made[300].zeros, *made[300].poles, acb(made[300].gain)],
        [*made[900].zeros, *made[900].poles, acb(made[900].gain)],
        strict=True,
    ):
        assert coarse.overlaps(fine)
        assert coarse.rel_accuracy_bits() > 200
        assert fine.rel_accuracy_bits() > 800


@pytest.mark.parametrize("order", ORDERS)
def test_the_edges_are_where_the_families_have_them(order: int) -> None:
    with ctx.workprec(400):
        made = {family: analog_prototype(family, order, PASS, STOP) for family in SCIPYS}
        edge = selectivity(order, (ripple_squared(PASS) / ripple_squared(STOP)).sqrt()).k
        expected = {
            "butterworth": arb(1) / 2,
            "chebyshev1": 1 / (1 + ripple_squared(PASS)),
            "chebyshev2": 1 / (1 + ripple_squared(STOP)),
            "elliptic": 1 / (1 + ripple_squared(PASS)),
            "bessel": arb(1) / 2,
        }
        for family, value in expected.items():
            found = power(made[family], 1)
            assert found.overlaps(value)
            assert found.rel_accuracy_bits() > 200
        assert power(made["elliptic"], 1 / edge).overlaps(1 / (1 + ripple_squared(STOP)))


@pytest.mark.parametrize("order", range(1, 11))
def test_the_magnitude_is_that_of_the_defining_polynomial(order: int) -> None:
    """Butterworth and Chebyshev: ``1 / (1 + e**2 F(w)**2)`` with F a power or a Chebyshev polynomial."""
    with ctx.workprec(300):
        for w in (arb(0), arb(0.3), arb(0.9), arb(1.5), arb(8)):
            square = power(analog_prototype("butterworth", order), w)
            assert square.overlaps(1 / (1 + w ** (2 * order)))
            square = power(analog_prototype("chebyshev1", order, PASS), w)
            assert square.overlaps(1 / (1 + ripple_squared(PASS) * w.chebyshev_t(order) ** 2))
            if w > 0:
                square = power(analog_prototype("chebyshev2", order, stopband_loss=STOP), w)
                ripple = (1 / w).chebyshev_t(order) ** 2 / ripple_squared(STOP)
                assert square.overlaps(ripple / (1 + ripple))


def test_closed_forms_of_low_orders() -> None:
    with ctx.workprec(200):
        root = arb(0.5).sqrt()
        (pole,) = analog_prototype("butterworth", 1).poles
        assert pole.overlaps(acb(-1))
        above, below = analog_prototype("butterworth", 2).poles
        assert above.overlaps(acb(-root, root))
        assert below.overlaps(acb(-root, -root))
        # s**2 + 2 a sin(45 degrees) s + (a**2 + b**2) / 2 with the half axes a, b of the ellipse; here e = 1.
        loss = Fraction(3)
        e = ripple_squared(loss).sqrt()
        first, second = analog_prototype("chebyshev1", 2, loss).poles
        assert (first * second).real.overlaps((1 + e**2).sqrt() / (2 * e))
        half = (((1 + e**2).sqrt() / e - 1) / 2).sqrt()
        assert (first + second).real.overlaps(-2 * half * root)
        # s**2 + 3 s + 3, whose power has doubled where w**4 + 3 w**2 = 9
        first, second = analog_prototype("bessel", 2).poles
        edge = ((arb(45).sqrt() - 3) / 2).sqrt()
        assert ((first + second) * edge).real.overlaps(arb(-3))
        assert ((first * second) * edge**2).real.overlaps(arb(3))


@pytest.mark.parametrize(("low", "high"), [(Fraction(1, 10**6), Fraction(200)), (Fraction(199), Fraction(200))])
@pytest.mark.parametrize("order", [1, 2, 9, 20])
def test_elliptic_filters_of_extreme_losses(order: int, low: Fraction, high: Fraction) -> None:
    with ctx.workprec(1200):
        made = analog_prototype("elliptic", order, low, high)
        found = power(made, 1)
        assert found.overlaps(1 / (1 + ripple_squared(low)))
        assert found.rel_accuracy_bits() > 300
