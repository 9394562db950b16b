"""Figures of a run: its traces, its errors, and those of other realizations beside them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sosmith.gen.quantity import scale
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.figures.painting import (
    COLOUR,
    IDEAL_LINE,
    NARROW,
    PANEL_HEIGHT,
    REAL_LINE,
    Array,
    clip,
    decades,
    draw,
    envelope,
)
from sosmith.gen.report.largest_error import close_up, error_limits, error_peak
from sosmith.gen.report.run import Instants
from sosmith.model.reference.accuracy import peak


def _range_of(values: Array, margin: float) -> tuple[float, float]:
    """Limits of an axis around `values`, with `margin` of their span to spare, never empty."""
    low, high = float(np.min(values)), float(np.max(values))
    space = margin * (high - low) if high > low else 0.5 * abs(high) or 1.0
    return low - space, high + space


def time_axis(axes: Axes, time: Array | Instants) -> tuple[float, str]:
    """Label the time axis and return the factor from seconds to its unit."""
    ends = np.array([time[0], time[len(time) - 1]])  # they rise
    factor, unit = scale(peak(ends), "s")
    axes.set_xlabel(f"time in {unit}")
    axes.set_xlim(*_range_of(ends * factor, margin=0.0))
    return factor, unit


def trace_figure(evidence: Evidence, transient: int, width: int) -> str:
    """Output against time: true value, unfiltered, exact calculation, hardware; below it hardware minus true value.

    The first `transient` samples are shaded; they do not set the scale of the lower panel.
    """
    compared = evidence.run.truth is not None

    def paint(figure: Figure) -> None:
        panels = figure.subplots(1 + compared, 1, sharex=True, squeeze=False, height_ratios=(2, 1)[: 1 + compared])
        axes, lowest = panels[0, 0], panels[-1, 0]
        time = evidence.run.instants
        factor, _ = time_axis(lowest, time)
        styles: dict[str, dict[str, Any]] = {"unfiltered": {"lw": 0.8}, "truth": {"lw": 5.0}, "golden": IDEAL_LINE}
        shown: dict[str, tuple[int, Array, Array]] = {}
        for order, role in enumerate((*styles, "hardware"), start=2):
            values = getattr(evidence.run, role)  # one at a time: a run has millions of samples
            if values is not None:
                shown[role] = (order, *envelope(time, values, width // 2))
                if role == "hardware":  # dashes along a curve that fills an area would make a pattern of their own
                    styles[role] = {"lw": 0.7} if _fills_area(values, width) else REAL_LINE
        extremes = np.concatenate([values for _, _, values in shown.values()])
        scaling, unit = scale(peak(extremes), evidence.facts.unit)
        for role, (order, thin_time, thin_values) in shown.items():
            axes.plot(thin_time * factor, thin_values * scaling, color=COLOUR[role], zorder=order, **styles[role])
        axes.set_ylim(*_range_of(extremes * scaling, margin=0.06))
        axes.set_ylabel(f"output in {unit}" if unit else "output")
        if evidence.run.truth is not None:
            _paint_true_error(lowest, evidence, transient, factor, width)
        for panel in panels[:, 0]:
            _shade_transient(panel, evidence, transient, factor)

    return draw("trace", "Output against time", width, 440 if compared else 310, paint)


def _paint_true_error(axes: Axes, evidence: Evidence, transient: int, factor: float, width: int) -> None:
    assert evidence.run.truth is not None  # the caller has seen it
    error = evidence.run.minus(evidence.run.truth)
    settled = error[transient:] if transient < len(error) else error
    scaling, unit = scale(peak(settled) or evidence.facts.lsb, evidence.facts.unit)
    error *= scaling
    time, low, high = stretches(evidence.run.instants, error, width)
    axes.fill_between(time * factor, low, high, color=COLOUR["hardware"], lw=0.8)
    axes.axhline(0, color=COLOUR["truth"], lw=1.2)
    axes.set_ylim(*_range_of(np.array([settled.min(), settled.max(), 0.0]), margin=0.08))
    axes.set_ylabel(f"minus true\nvalue in {unit}" if unit else "minus true\nvalue")
    axes.yaxis.set_major_locator(MaxNLocator(4))


def _shade_transient(axes: Axes, evidence: Evidence, transient: int, factor: float) -> None:
    if transient:
        last = min(transient, len(evidence.run) - 1)
        ends = (evidence.run.at(0) * factor, evidence.run.at(last) * factor)
        axes.axvspan(*ends, facecolor=COLOUR["muted"], alpha=0.14, lw=0)


def stretches(time: Array | Instants, values: Array, columns: int) -> tuple[Array, Array, Array]:
    """Smallest and largest value of each of at most `columns` stretches of a trace, at the middle of each.

    A short trace comes as it is, with its values twice.
    """
    if len(values) <= 2 * columns:
        return time[:], values, values
    edges = np.linspace(0, len(values), columns + 1).astype(int)
    low, high = np.minimum.reduceat(values, edges[:-1]), np.maximum.reduceat(values, edges[:-1])
    return (time[edges[:-1]] + time[edges[1:] - 1]) / 2, low, high


def _fills_area(values: Array, width: int) -> bool:
    """Whether a trace swings so often that its curve covers an area `width` pixels wide."""
    _, thin = envelope(values, values, width)
    travel = float(np.sum(np.abs(np.diff(thin))))
    return travel > width / 10 * float(np.ptp(values))


def close_up_figure(evidence: Evidence, width: int) -> str:
    """Exact calculation and hardware, sample by sample, around the largest error."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        near = close_up(evidence)
        time, golden, hardware = evidence.run.instants[near], evidence.run.golden[near], evidence.run.hardware[near]
        factor, _ = time_axis(axes, time)
        both = np.concatenate([golden, hardware])
        scaling, unit = scale(float(np.max(np.abs(both))), evidence.facts.unit)
        axes.plot(time * factor, golden * scaling, color=COLOUR["golden"], **IDEAL_LINE)
        axes.plot(time * factor, hardware * scaling, color=COLOUR["hardware"], ls="", marker="o", ms=4.5)
        axes.set_ylim(*_range_of(both * scaling, margin=0.1))
        axes.ticklabel_format(axis="y", useOffset=False)
        axes.set_ylabel(f"output in {unit}" if unit else "output")
        worst = int(np.argmax(np.abs(hardware - golden)))
        axes.axvline(time[worst] * factor, color=COLOUR["muted"], lw=1.0, ls=":")

    return draw("close-up", "Output around the largest error", width, 250, paint)


def error_figure(evidence: Evidence, width: int) -> str:
    """Hardware minus exact calculation against time, with its limits."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        factor, _ = time_axis(axes, evidence.run.instants)
        inside, _outside = error_limits(evidence)
        top = 1.25 * max([error_peak(evidence), *(limit.value for limit in inside)])
        scaling, unit = scale(top, evidence.facts.unit)
        error = evidence.run.error
        error *= scaling
        time, low, high = stretches(evidence.run.instants, error, width // 4)
        if low is high:
            axes.plot(time * factor, low, color=COLOUR["hardware"], lw=0.9)
        else:
            axes.fill_between(time * factor, low, high, color=COLOUR["hardware"], alpha=0.3, lw=0)
            for edge in (low, high):
                axes.plot(time * factor, edge, color=COLOUR["hardware"], lw=1.1)
        axes.set_ylim(-top * scaling, top * scaling)
        for limit in inside:
            for value in (-limit.value, limit.value):
                axes.axhline(value * scaling, color=COLOUR[limit.role], ls=limit.dashes, lw=1.6)
        if evidence.run.first_mismatch is not None:
            axes.axvline(evidence.run.at(evidence.run.first_mismatch) * factor, color=COLOUR["limit"], lw=1.6)
        axes.set_ylabel(f"error in {unit}" if unit else "error")

    return draw("error", "Error of the hardware against time", width, 270, paint)


def histogram_figure(evidence: Evidence) -> str:
    """Share of samples over the error in steps of the output code."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        steps = evidence.run.error
        steps /= evidence.facts.lsb
        reach = 1.2 * error_peak(evidence) / evidence.facts.lsb
        counts, edges = np.histogram(steps, bins=np.linspace(-reach, reach, 52))
        axes.stairs(100 * counts / len(steps), edges, fill=True, color=COLOUR["hardware"])
        for limit in (-0.5, 0.5):
            axes.axvline(limit, color=COLOUR["limit"], lw=1.2, ls=":")
        axes.set_xlim(-reach, reach)
        axes.set_ylim(bottom=0)
        axes.set_xlabel("error in steps of the output (LSB)")
        axes.set_ylabel("share of samples in %")

    return draw("histogram", "How often each error occurs", NARROW, PANEL_HEIGHT, paint)


def ranking_figure(
    rows: Sequence[tuple[str, float, str]], marks: Sequence[tuple[float, str]], unit: str, width: int
) -> str:
    """Largest errors beside each other on a logarithmic axis.

    Parameters
    ----------
    rows : sequence of (str, float, str)
        Name, value in `unit`, colour role.
    marks : sequence of (float, str)
        Values to mark with an upright line, and their colour roles.
    unit : str
        Unit of all values.
    width : int
        `WIDE` or `NARROW`.
    """
    known = [value for _name, value, _role in rows if value > 0] + [value for value, _role in marks]
    low, high = min(known, default=1.0) / 3, max(known, default=1.0) * 3

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        axes.set_xscale("log")
        axes.set_xlim(low, high)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        for value, role in marks:
            axes.axvline(value, color=COLOUR[role], lw=1.6, ls=":")
        for place, (_name, value, role) in enumerate(rows):
            if value > 0:
                axes.plot([low, value], [place, place], color=COLOUR[role], lw=2.5, solid_capstyle="butt")
                axes.plot([value], [place], color=COLOUR[role], marker="o", ms=9)
        axes.set_yticks(range(len(rows)), [clip(name, width // 20) for name, _value, _role in rows])
        axes.grid(visible=False, axis="y")
        axes.tick_params(axis="y", length=0)
        decades(axes.xaxis, low, high, unit, width // 110)
        axes.set_xlabel("largest error")

    return draw("ranking", "Largest errors beside each other", width, 80 + 40 * len(rows), paint)


def alternatives_figure(evidence: Evidence) -> str:
    """Largest errors of this design and its alternatives, with one LSB and the allowed error marked."""
    own = peak(evidence.run.error)
    rows = [(evidence.realization, own, "hardware")]
    rows += [(other.name, other.max_abs, "golden") for other in evidence.rivals]
    marks = [(evidence.facts.lsb, "muted"), (evidence.facts.max_error, "asked")]
    return ranking_figure(rows, marks, evidence.facts.unit, NARROW)
