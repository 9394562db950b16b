"""Figures of the report, as SVG elements to stand inside an HTML page.

Each figure is drawn in placeholder colours, which are then replaced by the page's CSS variables: light, dark
and print follow the page. Texts stay texts, in the page's own font. The same evidence gives the same bytes.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter

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
from sosmith.gen.picture import plain_parameters, settled, svg_text
from sosmith.gen.quantity import count, quantity, scale
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.largest_error import close_up, error_limits, error_peak
from sosmith.gen.report.run import Instants
from sosmith.model.reference.accuracy import peak

Array = npt.NDArray[np.float64]

WIDE, NARROW = 940, 460
"""Widths of the drawing in CSS pixels: across the page, and half the page or a telephone."""

SERIES = tuple(f"series{k}" for k in range(8))
"""Colour roles of curves that lie beside each other as equals."""

ROLES = ("ink", "muted", "grid", "truth", "unfiltered", "golden", "hardware", "limit", "asked", *SERIES)
COLOUR = {role: f"#0000{index:02x}" for index, role in enumerate(ROLES, start=1)}
PANEL_HEIGHT = 350
_FARTHEST = 3.0
"""Half width of the part of the z plane that is drawn at most: beyond it the unit circle would be small."""

IDEAL_LINE: dict[str, Any] = {"lw": 3.6}
REAL_LINE: dict[str, Any] = {"lw": 2.0, "ls": (0, (3.0, 1.6))}
"""Two curves that nearly always coincide: dashes on a broad line show both."""

STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 12.0,
    "axes.edgecolor": COLOUR["muted"],
    "axes.labelcolor": COLOUR["ink"],
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": COLOUR["grid"],
    "grid.linewidth": 0.8,
    "xtick.color": COLOUR["muted"],
    "ytick.color": COLOUR["muted"],
    "xtick.labelcolor": COLOUR["ink"],
    "ytick.labelcolor": COLOUR["ink"],
    "text.color": COLOUR["ink"],
    "lines.linewidth": 1.4,
    "lines.solid_joinstyle": "round",
    "path.simplify": False,
    "text.parse_math": False,  # a dollar sign in a name is a dollar sign
    "savefig.transparent": True,
}

MOST_DB = 200
"""Largest attenuation that is drawn, in dB."""

_PASSES_DB = 60
"""Attenuation, in dB, beyond which nothing is said to pass."""


def draw(name: str, title: str, width: int, height: int, paint: Callable[[Figure], None]) -> str:
    """Paint a figure of `width` by `height` CSS pixels and return it as one ``<svg>`` element.

    Parameters
    ----------
    name : str
        Name of the figure, unique in the page: it keeps the identifiers of its parts apart from others'.
    title : str
        What the figure shows, read out by screen readers; may not hold markup.
    """
    return _embed(settled(_painted(name, width, height, paint), f"{name}-{width}-"), title, width, height)


def _painted(name: str, width: int, height: int, paint: Callable[[Figure], None]) -> str:
    with mpl.rc_context(plain_parameters() | STYLE | {"svg.hashsalt": f"{name}-{width}"}):
        figure = Figure(figsize=(width / 72, height / 72), dpi=72, layout="constrained")
        paint(figure)
        return svg_text(figure)


def _embed(svg: str, title: str, width: int, height: int) -> str:
    """Strip a standalone SVG to the element that an HTML page wants, and hand its colours to the page."""
    body = svg[svg.index("<svg") :]
    body = body[body.index(">") + 1 :].removesuffix("\n")
    body = re.sub(r"<metadata>.*?</metadata>\s*", "", body, flags=re.DOTALL)
    body = re.sub(r'<g id="[^"]*"/>\s*', "", body)
    body = re.sub(r'<g id="[^"]*">', "<g>", body)
    body = re.sub(r"<!--.*?-->\s*", "", body)
    body = body.replace("xlink:href", "href")
    body = body.replace(' target="_blank"', "")  # a point leads to a place in the same page
    # before its release 3.11 matplotlib wrote size and family as one property
    body = re.sub(r"font: ([\d.]+px) [^;\"]*", r"font: \1 var(--sans)", body)
    body = re.sub(r"font-family: [^;\"]*", "font-family: var(--sans)", body)
    body = re.sub(r'(?<= )(d|x|y|width|height)="[^"]*"', _shorten, body)
    body = re.sub(r"\n\s*", "\n", body)
    for role, colour in COLOUR.items():
        body = body.replace(colour, f"var(--{role})")
    body, links = re.subn(r'<a href="#([a-z]+)-(\d+)">', r'<a href="#\1-\2" aria-label="\1 \2">', body)
    role = "group" if links else "img"  # what is within a picture cannot be reached
    return f'<svg viewBox="0 0 {width} {height}" role="{role}" aria-label="{title}">{body}'


def _shorten(attribute: re.Match[str]) -> str:
    """Round the numbers of an attribute to a hundredth of a pixel."""
    rounded = re.sub(r"\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}", attribute[0])
    return re.sub(r"\s+", " ", rounded)


def envelope(time: Array | Instants, values: Array, columns: int) -> tuple[Array, Array]:
    """Thin out a long trace so that no peak is lost.

    Parameters
    ----------
    time, values : ndarray, shape (n,)
        The trace.
    columns : int
        Number of stretches to divide it into.

    Returns
    -------
    time, values : ndarray, shape (m,) with m <= 2 * columns
        The smallest and the largest value of each stretch at their own times; a short trace as it is.
    """
    if len(values) <= 2 * columns:
        return time[:], values
    edges = np.linspace(0, len(values), columns + 1).astype(int)
    chosen = set()
    for start, stop in itertools.pairwise(edges):
        chosen.add(start + int(np.argmin(values[start:stop])))
        chosen.add(start + int(np.argmax(values[start:stop])))
    index = np.array(sorted(chosen))
    return time[index], values[index]


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


def clip(name: str, longest: int) -> str:
    """Shorten a name that is longer than `longest` characters."""
    return name if len(name) <= longest else name[: longest - 1] + "…"


def alternatives_figure(evidence: Evidence) -> str:
    """Largest errors of this design and its alternatives, with one LSB and the allowed error marked."""
    own = peak(evidence.run.error)
    rows = [(evidence.realization, own, "hardware")]
    rows += [(other.name, other.max_abs, "golden") for other in evidence.rivals]
    marks = [(evidence.facts.lsb, "muted"), (evidence.facts.max_error, "asked")]
    return ranking_figure(rows, marks, evidence.facts.unit, NARROW)


def frequency_axis(axes: Axes, frequency: Array) -> None:
    """Make the lower axis logarithmic, over all of `frequency`, in Hz."""
    axes.set_xscale("log")
    axes.set_xlim(float(frequency[0]), float(frequency[-1]))
    decades(axes.xaxis, float(frequency[0]), float(frequency[-1]), "Hz", 6)


def decades(axis: Axis, low: float, high: float, unit: str, labels: int) -> None:
    """Set the ticks of a logarithmic axis from `low` to `high`: one at every decade at least, `labels` with words.

    Less than two decades have ticks at 1, 2 and 5, less than half a one at all digits, the shortest spans even ones.
    Up to four decades have small ones at 2 to 9 between.
    """
    span = math.log10(high / low)
    subs = (1.0,) if span >= 2 else (1.0, 2.0, 5.0) if span > 0.5 else tuple(map(float, range(1, 10)))
    ends = math.floor(math.log10(low)), math.ceil(math.log10(high))
    places = [sub * 10.0**k for k in range(ends[0], ends[1] + 1) for sub in subs]
    places = [place for place in places if low * 0.999 <= place <= high * 1.001]
    if len(places) < 2:
        axis.set_major_locator(MaxNLocator(min(labels, 4)))
        axis.set_minor_locator(FixedLocator([]))
        axis.set_major_formatter(FuncFormatter(lambda v, _: quantity(v, unit)))
        return
    step = math.ceil(len(places) / labels)
    axis.set_major_locator(FixedLocator(places))
    small = [m * 10.0**k for k in range(*ends) for m in range(2, 10)] if span < 4 else []
    axis.set_minor_locator(FixedLocator([place for place in small if place not in places]))
    axis.set_minor_formatter(NullFormatter())
    named = places[::step]
    axis.set_major_formatter(FuncFormatter(lambda v, _: quantity(v, unit, 1) if v in named else ""))


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
        factor, unit = scale(float(np.nanmax(np.abs(difference))), "dB")
        lower.plot(frequency, difference * factor, color=COLOUR["hardware"])
        lower.set_ylabel(f"difference\nin {unit}")
        lower.yaxis.set_major_locator(MaxNLocator(3))
        lower.set_xlabel("frequency")
        frequency_axis(lower, frequency)

    return draw("magnitude", "Gain against frequency", NARROW, PANEL_HEIGHT, paint)


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
        factor, unit = scale(float(np.nanmax(np.abs(difference))), "deg")
        lower.plot(frequency, difference * factor, color=COLOUR["hardware"])
        lower.set_ylabel(f"difference\nin {unit}")
        lower.yaxis.set_major_locator(MaxNLocator(3))
        lower.set_xlabel("frequency")
        frequency_axis(lower, frequency)

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
