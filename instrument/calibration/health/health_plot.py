"""The control charts of a sensor as an SVG or PNG file; the same measurements give the same bytes."""

from __future__ import annotations

import datetime
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sosmith.gen.picture import AMBER, BLUE, GREEN, GREY, PURPLE, RED, legend_beside, picture
from sosmith.instrument.calibration.health.charts import Chart
from sosmith.instrument.calibration.health.monitoring import Health

_COLOURS = {
    "offset step": BLUE,
    "gain step": GREEN,
    "offset drift": BLUE,
    "gain drift": GREEN,
    "scatter": PURPLE,
}
_DIGITS = 4


def health_plot(sensor: str, found: Health, file_format: str) -> bytes:
    """Draw what each day brought, and the charts of it with limits and alarms.

    `file_format` is one of `sosmith.gen.picture.FORMATS`.
    """

    def paint(figure: Figure) -> None:
        days, steps, sums = figure.subplots(3, 1, sharex=True)
        known = found.innovations
        time = np.array([_since_1970(day) for day in known.days])
        alarms = f"{len(found.alarms)} alarms" if found.alarms else "no alarm"
        figure.suptitle(f"Health of sensor {sensor}: {alarms}")
        for name, values, colour in (
            ("offset", known.offset, BLUE),
            ("gain", known.gain, GREEN),
            ("scatter", known.scatter, PURPLE),
        ):
            days.plot(time, np.round(values, _DIGITS), ".", color=colour, ms=4, label=name)
        days.axhline(0.0, color=GREY, lw=0.8)
        days.set_ylabel("standard deviations")
        days.set_title("Each day against its prediction from the days before", loc="left")
        legend_beside(days)
        _draw(steps, time, [chart for chart in found.charts if chart.name.endswith("step")], "Steps")
        _draw(sums, time, [chart for chart in found.charts if not chart.name.endswith("step")], "Cumulative sums")
        sums.xaxis_date(tz="UTC")
        sums.tick_params(axis="x", labelsize=8)

    return picture("health", (9, 7.5), paint, file_format)


def _draw(axes: Axes, time: Sequence[float] | np.ndarray, charts: list[Chart], title: str) -> None:
    for chart in charts:
        colour = _COLOURS[chart.name]
        axes.plot(time, np.round(chart.values, _DIGITS), color=colour, lw=1.2, label=chart.name)
        if chart.begin is not None and chart.alarm is not None:
            axes.axvspan(time[chart.begin], time[chart.alarm], color=AMBER, alpha=0.18, lw=0)
            axes.plot([time[chart.alarm]], [round(float(chart.values[chart.alarm]), _DIGITS)], "D", color=RED, ms=6)
    axes.axhline(charts[0].limit, color=RED, lw=1.2, label=f"limit, {charts[0].limit:g}")
    axes.set_ylim(bottom=0.0)
    axes.set_title(title, loc="left")
    legend_beside(axes)


def _since_1970(day: int) -> float:
    return float(day - datetime.date(1970, 1, 1).toordinal())
