"""A step of the sensor is told, or intervals hold with it and without."""

import math

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import FIRST, TRUE, fitted

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.mixed_effects import steps
from sosmith.instrument.calibration.uncertainty import of_posterior, reading_half_width

DAYS, EACH = 8, 20


def stepped(volts: float, *, on: int = DAYS - 1, days: int = DAYS, seed: int = 3) -> Measurements:
    """Days with an error of 0.1 mm, and a step of the voltage from a day on."""
    chance = np.random.default_rng(seed)
    day = np.repeat(np.arange(days), EACH)
    V, T = chance.uniform(1.5, 8.5, len(day)), chance.uniform(20.0, 95.0, len(day))
    error = 0.1 * math.sqrt(2) * np.sin(TRUE(V, T) * 0.8 + chance.uniform(0, 2 * math.pi, days)[day])
    d = np.maximum(TRUE(V, T) + error + chance.normal(0, 0.2, len(day)), 0.0)
    return Measurements(d, V + volts * (day >= on), T, "m.csv", tuple((FIRST + day).tolist()))


@pytest.mark.sweep(1)
@pytest.mark.parametrize("volts", [-1.0, 1.0])
def test_a_large_step_is_told_on_its_first_day(volts: float) -> None:
    step = fitted(stepped(volts)).step
    assert step is not None
    assert step.told
    assert step.day == FIRST + DAYS - 1
    assert step.size == pytest.approx(volts, abs=0.25)
    assert step.sentence == (
        f"the voltage stepped by about {step.size:+.2g} V on 2021-08-05: the measurements before belong to another "
        "curve, and intervals are wider by it"
    )


def test_a_smaller_step_is_told_after_some_days() -> None:
    step = fitted(stepped(0.4, on=DAYS - 4)).step
    assert step is not None
    assert step.told
    assert step.size == pytest.approx(0.4, abs=0.15)


@pytest.mark.slow
def test_where_a_step_is_only_possible_intervals_hold_in_either_case() -> None:
    made = fitted(stepped(0.25), FIRST + DAYS)
    step = made.step
    assert step is not None
    assert not step.told
    assert step.sentence.startswith(f"the voltage may have stepped by about {step.size:+.2g} V on 2021-08-05: ")
    V, T = np.linspace(2.0, 8.0, 20), np.full(20, 50.0)
    centre = made.fit.polynomial(V, T)
    each = [one.half_width(V, T, centre, 0.95) for one in (made.posterior, step.posterior)]
    assert np.array_equal(of_posterior(stepped(0.25), made).half_width(V, T), np.maximum(*each))
    assert made.doubted is step.posterior
    assert np.all(reading_half_width(made, V, T, 0.01) > np.maximum(*each))


@pytest.mark.slow
def test_where_a_step_is_possible_the_curve_is_the_mean_of_both() -> None:
    V, T = np.linspace(2.0, 8.0, 20), np.full(20, 50.0)
    for date in (None, FIRST + DAYS):
        made = fitted(stepped(0.2), date)
        step = made.step
        assert step is not None
        assert 0.5 < step.weight < 0.999
        assert step.weight == pytest.approx(math.exp(step.evidence) / (1 + math.exp(step.evidence)))
        plain, other = (one.curve(V, T) for one in (made.posterior, step.posterior))
        mean = (1 - step.weight) * plain + step.weight * other
        assert made.averaged.curve(V, T) == pytest.approx(mean, abs=0.02)
        if date is not None:  # else the polynomial has to follow the day's own curve
            assert made.fit.polynomial(V, T) == pytest.approx(mean, abs=1e-9)
        assert np.abs(other - plain).max() > 0.02


@pytest.mark.slow
def test_past_doubt_the_curve_and_intervals_are_those_with_the_step() -> None:
    made = fitted(stepped(-1.0), FIRST + DAYS)
    step = made.step
    assert step is not None
    assert step.told
    assert made.either == (step.posterior,)
    V, T = np.linspace(3.0, 7.0, 9), np.full(9, 50.0)
    centre = made.fit.polynomial(V, T)
    assert centre == pytest.approx(TRUE(V + 1.0, T), abs=0.35)
    assert np.array_equal(reading_half_width(made, V, T), step.posterior.half_width(V, T, centre, 0.95))


@pytest.mark.slow
def test_the_curve_after_a_step_is_that_of_the_days_since() -> None:
    """With a step of -1 V, readings of the same clearance are 1 V lower."""
    made = fitted(stepped(-1.0, on=DAYS - 3))
    assert made.step is not None
    V, T = np.linspace(3.0, 7.0, 9), np.full(9, 50.0)
    assert made.step.posterior.curve(V, T) == pytest.approx(TRUE(V + 1.0, T), abs=0.25)


@pytest.mark.slow
def test_no_step_is_told_where_there_is_none() -> None:
    found = [fitted(stepped(0.0, seed=seed)).step for seed in range(10, 20)]
    assert not any(step is not None and step.told for step in found)
    assert sum(step is not None for step in found) <= 4


def test_two_days_are_too_few() -> None:
    assert fitted(stepped(-1.0, on=1, days=2)).step is None


@pytest.mark.slow
def test_a_step_long_ago_is_left_to_the_charts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(steps, "RECENT", 3)
    step = fitted(stepped(-1.0, on=2)).step
    assert step is None or step.day != FIRST + 2
