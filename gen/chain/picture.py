"""A chain as a picture: its end-to-end gain, that of each stage, and the limit of its aliasing, as SVG or PNG."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.golden import chain_gain, stage_gain
from sosmith.gen.picture import legend_below, picture
from sosmith.gen.report.plots import MOST_DB, frequency_axis
from sosmith.model.arrays import Values

_BLUE, _RED, _GREY = "#2563a8", "#b4432f", "#8a8f98"
_POINTS = 2000


def frequencies(design: ChainDesign) -> Values:
    """Return frequencies at the input in Hz, from far below the lowest rate to half the highest."""
    half = float(design.spec.base.sample_rate) / 2
    return np.geomspace(half / (100 * design.factor), half, _POINTS)


def level(gain: Values) -> Values:
    """Return magnitudes in dB, none below what is drawn."""
    return np.asarray(20 * np.log10(np.maximum(np.abs(gain), 10 ** (-MOST_DB / 20))), dtype=np.float64)


def chain_plot(design: ChainDesign, file_format: str) -> bytes:
    """Draw a chain; `file_format` is one of `sosmith.gen.picture.FORMATS`."""
    frequency = frequencies(design)

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        for k, stage in enumerate(design.stages):
            if stage.parts:
                style = ("-", "--", ":", "-.")[k % 4]
                gain = level(stage_gain(stage, frequency))
                axes.plot(frequency, gain, color=_GREY, lw=1.0, ls=style, label=stage.spec.name)
        axes.plot(frequency, level(np.abs(chain_gain(design, frequency))), color=_BLUE, lw=1.8, label="chain")
        if design.folding is not None:
            edge = float(design.spec.base.sample_rate) / (2 * design.factor)
            most = level(np.array([float(design.folding.gain)]))[0]
            axes.axvspan(edge, float(frequency[-1]), facecolor=_RED, alpha=0.08, lw=0)
            axes.plot(
                [edge, float(frequency[-1])], [most, most], color=_RED, lw=1.2, ls="--", label="proven aliasing limit"
            )
        axes.set(xlabel="frequency at the input", ylabel="gain (dB)")
        axes.set_title(f"Chain {design.name}", loc="left")
        axes.set_ylim(bottom=-160.0)
        frequency_axis(axes, frequency)
        legend_below(axes)

    return picture("chain", (7.5, 4.2), paint, file_format)
