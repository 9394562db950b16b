"""Wear: states as the hardware's flags have them, rates on noise with memory, remaining life, refusals."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from examples.wear_campaign.wear_intervals import wear_covered
from scipy import stats

from sosmith.gen.specification.wear_limits import WearSpec
from sosmith.instrument.wear.assessment import (
    ClearanceUncertainty,
    WearLimits,
    WearState,
    block_medians,
    judge,
    last_fall,
    rate_of,
)
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port

LIMITS = WearLimits(initial=1.5, limit=9, warning=7)


def noise(count: int, correlation: float, seed: int) -> Values:
    """Gaussian noise of unit variance in which neighbours correlate so."""
    drawn = np.random.default_rng(seed).normal(size=count)
    result = np.empty(count)
    result[0] = drawn[0]
    for k in range(1, count):
        result[k] = correlation * result[k - 1] + np.sqrt(1 - correlation**2) * drawn[k]
    return result


@pytest.mark.parametrize(
    ("lsb", "numbers"),
    [
        (Fraction(16, 2**16), ("1.5", "7", "9", None)),
        (Fraction(1, 1000), ("1.1", "2.2", "3.3", None)),
        (Fraction(1, 1000), ("0.1", "0.2", "0.7", "0.7")),
        (Fraction(10, 2**16), ("1.3", "4.7", "9.9", "10.5")),
    ],
)
def test_states_are_those_of_the_hardwares_codes(lsb: Fraction, numbers: tuple[str | None, ...]) -> None:
    port = Port(name="clearance", bits=16, signed=False, lsb=lsb, zero=Fraction(0), unit="mm")
    initial, warning, limit = (Fraction(text or "") for text in numbers[:3])
    sensor_range = None if numbers[3] is None else Fraction(numbers[3])
    ((low, high),) = WearSpec(initial=(initial,), warning=warning, limit=limit, sensor_range=sensor_range).codes(port)
    limits = WearLimits(
        initial=float(initial),
        warning=float(warning),
        limit=float(limit),
        sensor_range=None if sensor_range is None else float(sensor_range),
    )
    for code in (0, low - 2, low - 1, low, low + 1, high - 1, high, high + 1):
        state = limits.state(float(port.decode(np.array([code]))[0]))
        assert (state is not WearState.GOOD, state is WearState.CRITICAL) == (code >= low, code >= high), code


def test_the_sensors_range_is_critical_where_it_comes_first() -> None:
    short = WearLimits(initial=1.5, limit=11, warning=7, sensor_range=10.5)
    assert short.critical_clearance == 10.5
    assert short.state(10.5) is WearState.CRITICAL
    assert short.state(10.4) is WearState.WARNING
    assert WearLimits(initial=1.5, limit=9, sensor_range=12).critical_clearance == 10.5
    assert WearLimits(initial=1.5, limit=9).state(10.4) is WearState.GOOD


def test_a_straight_record_is_read_exactly() -> None:
    time = 100 + np.arange(0, 60, 0.25)
    report = judge(time, 1.5 + 0.1 * (time - 100), LIMITS)
    assert report.rate.rate == pytest.approx(0.1)
    assert (report.rate.blocks, report.rate.block) == (60, 1.0)
    assert report.last == pytest.approx(1.5 + 5.975)
    # the last block is the last day, counted back from the last reading
    assert report.last_block == 4
    assert report.clearance == pytest.approx(1.5 + 0.1 * (59.75 - 0.375))
    assert report.wear == pytest.approx(report.clearance - 1.5)
    assert report.life == pytest.approx(90 - 59.75)
    assert report.life_low == pytest.approx(report.life, rel=1e-6)
    assert report.state is WearState.GOOD
    assert (report.first_warning, report.first_critical) == (None, None)


def test_states_and_their_first_times() -> None:
    time = np.arange(0, 100, 0.5)
    report = judge(time, 1.5 + 0.1 * time, LIMITS)
    assert report.state is WearState.CRITICAL
    assert (report.first_warning, report.first_critical) == (70.0, 90.0)
    assert (report.warnings, report.criticals, report.last_block) == (2, 2, 2)
    assert (report.remaining, report.life, report.life_low, report.life_high) == (0, 0, 0, 0)


def test_wild_readings_do_not_move_the_rate() -> None:
    time = np.arange(0, 50, 0.1)
    clearance = 2 + 0.05 * time + 0.01 * noise(len(time), 0, 1)
    clean = judge(time, clearance, LIMITS).rate
    clearance[50:150] = 16.0  # a fifth of the record at the end of the range
    wild = judge(time, clearance, LIMITS).rate
    assert abs(wild.rate - 0.05) < 0.002
    assert abs(clean.rate - 0.05) < 0.0005
    assert abs(np.polyfit(time, clearance, 1)[0] - 0.05) > 0.05  # least squares would be far off


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("correlation", "blocks", "least"), [(0.0, 20, 0.93), (0.4, 40, 0.91), (0.7, 120, 0.9)])
def test_the_interval_holds_the_rate_as_often_as_it_says(correlation: float, blocks: int, least: float) -> None:
    time = np.arange(blocks, dtype=np.float64)
    held = 0
    for seed in range(300):
        found = rate_of(time, 0.06 * time + 0.05 * noise(blocks, correlation, seed), 1.0, 0.95)
        held += found.low <= 0.06 <= found.high
    assert held / 300 >= least


@pytest.mark.parametrize(("memory", "side"), [(0.0, 1), (0.0, -1), (0.6, 1), (0.6, -1)])
def test_each_end_of_the_interval_is_widened_by_itself(memory: float, side: int) -> None:
    """Sen's interval of skewed deviations is not symmetric, and does not become so by being widened."""
    time = np.arange(60.0)
    clearance = 0.06 * time + side * 0.05 * np.exp(noise(60, memory, 5))
    _, _, low, high = stats.theilslopes(clearance, time, alpha=0.9)
    found = rate_of(time, clearance, 1.0, 0.9)
    wider = np.sqrt((1 + found.correlation) / (1 - found.correlation)) if found.correlation > 0 else 1.0
    assert (wider > 1.3) == (memory > 0)
    assert found.rate - found.low == pytest.approx(wider * (found.rate - low), rel=1e-9)
    assert found.high - found.rate == pytest.approx(wider * (high - found.rate), rel=1e-9)
    assert abs((high - found.rate) / (found.rate - low) - 1) > 0.05


@pytest.mark.slow
def test_noise_with_memory_within_the_day_does_not_narrow_the_interval() -> None:
    time = np.arange(0, 40, 0.01)
    held = 0
    for seed in range(40):
        report = judge(time, 1.5 + 0.06 * time + 0.05 * noise(len(time), 0.95, seed), LIMITS)
        held += report.rate.low <= 0.06 <= report.rate.high
    assert held >= 35


def test_the_interval_of_the_life_holds_the_end() -> None:
    time = np.arange(0, 60, 0.1)
    held = 0
    for seed in range(40):
        report = judge(time, 1.5 + 0.1 * time + 0.1 * noise(len(time), 0.5, seed), LIMITS)
        assert report.life_low is not None
        assert report.life_high is not None
        held += report.life_low <= 90 - time[-1] <= report.life_high
    assert held >= 37


def test_without_wear_there_is_no_end() -> None:
    time = np.arange(0, 40, 0.1)
    report = judge(time, 3 + 0.1 * noise(len(time), 0, 1), LIMITS)
    assert report.rate.low < 0 < report.rate.high
    assert report.life_low is not None
    assert report.life_high is None


def test_a_window_takes_the_recent_rate() -> None:
    time = np.arange(0, 60, 0.25)
    clearance = 2 + 0.01 * time + 0.1 * np.maximum(time - 40, 0)
    assert judge(time, clearance, LIMITS, window=15).rate.rate == pytest.approx(0.11)
    assert judge(time, clearance, LIMITS).rate.rate < 0.08


def test_a_reading_at_the_start_of_the_window_belongs_to_it() -> None:
    """It lies 15 days before the last reading, and so is a sixteenth block by itself."""
    time = np.arange(0, 60, 0.25)
    for window, blocks in ((15.25, 16), (15.0, 16), (14.99, 15)):
        assert judge(time, 2 + 0.01 * time, LIMITS, window=window).rate.blocks == blocks


@pytest.mark.parametrize("scatter", [0.0, 0.05])
@pytest.mark.parametrize("turned", [(60,), (25, 80), (96,)])
def test_the_last_fall_is_where_the_wheel_was_turned(turned: tuple[int, ...], scatter: float) -> None:
    time = np.arange(100) + 0.5
    clearance = 4 + 0.02 * time + scatter * noise(100, 0.7, seed=3)
    for day in turned:
        clearance[time > day] -= 1.5
    clearance[[10, 70]] -= 3  # wild blocks are no falls
    clearance[[12, 90]] += 3
    report = judge(time, clearance, LIMITS)
    assert report.fall is not None
    assert report.fall.size == pytest.approx(1.5, abs=0.15)
    assert report.fall.window == pytest.approx(99.5 - turned[-1])
    if turned[-1] < 90:
        after = judge(time, clearance, LIMITS, window=report.fall.window)
        assert after.fall is None
        assert after.rate.rate == pytest.approx(0.02, abs=0.1 * scatter + 1e-9)


@pytest.mark.slow
def test_noise_with_memory_has_no_fall() -> None:
    time = np.arange(200.0)
    for seed in range(200):
        clearance = 0.01 * time + noise(200, 0.9, seed)
        assert last_fall(time, clearance, 0.0) is None
    assert last_fall(time, clearance - 6.0 * (time > 100), 0.0) is not None


def test_a_small_fall_may_be_the_season() -> None:
    time = np.arange(50.0)
    for size, found in ((0.4, False), (0.5, True)):
        report = judge(time, 4 + 0.001 * time - size * (time > 20), LIMITS)
        assert (report.fall is not None) == found


def test_blocks_of_short_records_and_gaps() -> None:
    times, medians, counts, block = block_medians(np.arange(101) / 100, np.arange(101.0), None)
    assert block == pytest.approx(1 / 40)
    assert (len(times), int(counts.sum())) == (41, 101)
    assert np.all(np.diff(medians) > 0)
    time = np.array([0.0, 0.1, 5.0, 9.0, 9.4, 9.5])
    times, medians, counts, _ = block_medians(time, np.array([1.0, 3.0, 4.0, 5.0, 16.0, 7.0]), 1.0)
    assert (times.tolist(), medians.tolist(), counts.tolist()) == ([0.05, 5.0, 9.4], [2.0, 4.0, 7.0], [2, 1, 3])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"initial": -1}, "initial must be a clearance of 0 mm or more, not -1 mm"),
        ({"limit": 0}, "limit must be a wear above 0 mm, not 0 mm"),
        ({"warning": 9}, "warning must be a wear above 0 mm and below the limit of 9 mm, not 9 mm"),
        ({"warning": float("nan")}, "warning must be a wear above 0 mm and below the limit of 9 mm, not nan mm"),
        ({"sensor_range": 8.5}, "sensor range must be above the clearance of the warning, 8.5 mm, not 8.5 mm"),
        (
            {"sensor_range": 1, "warning": None},
            "sensor range must be above the initial clearance, 1.5 mm, not 1 mm",
        ),
    ],
)
def test_limits_that_make_no_sense(given: dict[str, Any], message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        WearLimits(**({"initial": 1.5, "limit": 9, "warning": 7} | given))


@pytest.mark.parametrize(
    ("time", "given", "message"),
    [
        ([], {}, "the record must have a time for each clearance, not 0 for 0"),
        ([1.0] * 9, {}, "the record must span more than 0 days for a rate of wear, not 0 days"),
        ([2.0, 1.0], {}, "the record must be in chronological order, not go back in time"),
        ([0.0, float("inf")], {}, "the record must hold finite times and clearances, not NaN or infinity"),
        ([0.0, 4.0, 9.0], {}, "the record must have readings in at least 8 blocks of 1 days, not in 3"),
        ([0.0, 9.0], {"block": 0.0}, "block must be a time above 0 days, not 0 days"),
        (
            [0.0, 9.0],
            {"block": 1e-3},
            "block must be at least 0.0045 days for a record of 9 days, not 0.001 days",
        ),
        ([0.0, 9.0], {"window": -1.0}, "window must be a time above 0 days, not -1 days"),
        ([*map(float, range(9))], {"confidence": 1.0}, "confidence must be between 0 and 1, not 1"),
    ],
)
def test_records_that_make_no_sense(time: list[float], given: dict[str, float], message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        judge(np.array(time), np.full(len(time), 2.0), LIMITS, **given)


def test_what_the_clearances_are_worth_widens_depth_rate_and_life() -> None:
    time = np.arange(80) / 2
    clearance = 3.0 + 0.1 * time + 0.02 * noise(80, 0.0, 4)
    asked: list[tuple[float, float]] = []

    def worth(begin: float, now: float) -> ClearanceUncertainty:
        asked.append((begin, now))
        return ClearanceUncertainty(standard=0.2, freedom=10.0, rise=0.3)

    plain, known = judge(time, clearance, LIMITS), judge(time, clearance, LIMITS, uncertainty=worth)
    t = float(stats.t.ppf(0.975, 10))
    assert asked == [(pytest.approx(3.0, abs=0.1), pytest.approx(6.95, abs=0.1))]
    assert (known.wear_low, known.wear_high) == pytest.approx((known.wear - 0.2 * t, known.wear + 0.2 * t))
    assert known.rate.rate == plain.rate.rate
    assert known.rate.high - known.rate.rate == pytest.approx(
        np.hypot(plain.rate.high - plain.rate.rate, 0.3 * t / 39), rel=1e-3
    )
    assert plain.wear_high - plain.wear_low < 0.2
    assert known.life_low is not None
    assert plain.life_low is not None
    assert known.life_low < plain.life_low


@pytest.mark.slow
def test_intervals_with_an_uncertainty_hold_as_often_as_they_claim() -> None:
    inside = wear_covered()
    assert all(0.93 <= found["with"] <= 0.99 for found in inside.values())
    assert all(found["without"] < 0.9 for found in inside.values())
