"""Wear over time with its limits and where it is heading, as an SVG or PNG file."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sosmith.gen.picture import AMBER, BLUE, GREY, RED, legend_beside, picture
from sosmith.gen.report.figures.painting import envelope
from sosmith.instrument.wear.assessment import WearReport, block_medians
from sosmith.model.arrays import Values

_AHEAD = 2.0
"""How far the axis may reach beyond the record, in its lengths."""


def wear_plot(time: Values, clearance: Values, report: WearReport, file_format: str, *, dated: bool = False) -> bytes:
    """Draw a record of clearances as wear over time, and where it is heading.

    Parameters
    ----------
    time, clearance : ndarray, shape (n,)
        Days and mm, as judged.
    report : WearReport
        The judgement.
    file_format : str
        One of `sosmith.gen.picture.FORMATS`.
    dated : bool
        Whether `time` counts from 1970-01-01, so that the axis shows dates; else it shows days from the beginning.
    """

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        _draw(axes, time if dated else time - time[0], clearance, report)
        if dated:
            axes.xaxis_date(tz="UTC")  # matplotlib counts its days from 1970-01-01, too
            axes.tick_params(axis="x", labelsize=8)
        else:
            axes.set_xlabel("days from the beginning of the record")

    return picture("wear", (9, 4.5), paint, file_format)


def _draw(axes: Axes, time: Values, clearance: Values, report: WearReport) -> None:
    limits, rate = report.limits, report.rate
    thin_time, thin = envelope(time, clearance, 900)
    axes.plot(thin_time, thin - limits.initial, color=GREY, lw=0.5, alpha=0.5, label="readings")
    times, medians, _, _ = block_medians(time, clearance, rate.block)
    axes.plot(times, medians - limits.initial, ".", color=BLUE, ms=4, label=f"medians, {rate.block:.3g} d each")
    ahead = min(np.inf if report.life_high is None else report.life_high + rate.block, _AHEAD * report.duration)
    course = np.array([0.0, ahead])
    start = float(times[-1])
    axes.plot(start + course, report.wear + rate.rate * course, color=BLUE, lw=1.2, ls="--", label="at this rate")
    low, high = (report.wear + slope * course for slope in (rate.low, rate.high))
    interval = f"{100 * rate.confidence:g} % interval"
    axes.fill_between(start + course, low, high, color=BLUE, alpha=0.18, lw=0, label=interval)
    critical = limits.critical_clearance - limits.initial
    axes.axhline(critical, color=RED, lw=1.4, label=f"critical, {critical:.3g} mm")
    if limits.warning is not None:
        axes.axhline(limits.warning, color=AMBER, lw=1.4, label=f"warning, {limits.warning:.3g} mm")
    _draw_end_of_life(axes, float(time[-1]), critical, report, start + ahead)
    axes.set_ylim(min(0.0, float(np.min(thin)) - limits.initial), None)
    axes.set_xlim(float(time[0]), start + ahead)
    axes.set_ylabel("wear (mm)")
    axes.set_title(f"Wear {report.wear:.3g} mm, {report.state}; {rate.rate:.3g} mm a day", loc="left")
    legend_beside(axes)


def _draw_end_of_life(axes: Axes, last: float, critical: float, report: WearReport, edge: float) -> None:
    """Mark when the critical wear is reached, and the interval of that time as far as it is drawn."""
    if report.life is None or report.life <= 0 or last + report.life > edge:
        return
    ends = [last + life if life is not None else edge for life in (report.life_low, report.life_high)]
    axes.plot(np.clip(ends, None, edge), [critical, critical], color=RED, lw=5.0, alpha=0.45, solid_capstyle="butt")
    label = f"reached in {report.life:.3g} d"
    axes.plot([last + report.life], [critical], ls="", marker="D", ms=7, color=RED, label=label)
