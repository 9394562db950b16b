"""Sensor health: standard normal innovations without a fault, an alarm and its explanation with one."""

import datetime
from dataclasses import replace

import numpy as np
import pytest

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.health.charts import (
    CHARTS,
    DECISION,
    MOST_OF_A_DAY,
    STEP_LIMIT,
    WARNING_LIMIT,
    charts_of,
)
from sosmith.instrument.calibration.health.innovations import Innovations, course_of
from sosmith.instrument.calibration.health.monitoring import Health, health_of
from sosmith.instrument.calibration.sensor_type import SENSOR_TYPES
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError

TYPE = replace(SENSOR_TYPES["equation_5a"], systematic=0.05)
VOLTAGES = DEFAULT_RANGES[1]
START = datetime.date(2024, 3, 1).toordinal()
DAYS, A_DAY, FAULT = 26, 12, 16


def measured(seed: int = 3, deviations: tuple[float, ...] = (0.5, -0.4, 0.2, 0.3, -0.5)) -> Measurements:
    """Emulate a sensor that drifts as its type does, with a smooth error of each day, at any voltage."""
    generator = np.random.default_rng(seed)
    z = np.array(deviations)
    columns = []
    for day in range(DAYS):
        z = z + generator.normal(0, 1, 5) * np.sqrt(TYPE.drifts)
        V, T = generator.uniform(0.5, 9.5, A_DAY), generator.uniform(20, 95, A_DAY)
        d = TYPE.polynomial(tuple(z.tolist()))(V, T)
        s = 0.05 * np.sqrt(2) * np.cos(d / TYPE.correlation + generator.uniform(0, 6.28))
        columns.append([d + s + generator.normal(0, 0.1, A_DAY), V, T, np.full(A_DAY, START + day)])
    d, V, T, day = np.concatenate(columns, axis=1)
    return Measurements(d, V, T, "the depot", tuple(day.astype(int).tolist()))


def from_the_fault_on(healthy: Measurements, d: Values | float = 0.0, V: Values | float = 0.0) -> Measurements:
    """Add to clearance or voltage from day `FAULT` on."""
    late = np.array(healthy.days) >= START + FAULT
    return replace(healthy, clearance=healthy.clearance + late * d, voltage=healthy.voltage + late * V)


@pytest.fixture(scope="module")
def healthy() -> Measurements:
    return measured()


@pytest.fixture(scope="module")
def known(healthy: Measurements) -> Innovations:
    return course_of(healthy, TYPE, VOLTAGES).innovations()


def health(measurements: Measurements) -> Health:
    return health_of(measurements, TYPE, VOLTAGES)


def test_without_a_fault_the_innovations_are_standard_normal(known: Innovations) -> None:
    for values in (known.offset, known.gain, known.scatter):
        assert abs(values.mean()) < 3 / np.sqrt(DAYS)
        assert 0.5 < values.var() < 1.7
    together = np.corrcoef([known.offset, known.gain, known.scatter])
    assert np.abs(together - np.eye(3)).max() < 0.55


def test_nothing_of_a_day_is_known_before_it_comes(healthy: Measurements, known: Innovations) -> None:
    """The grid apart, a day's numbers do not depend on later days."""
    kept = np.array(healthy.days) < START + FAULT
    early = Measurements(
        healthy.clearance[kept],
        healthy.voltage[kept],
        healthy.temperature[kept],
        "the depot",
        tuple(np.array(healthy.days)[kept].tolist()),
    )
    found = course_of(early, TYPE, VOLTAGES).innovations()
    for name in ("offset", "gain", "scatter"):
        assert getattr(found, name) == pytest.approx(getattr(known, name)[:FAULT], abs=0.1)


def test_a_healthy_sensor_raises_no_alarm(healthy: Measurements) -> None:
    assert health(healthy).alarms == ()


def test_a_sensor_mounted_anew_is_told(healthy: Measurements) -> None:
    first = health(from_the_fault_on(healthy, d=0.6)).alarms[0]
    assert (first.chart.name, first.chart.alarm, first.chart.upwards) == ("offset step", FAULT, True)
    assert first.explanation.best.name == "mounted anew"
    assert first.sentence.startswith("2024-03-17: ")
    assert (
        "the offset stepped up; all clearances stepped alike: the sensor was moved, or mounted anew" in first.sentence
    )


def test_a_sensor_that_is_turned_is_told(healthy: Measurements) -> None:
    alarms = health(from_the_fault_on(healthy, V=0.3 + 0.08 * healthy.voltage)).alarms
    assert alarms[0].chart.alarm == FAULT
    assert alarms[0].explanation.best.name == "turned"


def test_another_sensor_is_told(healthy: Measurements) -> None:
    other = measured(seed=4, deviations=(-0.8, 0.9, -0.9, 1.0, 1.2))
    late = np.array(healthy.days) >= START + FAULT
    columns = (
        np.where(late, getattr(other, name), getattr(healthy, name)) for name in ("clearance", "voltage", "temperature")
    )
    alarms = health(Measurements(*columns, "the depot", healthy.days)).alarms
    assert alarms[0].chart.alarm == FAULT
    assert alarms[0].explanation.best.name == "another sensor"


def test_drift_faster_than_the_type_s_is_told(healthy: Measurements) -> None:
    late = np.maximum(np.array(healthy.days) - START - FAULT, 0)
    names = {alarm.chart.name for alarm in health(from_the_fault_on(healthy, d=0.04 * late)).alarms}
    assert "offset drift" in names


def test_more_scatter_is_told(healthy: Measurements) -> None:
    more = np.random.default_rng(5).normal(0, 0.25, len(healthy))
    alarms = [alarm for alarm in health(from_the_fault_on(healthy, d=more)).alarms if alarm.chart.name == "scatter"]
    assert [alarm.explanation.best.name for alarm in alarms] == ["scatter"]
    assert alarms[0].chart.alarm is not None
    assert FAULT <= alarms[0].chart.alarm < FAULT + 6


def test_outliers_and_readings_at_a_rail_raise_no_alarm(healthy: Measurements) -> None:
    day = np.flatnonzero(np.array(healthy.days) == START + FAULT)
    d, V = healthy.clearance.copy(), healthy.voltage.copy()
    d[day[0]] += 3.0
    d[day[1]], V[day[1]] = 0.0, 0.0
    found = health(replace(healthy, clearance=d, voltage=V))
    assert found.alarms == ()
    assert found.innovations.outliers[FAULT] == 1


def test_since_accepts_what_was_before(healthy: Measurements) -> None:
    stepped = from_the_fault_on(healthy, d=0.6)
    with_alarm = health_of(stepped, TYPE, VOLTAGES, START + FAULT)
    assert with_alarm.alarms
    with pytest.raises(SpecificationError) as refusal:
        health_of(stepped, TYPE, VOLTAGES, START + DAYS)
    assert str(refusal.value) == (
        "the charts must begin at 2024-03-26, the day of the last measurement, or before, not at 2024-03-27"
    )


def innovations_of(offset: list[float]) -> Innovations:
    x = np.array(offset)
    count = np.ones(len(x), int)
    return Innovations(tuple(range(START, START + len(x))), count, 0 * count, x, 0 * x, 0 * x, 0.1 * x)


def charted(offset: list[float]) -> dict[str, tuple[int | None, int | None]]:
    charts = charts_of(innovations_of(offset))
    assert [chart.name for chart in charts] == list(CHARTS)
    return {chart.name: (chart.begin, chart.alarm) for chart in charts if chart.alarm is not None}


def test_charts_sum_what_one_day_cannot_tell() -> None:
    assert charted([0.0, 0.0, -STEP_LIMIT, 0.0]) == {"offset step": (2, 2)}
    assert charted([9.0, 0.0, 0.0]) == {}  # the first day is held against the type
    days = int(np.ceil(DECISION / 1.0))
    assert charted([0.0, *[-1.5] * days]) == {"offset drift": (1, days)}
    assert charted([0.0, *[-1.5] * (days - 1)]) == {}
    assert MOST_OF_A_DAY < DECISION


def test_a_last_day_beyond_the_warning_limit_is_said() -> None:
    def said(offset: list[float], first: int = 1) -> str:
        known = innovations_of(offset)
        notice = Health(known, charts_of(known, first), (), first).notice
        return "" if notice is None else notice.sentence

    assert said([0.0, 0.0, -2.5]) == (
        "2024-03-03: the sensor reads 0.25 mm more than the days before predict, 2.5 standard deviations of a day; one "
        "day in 20 is beyond 2 by chance; if the sensor has stepped, intervals may not hold until another day is "
        "measured"
    )
    assert "the sensor reads 0.2 mm less than the days before predict, 2.0 standard" in said([0.0, WARNING_LIMIT])
    assert said([0.0, WARNING_LIMIT - 0.01]) == said([0.0, -2.5, 0.0]) == said([2.5]) == ""
    assert said([0.0, STEP_LIMIT]) == ""  # that is an alarm
    assert said([0.0, 0.0, 2.5], first=3) == ""


def test_the_shift_of_a_day_is_told_in_millimetres(healthy: Measurements, known: Innovations) -> None:
    """What the days err by is in it, so that it is not the shift alone."""
    last = np.array(healthy.days) == healthy.days[-1]
    shifted = replace(healthy, clearance=healthy.clearance - 0.12 * last)
    found = health(shifted)
    assert found.innovations.shift[-1] - known.shift[-1] == pytest.approx(-0.12, abs=0.01)
    assert found.notice is not None
    assert (found.notice.date, found.notice.shift) == ("2024-03-26", -found.innovations.shift[-1])
    assert found.notice.deviations == -found.innovations.offset[-1] > WARNING_LIMIT
    assert health(healthy).notice is None


def test_one_measurement_a_day_tells_no_gain_and_no_scatter() -> None:
    d, V = np.array([3.0, 3.1, 2.9]), np.full(3, 3.0)
    found = course_of(Measurements(d, V, np.full(3, 20.0), "", (1, 2, 3)), TYPE, VOLTAGES).innovations()
    assert np.abs(found.gain).max() < 1e-12
    assert np.abs(found.scatter).max() < 1e-12
