"""Spectrum of a run of sound in dB of full scale: the output and its error."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sosmith.gen.report.curves import welch
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.figures.painting import COLOUR, Array, draw, frequency_axis

LEAST_SPECTRUM = 64
"""Samples below which nothing is to be seen."""

_SEGMENT = 4096
_BETA = 24.0
"""Of a Kaiser window, whose side lobes lie far below the noise of 24 bits."""

_MARGIN_DB = 12


def spectrum_figure(evidence: Evidence, width: int) -> str:
    """Draw the spectrum of hardware and of hardware minus exact calculation; see `levels`."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        assert evidence.facts.filter is not None  # as in all sound
        rate = evidence.facts.filter.sample_rate
        first = 0 if evidence.run.tone is None else evidence.run.tone.settled
        frequency, output = levels(evidence.run.hardware[first:], rate)
        _, error = levels(evidence.run.error[first:], rate)
        axes.plot(frequency, output, color=COLOUR["hardware"])
        axes.plot(frequency, error, color=COLOUR["golden"])
        axes.set_ylim(max(float(np.min(error)), -220.0) - _MARGIN_DB, max(float(np.max(output)), 0.0) + _MARGIN_DB / 2)
        axes.set_ylabel("level in dBFS")
        axes.set_xlabel("frequency")
        frequency_axis(axes, frequency)

    return draw("spectrum", "Spectrum of output and error", width, 310, paint)


def levels(values: Array, rate: float) -> tuple[Array, Array]:
    """Return frequencies in Hz, without zero, and the mean level there in dB of full scale, by Welch's method.

    A sine over the whole scale is at 0 dB, or up to 0.4 dB below where it lies between two lines. What is no sine, such
    as noise, is shown by the power in a line, which grows with the length of a segment of up to `_SEGMENT` samples.
    """
    window = np.kaiser(min(_SEGMENT, len(values)) + 1, _BETA)[:-1]  # of a period, with its largest value in the middle
    frequency, power = welch(values, rate, window)
    return frequency[1:], 10 * np.log10(np.maximum(2 * power[1:] / window.sum() ** 2, 1e-30))
