"""The budget's arithmetic, held against examples of the GUM."""

import math

import numpy as np
import pytest

from sosmith.instrument.uncertainty.budget import Budget, Contribution, Kind, of_limits

ONE = np.ones(1)


def source(uncertainty: float, sensitivity: float = 1.0, freedom: float = math.inf, kind: Kind = "t") -> Contribution:
    return Contribution(
        source="s", kind=kind, uncertainty=uncertainty * ONE, unit="mm", sensitivity=sensitivity * ONE, freedom=freedom
    )


def test_the_end_gauge_of_the_gum() -> None:
    """JCGM 100:2008, H.1: u_c = 32 nm, 16 effective degrees of freedom, expanded by k = 2.92 at 99 %."""
    parts = ((25.0, 18.0), (9.7, 25.6), (2.9, 50.0), (16.6, 2.0))
    budget = Budget(tuple(source(value, freedom=freedom) for value, freedom in parts))
    assert budget.combined.item() == pytest.approx(31.7, abs=0.1)
    assert math.floor(budget.freedom.item()) == 16


def test_sensitivities_weigh_and_signs_do_not() -> None:
    budget = Budget((source(3.0, -2.0), source(4.0, 2.0)))
    assert budget.combined.item() == pytest.approx(10.0)
    assert budget.freedom.item() == math.inf
    assert budget.factor.item() == pytest.approx(1.959964, rel=1e-6)


def test_few_degrees_of_freedom_widen_the_interval() -> None:
    assert Budget((source(1.0, freedom=4.0),)).expanded.item() == pytest.approx(2.7764, rel=1e-4)
    mostly_known = Budget((source(1.0, freedom=4.0), source(10.0)))
    assert mostly_known.factor.item() < 1.97


def test_limits_are_a_rectangular_distribution() -> None:
    drawn = np.random.default_rng(1).uniform(-0.3, 0.3, 100_000)
    assert of_limits(0.3) == pytest.approx(drawn.std(), rel=0.01)
