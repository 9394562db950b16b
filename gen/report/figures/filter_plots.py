"""Figures of a filter: its response with the mask, its delay, its poles and zeros."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sosmith.gen.filter.response import (
    Band,
    FilterFacts,
    complex_response,
    frequency_grid,
    group_delay,
    magnitude_db,
    passband_level_db,
    passbands,
    poles,
    stopbands,
    zeros,
)
from sosmith.gen.quantity import count, scale
from sosmith.gen.report.figures.painting import (
    COLOUR,
    IDEAL_LINE,
    NARROW,
    PANEL_HEIGHT,
    REAL_LINE,
    Array,
    draw,
    frequency_axis,
)

_FARTHEST = 3.0
"""Half width of the part of the z plane that is drawn at most: beyond it the unit circle would be small."""

MOST_DB = 200
"""Largest attenuation that is drawn, in dB."""

_PASSES_DB = 60
"""Attenuation, in dB, beyond which nothing is said to pass."""


def forbidden_areas(axes: Axes, facts: FilterFacts, level: float) -> list[tuple[Band, float, float]]:
    """Return what the specification forbids inside the axis limits: bands in Hz, each between two gains in dB."""
    bottom, top = axes.get_ylim()
    areas: list[tuple[Band, float, float]] = []
    if facts.passband_edge and facts.passband_loss is not None:
        areas += [(band, level - facts.passband_loss, bottom) for band in passbands(facts)]
    if facts.stopband_edge and facts.stopband_loss is not None:
        areas += [(band, level - facts.stopband_loss, top) for band in stopbands(facts)]
    return areas


def _paint_mask(axes: Axes, facts: FilterFacts, level: float, start: float) -> None:
    """Shade what the specification forbids, inside the axis limits set before."""
    for (low, high), border, end in forbidden_areas(axes, facts, level):
        ends = [max(low, start), high]
        axes.fill_between(ends, border, end, facecolor=COLOUR["limit"], alpha=0.16, lw=0)
        axes.plot(ends, [border, border], color=COLOUR["limit"], lw=1.2)


def lowest_gain_db(facts: FilterFacts, least: float) -> float:
    """Return the gain in dB down to which a filter is drawn: below what it has to reach and what can be seen at all.

    `least` is the gain in dB with which the largest input leaves half an LSB of the output.
    """
    level = passband_level_db(facts)
    wanted = level - (facts.stopband_loss or 0) - 20
    return min(level - 60, wanted, max(least - 12, level - MOST_DB))


def magnitude_figure(facts: FilterFacts, least: float) -> str:
    """Magnitude of the ideal and the quantized filter with the mask, and their difference below.

    `least` is marked, the gain in dB with which the largest input leaves half an LSB of the output.
    """

    def paint(figure: Figure) -> None:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        frequency = frequency_grid(facts)
        ideal = magnitude_db(facts.ideal_sos, frequency, facts.sample_rate)
        quantized = magnitude_db(facts.quantized_sos, frequency, facts.sample_rate)
        level = passband_level_db(facts)
        floor = lowest_gain_db(facts, least)
        upper.set_ylim(floor, level + 8)
        if least > floor:
            upper.axhline(least, color=COLOUR["asked"], lw=1.4, ls=":")
        _paint_mask(upper, facts, level, float(frequency[0]))
        upper.plot(frequency, ideal, color=COLOUR["golden"], **IDEAL_LINE)
        upper.plot(frequency, quantized, color=COLOUR["hardware"], **REAL_LINE)
        upper.set_ylabel("gain in dB")
        shown = ideal >= floor
        difference = np.where(shown, quantized - ideal, np.nan)
        _paint_difference(lower, frequency, difference, "dB")

    return draw("magnitude", "Gain against frequency", NARROW, PANEL_HEIGHT, paint)


def _paint_difference(axes: Axes, frequency: Array, difference: Array, unit: str) -> None:
    """Draw the lower panel: what rounding the coefficients has changed, over the frequency."""
    factor, scaled = scale(float(np.nanmax(np.abs(difference))), unit)
    axes.plot(frequency, difference * factor, color=COLOUR["hardware"])
    axes.set_ylabel(f"difference\nin {scaled}")
    axes.yaxis.set_major_locator(MaxNLocator(3))
    axes.set_xlabel("frequency")
    frequency_axis(axes, frequency)


def phase_figure(facts: FilterFacts, least: float) -> str:
    """Phase of the ideal and the quantized filter where the magnitude is drawn, and their difference below."""

    def paint(figure: Figure) -> None:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        frequency = frequency_grid(facts)
        seen = magnitude_db(facts.ideal_sos, frequency, facts.sample_rate) >= lowest_gain_db(facts, least)
        ideal = np.where(seen, phase(facts.ideal_sos, frequency, facts.sample_rate), np.nan)
        quantized = np.where(seen, phase(facts.quantized_sos, frequency, facts.sample_rate), np.nan)
        upper.plot(frequency, ideal, color=COLOUR["golden"], **IDEAL_LINE)
        upper.plot(frequency, quantized, color=COLOUR["hardware"], **REAL_LINE)
        upper.set_ylabel("phase in °")
        upper.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 1.5, 3, 4.5, 9, 10]))
        difference = (quantized - ideal + 180) % 360 - 180
        _paint_difference(lower, frequency, difference, "deg")

    return draw("phase", "Phase against frequency", NARROW, PANEL_HEIGHT, paint)


def phase(sos: Array, frequency: Array, sample_rate: float) -> Array:
    """Return the phase in degrees without jumps but those at zeros on the unit circle, within a turn at first."""
    phase = np.zeros(len(frequency))
    for section in sos:  # by itself, as one turns less from point to point than all together
        phase += np.unwrap(np.angle(complex_response(section[np.newaxis], frequency, sample_rate)))
    degrees = np.degrees(phase)
    return np.asarray(degrees - 360 * np.round(degrees[0] / 360))


def delay_figure(facts: FilterFacts) -> str:
    """Group delay of the ideal and the quantized filter."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        frequency = frequency_grid(facts)
        ideal = group_delay(facts.ideal_sos, frequency, facts.sample_rate)
        quantized = group_delay(facts.quantized_sos, frequency, facts.sample_rate)
        # Zeros just off the unit circle, where nothing passes anyway, have delays beyond all bounds: not to be framed.
        level = magnitude_db(facts.quantized_sos, frequency, facts.sample_rate)
        both = np.concatenate([ideal, quantized[level > np.nanmax(level) - _PASSES_DB]])
        factor, unit = scale(float(np.nanmax(np.abs(both))), "s")
        axes.plot(frequency, ideal * factor, color=COLOUR["golden"], **IDEAL_LINE)
        axes.plot(frequency, quantized * factor, color=COLOUR["hardware"], **REAL_LINE)
        top = float(np.nanmax(both)) * factor
        axes.set_ylim(min(0.0, 1.08 * float(np.nanmin(both)) * factor), 1.08 * top if top > 0 else None)
        axes.set_ylabel(f"group delay in {unit}")
        axes.set_xlabel("frequency")
        frequency_axis(axes, frequency)

    return draw("delay", "Group delay against frequency", NARROW, PANEL_HEIGHT, paint)


def _zoom_box(facts: FilterFacts) -> tuple[float, float, float]:
    """Centre (real, imaginary) and half width of a square around the poles of the upper half plane."""
    both = np.concatenate([poles(facts.ideal_sos), poles(facts.quantized_sos)])
    upper = both[both.imag >= -1e-12]
    if not len(upper):
        return 0.0, 0.0, 1.0
    real = (float(upper.real.min()), float(upper.real.max()))
    imag = (float(upper.imag.min()), float(upper.imag.max()))
    half = max(real[1] - real[0], imag[1] - imag[0]) / 2
    return sum(real) / 2, sum(imag) / 2, max(1.4 * half, 1e-3)


def _paint_plane(axes: Axes, facts: FilterFacts, centre: tuple[float, float], half: float) -> None:
    """Poles, zeros and the unit circle in the square of half width `half` around `centre`."""
    angle = np.linspace(0, 2 * np.pi, 721)
    if half < 0.5:
        middle = float(np.arctan2(centre[1], centre[0]))
        angle = np.linspace(middle - 4 * half, middle + 4 * half, 361)
    axes.plot(np.cos(angle), np.sin(angle), color=COLOUR["muted"], lw=1)
    for sos, role, size, edge in (
        (facts.ideal_sos, "golden", 11, 3.0),
        (facts.quantized_sos, "hardware", 7, 1.5),
    ):
        for points, marker in ((poles(sos), "x"), (zeros(sos), "o")):
            distance = np.maximum(np.abs(points.real - centre[0]), np.abs(points.imag - centre[1]))
            near = points[distance <= half]
            axes.plot(near.real, near.imag, ls="", marker=marker, ms=size, mew=edge, color=COLOUR[role], mfc="none")
    axes.set_xlim(centre[0] - half, centre[0] + half)
    axes.set_ylim(centre[1] - half, centre[1] + half)
    axes.set_aspect("equal")
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.ticklabel_format(useOffset=False)
    axes.set_xlabel("real part")


def _paint_multiplicity(axes: Axes, facts: FilterFacts) -> None:
    """Write how many zeros share one place, where more than one does."""
    places, counts = np.unique(np.round(zeros(facts.quantized_sos), 3), return_counts=True)
    for place, number in zip(places, counts, strict=True):
        if number > 1:
            inward = 1 if place.real < 0 else -1
            axes.annotate(
                f"{number} zeros",
                (place.real, place.imag),
                xytext=(11 * inward, 0),
                textcoords="offset points",
                ha="left" if inward > 0 else "right",
                va="center",
            )


def plane_frame(facts: FilterFacts) -> tuple[float, int]:
    """Half width of the square around 0 that shows all zeros, as far as it goes, and how many lie outside.

    Half of the zeros of an FIR filter with linear phase, which are not on the unit circle, lie outside of it.
    """
    own = zeros(facts.quantized_sos)
    farthest = np.array([max(abs(zero.real), abs(zero.imag)) for zero in (*own, *zeros(facts.ideal_sos))])
    half = min(max(1.25, 1.1 * float(max(farthest, default=0.0))), _FARTHEST)
    return half, int(np.sum(farthest[: len(own)] > half))


def pole_zero_figure(facts: FilterFacts) -> str:
    """Poles and zeros in the z plane: all of the unit circle and the zeros around it, and a close-up of the poles."""

    def paint(figure: Figure) -> None:
        real, imag, half = _zoom_box(facts)
        panels = figure.subplots(1, 2 if half < 0.6 else 1, squeeze=False)[0]
        whole, outside = plane_frame(facts)
        _paint_plane(panels[0], facts, (0.0, 0.0), whole)
        _paint_multiplicity(panels[0], facts)
        panels[0].set_xticks([-1, 0, 1])
        panels[0].set_yticks([-1, 0, 1])
        panels[0].set_ylabel("imaginary part")
        beyond = f", {count(outside, 'zero')} farther out" if outside else ""
        panels[0].set_title(f"unit circle{beyond}", fontsize=12)
        if len(panels) > 1:
            _paint_plane(panels[1], facts, (real, imag), half)
            panels[1].set_title("close-up of the poles", fontsize=12)

    return draw("poles", "Poles and zeros in the z plane", NARROW, 250, paint)
