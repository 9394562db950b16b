"""A chain as a picture: its end-to-end gain, that of each stage, and the limit of its aliasing, as SVG or PNG."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.facts import limits
from sosmith.gen.chain.ideal import chain_gain, frequencies, level, stage_gain
from sosmith.gen.picture import legend_below, picture
from sosmith.gen.report.figures.painting import frequency_axis

_BLUE, _RED, _GREY = "#2563a8", "#b4432f", "#8a8f98"
POINTS = 2000
"""Frequencies of a curve."""


def axis_label(design: ChainDesign) -> str:
    """Say what the frequencies are."""
    return "frequency at the input" if design.rise == 1 else "frequency at the highest rate"


def chain_plot(design: ChainDesign, file_format: str) -> bytes:
    """Draw a chain; `file_format` is one of `sosmith.gen.picture.FORMATS`."""
    frequency = frequencies(design, POINTS)

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        for k, stage in enumerate(design.stages):
            if stage.parts:
                style = ("-", "--", ":", "-.")[k % 4]
                gain = level(stage_gain(stage, frequency))
                axes.plot(frequency, gain, color=_GREY, lw=1.0, ls=style, label=stage.spec.name)
        axes.plot(frequency, level(np.abs(chain_gain(design, frequency))), color=_BLUE, lw=1.8, label="chain")
        for edge, end, most, name in limits(design):
            axes.axvspan(edge, end, facecolor=_RED, alpha=0.08, lw=0)
            axes.plot([edge, end], [most, most], color=_RED, lw=1.2, ls="--", label=f"proven {name} limit")
        axes.set(xlabel=axis_label(design), ylabel="gain (dB)")
        axes.set_title(f"Chain {design.name}", loc="left")
        axes.set_ylim(bottom=-160.0)
        frequency_axis(axes, frequency)
        legend_below(axes)

    return picture("chain", (7.5, 4.2), paint, file_format)
