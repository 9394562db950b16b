"""Control charts over the innovations of a sensor: step, drift and scatter.

A step is told by one day (Shewhart), what builds up over days by cumulative sums (E. S. Page, Biometrika 41, 1954),
both together as J. M. Lucas combined them (J. Qual. Technol. 14, 1982). `python -m benchmarks.sensor_health` measures
how often they raise an alarm without a reason, and how soon with one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.instrument.calibration.health.innovations import Innovations
from sosmith.model.arrays import Values

STEP_LIMIT = 4.5
"""Standard deviations of one day's offset or gain from which on it is a step."""

WARNING_LIMIT = 2.0
"""Standard deviations of one day's offset from which on it is said, without an alarm: the warning limit that control
charts usually have beside that for action. A normal number is beyond it once in 22 days."""

ALLOWANCE = 0.5
"""Taken from each day's standard normal number before it is summed: half the shift that the sum finds soonest."""

DECISION = 7.0
"""Cumulative sum from which on there is an alarm."""

MOST_OF_A_DAY = 3.0
"""What one day can add to a cumulative sum, before the allowance: a single odd day is no drift."""

CHARTS = ("offset step", "gain step", "offset drift", "gain drift", "scatter")
"""Names of the charts."""


@dataclass(frozen=True, eq=False)
class Chart:
    """One chart.

    Attributes
    ----------
    name : str
        One of `CHARTS`.
    values : ndarray, shape (days,)
        What is held against the limit: magnitudes of a step, or the larger of the sums upwards and downwards.
    limit : float
        Alarm from here on.
    begin, alarm : int or None
        Index of the day on which the change began, as far as the chart knows, and of the first alarm; None without one.
    upwards : bool
        Direction of that alarm.
    """

    name: str
    values: Values
    limit: float
    begin: int | None
    alarm: int | None
    upwards: bool


def charts_of(found: Innovations, first: int = 1) -> tuple[Chart, ...]:
    """Draw the charts, from the day of index `first` on; before it they are 0."""
    return (
        _steps("offset step", found.offset, first),
        _steps("gain step", found.gain, first),
        _sums("offset drift", found.offset, first, both=True),
        _sums("gain drift", found.gain, first, both=True),
        _sums("scatter", found.scatter, first, both=False),
    )


def _steps(name: str, x: Values, first: int) -> Chart:
    values = np.abs(x)
    values[:first] = 0.0
    beyond = np.flatnonzero(values >= STEP_LIMIT)
    alarm = int(beyond[0]) if len(beyond) else None
    return Chart(name, values, STEP_LIMIT, alarm, alarm, alarm is not None and bool(x[alarm] > 0))


def _sums(name: str, x: Values, first: int, *, both: bool) -> Chart:
    """Sum up; a sum that has reached the limit stays there until it falls by itself."""
    values = np.zeros(len(x))
    sums, since = [0.0, 0.0], [first, first]
    begin = alarm = None
    upwards = True
    for k in range(first, len(x)):
        for side in range(1 + both):
            step = (1.0 - 2.0 * side) * float(x[k])
            if not sums[side]:
                since[side] = k
            sums[side] = min(max(sums[side] + min(step, MOST_OF_A_DAY) - ALLOWANCE, 0.0), 2.0 * DECISION)
        side = int(sums[1] > sums[0])
        values[k] = sums[side]
        if alarm is None and values[k] >= DECISION:
            begin, alarm, upwards = since[side], k, not side
    return Chart(name, values, DECISION, begin, alarm, upwards)
