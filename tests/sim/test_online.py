"""Cores in on-line arithmetic in Verilator and Icarus, with random handshakes: the integer model, within its proof."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from benchmarks.random_designs import random_specification
from tests.gen.designs import EXAMPLES
from tests.hdl.core_bench import Pace, run_core
from tests.sim.lint import icarus_check, lint

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.output.generate import generate
from sosmith.gen.report.report import summarise
from sosmith.gen.specification.specification import from_text, load
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.errors import ShortfallError
from sosmith.model.reference.golden import calibrated, filtered
from sosmith.sim.simulation import simulate
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.verification import verify

DESIGNS = 40
SAMPLES = 200


@cache
def audio(realization: str = "auto", bits: int = 16) -> CoreDesign:
    """Design the audio low-pass in the online architecture."""
    path = EXAMPLES / "audio_lowpass.toml"
    spec = from_text(path.read_text(encoding="utf-8").replace("bits = 16", f"bits = {bits}"), path)
    hardware = replace(spec.hardware, architecture="online", realization=realization)
    return design_core(replace(spec, hardware=hardware))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("simulator", "scenario", "bits"),
    [
        ("verilator", "worst_case_errors", 16),
        ("verilator", "worst_case_errors", 24),
        ("verilator", "worst_case", 24),
        ("icarus", "worst_case_errors", 16),
        ("icarus", "worst_case_errors", 24),
    ],
)
def test_worst_cases_stay_within_the_proof(simulator: str, scenario: str, bits: int, tmp_path: Path) -> None:
    """The inputs that drive the filter, and the way of every rounding error, furthest."""
    made = audio(bits=bits)
    traces = traces_for(made, scenario, seed=1)
    evidence = simulate(made, traces, tmp_path, seed=1, simulator=simulator)
    report = summarise(evidence)
    assert report["bit_exact"]
    assert 0.4 * made.quantized.bound < report["error"]["max_lsb"] <= made.quantized.bound
    exact = made.datapath.compute_exact(traces[0].codes)
    assert made.datapath.output.decode(np.array(exact)).tolist() == evidence.run.hardware.tolist()


@pytest.mark.slow
def test_a_short_run_in_icarus(tmp_path: Path) -> None:
    made = audio("df1_ef2")
    (trace,) = traces_for(made, "worst_case_errors", seed=2)
    trace = replace(trace, codes=trace.codes[-60:], truth=None, reading=None)
    evidence = simulate(made, [trace], tmp_path, seed=2, simulator="icarus", idle=0.8, stall=0.5)
    assert evidence.run.mismatches == 0
    assert evidence.run.samples == 60


@pytest.mark.slow
@pytest.mark.parametrize("realization", [pytest.param("df1", marks=pytest.mark.slow), "df1_ef2"])
def test_the_text_is_clean(realization: str, tmp_path: Path) -> None:
    made = audio(realization)
    source = generate(made, tmp_path)[0]
    assert lint(source, made.spec.name, tmp_path) == []
    assert icarus_check(source, made.spec.name) == []


@pytest.mark.slow
def test_the_polynomial_in_front_of_the_filter(tmp_path: Path) -> None:
    """Stages before the sections work on words, as in the other architectures."""
    spec = load(EXAMPLES / "flange_wear_bench.toml")
    made = design_core(replace(spec, hardware=replace(spec.hardware, architecture="online", realization="df1_ef1")))
    (trace,) = traces_for(made, "worst_case", seed=3)
    trace = replace(trace, codes=trace.codes[:100], truth=None, reading=None)
    assert simulate(made, [trace], tmp_path, seed=3).run.mismatches == 0


def designed(number: int) -> CoreDesign:
    """Design a random specification: the first that can be met of every `DESIGNS`th seed."""
    for seed in range(1000 + number, 10_000, DESIGNS):
        text = random_specification(seed)[1].replace('architecture = "auto"', 'architecture = "online"')
        try:
            return design_core(from_text(text, Path("random.toml")))
        except ShortfallError:
            continue
    raise AssertionError


@pytest.mark.slow
@pytest.mark.parametrize("number", range(DESIGNS))
def test_a_random_design_is_proven_and_equal_to_the_model(number: int) -> None:
    made = designed(number)
    quantized, output = made.quantized, made.datapath.output
    claimed = certificate(quantized, made.spec.max_error, online=made.architecture.online)
    proof = Certificate.model_validate(json.loads(certificate_text(claimed)))
    assert proof.claims.online is not None
    verify(proof)
    (trace,) = traces_for(made, "worst_case_errors", seed=number)
    codes = trace.codes[-SAMPLES:]
    found = [beat.code for beat in run_core(made.architecture, [(0, row) for row in codes.tolist()], Pace())]
    assert found == made.datapath.compute_exact(codes)
    assert quantized.filter is not None
    ideal, exact = np.array(quantized.filter.sos), calibrated(codes, made.datapath.inputs, None)
    golden = filtered(exact, ideal, output, steady=quantized.steady)
    error = np.abs(output.decode(np.array(found)) - golden).max() / float(output.lsb)
    assert error <= float(quantized.bound) + 1e-6
