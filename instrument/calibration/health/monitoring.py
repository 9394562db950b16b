"""The health of a sensor: its charts, their alarms, and a sentence for each change."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from functools import cache, partial

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.acceptance import Range
from sosmith.instrument.calibration.health.charts import STEP_LIMIT, WARNING_LIMIT, Chart, charts_of
from sosmith.instrument.calibration.health.explanation import Explanation, explanation_of
from sosmith.instrument.calibration.health.innovations import Innovations, course_of
from sosmith.instrument.calibration.sensor_type import SensorType
from sosmith.model.errors import SpecificationError


@dataclass(frozen=True, eq=False)
class Alarm:
    """An alarm.

    Attributes
    ----------
    chart : Chart
        The chart that raised it.
    explanation : Explanation
        What explains the change.
    begin, raised : str
        Dates on which the change began, as far as the chart knows, and of the alarm.
    """

    chart: Chart
    explanation: Explanation
    begin: str
    raised: str

    @property
    def sentence(self) -> str:
        """What happened, when, and what explains it best."""
        what = {
            "offset step": "the offset stepped",
            "gain step": "the gain stepped",
            "offset drift": "the offset drifts",
            "gain drift": "the gain drifts",
            "scatter": "the measurements, or the days, scatter",
        }[self.chart.name]
        way = "more" if self.chart.name == "scatter" else "up" if self.chart.upwards else "down"
        since = f", since {self.begin}" if self.begin != self.raised else ""
        best = self.explanation.best
        sure = max(self.explanation.probabilities)
        return (
            f"{self.raised}: {what} {way}{since}; {best.text} ({100 * min(sure, 0.999):.3g} % among the explanations)"
        )


@dataclass(frozen=True)
class Notice:
    """A last day that is beyond the warning limit and within that for an alarm.

    Attributes
    ----------
    date : str
        The day.
    shift : float
        Readings minus measured clearances in mm, where the days before agree: positive if the sensor reads too much.
    deviations : float
        The same in standard deviations of what may be expected of a day.
    """

    date: str
    shift: float
    deviations: float

    @property
    def sentence(self) -> str:
        """What is to be known of it."""
        way = "more" if self.shift > 0 else "less"
        return (
            f"{self.date}: the sensor reads {abs(self.shift):.2g} mm {way} than the days before predict, "
            f"{abs(self.deviations):.1f} standard deviations of a day; one day in 20 is beyond {WARNING_LIMIT:g} by "
            "chance; if the sensor has stepped, intervals may not hold until another day is measured"
        )


@dataclass(frozen=True, eq=False)
class Health:
    """The health of a sensor.

    Attributes
    ----------
    innovations : Innovations
        The numbers of each day.
    charts : tuple of Chart
        In the order of `charts.CHARTS`.
    alarms : tuple of Alarm
        In the order of their dates.
    first : int
        Index of the first day on the charts.
    """

    innovations: Innovations
    charts: tuple[Chart, ...]
    alarms: tuple[Alarm, ...]
    first: int

    @property
    def notice(self) -> Notice | None:
        """The last day, if its offset is beyond the warning limit and within that for an alarm."""
        known = self.innovations
        offset = float(known.offset[-1])
        if len(known.days) <= self.first or not WARNING_LIMIT <= abs(offset) < STEP_LIMIT:
            return None
        return Notice(date_of(known.days[-1]), -float(known.shift[-1]), -offset)


def health_of(measurements: Measurements, sensor_type: SensorType, voltages: Range, since: int | None = None) -> Health:
    """Judge the health of a sensor from its measurements.

    Parameters
    ----------
    measurements : Measurements
        With their `days`.
    sensor_type : SensorType
        What is known of the sensor beforehand.
    voltages : tuple of float
        Range of the voltage in V.
    since : int or None
        Ordinal of the first day on the charts: what happened before is known and accepted. The days before still say
        what is to be expected.

    Raises
    ------
    SpecificationError
        If no measurement is of the day `since` or later.
    """
    course = course_of(measurements, sensor_type, voltages)
    found = course.innovations()
    before = 0 if since is None else sum(day < since for day in found.days)
    if since is not None and before == len(found.days):
        raise SpecificationError(
            f"the charts must begin at {date_of(found.days[-1])}, the day of the last measurement, or before, not at "
            f"{date_of(since)}"
        )
    first = max(before, 1)  # the first day is held against the type, not against what the sensor was
    charts = charts_of(found, first)
    explained = cache(partial(explanation_of, course))
    alarms = [
        Alarm(
            chart,
            explained(chart.begin, chart.alarm),
            date_of(found.days[chart.begin]),
            date_of(found.days[chart.alarm]),
        )
        for chart in charts
        if chart.alarm is not None and chart.begin is not None
    ]
    alarms.sort(key=lambda alarm: alarm.raised)
    return Health(found, charts, tuple(alarms), first)


def date_of(day: int) -> str:
    """Return the date of an ordinal, such as 2024-03-01."""
    return datetime.date.fromordinal(day).isoformat()
