"""Measures every realization and writes docs/numerics.md with its plot: `python -m benchmarks.numerics`.

With `--check` nothing is written; the exit status tells whether the document is up to date.
"""

from __future__ import annotations

import io
import sys
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import matplotlib
import numpy as np
from benchmarks import budgets, published
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from scipy import signal

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.design import decay_length
from sosmith.gen.picture import settled
from sosmith.gen.proof.linear_model import linear_model
from sosmith.gen.realizations.noise import minimum_gain, second_order_modes
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.gen.realizations.state_space import minimum_noise
from sosmith.gen.specification.specification import Specification, load
from sosmith.gen.word_lengths.cost import LUTS_OF_A_BLOCK
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.arrays import Codes
from sosmith.model.errors import ShortfallError
from sosmith.model.reference.golden import entering_filter, filtered
from sosmith.model.sections.truncated_products import constants_of

ROOT = Path(__file__).resolve().parent.parent
SPECIFICATIONS = ("audio_lowpass", "flange_wear_locomotive")
QUALITY = published.qualities(7)[0]  # of the section that is plotted: the highest of a 7th-order Butterworth filter
CUTOFFS = np.geomspace(5e-4, 5e-2, 41)  # over the sample rate
SLOPES = (-30, -10, 0)  # dB per decade, drawn for reference
COEFFICIENT_BITS = 40  # of the section that is plotted
NOISE_SAMPLES = 200_000
FAST = Fraction(120_000_000)
"""Clock in Hz that sections with look-ahead are designed for."""
SEED = 1


@dataclass(frozen=True)
class Row:
    """One realization of one filter: a row of the table."""

    coefficient_bits: str
    states: str
    multipliers: str
    bound: float
    worst: float
    rms: float
    area: int


def stimulus(design: CoreDesign) -> Codes:
    """Return white noise, both rails and a small step until settled, and the worst cases of all error paths."""
    assert design.quantized.filter is not None
    (port,) = design.datapath.inputs
    settle = len(design.quantized.filter.impulse_response)
    levels = (port.highest, port.lowest, (port.lowest + port.highest) // 2 + 3)
    parts = [
        np.random.default_rng(SEED).integers(port.lowest, port.highest + 1, NOISE_SAMPLES),
        *(np.full(settle, level) for level in levels),
        traces_for(design, "worst_case", seed=SEED)[0].codes[:, 0],
        traces_for(design, "worst_case_errors", seed=SEED)[0].codes[:, 0],
    ]
    return np.concatenate(parts).reshape(-1, 1)


def measure(design: CoreDesign) -> Row:
    """Run the stimulus through the integer model and the golden chain."""
    quantized, datapath = design.quantized, design.datapath
    assert quantized.filter is not None
    codes = stimulus(design)
    values = entering_filter(codes, datapath, None)
    golden = filtered(values, quantized.filter.sos, datapath.output, steady=quantized.steady)
    error = (datapath.output.decode(datapath.compute(codes)) - golden) / float(datapath.output.lsb)
    graphs = [section.graph for section in quantized.sections]
    coefficients = [abs(by.integer).bit_length() for graph in graphs for by in constants_of(graph).values()]
    states = [section.graph.nodes[i].width for section in quantized.sections for i in section.graph.delays]
    return Row(
        coefficient_bits=f"{min(coefficients)}..{max(coefficients)}" if coefficients else "none",
        states=f"{min(states)}..{max(states)}, {sum(states)} in all",
        multipliers=design.architecture.cost.multiplier_sizes,
        bound=float(quantized.bound),
        worst=float(np.abs(error).max()),
        rms=float(np.sqrt(np.mean(error**2))),
        area=round(design.architecture.cost.area),
    )


def others(spec: Specification) -> list[tuple[str, Specification, None]]:
    """Return other ways to compute the same filter: a name for each, and the specification that asks for it."""
    hardware = spec.hardware
    fast = replace(hardware, pipeline="look-ahead", clock=FAST)
    return [
        ("without multipliers", replace(spec, hardware=replace(hardware, multipliers=0)), None),
        (f"look-ahead for {FAST / 10**6} MHz", replace(spec, hardware=fast), None),
        ("on-line arithmetic", replace(spec, hardware=replace(hardware, architecture="online")), None),
        ("decimated", replace(spec, filter=replace(spec.filter, decimate="auto")), None),
    ]


def table(name: str) -> str:
    """Return a Markdown table of all realizations of one example's filter."""
    spec = load(ROOT / "examples" / f"{name}.toml")
    lines = [
        f"Allowed: {float(spec.max_error / spec.output.lsb):.4f} LSB.",
        "",
        "| realization | coefficient bits | state bits (each, sum) | multipliers (bits x bits) | bound (LSB) "
        "| worst found (LSB) | worst / bound | rms (LSB) | estimated area (LUT4) |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    plain = replace(spec, hardware=replace(spec.hardware, architecture="parallel"))
    for label, wanted, realization in (*((name, plain, name) for name in SECTIONS), *others(plain)):
        try:
            design = design_core(wanted, core="filter", realization=realization)
        except ShortfallError as error:
            lines.append(f"| {label} | refused: {error} |" + " |" * 7)
            continue
        if wanted.filter.decimate and design.datapath.decimator is None:
            continue
        row = measure(design)
        chosen = "" if realization else f", {design.quantized.realization}"
        lines.append(
            f"| {label}{chosen} | {row.coefficient_bits} | {row.states} | {row.multipliers} | {row.bound:.4f} "
            f"| {row.worst:.4f} | {100 * row.worst / row.bound:.0f} % | {row.rms:.4f} | {row.area:,} |"
        )
    return "\n".join(lines)


def noise_gain(realization: str, cutoff: float) -> float:
    """Return the noise power gain of a unity-gain low-pass section, from all quantizers with equal variance."""
    words = SectionFormat(coefficient_bits=COEFFICIENT_BITS)
    stage = SECTIONS[realization].build(published.lowpass(cutoff, QUALITY), words, "section")
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


def noise_curve(realization: str) -> list[float] | str:
    """Return the noise gain in dB at each cutoff, or the reason why there is none."""
    try:
        return [10 * float(np.log10(noise_gain(realization, cutoff))) for cutoff in CUTOFFS]
    except ShortfallError as error:
        return f"refused: {error}"


def slope_of(decibels: list[float]) -> float:
    """Return the fitted slope in dB per decade of the cutoff."""
    return float(np.polyfit(np.log10(CUTOFFS), decibels, 1)[0])


def plot(curves: dict[str, list[float] | str]) -> str:
    """Return an SVG of noise gain in dB against cutoff, by realization."""
    with matplotlib.rc_context({"svg.hashsalt": "sosmith", "svg.fonttype": "none"}):
        figure = Figure(figsize=(8, 5.5), layout="constrained")
        FigureCanvasSVG(figure)
        axes = figure.add_subplot()
        for style, (realization, decibels) in enumerate(curves.items()):
            if isinstance(decibels, str):
                continue
            dashes = ("-", "--", "-.", ":")[style % 4]  # curves overlap
            axes.semilogx(CUTOFFS, decibels, dashes, label=f"{realization} ({slope_of(decibels):+.1f} dB/decade)")
        ends = CUTOFFS[[0, -1]]
        for slope in SLOPES:
            axes.semilogx(ends, -6 + slope * np.log10(ends / ends[1]), color="0.6", lw=0.8)
            axes.annotate(f"{slope} dB/decade", (ends[0], -6 + slope * np.log10(ends[0] / ends[1])), color="0.4")
        axes.set_xlabel("cutoff over sample rate")
        axes.set_ylabel("noise gain in dB, all quantizers at one width")
        axes.grid(visible=True, which="both", alpha=0.3)
        axes.legend()
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    return settled(text.getvalue())


def slope_table(curves: dict[str, list[float] | str]) -> str:
    """Return a Markdown table of the slopes."""
    rows = []
    for name, curve in curves.items():
        slope = curve if isinstance(curve, str) else f"{slope_of(curve):+.1f}"
        rows.append(f"| {name} | {SECTIONS[name].terms.title} | {slope} |")
    return "\n".join(["| realization | | slope, dB per decade of the cutoff |", "|---|---|---|", *rows])


def jenssen_table() -> str:
    """Return a Markdown table of the figures for a 10th-order cascade, ours and the published ones."""
    lines = [
        "| structure | noise gain | published | estimated variance | published | simulated variance | published |",
        "|---|---|---|---|---|---|---|",
    ]
    for structure, (gain, estimate, simulated) in published.JENSSEN.items():
        lines.append(
            f"| {structure} | {published.jenssen_gain(structure):.2f} | {gain:.2f} "
            f"| {published.jenssen_estimate(structure):.2f} | {estimate:.2f} "
            f"| {published.jenssen_simulated(structure):.2f} | {simulated:.2f} |"
        )
    return "\n".join(lines)


def section_table() -> str:
    """Return a Markdown table of the least noise of sections at two cutoffs, with published figure and closed form."""
    lines = [
        "| order of the filter | Q of the section | gain at 0.0026 | gain at 0.1 | figure | Q^2/2 + 1/8 |",
        "|---|---|---|---|---|---|",
    ]
    for order, figures in published.SECTION_GAINS.items():
        for q, figure in zip(published.qualities(order), figures, strict=True):
            low, high = (
                minimum_gain(second_order_modes(minimum_noise(published.lowpass(cutoff, q)).system))
                for cutoff in (0.0026, 0.1)
            )
            lines.append(f"| {order} | {q:.5f} | {low:.6f} | {high:.6f} | {figure:.6f} | {q * q / 2 + 1 / 8:.6f} |")
    return "\n".join(lines)


def order_table() -> str:
    """Return a Markdown table of the least noise of whole filters, with published figures."""
    lines = ["| order | least noise gain | figure |", "|---|---|---|"]
    for order, figure in enumerate(published.BUTTERWORTH_GAINS, start=1):
        lines.append(f"| {order} | {published.butterworth_gain(order):.6f} | {figure:.6f} |")
    return "\n".join(lines)


def document() -> dict[str, str]:
    """Return the texts of the document and its plot, by path from the root."""
    curves = {name: noise_curve(name) for name, realization in SECTIONS.items() if realization.cascade}
    sections = "\n\n".join(f"## {name}\n\n{table(name)}" for name in SPECIFICATIONS)
    text = f"""# Numerics of the realizations, side by side

Written by `python -m benchmarks.numerics`; no figure is typed in. The filter core alone, within the allowed error of
its specification. The bound is proven for every input. "Worst found" is the largest error of the integer model
against the double-precision golden chain on noise, rails, a small step, and the sign-matched worst cases of the whole
filter and of the path from every quantizer to the output. The area is estimated for an ECP5 in the parallel
architecture, a multiplier block counted as {LUTS_OF_A_BLOCK} LUT4. Below the realizations stand other ways to compute
the same filter, with the realization that `auto` takes in each: products by constants made of adders; recursions over
several samples at once, whose pipeline registers are not in the estimate; sections on signed digits; and, where `auto`
decimates, the filter at the lower rate, against its exact multirate chain.

{sections}

## Error budgets

{budgets.section()}

## Rounding noise against the cutoff

One section of Q = {QUALITY:.5f}, every quantizer with the same word length: output noise relative to the noise of one
quantizer. Plain direct forms lose 30 dB per decade of lower cutoff. First-order error feedback loses 10 dB, and so does
the delta form, whose noise is that of its states. Second-order error feedback loses nothing, and neither do state-space
forms with scaled states, apart from the steps of scaling by powers of two.

![noise gain](images/noise.svg)

{slope_table(curves)}

## Least noise of any structure

If all state words are scaled equally, no state-space coordinates give less noise than
(sum of the second-order modes)^2 / n: for a Butterworth section Q^2/2 + 1/8, for any cutoff.

{section_table()}

A whole Butterworth low-pass as one system:

{order_table()}

## Jenssen's table

Butterworth low-pass of order 10 at 0.1 of the sample rate, 10-bit coefficients, state words that hold plus or minus
{published.DELTA:g} standard deviations of their states; gains, and variances in squares of an LSB, with those
published (Jenssen, Design of IIR Filters). The simulation runs {published.SAMPLES:,} samples of uniform noise.

{jenssen_table()}
"""
    return {"docs/numerics.md": text, "docs/images/noise.svg": plot(curves)}


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
