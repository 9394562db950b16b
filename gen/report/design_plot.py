"""A design as a picture: gain with the mask, group delay, and the curves of the calibration, as SVG or PNG."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sosmith.gen.filter.response import (
    FilterFacts,
    frequency_grid,
    group_delay,
    magnitude_db,
    passband_level_db,
)
from sosmith.gen.picture import picture
from sosmith.gen.quantity import scale
from sosmith.gen.report.figures.filter_plots import forbidden_areas
from sosmith.gen.report.figures.painting import frequency_axis
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.port import Port

Array = npt.NDArray[np.float64]

_BLUE, _RED, _AMBER = "#2563a8", "#b4432f", "#e0a63a"
_CURVES, _POINTS = 5, 200
_DEPTH = 100.0
"""Smallest depth of the gain's axis in dB."""


def design_plot(quantized: Quantized, file_format: str) -> bytes:
    """Draw a design.

    Parameters
    ----------
    quantized : Quantized
        The design.
    file_format : str
        One of `sosmith.gen.picture.FORMATS`.
    """
    facts = quantized.filter_facts
    count = 2 * (facts is not None) + (quantized.polynomial is not None)

    def paint(figure: Figure) -> None:
        panels = list(figure.subplots(1, count, squeeze=False)[0])
        if quantized.polynomial is not None:
            _paint_calibration(panels.pop(0), quantized)
        if facts is not None:
            _paint_gain(panels[0], facts)
            _paint_delay(panels[1], facts)

    return picture("design", (4.5 * count, 3.6), paint, file_format)


def _paint_gain(axes: Axes, facts: FilterFacts) -> None:
    frequency = frequency_grid(facts)
    level = passband_level_db(facts)
    axes.set_ylim(level - max(_DEPTH, (facts.stopband_loss or 0) + 30), level + 8)
    for (low, high), border, end in forbidden_areas(axes, facts, level):
        axes.fill_between([max(low, float(frequency[0])), high], border, end, facecolor=_RED, alpha=0.15, lw=0)
    for sos, label, line in _both(facts):
        axes.plot(frequency, magnitude_db(sos, frequency, facts.sample_rate), label=label, **line)
    axes.set(xlabel="frequency", ylabel="gain (dB)")
    axes.set_title("Gain", loc="left")
    axes.legend(loc="best", fontsize=8)
    frequency_axis(axes, frequency)


def _paint_delay(axes: Axes, facts: FilterFacts) -> None:
    frequency = frequency_grid(facts)
    delays = [group_delay(sos, frequency, facts.sample_rate) for sos, _, _ in _both(facts)]
    # Zeros just off the unit circle, where nothing passes anyway, have delays beyond all bounds.
    most = 1.1 * float(np.nanmax(np.abs(delays[0])))
    factor, unit = scale(most, "s")
    for delay, (_, label, line) in zip(delays, _both(facts), strict=True):
        axes.plot(frequency, delay * factor, label=label, **line)
    # A constant factor has no delay, which leaves the upper end to matplotlib.
    axes.set_ylim(min(0.0, 1.1 * float(np.nanmin(delays[0])) * factor), most * factor if most else None)
    axes.set(xlabel="frequency", ylabel=f"group delay ({unit})")
    axes.set_title("Group delay", loc="left")
    frequency_axis(axes, frequency)


def _both(facts: FilterFacts) -> list[tuple[Array, str, dict[str, Any]]]:
    """Return the specified filter, a broad line, and the one with integer coefficients, a dashed line on it."""
    return [
        (facts.ideal_sos, "specified", {"color": _AMBER, "lw": 3.2}),
        (facts.quantized_sos, "integer coefficients", {"color": _BLUE, "lw": 1.4, "ls": (0, (3.0, 1.6))}),
    ]


def _paint_calibration(axes: Axes, quantized: Quantized) -> None:
    polynomial, output = quantized.polynomial, quantized.datapath.output
    assert polynomial is not None  # the caller has seen it
    first, second = quantized.datapath.inputs
    x, fixed_at = (_span(port, count) for port, count in ((first, _POINTS), (second, _CURVES)))
    for k, fixed in enumerate(fixed_at):
        shade = 0.25 + 0.75 * k / (_CURVES - 1)
        label = f"{fixed:.4g} {second.unit}"
        axes.plot(x, polynomial(x, np.full_like(x, fixed)), color=_BLUE, alpha=shade, lw=1.6, label=label)
    axes.set(xlabel=f"{first.name} ({first.unit})", ylabel=f"{output.name} ({output.unit})")
    axes.set_title(f"Calibration at each {second.name}", loc="left")
    axes.legend(loc="upper left", fontsize=8)


def _span(port: Port, count: int) -> Array:
    """Return values from the lowest to the highest code of a port."""
    low, high = port.decode(np.array([port.lowest, port.highest]))
    return np.linspace(float(low), float(high), count)
