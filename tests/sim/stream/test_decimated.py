"""Decimated filters in simulation, result for result the integer model; and forty random ones, each proven twice.

`./run test --slow` runs all random designs; the fast tests take none of them, but the locomotive's filter.
"""

import json
import random
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.report.pictures import without_pictures
from tests.gen.word_lengths.decimated import locomotive
from tests.sim.lint import icarus_check, lint
from tests.sim.stream.proof_and_hardware import check_proof_and_hardware
from tests.sim.stream.random_lowpass import lowpass

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.report.report import write_report
from sosmith.gen.stimuli.core import bench_of
from sosmith.gen.stimuli.worst_case_inputs import sign_matched
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.interface.specification import Specification
from sosmith.model.reference.golden import entering_filter, filtered
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import simulate


def samples_of(made: CoreDesign, count: int) -> Trace:
    """Return noise, both ends of the range, and a constant, which the filter settles on."""
    (trace,) = traces_for(made, "noise", seed=3)
    port = made.datapath.inputs[0]
    codes = np.resize(trace.codes, (count, 1)).copy()
    codes[count // 3 : count // 2] = port.highest
    codes[count // 2 : count * 2 // 3] = port.lowest
    codes[-count // 8 :] = port.highest // 3
    return replace(trace, codes=codes, truth=None, reading=None)


def settling_of(made: CoreDesign) -> float:
    """Measure, with the integer model, the seconds from a step until results stay within 1 % of it."""
    decimator = made.datapath.decimator
    assert decimator is not None
    ends = decimator.input.lowest // 2, decimator.input.highest // 2
    codes = np.repeat(ends, [decimator.factor, 400 * decimator.factor])[:, np.newaxis]
    before, *results = made.datapath.compute(codes).tolist()
    left = np.abs(np.array(results) - results[-1])
    outside = np.flatnonzero(left > 0.01 * abs(results[-1] - before))
    return float((outside[-1] + 1) * decimator.factor / made.spec.sample_rate)


@pytest.mark.slow
@without_pictures
@pytest.mark.parametrize(
    ("architecture", "simulator"), [("folded", "icarus"), ("parallel", "verilator"), ("serial", "cxxrtl")]
)
def test_hardware_equals_the_integer_model(architecture: str, simulator: str, tmp_path: Path) -> None:
    made = locomotive(architecture=architecture)
    evidence = simulate(made, [samples_of(made, 900)], tmp_path, seed=5, simulator=simulator)
    assert evidence.run.mismatches == 0
    assert evidence.run.samples == len(evidence.run.time) == 57
    assert evidence.run.time[1] == 0.16
    summary = write_report(evidence, tmp_path)
    assert summary["passed"]
    assert summary["decimation"]["factor"] == 16
    assert summary["delay"]["seconds"] == pytest.approx(3.006, abs=0.001)
    assert summary["settling"]["seconds"] == settling_of(made)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "What folds, anywhere and into the pass band" in page
    assert "46.875 Hz to 50 Hz" in page
    assert "49.74122 Hz to 50 Hz" in page
    assert page.count("Of the filter alone, behind the decimator.") == 3
    assert "That adds 300\xa0ms." in page


@pytest.mark.slow
@without_pictures
@pytest.mark.parametrize(("architecture", "simulator"), [("folded", "verilator"), ("parallel", "icarus")])
def test_held_results_come_as_often_as_samples(architecture: str, simulator: str, tmp_path: Path) -> None:
    made = locomotive(architecture=architecture, hold=True)
    bare = locomotive(architecture=architecture).architecture
    assert (made.architecture.copies_per_result, bare.copies_per_result) == (16, 1)
    assert made.architecture.cycles_per_result == bare.cycles_per_result
    evidence = simulate(made, [samples_of(made, 500)], tmp_path, seed=5, simulator=simulator)
    assert (evidence.run.mismatches, evidence.run.samples) == (0, 32)
    manifest = json.loads((tmp_path / f"{made.spec.name}.json").read_text(encoding="utf-8"))
    assert manifest["decimation"]["held"]
    write_report(evidence, tmp_path)
    assert "16 samples make one result, which leaves as many times" in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("hold", [False, True])
def test_vectors_have_a_result_for_every_16th_sample(hold: bool, tmp_path: Path) -> None:
    """The last of three groups is not complete: its result is there, and as often as the others if it is held."""
    made = locomotive(architecture="folded", hold=hold)
    trace = samples_of(made, 40)
    expected = made.datapath.compute(trace.codes).tolist()
    assert len(expected) == 3
    simulate(made, [trace], tmp_path, simulator="icarus", vectors=tmp_path / "some.csv")
    rows = [row.split(",")[3] for row in (tmp_path / "some.csv").read_text(encoding="utf-8").splitlines()[1:]]
    shown = [str(expected[n // 16]) if hold or n % 16 == 0 else "" for n in range(40)]
    assert rows == shown
    simulate(made, [trace], tmp_path, simulator="icarus", vectors=tmp_path / "some.hex")
    lines = (tmp_path / "some_responses.hex").read_text(encoding="utf-8").split()
    assert [int(line.split("_")[1], 16) for line in lines] == [
        code for code in expected for _ in range(16 if hold else 1)
    ]
    assert len((tmp_path / "some_stimuli.hex").read_text(encoding="utf-8").split()) == 40


@pytest.mark.slow
def test_held_results_take_no_longer(tmp_path: Path) -> None:
    made = locomotive(architecture="folded", hold=True)
    stated, decimator = made.architecture, made.datapath.decimator
    assert decimator is not None
    evidence = simulate(made, [samples_of(made, 801)], tmp_path, seed=1, idle=0.0, stall=0.0)
    last = stated.cycles_per_result * 50 + stated.latency_cycles + decimator.factor - 1
    assert evidence.run.cycles == decimator.warm_up + 1 + last


@pytest.mark.slow
def test_results_come_at_the_rate_that_is_stated(tmp_path: Path) -> None:
    made = locomotive(architecture="folded")
    stated, decimator = made.architecture, made.datapath.decimator
    assert decimator is not None
    evidence = simulate(made, [samples_of(made, 801)], tmp_path, seed=1, idle=0.0, stall=0.0)
    assert evidence.run.samples == 51
    # The first sample is offered while the decimator fills; then results come one after the other.
    assert evidence.run.cycles == decimator.warm_up + 1 + stated.cycles_per_result * 50 + stated.latency_cycles


DESIGNS = 40


def random_tree(number: int) -> dict[str, Any]:
    """Draw a specification: family, order, cutoff, factor, formats and architecture."""
    draw = random.Random(f"decimated {number}")
    factor = 2 ** draw.randint(1, 6)
    # The cutoff lies from a fortieth to a tenth of the lower rate.
    cutoff = 1000 / factor / 40 * 4 ** draw.random()
    bits, out = draw.randint(8, 18), draw.randint(8, 18)
    span = draw.choice([1.0, 1.0, 10.0, 3.3])
    signed = draw.random() < 0.5
    table = lowpass(draw, number, cutoff, factor)
    ends = [-span, span] if signed else [0.0, span]
    return {
        "name": f"decimated{number}",
        "sample_rate": 1000,
        "input": {"x": {"bits": bits, "range": ends, "signed": signed}},
        "filter": table,
        "output": {"bits": out, "range": [-2.0 * span, 2.0 * span], "signed": True, "max_error": "faithful"},
        "hardware": {"architecture": ("folded", "folded", "parallel", "serial")[number % 4], "clock": 20_000_000},
    }


def worst_cases(made: CoreDesign) -> Iterator[np.ndarray]:
    """Yield codes at random, and those that maximize the result and what each quantizer adds to it."""
    (port,) = made.datapath.inputs
    yield np.random.default_rng(7).integers(port.lowest, port.highest + 1, 100_000)
    bench = bench_of(made)
    for response in (bench.impulse_response, *bench.error_responses):
        yield np.where(sign_matched(response), port.highest, port.lowest)
    yield np.repeat([1, port.highest // 3, port.highest, port.lowest, 5], len(bench.impulse_response))


@pytest.mark.slow
@pytest.mark.parametrize("number", range(DESIGNS))
def test_random_designs(number: int, tmp_path: Path) -> None:
    """No input exceeds the bound, no result differs, and the other method proves the same."""
    made = design_core(Specification.load(random_tree(number)).checked)
    quantized, datapath = made.quantized, made.datapath
    assert quantized.filter is not None
    bound = float(quantized.bound)
    for codes in worst_cases(made):
        column = codes.reshape(-1, 1)
        entering = entering_filter(column, datapath, None)
        exact = filtered(entering, quantized.filter.sos, datapath.output, steady=quantized.steady)
        error = np.abs(datapath.output.decode(datapath.compute(column)) - exact).max() / float(datapath.output.lsb)
        assert error <= bound + 1e-6
    check_proof_and_hardware(made, samples_of, number, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["folded", "parallel"])
def test_tools_read_the_text_without_a_warning(architecture: str, tmp_path: Path) -> None:
    made = locomotive(architecture=architecture)
    generate(made, tmp_path)
    text = tmp_path / f"{made.spec.name}.sv"
    assert lint(text, made.spec.name, tmp_path / "lint") == []
    assert icarus_check(text, made.spec.name) == []
    assert re.findall(r"^module (\w+)\(", text.read_text(encoding="utf-8"), re.MULTILINE)[:2] == [
        made.spec.name,
        f"{made.spec.name}_behind",
    ]
