"""A day from its morning alone is the day from all measurements."""

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import RANGES, TRUE, TYPE, measured

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.mixed_effects.following_day import Following


def morning(day: int, off: float) -> Measurements:
    """Three targets that are known to 0.02 mm, on a day that errs by `off`."""
    V = np.array([1.5, 4.0, 8.0])
    T = np.full(3, 40.0)
    known = np.zeros((3, 3))
    known[0] = 0.02
    return Measurements(TRUE(V, T) + off, V, T, "t.csv", (day,) * 3, known)


@pytest.mark.slow
def test_a_morning_gives_what_a_fit_of_everything_gives() -> None:
    before = measured(10, 20, systematic=0.1)
    last = max(before.days)
    so_far = Following(bayesian_fit(before, TYPE, last + 1, RANGES).posterior, last + 1)
    targets = morning(last + 2, 0.2)
    so_far = so_far.on(targets, np.ones(3), last + 2)
    d, V, T = (
        np.concatenate([getattr(one, name) for one in (before, targets)])
        for name in ("clearance", "voltage", "temperature")
    )
    assert targets.uncertainty is not None
    known = np.concatenate((np.zeros((3, len(before))), targets.uncertainty), axis=1)
    both = Measurements(d, V, T, "all.csv", before.days + targets.days, known)
    every = bayesian_fit(both, TYPE, last + 2, RANGES).posterior
    V, T = np.linspace(1.0, 9.0, 9), np.full(9, 40.0)
    assert so_far.posterior.curve(V, T) == pytest.approx(every.curve(V, T), abs=0.002)
    here, there = (one.half_width(V, T, one.curve(V, T), 0.95) for one in (so_far.posterior, every))
    assert here == pytest.approx(there, rel=0.1)
    assert so_far.day == last + 2


@pytest.mark.slow
def test_without_targets_the_whole_error_of_a_day_is_open() -> None:
    before = measured(4, 40, systematic=0.1)
    last = max(before.days)
    posterior = bayesian_fit(before, TYPE, last, RANGES).posterior
    later = Following(posterior, last).without(last + 10).posterior
    again = bayesian_fit(before, TYPE, last + 10, RANGES).posterior
    assert not later.same_day
    V, T = np.linspace(1.0, 9.0, 9), np.full(9, 40.0)
    assert later.curve(V, T) == pytest.approx(again.curve(V, T), abs=1e-9)
    assert later.half_width(V, T, later.curve(V, T), 0.95) == pytest.approx(
        again.half_width(V, T, again.curve(V, T), 0.95), rel=1e-9
    )
