"""Steps of one multiplier: pairs of equal taps, taps alone, and the grid of their coefficients."""

from __future__ import annotations

from fractions import Fraction

import pytest

from sosmith.hdl.plan.tap_steps import TapStep, TapSteps
from sosmith.model.dataflow.graph import Range
from sosmith.model.sections.fir import FirSection, Form, TapProduct

X = Range(0, -128, 127)


def section(*products: TapProduct, form: Form = Form.SYMMETRIC) -> FirSection:
    return FirSection(name="s", products=products, form=form, x=X)


def taps_of(plan: TapSteps) -> dict[int, Fraction]:
    """Return the tap at each delay that the steps add up to."""
    taps: dict[int, Fraction] = {}
    for step in plan.steps:
        value = Fraction(step.coefficient, 2**plan.frac)
        taps[step.first] = taps.get(step.first, Fraction(0)) + value
        if step.second is not None:
            taps[step.second] = taps.get(step.second, Fraction(0)) + step.sign * value
    return taps


def test_pairs_share_a_step_and_the_middle_counts_twice() -> None:
    plan = TapSteps(section(TapProduct("b0", 3, 4, ((0, 1), (4, -1))), TapProduct("b2", 1, 1, ((2, 1),))))
    assert plan.steps == (TapStep(3, 0, 4, -1), TapStep(4, 2, 2))
    assert taps_of(plan) == {0: Fraction(3, 16), 4: Fraction(-3, 16), 2: Fraction(1, 2)}
    assert (plan.words, plan.factor_bits) == (8, 4)


def test_a_coefficient_that_is_odd_stays_alone() -> None:
    plan = TapSteps(section(TapProduct("b0", 3, 4, ((0, 1), (4, 1))), TapProduct("b2", 5, 4, ((2, -1),))))
    assert plan.steps == (TapStep(3, 0, 4), TapStep(-5, 2))


def test_three_taps_of_a_magnitude_take_two_steps() -> None:
    plan = TapSteps(section(TapProduct("b0", 3, 4, ((0, 1), (1, -1), (3, -1)))))
    assert len(plan.steps) == 2
    assert taps_of(plan) == {0: Fraction(3, 16), 1: Fraction(-3, 16), 3: Fraction(-3, 16)}


def test_a_direct_form_has_a_step_for_each_tap() -> None:
    plan = TapSteps(section(TapProduct("b0", 3, 4, ((0, 1), (4, 1))), form=Form.DIRECT))
    assert plan.steps == (TapStep(3, 0), TapStep(3, 4))
    assert not plan.pairs


def test_a_form_that_keeps_sums_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^form must be one that keeps samples, not transposed$"):
        TapSteps(section(TapProduct("b0", 3, 4, ((1, 1),)), form=Form.TRANSPOSED))


def test_one_tap_keeps_its_sample_in_any_form() -> None:
    plan = TapSteps(section(TapProduct("b0", 3, 4, ((0, 1),)), form=Form.TRANSPOSED))
    assert plan.steps == (TapStep(3, 0),)
    assert plan.words == 2
