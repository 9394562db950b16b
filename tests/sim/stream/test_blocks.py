"""Look-ahead and beats of several samples in simulation: every result that of the model, and within its bound."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.gen.block_specifications import AUDIO, designed, text
from tests.sim.lint import icarus_check, lint

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.report.report import write_report
from sosmith.gen.specification.specification import from_text
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.sim.simulation import simulate

SIMPLE = AUDIO.replace("order = 5", "order = 1")


def worst(made: CoreDesign, kind: str, samples: int, folder: Path, simulator: str) -> None:
    """Simulate the end of a worst case, which is where it is worst, and hold all results against model and bound."""
    (trace,) = traces_for(made, kind, seed=3)
    end = replace(trace, codes=trace.codes[-samples:], truth=None, reading=None)
    evidence = simulate(made, [end], folder, seed=7, simulator=simulator)
    assert (evidence.run.mismatches, evidence.run.samples) == (0, len(end.codes))
    assert write_report(evidence, folder)["passed"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lanes", "simulator"),
    [
        (2, "verilator"),
        (16, "icarus"),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in ((4, "cxxrtl"), (16, "verilator"), (16, "cxxrtl"))),
    ],
)
def test_beats_of_any_width_are_simulated(lanes: int, simulator: str, tmp_path: Path) -> None:
    """16 samples of 16 bits are 256 bits, which the compiled loop does not take; the last beat is not full."""
    made = design_core(from_text(text(lanes, pipeline="plain", base=SIMPLE), Path("simple.toml")))
    worst(made, "worst_case", 500, tmp_path, simulator)
    bench = json.loads((tmp_path / "simulation" / simulator / "bench.json").read_text(encoding="utf-8"))
    assert bench["compiled"] is (lanes < 16)
    assert (bench["tdata_bits"], bench["tuser_bits"]) == (16 * lanes, 8 * lanes)


@pytest.mark.slow
@pytest.mark.parametrize("simulator", ["verilator", "icarus"])
@pytest.mark.parametrize(("lanes", "clock"), [(1, "120.0e6"), (2, "100.0e6"), (4, "100.0e6")])
@pytest.mark.parametrize("kind", ["worst_case", "worst_case_errors"])
def test_the_fastest_cores_hold_their_bound(kind: str, lanes: int, clock: str, simulator: str, tmp_path: Path) -> None:
    """Under the worst case of the whole filter, and of the path from every quantizer to the output."""
    worst(designed(lanes, clock=clock), kind, 1 << 20, tmp_path, simulator)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lanes", "pipeline"), [(1, "look-ahead"), (2, "plain"), pytest.param(2, "look-ahead", marks=pytest.mark.slow)]
)
def test_tools_read_the_text_without_a_warning(lanes: int, pipeline: str, tmp_path: Path) -> None:
    made = designed(lanes, pipeline=pipeline, order=2)
    generate(made, tmp_path)
    path = tmp_path / f"{made.spec.name}.sv"
    assert lint(path, made.spec.name, tmp_path / "lint") == []
    assert icarus_check(path, made.spec.name) == []


@pytest.mark.slow
def test_vectors_of_beats(tmp_path: Path) -> None:
    """Sample by sample in CSV; in words of the bus with all that the bus had, the filling of the last beat too."""
    made = design_core(from_text(text(4, pipeline="plain", base=SIMPLE), Path("simple.toml")))
    (trace,) = traces_for(made, "noise", seed=3)
    short = replace(trace, codes=trace.codes[:30], truth=None, reading=None)
    simulate(made, [short], tmp_path, vectors=tmp_path / "some.csv")
    assert len((tmp_path / "some.csv").read_text(encoding="utf-8").splitlines()) == 31
    evidence = simulate(made, [short], tmp_path, vectors=tmp_path / "some.hex")
    assert (evidence.run.mismatches, evidence.run.samples) == (0, 30)
    filled = np.concatenate([short.codes, short.codes[-1:], short.codes[-1:]])
    lines = (tmp_path / "some_stimuli.hex").read_text(encoding="utf-8").split()
    sent = [line[16 - 4 * lane : 20 - 4 * lane] for line in lines for lane in (1, 2, 3, 4)]
    assert sent == [f"{code % 65536:04x}" for code in filled[:, 0].tolist()]
    lines = (tmp_path / "some_responses.hex").read_text(encoding="utf-8").split()
    found = [line.split("_")[1][16 - 4 * lane : 20 - 4 * lane] for line in lines for lane in (1, 2, 3, 4)]
    assert found == [f"{code % 65536:04x}" for code in made.datapath.compute(filled).tolist()]
    flags = [line[8 - 2 * lane : 10 - 2 * lane] for line in lines for lane in (1, 2, 3, 4)]
    assert flags == [f"{status:02x}" for status in made.datapath.compute_status(filled).tolist()]
