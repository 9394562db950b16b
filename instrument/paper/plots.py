"""Pictures of the comparison with the paper, as SVG; the same figures give the same bytes."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sosmith.gen.picture import picture
from sosmith.instrument.paper.accuracy import TABLES, errors_in_mm
from sosmith.instrument.paper.arithmetic import Coefficients, gain_db, poles
from sosmith.instrument.paper.difference_equation import printed_filter, step_response
from sosmith.instrument.paper.fifth_order import equation_16_filter, exact, table_3_filter
from sosmith.instrument.paper.figures import PaperFigures
from sosmith.instrument.paper.seventh_order import (
    HUNTING,
    delay,
    irregularity_frequency,
    proper_cutoff,
    proper_filter,
    stated_cutoff,
    table_9_filter,
)
from sosmith.model.arithmetic.elementary import geometric

_BLUE, _RED, _GREEN, _GREY = "#2563a8", "#b4432f", "#2f8a57", "#8a8a8a"
_COLOURS = (_BLUE, _RED, _GREEN)

Digital = tuple[Coefficients, Coefficients]


def plots(figures: PaperFigures) -> dict[str, str]:
    """SVG text of each picture, by file name."""
    return {
        "paper_errors.svg": _draw(lambda figure: _errors(figure, figures)),
        "paper_fifth_order.svg": _draw(lambda figure: _fifth_order(figure, figures)),
        "paper_seventh_order.svg": _draw(lambda figure: _seventh_order(figure, figures)),
        "paper_poles.svg": _draw(lambda figure: _poles(figure, figures), height=4.4),
    }


def _draw(paint: Callable[[Figure], None], height: float = 3.4) -> str:
    return picture("paper", (9, height), paint, style={"text.parse_math": True}).decode()


def _errors(figure: Figure, figures: PaperFigures) -> None:
    """Draw the errors of tables 1, 2 and 4 under both readings."""
    percent, length = figure.subplots(1, 2)
    for name, colour, marker in zip(TABLES, _COLOURS, "o^s", strict=True):
        clearances = [float(value) for value in figures.numbers(name, "clearance")]
        printed = [float(value) for value in figures.numbers(name, "percent")]
        label = name.replace("_", " ")
        percent.plot(clearances, printed, marker, ls="-", lw=0.8, ms=4, color=colour, label=label)
        length.plot(clearances, errors_in_mm(figures, name), marker, ls="-", lw=0.8, ms=4, color=colour, label=label)
        errors = [float(value) for value in figures.numbers(name, "error")]
        length.plot(clearances, errors, marker, ls=":", lw=0.8, ms=4, mfc="none", color=colour)
    percent.set(xlabel="clearance (mm)", ylabel="percentage as printed (%)", ylim=(0, None))
    percent.legend()
    length.set(xlabel="clearance (mm)", ylabel="error (mm)", ylim=(0, None))
    length.set_title("filled: the printed error is relative; hollow: in mm", loc="left", fontsize=9)


def _fifth_order(figure: Figure, figures: PaperFigures) -> None:
    rate = float(figures.number("equation_10", "sample_rate"))
    printed_rate = 1 / float(figures.number("equation_17", "period"))
    as_printed = exact(figures, "equation_18", "numerator"), exact(figures, "equation_18", "denominator")
    cutoff = figures.number("table_3", "prewarped_cutoff")
    responses: list[tuple[str, Digital, float]] = [
        (f"table 3, $\\Omega_c$ = {cutoff} rad/s", table_3_filter(figures), rate),
        ("equation 16", equation_16_filter(figures), printed_rate),
        ("equation 18 as printed", as_printed, printed_rate),
    ]
    edges = [float(figures.number("equation_10", f"{band}_edge")) for band in ("passband", "stopband")]
    losses = [float(figures.number("equation_12", f"{band}_loss")) for band in ("passband", "stopband")]
    whole, close = figure.subplots(1, 2)
    for axes, limits in ((whole, (-80.0, 5.0)), (close, (-1.0, 0.25))):
        _responses(axes, responses, 0.03)
        _mask(axes, edges, losses, 0.03, rate / 2, limits)
    whole.legend()
    close.set_title("pass band, close", loc="left", fontsize=9)


def _seventh_order(figure: Figure, figures: PaperFigures) -> None:
    rate = float(figures.number("table_9", "sample_rate"))
    stated, proper = float(stated_cutoff(figures)), proper_cutoff(figures)
    responses: list[tuple[str, Digital, float]] = [
        (f"table 9, $\\Omega_c$ = {stated:g} rad/s", table_9_filter(figures), rate),
        (
            f"{figures.number('table_9', 'passband_edge')} Hz pre-warped, $\\Omega_c$ = {proper:.4g} rad/s",
            proper_filter(figures),
            rate,
        ),
    ]
    edges = [float(figures.number("table_9", f"{band}_edge")) for band in ("passband", "stopband")]
    losses = [float(figures.number("table_9", f"{band}_loss")) for band in ("passband", "stopband")]
    magnitude, step = figure.subplots(1, 2)
    _responses(magnitude, responses, 0.05)
    _mask(magnitude, edges, losses, 0.05, rate / 2, (-260.0, 10.0))
    for frequency, what in ((HUNTING, "hunting"), (irregularity_frequency(figures), "irregularity")):
        magnitude.axvline(frequency, color=_GREY, lw=0.8)
        magnitude.annotate(what, (frequency, -5), rotation=90, ha="right", va="top", color=_GREY)
    magnitude.legend(loc="lower left")
    step.plot(*step_response(figures), color=_BLUE)
    step.axhline(1, color=_GREY, lw=0.8)
    step.axvline(delay(stated), color=_RED, lw=0.8, ls="--", label=f"delay at 0 Hz, {delay(stated):.2f} s")
    step.set(xlabel="time (s)", ylabel="output for a step", xlim=(0, 15))
    step.legend()


def _poles(figure: Figure, figures: PaperFigures) -> None:
    """Draw the poles of table 10 as printed, and the exact ones, these also enlarged."""
    whole, close = figure.subplots(1, 2)
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 721))
    printed = np.array(poles(printed_filter(figures)[1]))
    exactly = np.array(poles(table_9_filter(figures)[1]))
    for axes in (whole, close):
        axes.plot(circle.real, circle.imag, color=_GREY, lw=0.8)
        axes.plot(exactly.real, exactly.imag, "x", color=_BLUE, ms=6, label="exact")
        axes.plot(printed.real, printed.imag, "o", mfc="none", color=_RED, ms=6, label="as printed")
        axes.set_aspect("equal")
        axes.set(xlabel="real part of z", ylabel="imaginary part of z")
    whole.legend(loc="lower left")
    arc = np.exp(1j * np.linspace(-0.02, 0.02, 101))
    close.plot(arc.real, arc.imag, color=_GREY, lw=0.8)
    close.set(xlim=(0.98, 1.004), ylim=(-0.018, 0.018))
    close.set_title("close to z = 1", loc="left", fontsize=9)


def _responses(axes: Axes, responses: list[tuple[str, Digital, float]], lowest: float) -> None:
    for (label, filter_, rate), colour, dashes in zip(responses, _COLOURS, ("-", "--", ":"), strict=False):
        frequencies = geometric(lowest, 0.499 * rate, 250)
        gains = [gain_db(*filter_, float(Fraction(f)), rate) for f in frequencies]
        axes.semilogx(frequencies, gains, dashes, color=colour, label=label)
    axes.set(xlabel="frequency (Hz)", ylabel="gain (dB)")


def _mask(
    axes: Axes, edges: list[float], losses: list[float], lowest: float, highest: float, limits: tuple[float, float]
) -> None:
    """Shade the regions outside the mask: below the pass band's loss, above the stop band's."""
    axes.set_ylim(*limits)
    shade: dict[str, Any] = {"color": _GREY, "alpha": 0.25, "lw": 0}
    axes.fill_between([lowest, edges[0]], limits[0], max(-losses[0], limits[0]), **shade)
    if edges[1] < highest:
        axes.fill_between([edges[1], highest], max(-losses[1], limits[0]), limits[1], **shade)
