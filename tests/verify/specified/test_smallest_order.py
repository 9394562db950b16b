"""Minimum orders, decided in balls: against scipy's formulas, and at their thresholds."""

import re
from fractions import Fraction

import numpy as np
import pytest
from flint import acb, arb, ctx
from scipy import signal

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.specified.analog_prototypes import AnalogPrototype, analog_prototype, discrimination
from sosmith.verify.specified.smallest_order import edge_from_passband, smallest_order

ESTIMATES = {
    "butterworth": signal.buttord,
    "chebyshev1": signal.cheb1ord,
    "chebyshev2": signal.cheb2ord,
    "elliptic": signal.ellipord,
}


def loss(made: AnalogPrototype, frequency: arb) -> arb:
    """In dB."""
    value = arb(made.gain)
    for zero in made.zeros:
        value *= abs(1 - acb(0, frequency) / zero)
    for pole in made.poles:
        value /= abs(1 - acb(0, frequency) / pole)
    return -20 * value.log() / arb(10).log()


@pytest.mark.parametrize("family", ESTIMATES)
def test_orders_and_edges_are_scipys(family: str) -> None:
    random = np.random.default_rng(7)
    seen = set()
    for _ in range(60):
        transition = 1 + 10 ** random.uniform(-1.5, 0.7)
        low, high = 10 ** random.uniform(-2, 0.5), random.uniform(4, 90)
        order, edge = ESTIMATES[family](1.0, transition, low, high, analog=True)
        with ctx.workprec(200):
            losses = Fraction(low), Fraction(high)
            found = smallest_order(family, arb(transition), *losses, 1000)
            assert found == order
            ours = edge_from_passband(family, order, *losses)
        assert float(ours) == pytest.approx(edge, rel=1e-9)
        seen.add(found)
    assert len(seen) > 8


@pytest.mark.parametrize("order", [1, 2, 5, 8])
@pytest.mark.parametrize("family", ESTIMATES)
def test_the_order_rises_where_the_filter_just_meets_the_losses(family: str, order: int) -> None:
    """The threshold is found on the prototype itself: where its loss is the stop band's."""
    low, high = Fraction(1, 2), Fraction(50)
    with ctx.workprec(200):
        made, edge = analog_prototype(family, order, low, high), edge_from_passband(family, order, low, high)
        ends = [arb(1), arb(10**6)]
        for _ in range(90):
            middle = ((ends[0] + ends[1]) / 2).mid()
            ends[loss(made, middle / edge) > 50] = middle
        above, below = ends[1] * (1 + arb(2) ** -40), ends[0] * (1 - arb(2) ** -40)
        assert smallest_order(family, above, low, high, 20) == order
        assert smallest_order(family, below, low, high, 20) == order + 1


def test_an_equality_is_not_decided() -> None:
    low, high = Fraction(1, 2), Fraction(50)
    sentence = "whether order 1 meets the losses could not be decided"
    with pytest.raises(UndecidedError, match=f"^{re.escape(sentence)}$"):
        smallest_order("butterworth", 1 / discrimination(low, high), low, high, 20)


def test_there_may_be_no_such_order() -> None:
    assert smallest_order("butterworth", arb(1.01), Fraction(1), Fraction(60), 20) is None
