"""Decimated instruments in simulation, result for result the integer model; and forty random ones, each proven twice.

`./run test --slow` runs all random designs; the fast tests take none of them, but the locomotive's instrument.
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
from tests.gen.word_lengths.decimated import locomotive, locomotive_text, small
from tests.gen.word_lengths.multirate import worst_error
from tests.sim.lint import icarus_check, lint
from tests.sim.stream.proof_and_hardware import check_proof_and_hardware
from tests.sim.stream.random_lowpass import lowpass

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.report.report import write_report
from sosmith.gen.specification.specification import from_text
from sosmith.gen.stimuli.core import bench_of
from sosmith.gen.stimuli.worst_case_inputs import sign_matched
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.interface.specification import Specification
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import simulate

WEAR = "\n[wear]\ninitial = 4.0\nwarning = 1.4\nlimit = 1.8\n"


CHANNELS = """
channels = 5
hardware.architecture = "{}"
wear = {{ initial = [3.0, 3.5, 4.0, 4.5, 5.0], warning = 1.4, limit = 3.8 }}
"""


def whole(architecture: str) -> CoreDesign:
    return locomotive(architecture=architecture, core="instrument")


def samples_of(made: CoreDesign, count: int) -> Trace:
    """Return random codes, the ends of both ranges, and a constant, which the filter settles on."""
    trace, *_ = traces_for(made, "worst_case", seed=3)
    codes = np.random.default_rng(count).integers(
        [port.lowest for port in made.datapath.inputs], [port.highest + 1 for port in made.datapath.inputs], (count, 2)
    )
    codes[count // 3 : count // 2, 0] = made.datapath.inputs[0].highest
    codes[count // 2 : count * 2 // 3] = [port.lowest for port in made.datapath.inputs]
    codes[-count // 8 :] = [port.highest // 3 for port in made.datapath.inputs]
    return replace(trace, codes=codes, truth=None, reading=None)


@pytest.mark.slow
@without_pictures
@pytest.mark.parametrize(
    ("architecture", "simulator"), [("folded", "icarus"), ("parallel", "verilator"), ("serial", "cxxrtl")]
)
def test_hardware_equals_the_integer_model(architecture: str, simulator: str, tmp_path: Path) -> None:
    made = whole(architecture)
    evidence = simulate(made, [samples_of(made, 600)], tmp_path, seed=5, simulator=simulator)
    assert evidence.run.mismatches == 0
    assert evidence.run.samples == len(evidence.run.time) == 38
    chosen = ("Decimation by ", " Realization ", " Architecture ", " Calibration before the decimator ")
    assert all(evidence.facts.why.count(words) == 1 for words in chosen)
    summary = write_report(evidence, tmp_path)
    assert summary["passed"]
    assert summary["error"]["max_abs"] <= summary["error"]["bound"] <= 0.00025
    assert summary["decimation"]["calibration"]["architecture"] == architecture
    assert summary["delay"]["seconds"] == pytest.approx(3.006, abs=0.001)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert re.search(r"Every sample is calibrated first, within [\d.]+\xa0nm\. 16 samples make one result", page)
    assert "A sine over the whole range of the calibration&#39;s result" in page


@pytest.mark.parametrize("simulator", ["verilator", "icarus"])
@pytest.mark.slow
def test_the_locomotive_on_its_worst_case(simulator: str, tmp_path: Path) -> None:
    """With random handshakes, on the inputs that maximize the result and what each quantizer adds to it."""
    made = whole("auto")
    for scenario in ("worst_case", "worst_case_errors"):
        (trace,) = traces_for(made, scenario, seed=1)
        evidence = simulate(made, [trace], tmp_path / scenario, seed=5, simulator=simulator)
        assert evidence.run.mismatches == 0
        assert worst_error(made, trace.codes) <= float(made.quantized.bound)
        assert write_report(evidence, tmp_path / scenario)["passed"]


@pytest.mark.slow
def test_wear_held_and_judged(tmp_path: Path) -> None:
    """The locomotive's readings rise over the limits of wear; each result leaves once for each of its samples."""
    text = locomotive_text(architecture="folded", hold=True) + WEAR
    made = design_core(from_text(text, Path("locomotive.toml")))
    (trace,) = traces_for(made, "worst_case", seed=1)
    codes = np.repeat(np.array([[20000, 20000], [32000, 20000], [60000, 20000]]), 700, axis=0)
    evidence = simulate(made, [replace(trace, codes=codes, truth=None, reading=None)], tmp_path, seed=2)
    assert (evidence.run.mismatches, evidence.run.samples) == (0, 132)
    assert {status >> 3 & 3 for status in made.datapath.compute_status(codes).tolist()} == {0, 1, 3}
    assert json.loads((tmp_path / f"{made.spec.name}.json").read_text(encoding="utf-8"))["decimation"]["held"]


@pytest.mark.slow
@without_pictures
@pytest.mark.parametrize(
    ("architecture", "core", "simulator"),
    [("folded", "instrument", "icarus"), ("parallel", "instrument", "verilator"), ("folded", "filter", "verilator")],
)
def test_channels_in_any_order(architecture: str, core: str, simulator: str, tmp_path: Path) -> None:
    """Each has its own limits of wear, and its samples come at random among those of the others."""
    made = small(CHANNELS.format(architecture), core)
    trace, *_ = traces_for(made, "worst_case", seed=1)
    rng = np.random.default_rng(1)
    codes = [np.repeat(rng.integers(0, 1024, (12, trace.codes.shape[1])), 20, axis=0) for _ in range(5)]
    traces = [replace(trace, codes=each, truth=None, reading=None) for each in codes]
    evidence = simulate(made, traces, tmp_path, seed=5, simulator=simulator)
    assert (evidence.run.mismatches, evidence.run.samples) == (0, 5 * 60)
    assert write_report(evidence, tmp_path)["passed"]
    text = tmp_path / f"{made.spec.name}.sv"
    assert lint(text, made.spec.name, tmp_path / "lint") == []
    status = made.datapath.compute_status(np.stack(codes, axis=1))
    assert {flags >> 3 & 3 for flags in status.ravel().tolist()} == {0, 1, 3}


@pytest.mark.slow
def test_readings_are_held_against_the_truth(tmp_path: Path) -> None:
    made = whole("folded")
    (trace,) = traces_for(made, "wear_ramp", seed=1, seconds=40)
    evidence = simulate(made, [trace], tmp_path, seed=2)
    assert evidence.run.mismatches == 0
    summary = write_report(evidence, tmp_path)
    assert summary["passed"]
    assert summary["true_error"]["readings"] > 0


@pytest.mark.slow
def test_results_come_at_the_rate_that_is_stated(tmp_path: Path) -> None:
    made = whole("folded")
    stated = made.architecture
    evidence = simulate(made, [samples_of(made, 321)], tmp_path, seed=1, idle=0.0, stall=0.0)
    # The last sample is found as many clocks before it is accepted as the first.
    assert (
        stated.cycles_per_result * 20
        < evidence.run.cycles - stated.reset_cycles
        <= (stated.cycles_per_result * 20 + stated.latency_cycles + 1)
    )


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["folded", "parallel"])
def test_tools_read_the_text_without_a_warning(architecture: str, tmp_path: Path) -> None:
    made = whole(architecture)
    generate(made, tmp_path)
    text = tmp_path / f"{made.spec.name}.sv"
    assert lint(text, made.spec.name, tmp_path / "lint") == []
    assert icarus_check(text, made.spec.name) == []
    modules = re.findall(r"^module (\w+)\(", text.read_text(encoding="utf-8"), re.MULTILINE)
    assert {f"{made.spec.name}{part}" for part in ("", "_ahead", "_decimator", "_behind")} <= set(modules)


DESIGNS = 40


def random_tree(number: int) -> dict[str, Any]:
    """Draw a specification: polynomial, family, order, cutoff, factor, formats and architecture."""
    draw = random.Random(f"decimated instrument {number}")
    factor = 2 ** draw.randint(1, 6)
    # The cutoff lies from a fortieth to a tenth of the lower rate; "auto" finds a factor where it is low.
    cutoff = 1000 / (64 if number % 5 == 4 else factor) / 40 * 4 ** draw.random()
    table = lowpass(draw, number, cutoff, factor)
    signed = draw.random() < 0.3
    inputs = {
        "voltage": {"bits": draw.randint(8, 16), "range": [0.0, draw.choice([5.0, 10.0])]},
        "temperature": {
            "bits": draw.randint(8, 16),
            "range": [-64.0, 64.0] if signed else [draw.choice([0.0, -40.0]), 100.0],
            "signed": signed,
        },
    }
    # Each term reaches some millimetres at the end of the ranges, so that some results are limited.
    rows = [
        [round(draw.uniform(-8, 8) / 10**i / 100**j, 3 + i + 2 * j) for j in range(draw.randint(1, 3))]
        for i in range(draw.randint(1 if number % 4 == 0 else 2, 4))  # a constant cannot be folded
    ]
    return {
        "name": f"instrument{number}",
        "sample_rate": 1000,
        "channels": 3 if number % 6 == 5 else 1,
        "input": inputs,
        "calibration": {"coefficients": rows},
        "filter": table,
        "output": {
            "bits": draw.randint(8, 18),
            "range": [-16.0, 16.0],
            "signed": True,
            "unit": "mm",
            "max_error": "faithful",
        },
        "hardware": {
            "architecture": ("auto", "folded", "parallel", "serial")[number % 4],
            "clock": draw.choice([20_000_000, 20_000_000, 40_000]) if number % 4 == 0 else 20_000_000,
        },
    }


def worst_cases(made: CoreDesign) -> Iterator[np.ndarray]:
    """Yield codes at random, and those that maximize the result and what each quantizer adds to it."""
    ports = made.datapath.inputs
    ends = [port.lowest for port in ports], [port.highest + 1 for port in ports]
    rng = np.random.default_rng(7)
    yield rng.integers(*ends, (20_000, 2))
    bench = bench_of(made)
    grid = rng.integers(*ends, (4000, 2))
    assert bench.polynomial is not None
    values = bench.polynomial(*(port.decode(grid[:, k]) for k, port in enumerate(ports)))
    low, high = grid[np.argmin(values)], grid[np.argmax(values)]
    for response in (bench.impulse_response, *bench.error_responses):
        yield np.where(sign_matched(response)[:, np.newaxis], high, low)
    yield np.repeat(rng.integers(*ends, (5, 2)), min(len(bench.impulse_response), 5000), axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(DESIGNS))
def test_random_designs(number: int, tmp_path: Path) -> None:
    """No input exceeds the bound, no result differs, and the other method proves the same."""
    made = design_core(Specification.load(random_tree(number)).checked)
    assert made.datapath.calibration is not None
    bound = float(made.quantized.bound)
    for codes in worst_cases(made):
        assert worst_error(made, codes) <= bound
    check_proof_and_hardware(made, samples_of, number, tmp_path)
