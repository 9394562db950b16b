"""Plots spectra with the mask and the response of the proposed filter, as an SVG or PNG file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from sosmith.gen.filter.response import magnitude_db
from sosmith.gen.picture import AMBER, BLUE, GREEN, PURPLE, RED, SKY, legend_below, picture
from sosmith.instrument.spectrum.proposal import Proposal
from sosmith.instrument.spectrum.spectra import Array, Spectrum
from sosmith.model.arithmetic.elementary import geometric

_COLOURS = (BLUE, RED, GREEN, PURPLE, AMBER, SKY)
_PLAIN = FuncFormatter(lambda value, _: f"{value:g}")
_DECADES = 8.0
"""Decades of density that are drawn below the highest; rounding errors are lower."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Curve:
    """A spectrum with its name and unit.

    Attributes
    ----------
    name : str
        For the legend.
    unit : str
        Unit of the signal; curves with the same unit share a panel.
    spectrum : Spectrum
        The spectrum.
    """

    name: str
    unit: str
    spectrum: Spectrum


def spectrum_plot(curves: Sequence[Curve], proposal: Proposal | None, file_format: str) -> bytes:
    """Draw the spectra in one panel for each unit, and below them mask and response of the proposal, if there is one.

    Parameters
    ----------
    curves : sequence of Curve
        At least one.
    proposal : Proposal or None
        Filter whose bands are shaded in the panel of the first unit.
    file_format : str
        One of `sosmith.gen.picture.FORMATS`.
    """
    units = list(dict.fromkeys(curve.unit for curve in curves))
    panels = len(units) + (proposal is not None)
    lowest = min(curve.spectrum.step for curve in curves)
    highest = max(float(curve.spectrum.frequency[-1]) for curve in curves)

    def paint(figure: Figure) -> None:
        all_axes = figure.subplots(panels, 1, sharex=True, squeeze=False)[:, 0]
        for axes, unit in zip(all_axes, units, strict=False):
            _draw_density(axes, [curve for curve in curves if curve.unit == unit], unit)
            if proposal is not None and unit == units[0]:
                _shade(axes, proposal, lowest, highest)
        if proposal is not None:
            _draw_response(all_axes[-1], proposal, lowest, highest)
        all_axes[-1].set(xscale="log", xlim=(lowest, highest), xlabel="frequency (Hz)")
        all_axes[-1].xaxis.set_major_locator(LogLocator(numticks=99))
        all_axes[-1].xaxis.set_major_formatter(_PLAIN)

    return picture("spectrum", (9, 1 + 3 * panels), paint, file_format, style={"lines.linewidth": 1.1})


def _draw_density(axes: Axes, curves: Sequence[Curve], unit: str) -> None:
    top = max(float(np.max(curve.spectrum.density[1:])) for curve in curves)
    floor = top * 10**-_DECADES if top > 0 else 1e-12
    for k, curve in enumerate(curves):
        if np.max(curve.spectrum.density[1:]) < floor:
            continue
        found, colour = curve.spectrum, _COLOURS[k % len(_COLOURS)]
        frequency, density = found.frequency[1:], np.maximum(found.density[1:], floor)
        axes.plot(frequency, np.sqrt(density), color=colour, label=curve.name)
        low, high = (np.sqrt(density * factor) for factor in (found.lower, found.upper))
        axes.fill_between(frequency, low, high, color=colour, alpha=0.15, lw=0)
    ends = (float(np.sqrt(floor)), float(np.sqrt(top)) * 10**0.5 if top > 0 else 1.0)
    axes.set(xscale="log", yscale="log", ylim=ends, ylabel=f"{unit or 'value'}/√Hz")
    axes.yaxis.set_major_locator(LogLocator(numticks=99))
    axes.yaxis.set_major_formatter(_PLAIN)
    axes.set_title("Spectral density, with its confidence interval", loc="left")
    legend_below(axes, 0.06)


def _shade(axes: Axes, proposal: Proposal, lowest: float, highest: float) -> None:
    axes.axvspan(lowest, proposal["passband_edge"], color=_COLOURS[2], alpha=0.08, lw=0)
    axes.axvspan(proposal["stopband_edge"], highest, color=RED, alpha=0.08, lw=0)


def _draw_response(axes: Axes, proposal: Proposal, lowest: float, highest: float) -> None:
    made = proposal.filter
    frequency: Array = geometric(lowest, highest, 1200)
    bottom = -max(40.0, 2 * proposal["stopband_loss"])
    axes.plot(frequency, magnitude_db(made.sos, frequency, made.sample_rate), color=_COLOURS[0])
    for ends, border, end in (
        ((lowest, proposal["passband_edge"]), -proposal["passband_loss"], bottom),
        ((proposal["stopband_edge"], highest), -proposal["stopband_loss"], 3.0),
    ):
        axes.fill_between(ends, border, end, facecolor=RED, alpha=0.16, lw=0)
        axes.plot(ends, [border, border], color=RED, lw=1.0)
    axes.set(ylim=(bottom, 3.0), ylabel="gain (dB)")
    title = f"Filter of order {made.order}, delay {proposal.delay:.3g} s; the mask forbids what is red"
    axes.set_title(title, loc="left")
