"""Wear over time with its limits and where it is heading, as an SVG or PNG file."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sosmith.gen.picture import picture
from sosmith.gen.report.plots import envelope
from sosmith.model.arrays import Values
from sosmith.model.wear.assessment import WearReport, block_medians

_BLUE, _RED, _AMBER, _GREY = "#2563a8", "#b4432f", "#c08a1e", "#8a8a8a"
_AHEAD = 2.0
"""How far the axis may reach beyond the record, in its lengths."""


def wear_plot(time: Values, clearance: Values, report: WearReport, file_format: str) -> bytes:
    """Draw a record of clearances as wear over days from its beginning.

    Parameters
    ----------
    time, clearance : ndarray, shape (n,)
        Days and mm, as judged.
    report : WearReport
        The judgement.
    file_format : str
        One of `sosmith.gen.picture.FORMATS`.
    """

    def paint(figure: Figure) -> None:
        _draw(figure.subplots(), time - time[0], clearance, report)

    return picture("wear", (9, 4.5), paint, file_format)


def _draw(axes: Axes, time: Values, clearance: Values, report: WearReport) -> None:
    limits, rate = report.limits, report.rate
    thin_time, thin = envelope(time, clearance, 900)
    axes.plot(thin_time, thin - limits.initial, color=_GREY, lw=0.5, alpha=0.6, label="readings")
    times, medians, _, _ = block_medians(time, clearance, rate.block)
    axes.plot(times, medians - limits.initial, ".", color=_BLUE, ms=4, label=f"medians, {rate.block:.3g} d each")
    ahead = min(np.inf if report.life_high is None else report.life_high + rate.block, _AHEAD * report.duration)
    course = np.array([0.0, ahead])
    start = float(times[-1])
    axes.plot(start + course, report.wear + rate.rate * course, color=_BLUE, lw=1.0, ls="--", label="at this rate")
    low, high = (report.wear + slope * course for slope in (rate.low, rate.high))
    axes.fill_between(start + course, low, high, color=_BLUE, alpha=0.15, lw=0)
    critical = limits.critical_clearance - limits.initial
    axes.axhline(critical, color=_RED, lw=1.2, label=f"critical, {critical:.3g} mm")
    if limits.warning is not None:
        axes.axhline(limits.warning, color=_AMBER, lw=1.2, label=f"warning, {limits.warning:.3g} mm")
    axes.set_ylim(min(0.0, float(np.min(thin)) - limits.initial), None)
    axes.set(xlabel="days from the beginning of the record", ylabel="wear (mm)")
    axes.set_title(f"Wear {report.wear:.3g} mm, {report.state}; {rate.rate:.3g} mm a day", loc="left")
    axes.legend(loc="upper left", fontsize=8)
