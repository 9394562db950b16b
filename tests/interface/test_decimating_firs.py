"""Random FIR filters that decimate: within the bound, hardware equal to its model, certificates and files proven.

The exact results are those of the definition, a sum of taps times samples at every N-th sample, in rational arithmetic.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.interface.decimating_firs import OTHERS, draw
from tests.interface.fir_draws import SHAPES, FirDraw, exact, stimulus

import sosmith

SEEDS = range(60)
FEW = (1, 3, 8, 41, 44)
SIMULATED = (3, 41)
"""With multipliers that take turns, and with adders alone."""

SAMPLES = 260
CASES = [pytest.param(seed, marks=[] if seed in FEW else pytest.mark.slow) for seed in SEEDS]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("seed", CASES)
def test_no_error_exceeds_the_bound(seed: int) -> None:
    drawn = draw(seed)
    spec = drawn.specification.checked
    made = sosmith.design(drawn.specification)
    codes = stimulus(drawn, SAMPLES, seed)
    factor = int(spec.filter.decimate or 1)
    results = made.run_codes(x=codes).reshape(-1, spec.channels)
    bound = made.core.quantized.bound
    assert bound * spec.output.lsb <= spec.max_error
    assert len(results) == -(-SAMPLES // factor)
    worst = Fraction(0)
    for k in range(spec.channels):
        wanted = exact(codes[:, k].tolist(), drawn)[::factor]
        for code, value in zip(results[:, k].tolist(), wanted, strict=True):
            worst = max(worst, abs(spec.output.zero + spec.output.lsb * int(code) - value) / spec.output.lsb)
    assert worst <= bound
    assert worst or drawn.shape == "cic"  # which may be exact
    one = made.core.datapath.compute_exact(codes[:, :1])
    assert one == results[:, 0].tolist()


@pytest.mark.slow
@pytest.mark.parametrize("seed", CASES)
def test_certificate_and_files_are_proven(seed: int, tmp_path: Path) -> None:
    drawn = draw(seed)
    made = sosmith.design(drawn.specification)
    (tmp_path / "down.toml").write_text(drawn.specification.toml(), encoding="utf-8")
    made.generate(tmp_path)
    read = sosmith.Certificate.load(tmp_path / f"down{seed}.certificate.json")
    proof = read.verify(spec=tmp_path / "down.toml", files=tmp_path)
    assert not proof.missing
    assert {name: part.state.value for name, part in proof.scope.items()} == dict.fromkeys(proof.scope, "proven") | {
        "calibration": "not_read"
    }
    assert float(proof.budget["filter rounding"]) * 2**40 < float(proof.lsb)  # nothing is rounded but the output


@pytest.mark.parametrize(
    ("simulator", "seed"),
    [
        pytest.param(simulator, seed, marks=[] if simulator == "icarus" and seed in SIMULATED else pytest.mark.slow)
        for simulator in ("verilator", "icarus")
        for seed in SEEDS
    ],
)
def test_hardware_equals_the_model(simulator: str, seed: int, tmp_path: Path) -> None:
    drawn = draw(seed)
    made = sosmith.design(drawn.specification)
    codes = stimulus(drawn, SAMPLES, seed)
    (port,) = drawn.specification.checked.inputs
    report = made.simulate({"x": port.decode(codes)}, folder=tmp_path, simulator=simulator, seed=seed)
    assert report.bit_exact
    assert report.summary["mismatches"] == 0
    factor = int(drawn.specification.checked.filter.decimate or 1)
    assert report.summary["samples"] == -(-SAMPLES // factor) * drawn.specification.channels
    assert report.summary["error"]["max_abs"] <= report.summary["error"]["bound"]


def made_of(drawn: FirDraw) -> str:
    """Return the architecture that a CIC filter has: adders for one channel, or if they are asked for."""
    spec = drawn.specification.checked
    return "folded" if spec.channels > 1 and spec.hardware.architecture == "auto" else "parallel"


@pytest.mark.parametrize("seed", [OTHERS, OTHERS + 1, OTHERS + 2])
def test_a_cic_filter_is_made_of_adders(seed: int) -> None:
    drawn = draw(seed)
    made = sosmith.design(drawn.specification)
    assert made.architecture == made_of(drawn)
    assert (made.core.architecture.multiplier_blocks == 0) == (made.architecture == "parallel")


def test_the_draws_are_of_all_kinds() -> None:
    drawn = [draw(seed) for seed in SEEDS]
    specs = [each.specification.checked for each in drawn]
    assert {each.shape for each in drawn} == {*SHAPES, "cic"}
    assert {made_of(each) for each in drawn if each.shape == "cic"} == {"parallel", "folded"}
    assert {spec.filter.decimate for spec in specs} == {2, 3, 4, 7, 16, 64}
    assert {spec.filter.hold for spec in specs} == {False, True}
    assert {spec.hardware.start for spec in specs} == {"zero", "steady"}
    assert {spec.channels for spec in specs} == {1, 2, 5, 8}
    assert {spec.inputs[0].signed for spec in specs} == {False, True}
    assert {spec.output.signed for spec in specs} == {False, True}
    bits = np.array([(spec.inputs[0].bits, spec.output.bits) for spec in specs])
    assert (bits.min(axis=0) <= 9).all()
    assert (bits.max(axis=0) >= 23).all()
