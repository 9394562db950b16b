"""The parts of error budgets, and how near inputs come to the bound: a section of docs/numerics.md.

`benchmarks.numerics` writes it: the three examples, and random filters.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import numpy as np
from benchmarks.random_designs import random_specification
from benchmarks.steering import steered

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification.specification import from_text, load
from sosmith.gen.word_lengths.input_stage import normalised
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.horner import HornerStep

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ("audio_lowpass", "flange_wear_bench", "flange_wear_locomotive")
RANDOM = 20
"""Random filters."""
SEED = 1
NOISE = 50_000
"""Samples of noise over all codes."""
HEAD = (
    "| design | realization | calibration | coefficients | filter rounding | start | output rounding | bound "
    "| largest error reached | share | program or area |",
    "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
)
_PARTS = ("filter coefficients", "filter rounding", "start", "output rounding")


def reached(design: CoreDesign) -> float:
    """Return the largest error that inputs reach, in output LSBs: noise, worst cases of the parts, steered ones."""
    rng = np.random.default_rng(SEED)
    ports = design.datapath.inputs
    noise = np.stack([rng.integers(port.lowest, port.highest + 1, NOISE) for port in ports], axis=1)[:, np.newaxis, :]
    traces = (traces_for(design, name, seed=SEED)[0].codes for name in ("worst_case", "worst_case_errors"))
    inputs = [noise, *(codes.reshape(-1, 1, len(ports)) for codes in traces)]
    output = design.datapath.output
    errors = [
        float(np.abs(output.decode(design.datapath.compute(codes)) - design.quantized.exact(codes)).max())
        / float(output.lsb)
        for codes in inputs
    ]
    with suppress(ValueError):  # where none can be searched for, noise and worst cases are what there is
        errors.append(steered(design, seed=SEED).error)
    return max(errors)


def random_designs() -> Iterator[tuple[str, CoreDesign]]:
    """Yield random filters that can be met, by name."""
    count = seed = 0
    while count < RANDOM:
        name, text = random_specification(seed, max_order=5, lowest=-2.0)
        seed += 1
        try:
            design = design_core(from_text(text, Path(tempfile.gettempdir())))
        except ShortfallError:
            continue
        count += 1
        yield name, design


def uncentred(design: CoreDesign) -> Fraction | None:
    """Bound the calibration's error with variables from 0 to 1 that all count whole; None without a calibration."""
    quantized = design.quantized
    stages = [stage for stage in design.datapath.stages if isinstance(stage, HornerStep)]
    if quantized.polynomial is None or not stages or quantized.proof is None:
        return None
    exact = normalised(quantized.polynomial, design.datapath.inputs, design.datapath.output)
    nodes = {node.name: node for stage in stages for node in stage.graph.nodes}
    errors = sum(
        abs(nodes[f"c{i}{j}"].parameter * Fraction(2) ** -nodes[f"c{i}{j}"].frac - a)
        for i, row in enumerate(exact)
        for j, a in enumerate(row)
    )
    kept = [
        node.frac for stage in stages for node in stage.graph.nodes if node.name.startswith("row") and node.operands
    ]
    return (errors + sum(Fraction(1, 2 << frac) for frac in kept)) * quantized.proof.gain


def row(name: str, design: CoreDesign) -> str:
    """Return a row of the table."""
    budget, bound, worst = design.quantized.budget, design.quantized.bound, reached(design)
    first = budget.get("calibration", budget.get("input scaling"))
    parts = [first, *(budget.get(part) for part in _PARTS)]
    shown = " | ".join("" if part is None else f"{float(part):.4f}" for part in parts)
    return (
        f"| {name} | {design.quantized.realization} | {shown} | {float(bound):.4f} | {worst:.4f} "
        f"| {100 * worst / float(bound):.0f} % | {design.architecture.cost.area:,.0f} |"
    )


def section() -> str:
    """Return the section of the document."""
    examples = {name: design_core(load(ROOT / "examples" / f"{name}.toml")) for name in EXAMPLES}
    whole = [f"{name} {float(value):.4f}" for name, made in examples.items() if (value := uncentred(made)) is not None]
    rows = [*(row(name, made) for name, made in examples.items()), *(row(*one) for one in random_designs())]
    return "\n".join(
        [
            "In output LSBs. The part of the calibration is bounded about the middle of the box of its codes, and its",
            "coefficients are rounded for all of it; with each variable counted from 0 to 1, the same words would have",
            f"{', '.join(whole)}. The largest error is that of the integer model on noise, on",
            "worst cases of each part, and on inputs that `benchmarks/steering.py` searches for, so that all roundings",
            "go the same way. What is left to the bound are roundings that the code of one sample cannot all choose at",
            "once; where the output moves by less than a code from sample to sample, it cannot choose the last one",
            "either. Random filters are drawn as for [speed.md](speed.md), of order 5 at most, with edges from a",
            "hundredth of the sample rate on.",
            "",
            *HEAD,
            *rows,
        ]
    )


if __name__ == "__main__":
    print(section())
