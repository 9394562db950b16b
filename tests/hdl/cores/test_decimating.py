# amaranth: UnusedElaboratable=no
"""Cores that decimate and take a sample at each clock: what they refuse, and what they take on an FPGA."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import pytest
from benchmarks.synthesis import TARGETS, Area, place, synthesize
from tests.hdl.cores.resets import check_resets
from tests.interface.decimating_firs import draw

import sosmith
from sosmith.gen.output.verilog import core_verilog
from sosmith.hdl.cores.cic import CicCore
from sosmith.hdl.cores.polyphase import PolyphaseCore
from sosmith.hdl.plan.decimating.polyphase import polyphase_plan
from sosmith.model.dataflow.cic import impulse_response

RECIPE = Path(__file__).parents[3] / "examples" / "recipes" / "half_band_decimator.toml"
HALF_BAND = {"luts": 453, "multipliers": 4, "clock": 150.0}
"""LUT4 of litedsp's half-band decimator on an ECP5, which takes a sample in some clocks; here one at each."""

CIC = {"luts": 400, "multipliers": 0, "clock": 200.0}
"""Four sums of 16 samples of 16 bits."""


def half_band() -> sosmith.Design:
    tree = sosmith.Specification.load(RECIPE).as_dict()
    tree["hardware"]["architecture"] = "parallel"
    return sosmith.design(sosmith.Specification.load(tree))


def cic() -> sosmith.Design:
    tree: dict[str, Any] = {
        "name": "cic",
        "sample_rate": 12e6,
        "input": {"x": {"bits": 16, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"taps": [tap / 2**16 for tap in impulse_response(16, 4)], "decimate": 16},
        "output": {"bits": 16, "range": [-1.0, 1.0], "signed": True},
        "hardware": {"clock": 12e6},
    }
    return sosmith.design(sosmith.Specification.load(tree))


def test_all_results_leave_another_core() -> None:
    datapath = half_band().core.datapath
    assert polyphase_plan(datapath).multipliers == 4
    for core in (PolyphaseCore, CicCore):
        with pytest.raises(ValueError, match=r" must "):
            core(replace(datapath, downsampler=None))


@pytest.mark.parametrize(("seed", "hold"), [(41, True), (3, True), (57, False)])
def test_results_are_those_of_the_model_after_any_reset(seed: int, hold: bool, tmp_path: Path) -> None:
    tree = draw(seed).specification.as_dict() | {"channels": 1}
    tree["filter"]["hold"], tree["hardware"]["architecture"] = hold, "parallel"
    seen = check_resets(sosmith.design(sosmith.Specification.load(tree)), tmp_path, seed)
    assert seen.results > 3
    assert seen.resets > 1


@pytest.mark.slow
@pytest.mark.parametrize(("design", "most"), [(half_band, HALF_BAND), (cic, CIC)])
def test_what_it_takes(design: Any, most: dict[str, float], tmp_path: Path) -> None:
    made = design()
    name, target = made.core.datapath.name, TARGETS["ecp5"]
    (tmp_path / f"{name}.sv").write_text(core_verilog(made.core), encoding="utf-8")
    area = Area.of(synthesize(tmp_path / f"{name}.sv", name, target))
    assert area.all_luts <= most["luts"]
    assert area.multipliers <= most["multipliers"]
    assert area.rams == 0
    assert median(place(tmp_path, target, seed).fmax for seed in (1, 2, 3)) >= most["clock"]
