"""Random FIR filters: no error beyond the proven bound, hardware equal to its model, certificates and files proven.

The exact results are those of the definition, a sum of taps times samples, in rational arithmetic.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.interface.fir_draws import ARCHITECTURES, SHAPES, draw, largest_error, stimulus

import sosmith

SEEDS = range(60)
FEW = (5, 15, 25)
SAMPLES = 300
CASES = [pytest.param(seed, marks=[] if seed in FEW else pytest.mark.slow) for seed in SEEDS]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("seed", CASES)
def test_no_error_exceeds_the_bound(seed: int) -> None:
    drawn = draw(seed)
    made = sosmith.design(drawn.specification)
    codes = stimulus(drawn, SAMPLES, seed)
    results = made.run_codes(x=codes).reshape(codes.shape)
    bound = made.core.quantized.bound
    assert bound * drawn.specification.checked.output.lsb <= drawn.specification.checked.max_error
    assert 0 < largest_error(results, codes, drawn) <= bound


@pytest.mark.slow
@pytest.mark.parametrize("seed", CASES)
def test_certificate_and_files_are_proven(seed: int, tmp_path: Path) -> None:
    drawn = draw(seed)
    made = sosmith.design(drawn.specification)
    (tmp_path / "fir.toml").write_text(drawn.specification.toml(), encoding="utf-8")
    made.generate(tmp_path)
    read = sosmith.Certificate.load(tmp_path / f"fir{seed}.certificate.json")
    proof = read.verify(spec=tmp_path / "fir.toml", files=tmp_path)
    assert proof.missing.keys() <= ({"manifest"} if "multipliers" in drawn.specification.toml() else set())
    assert float(proof.budget["filter rounding"]) * 2**40 < float(proof.lsb)  # nothing is rounded but the output


def test_an_error_next_to_a_number_of_the_claims_grid_is_proven() -> None:
    """The tap's error is 4095/16384 LSB but for 2.6e-54, which a bound that is not exact exceeds."""
    one = {
        "name": "one",
        "sample_rate": 1000,
        "input": {"x": {"bits": 12, "range": [0.0, 5.0]}},
        "filter": {"taps": [1.7]},
        "output": {"bits": 19, "range": [-16.0, 16.0], "signed": True},
    }
    certificate = sosmith.design(one).certificate
    claimed = certificate.verify().budget["filter coefficients"]
    assert float(claimed) == 4095 / 16384 / 16384


@pytest.mark.slow
@pytest.mark.parametrize("simulator", ["verilator", "icarus"])
@pytest.mark.parametrize("seed", SEEDS)
def test_hardware_equals_the_model(seed: int, simulator: str, tmp_path: Path) -> None:
    drawn = draw(seed)
    made = sosmith.design(drawn.specification)
    codes = stimulus(drawn, SAMPLES, seed)
    (port,) = drawn.specification.checked.inputs
    values = port.decode(codes)
    report = made.simulate({"x": values}, folder=tmp_path, simulator=simulator, seed=seed)
    assert report.bit_exact
    assert report.summary["mismatches"] == 0
    assert report.summary["samples"] == codes.size
    assert report.summary["cycles"] > codes.size


def test_the_draws_are_of_all_kinds() -> None:
    drawn = [draw(seed) for seed in SEEDS]
    assert {each.shape for each in drawn} == set(SHAPES)
    named = {each.specification.checked.hardware.architecture for each in drawn}
    assert named == set(ARCHITECTURES)
    assert {len(each.taps) % 2 for each in drawn} == {0, 1}
    assert max(each.specification.channels for each in drawn) == 5
    bits = np.array(
        [(each.specification.checked.inputs[0].bits, each.specification.checked.output.bits) for each in drawn]
    )
    assert (bits.min(axis=0) <= 9).all()
    assert (bits.max(axis=0) >= 23).all()
