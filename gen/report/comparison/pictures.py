"""Figures of a comparison: errors beside costs, and errors over time, their spectra and the filters overlaid."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import FuncFormatter, MaxNLocator

from sosmith.gen.filter.response import magnitude_db
from sosmith.gen.quantity import scale
from sosmith.gen.report.comparison.choice import SMALLEST_FIRST, Choice, cost_unit, hardware_cost
from sosmith.gen.report.comparison.report_file import Report, fact
from sosmith.gen.report.figures.figure import Figure
from sosmith.gen.report.figures.painting import COLOUR, NARROW, SERIES, WIDE, clip, decades, draw, frequency_axis
from sosmith.model.arithmetic.elementary import geometric

Array = npt.NDArray[np.float64]

_POINTS = 500
_WIDEST = 1e12
"""Range of a logarithmic axis at most: what lies further below the largest value is left of the picture."""
_ONE_SIZE = 20
"""Factor between errors up to which their axis is linear."""
_LARGEST_DB = 300.0
"""Gains beyond, either way, are of no filter that was ever built."""

_DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)))
"""The second and third round of colours is dashed."""


def standing_figure(reports: Sequence[Report], names: Sequence[str], choice: Choice) -> Figure | None:
    """Largest error, its limit and the cost of every report; None where units differ.

    The cheapest is first; where costs cannot be compared, those of the smallest architecture.
    """
    units = {str(report["error"]["unit"]) for report in reports}
    if len(units) > 1:
        return None
    costs = [hardware_cost(report) for report in reports]
    units_of_cost = [cost_unit(report) for report in reports]
    alike = len(set(units_of_cost)) == 1
    counted = units_of_cost[choice.taken or 0]
    smallest = choice.taken is not None and all(_size(reports[choice.taken]) <= _size(report) for report in reports)
    with_costs = None not in costs and (alike or smallest)
    order = sorted(
        range(len(reports)),
        key=lambda k: (0 if alike else _size(reports[k]), costs[k] or 0.0, reports[k]["error"]["bound"] or 0.0),
    )
    unit = units.pop()

    def picture(width: int) -> str:
        def paint(drawing: Drawing) -> None:
            panels = drawing.subplots(1, 2 if with_costs else 1, sharey=True, squeeze=False)[0]
            _paint_errors(panels[0], [reports[k] for k in order], unit, _place(order, choice.taken))
            if with_costs:
                shown = [costs[k] or 0.0 if units_of_cost[k] == counted else None for k in order]
                _paint_costs(panels[1], shown, counted, order, choice)
                for place, k in enumerate(order):
                    if shown[place] is None:
                        panels[1].text(0, place, f" {clip(reports[k]['architecture'], 12)}", va="center")
            longest = width // 32
            labels = [clip(("▸ " if k == choice.taken else "") + names[k], longest) for k in order]
            panels[0].set_yticks(range(len(order)), labels)
            panels[0].set_ylim(len(order) - 0.4, -0.6)
            for axes in panels:
                axes.grid(visible=False, axis="y")
                axes.tick_params(axis="y", length=0)

        return draw("standing", "Largest errors, their limits and costs", width, 90 + 34 * len(order), paint)

    legend = [("hardware", "dot", "largest error of the run"), ("muted", "", "up to the limit over all inputs")]
    legend += [] if choice.taken is None else [("truth", "dot", "the one to take")]
    legend += [] if all(report["passed"] for report in reports) else [("limit", "dot", "falls short")]
    return Figure(
        drawing=picture(WIDE),
        narrow=picture(NARROW),
        caption="The limit holds for all inputs in range; this trace need not reach it.",
        legend=legend,
    )


def _size(report: Report) -> int:
    name = fact(report, "architecture")
    return SMALLEST_FIRST.index(name) if name in SMALLEST_FIRST else len(SMALLEST_FIRST)


def _place(order: Sequence[int], taken: int | None) -> int | None:
    return None if taken is None else order.index(taken)


def _paint_errors(axes: Axes, reports: Sequence[Report], unit: str, taken: int | None) -> None:
    errors = [float(report["error"]["max_abs"]) for report in reports]
    bounds = [float(report["error"]["bound"] or 0) for report in reports]
    known = [value for value in (*errors, *bounds) if value > 0] or [1.0]
    _error_axis(axes, min(known), max(known), unit)
    for place, (error, bound) in enumerate(zip(errors, bounds, strict=True)):
        role = "truth" if place == taken else "hardware" if reports[place]["passed"] else "limit"
        if bound > 0:
            axes.plot([error or min(known), bound], [place, place], color=COLOUR["muted"], lw=2.0)
            axes.plot([bound], [place], color=COLOUR["muted"], marker="|", ms=13, mew=2.0)
        if error > 0:
            axes.plot([error], [place], color=COLOUR[role], marker="o", ms=9)


def _error_axis(axes: Axes, low: float, high: float, unit: str) -> None:
    """From zero where all values are of one size, else logarithmic."""
    if high < _ONE_SIZE * low:
        axes.set_xlim(0, 1.08 * high)
        axes.xaxis.set_major_locator(MaxNLocator(3))
        factor, symbol = scale(high, unit)
        axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v * factor:g}"))
        axes.set_xlabel(f"largest error, and its limit, in {symbol}" if symbol else "largest error, and its limit")
        return
    low = max(low, high / _WIDEST)
    axes.set_xscale("log")
    axes.set_xlim(low / 1.6, high * 1.6)
    decades(axes.xaxis, low / 1.6, high * 1.6, unit, 4)
    axes.set_xlabel("largest error, and its limit (logarithmic)")


def _paint_costs(axes: Axes, costs: Sequence[float | None], counted: str, order: Sequence[int], choice: Choice) -> None:
    for place, cost in enumerate(costs):
        role = (
            "truth" if order[place] == choice.taken else "unfiltered" if order[place] in choice.beaten else "hardware"
        )
        axes.barh([place], [cost or 0.0], height=0.5, color=COLOUR[role])
    axes.set_xlim(0, 1.08 * max(1.0, *(cost or 0.0 for cost in costs)))
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:,.0f}"))
    axes.set_xlabel(f"cost in {counted.partition(',')[0]}")


def error_figure(reports: Sequence[Report], names: Sequence[str]) -> Figure | None:
    """Magnitude of the error over time, the largest of each stretch; None where reports know no curves."""
    curves = [fact(report, "curves.error") for report in reports]
    if _unlike(reports) or any(curve is None for curve in curves):
        return None
    unit = str(reports[0]["error"]["unit"])
    sizes = [np.maximum(np.abs(curve["low"]), np.abs(curve["high"])) for curve in curves]
    times = [np.array(curve["time"], dtype=np.float64) for curve in curves]
    factor, seconds = scale(float(max(np.max(np.abs(time)) for time in times)), "s")
    scaling, symbol = scale(float(max(np.max(size) for size in sizes)), unit)

    def paint(axes: Axes) -> None:
        for k, (time, size) in enumerate(zip(times, sizes, strict=True)):
            axes.step(time * factor, size * scaling, where="post", lw=1.5, **_line(k))
        axes.set_ylim(bottom=0)
        axes.margins(x=0)
        axes.set_xlabel(f"time in {seconds}")
        axes.set_ylabel(f"|error| in {symbol}" if symbol else "|error|")

    return _figure(names, "error-over-time", "Error over time", paint, "The largest magnitude in each stretch of time.")


def spectrum_figure(reports: Sequence[Report], names: Sequence[str]) -> Figure | None:
    """Amplitude densities of the errors; None where reports know none."""
    curves = [fact(report, "curves.spectrum") for report in reports]
    if _unlike(reports) or any(curve is None for curve in curves):
        return None
    unit = str(reports[0]["error"]["unit"])
    lines = [(np.array(c["frequency"], dtype=np.float64), np.array(c["density"], dtype=np.float64)) for c in curves]
    known = [density[density > 0] for _, density in lines]
    if not all(len(each) for each in known) or any(np.any(frequency <= 0) for frequency, _ in lines):
        return None

    def paint(axes: Axes) -> None:
        for k, (frequency, density) in enumerate(lines):
            axes.plot(frequency, np.maximum(density, np.min(known[k])), lw=1.5, **_line(k))
        axes.set_yscale("log")
        decades(axes.yaxis, *axes.get_ylim(), unit, 6)
        axes.set_ylabel("error per √Hz")
        axes.set_xlabel("frequency")
        ends = np.array([min(f[0] for f, _ in lines), max(f[-1] for f, _ in lines)])
        frequency_axis(axes, ends)

    return _figure(
        names,
        "error-spectrum",
        "Spectrum of the error",
        paint,
        "Amplitude density of hardware minus exact calculation.",
    )


def response_figure(reports: Sequence[Report], names: Sequence[str]) -> Figure | None:
    """How far rounding the coefficients bends each filter; None where a report has no filter, or it cannot be drawn."""
    filters = [fact(report, "curves.filter") for report in reports]
    if any(each is None for each in filters):
        return None
    nyquists = [float(each["sample_rate"]) / 2 for each in filters]
    frequency = geometric(min(nyquists) / 10**4, max(nyquists) * 0.999, _POINTS)
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a file may hold any numbers
        gains = [_gain(each, "quantized_sos", frequency) for each in filters]
        bends = [gain - _gain(each, "ideal_sos", frequency) for gain, each in zip(gains, filters, strict=True)]
    top = max((float(np.max(gain[np.isfinite(gain)], initial=-400.0)) for gain in gains), default=0.0)
    shown = [
        np.where(np.isfinite(bend) & (gain > top - 100), bend, np.nan) for gain, bend in zip(gains, bends, strict=True)
    ]
    sizes = [float(np.max(np.abs(bend[np.isfinite(bend)]), initial=0.0)) for bend in shown]
    if not all(np.any(np.isfinite(bend)) for bend in shown) or max(abs(top), *sizes) > _LARGEST_DB:
        return None
    factor, unit = scale(max(sizes), "dB")

    def paint_both(drawing: Drawing) -> None:
        upper, lower = drawing.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        for k, (gain, bend) in enumerate(zip(gains, shown, strict=True)):
            upper.plot(frequency, np.where(np.isfinite(gain), gain, np.nan), lw=1.5, **_line(k))
            lower.plot(frequency, bend * factor, lw=1.5, **_line(k))
        upper.set_ylim(top - 100, top + 8)
        upper.set_ylabel("gain in dB")
        lower.set_ylabel(f"from ideal\nin {unit}")
        lower.yaxis.set_major_locator(MaxNLocator(3))
        lower.set_xlabel("frequency")
        frequency_axis(lower, frequency)

    return Figure(
        title="Filters with their integer coefficients",
        drawing=draw("responses", "Gain against frequency", WIDE, 400, paint_both),
        narrow=draw("responses", "Gain against frequency", NARROW, 380, paint_both),
        caption="Below: the difference of each from its own ideal filter, where the gain is within 100 dB of the top.",
        legend=_legend(names),
    )


def _gain(filter_: Mapping[str, Any], name: str, frequency: Array) -> Array:
    """Return a gain in dB, NaN above half the filter's own sample rate."""
    rate = float(filter_["sample_rate"])
    gain = magnitude_db(np.array(filter_[name], dtype=np.float64), frequency, rate)
    return np.where(frequency < rate / 2, gain, np.nan)


def _unlike(reports: Sequence[Report]) -> bool:
    return len({report["error"]["unit"] for report in reports}) > 1


def _line(k: int) -> dict[str, Any]:
    return {"color": COLOUR[SERIES[k % len(SERIES)]], "ls": _DASHES[k // len(SERIES) % len(_DASHES)]}


def _legend(names: Sequence[str]) -> list[tuple[str, str, str]]:
    shapes = ("", "dashed", "dotted")
    return [(SERIES[k % len(SERIES)], shapes[k // len(SERIES) % len(shapes)], name) for k, name in enumerate(names)]


def _figure(names: Sequence[str], name: str, title: str, paint: Callable[[Axes], None], caption: str) -> Figure:
    def on(drawing: Drawing) -> None:
        paint(drawing.subplots())

    return Figure(
        title=title,
        drawing=draw(name, title, WIDE, 290, on),
        narrow=draw(name, title, NARROW, 270, on),
        caption=caption,
        legend=_legend(names),
    )
