"""CIC filters of adders for several channels: equal to the model at any pace, in any order, after any reset."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from typing import Any

import pytest
from benchmarks.synthesis import TARGETS, Area, place, synthesize
from tests.hdl.cores.resets import check_resets
from tests.interface.decimating_firs import OTHERS, draw
from tests.verify.multirate.single_cores import proven_alone
from tests.verify.parallel.simulated import Simulation

import sosmith
from sosmith.gen.output.verilog import core_verilog
from sosmith.model.dataflow.cic import impulse_response
from sosmith.verify.multirate.decimating.cic import check_cic
from sosmith.verify.parallel.netlist import flattened
from sosmith.verify.reader.source import read_modules

MOST = {"luts": 700, "clock": 130.0}
"""LUT4, those of LUT RAM among them, and MHz on an ECP5, for 8 channels."""

FEW = (OTHERS, OTHERS + 1, OTHERS + 2)
CASES = [pytest.param(seed, marks=[] if seed in FEW else pytest.mark.slow) for seed in range(OTHERS, OTHERS + 40)]


def drawn(seed: int) -> sosmith.Specification:
    """Draw a CIC filter for 2 to 8 channels."""
    tree = draw(seed).specification.as_dict() | {"channels": 2 + seed % 7}
    tree["hardware"]["architecture"] = "parallel"
    return sosmith.Specification.load(tree)


@pytest.mark.parametrize("seed", CASES)
def test_results_are_those_of_the_model_after_any_reset(seed: int, tmp_path: Path) -> None:
    seen = check_resets(sosmith.design(drawn(seed)), tmp_path, seed)
    assert seen.results > 3
    assert seen.resets > 1


@pytest.mark.parametrize("start", ["zero", pytest.param("steady", marks=pytest.mark.slow)])
def test_wear_is_judged_by_the_limits_of_the_channel(start: str, tmp_path: Path) -> None:
    tree: dict[str, Any] = {
        "name": "worn",
        "sample_rate": 1000.0,
        "channels": 3,
        "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"taps": [1, 2, 3, 2, 1], "decimate": 3},
        "output": {"bits": 9, "range": [-8.0, 8.0], "signed": True, "unit": "mm"},
        "wear": {"initial": [1.0, 2.0, 3.0], "warning": 1.0, "limit": 2.0},
        "hardware": {"clock": 1e6, "architecture": "parallel", "start": start},
    }
    core = proven_alone(sosmith.design(sosmith.Specification.load(tree)))
    check_cic(core.text, core.certificate, core.item)
    seen = check_resets(core.design, tmp_path, 3)
    assert seen.results > 3
    assert seen.resets > 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(OTHERS, OTHERS + 40))
def test_certificate_and_files_are_proven(seed: int, tmp_path: Path) -> None:
    spec = drawn(seed)
    (tmp_path / "down.toml").write_text(spec.toml(), encoding="utf-8")
    sosmith.design(spec).generate(tmp_path)
    read = sosmith.Certificate.load(tmp_path / f"down{seed}.certificate.json")
    proof = read.verify(spec=tmp_path / "down.toml", files=tmp_path)
    assert not proof.missing
    assert {part.state.value for name, part in proof.scope.items() if name != "calibration"} == {"proven"}


def test_the_draws_are_of_all_kinds() -> None:
    specs = [drawn(seed).checked for seed in range(OTHERS, OTHERS + 40)]
    assert {spec.channels for spec in specs} == set(range(2, 9))
    assert {spec.filter.hold for spec in specs} == {False, True}
    assert {spec.hardware.start for spec in specs} == {"zero", "steady"}
    assert {spec.filter.decimate for spec in specs} == {2, 3, 4, 7, 16, 64}


@pytest.mark.parametrize(("order", "clocks"), [((0, 1), 1), ((0, 1, 2), 1), ((0,), 2), ((2, 2, 1), 4 / 3)])
def test_a_sample_waits_only_behind_one_of_its_channel(order: tuple[int, ...], clocks: float) -> None:
    simulation = Simulation(flattened(read_modules(core_verilog(design(3, order=1, start="zero").core)), "aclk"))
    row = {"aclk": 0, "aresetn": 1, "s_axis_tvalid": 1, "s_axis_tdata": 5, "m_axis_tready": 1}
    count, taken = 60, 0
    for _ in range(3 + int(clocks * count)):  # 3 in which words are cleared
        row["s_axis_tdest"] = order[taken % len(order)]
        taken += simulation.outputs(row)["s_axis_tready"]
        simulation.clock()
    assert count <= taken <= count + 2


def design(channels: int, order: int = 4, start: str = "steady") -> sosmith.Design:
    """Make sums of 16 samples of 16 bits."""
    tree: dict[str, Any] = {
        "name": "cic",
        "sample_rate": 1e6,
        "channels": channels,
        "input": {"x": {"bits": 16, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"taps": [tap / 16**order for tap in impulse_response(16, order)], "decimate": 16},
        "output": {"bits": 16, "range": [-1.0, 1.0], "signed": True},
        "hardware": {"clock": 48e6, "architecture": "parallel", "start": start},
    }
    return sosmith.design(sosmith.Specification.load(tree))


@pytest.mark.slow
def test_what_it_takes(tmp_path: Path) -> None:
    made, target = design(8), TARGETS["ecp5"]
    (tmp_path / "cic.sv").write_text(core_verilog(made.core), encoding="utf-8")
    area = Area.of(synthesize(tmp_path / "cic.sv", "cic", target))
    assert (area.multipliers, area.rams) == (0, 0)
    assert area.all_luts <= MOST["luts"]
    assert median(place(tmp_path, target, seed).fmax for seed in (1, 2, 3)) >= MOST["clock"]
