"""The step response of the filter with integer coefficients, with its overshoot and settling time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sosmith.gen.filter.step_response import SETTLED, StepResponse
from sosmith.gen.quantity import scale
from sosmith.gen.report.figures.painting import COLOUR, NARROW, PANEL_HEIGHT, draw, envelope


def step_figure(step: StepResponse) -> str:
    """Output after a unit step, with its final value, the band of its tolerance, overshoot and settling time."""
    settled = step.samples_to(SETTLED)
    samples = min(len(step.values), max(16, round(1.6 * settled)))
    time, values = np.arange(samples) / step.sample_rate, step.values[:samples]

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        factor, unit = scale(float(time[-1]), "s")
        tolerance = SETTLED * step.scale
        axes.axhspan(step.final - tolerance, step.final + tolerance, facecolor=COLOUR["truth"], alpha=0.18, lw=0)
        axes.axhline(step.final, color=COLOUR["truth"], lw=1.2)
        thin_time, thin = envelope(time, values, NARROW)
        if samples <= 60:
            axes.step(thin_time * factor, thin, where="post", color=COLOUR["hardware"], lw=2.0)
        else:
            axes.plot(thin_time * factor, thin, color=COLOUR["hardware"], lw=2.0)
        axes.axvline(settled / step.sample_rate * factor, color=COLOUR["limit"], lw=1.6, ls="--")
        if step.overshoot:
            peak = int(np.argmax(values / step.final))
            axes.plot([time[peak] * factor], [values[peak]], color=COLOUR["asked"], marker="o", ms=8)
        axes.set_xlim(0, float(time[-1]) * factor)
        axes.margins(y=0.08)
        axes.set_xlabel(f"time after the step in {unit}")
        axes.set_ylabel("output for a step of 1")

    return draw("step", "Step response", NARROW, PANEL_HEIGHT, paint)
