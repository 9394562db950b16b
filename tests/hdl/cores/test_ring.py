# amaranth: UnusedElaboratable=no
"""The core with rings: what it refuses, and what a half-band decimator takes on an FPGA."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from statistics import median

import pytest
from benchmarks.synthesis import TARGETS, Area, place, synthesize

import sosmith
from sosmith.gen.output.verilog import core_verilog
from sosmith.hdl.cores.ring import RingCore

RECIPE = Path(__file__).parents[3] / "examples" / "recipes" / "half_band_decimator.toml"
MOST_LUTS, MOST_MULTIPLIERS, LEAST_CLOCK = 453, 2, 95.8
"""Figures of litedsp's half-band decimator on an ECP5, whose error is not bounded."""


def test_all_results_leave_another_core() -> None:
    design = sosmith.design(RECIPE)
    with pytest.raises(ValueError, match=r"^datapath must have a downsampler$"):
        RingCore(replace(design.core.datapath, downsampler=None))


def test_an_lsb_is_proven() -> None:
    design = sosmith.design(RECIPE)
    assert design.core.quantized.bound <= 1
    steps = design.core.architecture.plan.steps
    assert (len(steps), sum(step.second is not None for step in steps)) == (7, 6)


@pytest.mark.slow
def test_what_a_half_band_decimator_takes(tmp_path: Path) -> None:
    design = sosmith.design(RECIPE)
    name, target = design.core.datapath.name, TARGETS["ecp5"]
    (tmp_path / f"{name}.sv").write_text(core_verilog(design.core), encoding="utf-8")
    area = Area.of(synthesize(tmp_path / f"{name}.sv", name, target))
    assert area.all_luts <= MOST_LUTS
    assert area.multipliers <= MOST_MULTIPLIERS
    assert area.rams == 0
    assert median(place(tmp_path, target, seed).fmax for seed in (1, 2, 3)) >= LEAST_CLOCK
