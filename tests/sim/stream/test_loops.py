"""Both loops in both simulators that have them: the same samples, clocks and words about every broken rule."""

import json
import random
import sys
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from cocotb_tools.runner import Verilator
from tests.sim.stream.both_loops import run_cases

from sosmith.sim.beats import Beats
from sosmith.sim.cxxrtl_model import build_cxxrtl
from sosmith.sim.simulators import PLAIN_ASSERTIONS, find_simulator
from sosmith.sim.stream.bursts import Pace, below
from sosmith.sim.stream.cxxrtl_pins import CxxrtlPins, finished
from sosmith.sim.verilated_model import Builder, Model

ROOT = Path(__file__).parents[3]
FAULTY = Path(__file__).with_name("faulty.sv")
SAMPLES = 200
FOLLOWS = "outputs must not follow s_axis_tvalid or m_axis_tready within a clock, as they did at clock "
HUNG = "a sample must move at least every "
FAULTS = {
    0: None,
    1: FOLLOWS,
    2: FOLLOWS,
    3: HUNG,
    4: "m_axis_tvalid must not wait for m_axis_tready",
    5: FOLLOWS,
    6: "a stalled core must not drop m_axis_tvalid, as it did at sample ",
    7: "a stalled core must not change m_axis_tdata from ",
    8: "a stalled core must not change m_axis_tuser from ",
    9: "200 samples must come out, not more",
    10: "200 samples must come out, not more",
    11: HUNG,
    12: "a stalled core must not drop m_axis_tvalid, as it did at sample ",
    13: "the first results after a reset must not depend on what came before it",
    14: "a stalled core must not change m_axis_tdest from ",
    15: "a stalled core must not change m_axis_tdata from ",
}
"""How the sentence about each fault of faulty.sv begins, in a core that takes no time for a sample."""
PACES = [(0.5, 0.5), (0.0, 0.3), (0.9, 0.0), (0.3, 0.9)]
WORKS = {0: 2, 70: 72, 150: 100}
"""Clocks that the core works on a sample, and how long the bench thinks that it may take."""


def cases() -> list[dict[str, Any]]:
    return [
        {
            "fault": fault,
            "work": work,
            "bench": {
                "tdest": True,
                "tuser": True,
                "seed": 7 * fault + number,
                "idle": idle,
                "stall": stall,
                "latency_cycles": patience,
                "reset_cycles": 0,
                "samples_per_result": 1,
                "rates": (),
                "copies_per_result": 1,
                "tdata_bits": 64,
                "zeros": [],
                "tuser_bits": 64,
            },
        }
        for fault in FAULTS
        for work, patience in WORKS.items()
        for number, (idle, stall) in enumerate(PACES)
        if (number == 0 or (fault == 0 and work == 70)) and (work == 0 or FAULTS[fault] in (None, HUNG))
    ]


def prepare(folder: Path) -> None:
    folder.mkdir()
    rng = np.random.default_rng(3)
    tdest, tdata = rng.integers(0, 4, SAMPLES), rng.integers(0, 2**16, SAMPLES).astype(np.uint64)
    Beats(tdest, tdata, np.zeros(SAMPLES, np.uint64)).save(folder / "sent.npy")
    (folder / "cases.json").write_text(json.dumps(cases()), encoding="utf-8")


def found_in(folder: Path) -> list[list[Any]]:
    found: list[list[Any]] = json.loads((folder / "outcomes.json").read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> list[list[Any]]:
    """Outcomes of all cases in Verilator, with the loop in Python and with the compiled one."""
    folder = tmp_path_factory.mktemp("both") / "verilator"
    prepare(folder)
    tool = find_simulator("verilator", folder / "bin")
    signals = ("tdest", "tdata", "tvalid", "tready")
    ports = ("aclk", "aresetn", "fault", "work", *(f"s_axis_{name}" for name in signals), "m_axis_tuser")
    ports += tuple(f"m_axis_{name}" for name in signals)
    model = Model(source=FAULTY, top="faulty", ports=ports, signals=("tdest", "tuser"), waves=False)
    Builder(tool.version, tool.environment, folder).build(model, folder / "faulty")
    with patch.object(sys, "path", [str(ROOT), *sys.path]):  # where the simulator's Python looks
        Verilator().test(
            test_module="tests.sim.stream.both_loops",
            hdl_toplevel="faulty",
            hdl_toplevel_lang="verilog",
            build_dir=folder,
            test_dir=folder,
            results_xml=str(folder / "results.xml"),
            timescale=("1ns", "1ps"),
            extra_env={"BOTH_LOOPS": str(folder), "COCOTB_LOG_LEVEL": "WARNING", **PLAIN_ASSERTIONS},
        )
    return found_in(folder)


@pytest.mark.slow
def test_both_loops_agree_on_every_sample_clock_and_failure(outcomes: list[list[Any]]) -> None:
    assert len(outcomes) == len(cases())
    for case, (in_python, compiled) in zip(cases(), outcomes, strict=True):
        assert compiled == in_python, case


CONSTANTS = """
  (* init = 2'h0 *)
  wire [1:0] bank;
  (* init = 2'bx0 *)
  wire [1:0] flags;
  assign bank = { 1'h0, aresetn };
  assign flags = { 1'h0, aresetn };
endmodule
"""
"""Words of which a bit is wired to a constant, and their initial values, as Yosys writes them."""


@pytest.mark.slow
def test_cxxrtl_agrees_on_them_too(outcomes: list[list[Any]], tmp_path: Path) -> None:
    folder = tmp_path / "cxxrtl"
    prepare(folder)
    library = folder / "faulty.so"
    tool = find_simulator("cxxrtl", folder)
    source = tmp_path / "core.sv"
    source.write_text(FAULTY.read_text().rstrip().removesuffix("endmodule") + CONSTANTS)
    build_cxxrtl(source, "faulty", ("tdest", "tuser"), tool.environment, folder, library)
    finished(run_cases(CxxrtlPins(library), folder))
    for case, mine, verilators in zip(cases(), found_in(folder), outcomes, strict=True):
        assert mine == verilators, case


@pytest.mark.slow
def test_every_rule_is_broken_and_named(outcomes: list[list[Any]]) -> None:
    for case, ((failure, *_), _) in zip(cases(), outcomes, strict=True):
        if case["work"] == 0:
            sentence = FAULTS[case["fault"]]
            assert failure is None if sentence is None else str(failure).startswith(sentence), (case, failure)


@pytest.mark.slow
def test_a_sound_core_gives_what_was_sent(outcomes: list[list[Any]]) -> None:
    rng = np.random.default_rng(3)
    tdest, tdata = rng.integers(0, 4, SAMPLES).tolist(), ((rng.integers(0, 2**16, SAMPLES) + 3) % 2**16).tolist()
    expected = [tdest, tdata, [word & 3 for word in tdata]]
    sound = [both for case, both in zip(cases(), outcomes, strict=True) if case["fault"] == 0]
    assert [found[2:] for both in sound for found in both] == [expected] * (2 * len(sound))


def test_the_draws_are_those_that_are_stated() -> None:
    """`below` is Python's own way to draw an integer, and a pace waits for its share of clocks."""
    ours, pythons = random.Random(5), random.Random(5)
    assert [below(180, ours) for _ in range(500)] == [pythons.randrange(180) for _ in range(500)]
    pace = Pace(random.Random(1), 0.3)
    waited = sum(not next(pace) for _ in range(200_000)) / 200_000
    assert abs(waited - 0.3) < 0.01
