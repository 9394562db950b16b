"""Synthesizes cores for ECP5 and fits the area model of `sosmith.gen.word_lengths.cost` to the result.

`python -m benchmarks.cost_model` needs no more than the program itself. For each core it prints the LUT4 (a
CCU2C counts as two), flip-flops and MULT18X18D after synthesis and by the model, then the fitted constants.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from benchmarks.synthesis import TARGETS, Area, synthesize

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.gen.specification.specification import load
from sosmith.gen.word_lengths.cost import Cost, cost_of

ROOT = Path(__file__).resolve().parent.parent
CORES = [
    (path.stem, core, realization)
    for path in sorted((ROOT / "examples").glob("*.toml"))
    for core in ("filter", "calibration", "instrument")
    for realization in (list(SECTIONS) if core == "filter" else ["df1_ef2"])
    if not (path.stem == "audio_lowpass" and core != "filter")
]


def main() -> None:
    """Print the table and the fit."""
    found: list[tuple[Cost, int, int, int]] = []
    print(f"{'core':44} {'LUT4':>6} {'model':>6} {'FF':>5} {'model':>6} {'MULT18':>6} {'model':>6}")
    for name, core, realization in CORES:
        with tempfile.TemporaryDirectory() as folder:
            design = design_core(load(ROOT / "examples" / f"{name}.toml"), core=core, realization=realization)
            generate(design, Path(folder))
            area = Area.of(synthesize(Path(folder) / f"{name}.sv", name, TARGETS["ecp5"]))
        cost = cost_of(design.datapath)
        found.append((cost, area.all_luts, area.flip_flops, area.multipliers))
        label = f"{name} {core} {realization}"
        print(
            f"{label:44} {area.all_luts:6} {cost.luts:6} {area.flip_flops:5} {cost.register_bits:6} "
            f"{area.multipliers:6} {cost.multiplier_blocks:6}",
            flush=True,
        )
    # The fit minimizes relative errors, so that every core has the same weight, whatever its size.
    features = np.array(
        [[(cost.adder_bits + cost.extra_bits) / luts, cost.splits / luts] for cost, luts, _, _ in found]
    )
    fit, *_ = np.linalg.lstsq(features, np.ones(len(found)), rcond=None)
    print("LUT4 = {:.2f} * adder bits + {:.1f} * splits".format(*fit))
    error = features @ fit - 1
    print(f"fitted to within {100 * np.abs(error).max():.0f} %, {100 * np.sqrt(np.mean(error**2)):.0f} % rms")


if __name__ == "__main__":
    main()
