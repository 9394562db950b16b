"""Wear as a state over days: the filter against least squares, what is told, what is refused."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from sosmith.instrument.wear.state_space import DayReading, DayState, Happening, WearModel, filtered
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError

NEVER = 1e-12
"""So rare that the filter is one of Kalman."""

PLAIN = WearModel(jumps=NEVER, rate_changes=NEVER, sensor_changes=1e-100, offs=NEVER, shared=0.05)


def days_of(read: Values, error: float) -> list[DayReading]:
    return [DayReading(time=float(k), clearance=(d,), uncertainty=(error,)) for k, d in enumerate(read.tolist())]


def worn(days: int, error: float, seed: int, *, at: int = 0, step: float = 0.0, times: float = 1.0) -> Values:
    """Read a wheel that wears by 0.05 mm a day; from the day `at` on with a step and another rate."""
    true = 3.0 + np.cumsum(np.where(np.arange(days) > at, 0.05 * times, 0.05)) + step * (np.arange(days) >= at)
    return np.asarray(true + np.random.default_rng(seed).normal(0, error, days))


def by_least_squares(days: list[DayReading], model: WearModel) -> tuple[Values, Values]:
    """Mean and covariance of the states of the last day, from all days at once."""
    wheels, count = len(days[0].clearance), len(days)
    size = 3 * wheels
    # unknowns: the first states, then the noise of level and rate between the days
    mean = np.concatenate([np.tile([0.0, model.rate, 0.0], wheels), np.zeros(2 * wheels * (count - 1))])
    first = np.tile(np.array([10.0, model.rate_spread, model.shared]) ** 2, wheels)
    prior = np.zeros((len(mean), len(mean)))
    prior[:size, :size] = np.diag(first)
    maps = [np.eye(size, len(mean))]
    for k in range(1, count):
        gap = days[k].time - days[k - 1].time
        now = maps[-1].copy()
        for w in range(wheels):
            at = size + 2 * (wheels * (k - 1) + w)
            now[3 * w] += gap * maps[-1][3 * w + 1]
            now[3 * w, at] += 1.0
            now[3 * w + 1, at + 1] += 1.0
            walk, turn = model.level_walk**2, model.rate_walk**2
            prior[at : at + 2, at : at + 2] = [
                [gap * walk + gap**3 / 3 * turn, gap**2 / 2 * turn],
                [gap**2 / 2 * turn, gap * turn],
            ]
        maps.append(now)
    rows, values, noise = [], [], []
    for day, states in zip(days, maps, strict=True):
        for w in range(wheels):
            rows.append(states[3 * w] + states[3 * w + 2])
            values.append(day.clearance[w])
            noise.append(day.uncertainty[w] ** 2)
        if day.total is not None:
            rows.append(states[0] + states[3])
            values.append(day.total)
            noise.append(day.total_uncertainty**2)
    h = np.array(rows)
    gain = prior @ h.T @ np.linalg.inv(h @ prior @ h.T + np.diag(noise))
    found = mean + gain @ (np.array(values) - h @ mean)
    covariance = prior - gain @ h @ prior
    return maps[-1] @ found, maps[-1] @ covariance @ maps[-1].T


@pytest.mark.parametrize("total", [None, 7.0])
def test_without_happenings_the_filter_is_least_squares_over_all_days(total: float | None) -> None:
    generator = np.random.default_rng(3)
    days = [
        DayReading(
            time=float(time),
            clearance=(3.0 + 0.05 * time + float(generator.normal(0, 0.1)), 2.5 + float(generator.normal(0, 0.1))),
            uncertainty=(0.1, 0.2),
            total=None if total is None else total + 0.05 * time,
        )
        for time in (0, 1, 2, 4, 5, 9)
    ]
    mean, covariance = by_least_squares(days, PLAIN)
    state = filtered(days, PLAIN)[-1]
    for wheel in range(2):
        level, spread = state.level(wheel)
        assert level == pytest.approx(mean[3 * wheel], abs=1e-6)
        assert spread == pytest.approx(math.sqrt(covariance[3 * wheel, 3 * wheel]), rel=1e-5)
        rate, spread = state.rate(wheel)
        assert rate == pytest.approx(mean[3 * wheel + 1], abs=1e-6)
        assert spread == pytest.approx(math.sqrt(covariance[3 * wheel + 1, 3 * wheel + 1]), rel=1e-5)


@pytest.mark.slow
def test_what_all_readings_share_is_not_averaged_away() -> None:
    read = worn(100, 0.05, 1)
    for shared in (0.0, 0.1):
        _, spread = filtered(days_of(read, 0.05), WearModel(shared=shared))[-1].level()
        assert spread == pytest.approx(math.hypot(shared, 0.016), rel=0.2)


@pytest.mark.parametrize(
    ("what", "step", "times"), [(Happening.JUMP, -0.4, 1.0), (Happening.JUMP, 0.3, 1.0), (Happening.RATE, 0.0, 2.0)]
)
def test_what_happens_is_told_with_its_size(what: Happening, step: float, times: float) -> None:
    states = filtered(days_of(worn(41, 0.04, 2, at=30, step=step, times=times), 0.04), WearModel())
    (told,) = [one for state in states for one in state.told]
    assert told.event.what is what
    assert abs(told.event.time - 30) <= 4
    assert 30 <= told.at <= 40
    expected = step if what is Happening.JUMP else 0.05 * times
    assert told.size == pytest.approx(expected, abs=0.1 if what is Happening.JUMP else 0.04)


def test_the_sum_tells_a_replaced_sensor_from_a_jump_of_the_wheel() -> None:
    """At errors of 0.13 mm a day; the sum knows nothing of what a sensor reads, and all of what happens to a wheel."""
    generator = np.random.default_rng(5)
    true = np.add.outer([3.0, 3.4], 0.05 * np.arange(45.0))
    read = true + generator.normal(0, 0.13, true.shape)
    for name, of_sensor, of_wheel in ((Happening.SENSOR, 0.4, 0.0), (Happening.JUMP, 0.0, 0.4)):
        days = [
            DayReading(
                time=float(k),
                clearance=(float(read[0, k] + (of_sensor + of_wheel) * (k >= 35)), float(read[1, k])),
                uncertainty=(0.13, 0.13),
                total=float(true[:, k].sum() + of_wheel * (k >= 35) + generator.normal(0, 0.03)),
            )
            for k in range(45)
        ]
        (told,) = [one for state in filtered(days, WearModel()) for one in state.told]
        assert (told.event.wheel, told.event.what) == (0, name)
        assert told.size == pytest.approx(0.4, abs=0.15)


def test_nothing_is_told_where_nothing_happens_nor_where_one_reading_is_off() -> None:
    read = worn(40, 0.05, 3)
    assert not [one for state in filtered(days_of(read, 0.05), WearModel()) for one in state.told]
    read[20] += 0.4
    states = filtered(days_of(read, 0.05), WearModel())
    assert not [one for state in states[22:] for one in state.told]
    assert states[-1].level()[0] == pytest.approx(5.0, abs=0.06)
    assert states[22].level()[1] < 0.03  # two jumps, there and back, would leave the level to two readings


def test_a_wheel_without_a_reading_is_followed_by_the_sum() -> None:
    days = [
        DayReading(
            time=float(k),
            clearance=(3.0 + 0.05 * k, 4.0 if k < 5 else math.nan),
            uncertainty=(0.05, 0.05),
            total=7.0 + 0.05 * k,
            total_uncertainty=0.01,
        )
        for k in range(20)
    ]
    level, spread = filtered(days, WearModel())[-1].level(1)
    assert level == pytest.approx(4.0, abs=0.06)
    assert spread < 0.08


def test_risk_interval_and_life_belong_together() -> None:
    state = filtered(days_of(3.0 + 0.05 * np.arange(60.0), 0.1), WearModel())[-1]
    low, high = state.interval(0.9)
    assert state.beyond(high) == pytest.approx(0.05, abs=1e-9)
    assert state.beyond(low) == pytest.approx(0.95, abs=1e-9)
    half = state.life(7.0)
    assert half is not None
    assert half == pytest.approx((7.0 - state.level()[0]) / state.rate()[0], rel=0.02)
    assert state.beyond(7.0, after=half) == pytest.approx(0.5, abs=1e-9)
    assert state.life(5.0) == 0.0


def test_a_wheel_that_does_not_wear_has_no_end_in_sight() -> None:
    model = WearModel(rate=0.0, rate_spread=1e-9, rate_walk=0.0, level_walk=0.0, rate_change=0.0)
    assert filtered(days_of(np.full(30, 3.0), 0.05), model)[-1].life(9.0) is None


@pytest.mark.parametrize(
    ("days", "sentence"),
    [
        ([], "the record must have one or two wheels on every day, not 0"),
        (
            [DayReading(time=0.0, clearance=(1.0,) * 3, uncertainty=(0.1,) * 3)],
            "the record must have one or two wheels on every day, not 3",
        ),
        (
            [DayReading(time=t, clearance=(1.0,), uncertainty=(0.1,)) for t in (1.0, 0.0)],
            "the record must be in chronological order, not go back in time",
        ),
    ],
)
def test_impossible_days_are_refused(days: list[DayReading], sentence: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$"):
        filtered(days, WearModel())


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"shared": -1.0}, "shared must be 0 or more, not -1"),
        (
            {"jumps": 0.5},
            "jumps, rate_changes, sensor_changes and offs must be above 0 and below 0.5 a day together, not 0.512",
        ),
        (
            {"offs": 0.0},
            "jumps, rate_changes, sensor_changes and offs must be above 0 and below 0.5 a day together, not 0.017",
        ),
    ],
)
def test_an_impossible_model_is_refused(changes: dict[str, float], sentence: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$"):
        WearModel(**changes)


def test_states_know_their_day() -> None:
    states = filtered(days_of(np.full(3, 2.0), 0.1), WearModel())
    assert [state.time for state in states] == [0.0, 1.0, 2.0]
    assert all(isinstance(state, DayState) for state in states)
