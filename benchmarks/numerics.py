"""Measures every realization and writes docs/numerics.md with its plot: `python benchmarks/numerics.py`.

With `--check` nothing is written; the exit status says whether the document is what this run gives.
"""

from __future__ import annotations

import io
import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from scipy import signal

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.cost import cost_of
from sosmith.gen.design import decay_length
from sosmith.gen.linear_model import linear_model
from sosmith.gen.realizations import REALIZATIONS, SectionFormat
from sosmith.gen.specification import load
from sosmith.model.golden import calibrated, filtered

ROOT = Path(__file__).resolve().parent.parent
SPECIFICATIONS = ("audio_lowpass", "flange_wear_locomotive")
QUALITY = 2.24698  # of the section that is plotted: the highest of a 7th-order Butterworth filter
CUTOFFS = np.geomspace(5e-4, 5e-2, 21)  # over the sample rate
SEED = 1


@dataclass(frozen=True)
class Row:
    """One realization of one filter, as the table shows it."""

    name: str
    coefficient_bits: int
    states: str
    multipliers: str
    bound: float
    worst: float
    rms: float


def measure(design: CoreDesign) -> Row:
    """Run noise, both rails and a small step, and the sign-matched worst case, through the integer model."""
    quantized, datapath = design.quantized, design.datapath
    assert quantized.filter is not None
    (port,) = datapath.inputs
    rng = np.random.default_rng(SEED)
    response = quantized.filter.impulse_response
    ends = np.array([port.lowest, port.highest])
    worst_case = ends[(response[::-1] > 0).astype(int)]
    settle = len(response)
    parts = [
        rng.integers(port.lowest, port.highest + 1, 200_000),
        *(np.full(settle, level) for level in (port.highest, port.lowest, (port.lowest + port.highest) // 2 + 3)),
        worst_case,
    ]
    codes = np.concatenate(parts).reshape(-1, 1)
    golden = filtered(calibrated(codes, datapath.inputs, None), quantized.filter.sos, datapath.output)
    error = (datapath.output.decode(datapath.compute(codes)) - golden) / float(datapath.output.lsb)
    states = [section.graph.nodes[i].width for section in quantized.sections for i in section.graph.delays]
    return Row(
        name=quantized.realization,
        coefficient_bits=quantized.coefficient_bits,
        states=f"{min(states)}..{max(states)}, {sum(states)} in all",
        multipliers=cost_of(datapath).multiplier_sizes,
        bound=float(quantized.bound),
        worst=float(np.abs(error).max()),
        rms=float(np.sqrt(np.mean(error**2))),
    )


def table(name: str) -> str:
    """Markdown table of all realizations of one example's filter."""
    lines = [
        "| realization | coefficient bits | state bits (each, sum) | multipliers (bits x bits) "
        "| bound (LSB) | worst found (LSB) | rms (LSB) |",
        "|---|---|---|---|---|---|---|",
    ]
    for realization in REALIZATIONS:
        row = measure(design_core(load(ROOT / "examples" / f"{name}.toml"), core="filter", realization=realization))
        lines.append(
            f"| {row.name} | {row.coefficient_bits} | {row.states} | {row.multipliers} "
            f"| {row.bound:.4f} | {row.worst:.4f} | {row.rms:.4f} |"
        )
    return "\n".join(lines)


def noise_gain(realization: str, cutoff: float) -> float:
    """Power gain from all quantizers of one unity-gain low-pass section to its output, each of the same variance."""
    u = np.tan(np.pi * cutoff)
    a0 = 1 + u / QUALITY + u * u
    row = (u * u / a0, 2 * u * u / a0, u * u / a0, 1.0, 2 * (u * u - 1) / a0, (1 - u / QUALITY + u * u) / a0)
    stage = REALIZATIONS[realization].build(row, SectionFormat(coefficient_bits=40), "section")
    model = linear_model(stage.graph)
    a = [float(value) for value in model.denominator]
    impulse = np.zeros(decay_length(np.array([[1.0, 0, 0, *a, *[0.0] * (3 - len(a))]])))
    impulse[0] = 1
    gain = 0.0
    for source in model.sources:
        if source.name not in {"input", "constant"}:
            taps = [float(value) for value in source.numerators[model.output]]
            gain += float(np.sum(signal.lfilter(taps, a, impulse) ** 2))
    return gain


def plot() -> tuple[str, dict[str, float]]:
    """SVG of noise gain against cutoff, and the slope of each realization in dB per decade, fitted to it."""
    figure = Figure(figsize=(8, 5), layout="constrained")
    FigureCanvasSVG(figure)
    axes = figure.add_subplot()
    slopes = {}
    for realization in REALIZATIONS:
        decibels = np.array([10 * np.log10(noise_gain(realization, cutoff)) for cutoff in CUTOFFS])
        slopes[realization] = float(np.polyfit(np.log10(CUTOFFS), decibels, 1)[0])
        axes.semilogx(CUTOFFS, decibels, label=f"{realization} ({slopes[realization]:+.1f} dB/decade)")
    axes.set_xlabel("cutoff over sample rate")
    axes.set_ylabel("noise gain in dB, all quantizers at one width")
    axes.grid(visible=True, which="both", alpha=0.3)
    axes.legend()
    text = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "sosmith"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue(), slopes


def document() -> dict[str, str]:
    """Texts of the document and its plot, by path from the root."""
    svg, slopes = plot()
    sections = "\n\n".join(f"## {name}\n\n{table(name)}" for name in SPECIFICATIONS)
    slope_rows = "\n".join(f"| {name} | {REALIZATIONS[name].title} | {slope:+.1f} |" for name, slope in slopes.items())
    text = f"""# Numerics of the realizations, side by side

Written by `python benchmarks/numerics.py`; nothing here is typed in. The filter core alone, at one output LSB of
allowed error. The bound is proven for every input; "worst found" is the largest error of the integer model against
the double-precision golden chain on noise, rails, a small step and the sign-matched worst case.

{sections}

## Rounding noise against the cutoff

One section of Q = {QUALITY}, every quantizer at the same width. Plain direct forms lose 30 dB for each decade that
the cutoff goes down, first-order error feedback 10, second-order none.

![noise gain](images/noise.svg)

| realization | | slope, dB per decade of the cutoff |
|---|---|---|
{slope_rows}
"""
    return {"docs/numerics.md": text, "docs/images/noise.svg": svg}


def main() -> None:
    """Write or check the document."""
    texts = document()
    if "--check" in sys.argv[1:]:
        stale = [name for name, text in texts.items() if (ROOT / name).read_text(encoding="utf-8") != text]
        sys.exit(f"out of date: {', '.join(stale)}" if stale else 0)
    for name, text in texts.items():
        (ROOT / name).parent.mkdir(parents=True, exist_ok=True)
        (ROOT / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
