"""Random designs without multipliers: proven, proven again by the verifier, and equal to the model in simulation."""

import json
from pathlib import Path

import numpy as np
import pytest
from benchmarks.random_designs import random_specification
from tests.hdl.core_bench import Pace, run_core

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.specification.specification import from_text
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.errors import ShortfallError
from sosmith.model.reference.golden import calibrated, filtered
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.parallel.check import check_hardware
from sosmith.verify.verification import verify

DESIGNS = 40
SAMPLES = 300


def designed(number: int) -> CoreDesign:
    """Design a random specification without multipliers: the first that can be met of every `DESIGNS`th seed."""
    for seed in range(1000 + number, 10_000, DESIGNS):
        text = random_specification(seed)[1].replace('architecture = "auto"', 'architecture = "parallel"')
        try:
            return design_core(from_text(text + "multipliers = 0\n", Path("random.toml")))
        except ShortfallError:
            continue
    raise AssertionError


@pytest.mark.slow
@pytest.mark.parametrize("number", range(DESIGNS))
def test_a_random_design_is_proven_and_equal_to_the_model(number: int) -> None:
    made = designed(number)
    core, quantized, output = made.architecture, made.quantized, made.datapath.output
    assert core.cost.multiplications == ()
    text = to_verilog(to_rtlil(core.component(), made.datapath.name))
    assert " * " not in text
    proof = Certificate.model_validate(json.loads(certificate_text(certificate(quantized, made.spec.max_error))))
    verify(proof)
    check_hardware(text, proof)
    (trace,) = traces_for(made, "worst_case_errors", seed=number)
    codes = trace.codes[-SAMPLES:]
    wanted = made.datapath.compute_exact(codes)
    found = [beat.code for beat in run_core(core, [(0, row) for row in codes.tolist()], Pace())]
    assert found == wanted
    assert quantized.filter is not None
    ideal, exact = np.array(quantized.filter.sos), calibrated(codes, made.datapath.inputs, None)
    golden = filtered(exact, ideal, output, steady=quantized.steady)
    error = np.abs(output.decode(np.array(found)) - golden).max() / float(output.lsb)
    assert error <= float(quantized.bound) + 1e-6
