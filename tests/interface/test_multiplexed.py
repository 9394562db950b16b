"""Random filters whose sections share hardware: within the bound, hardware equal to its model, files proven."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from tests.interface.multiplexed_draws import drawn

import sosmith

SEEDS = range(80)
FEW = (6, 46, 55, 65)
SAMPLES = 400
CASES = [pytest.param(seed, marks=[] if seed in FEW else pytest.mark.slow) for seed in SEEDS]

DOUBLE = 1e-9
"""What a reference in double precision may err, of the output's range."""


@cache
def made(seed: int) -> sosmith.Design | None:
    """Return a design; None where the specification is refused."""
    try:
        return sosmith.design(drawn(seed))
    except (sosmith.ShortfallError, sosmith.SpecificationError):
        return None


def codes_for(design: sosmith.Design, seed: int) -> npt.NDArray[np.int64]:
    (port,) = design.core.datapath.inputs
    codes = np.random.default_rng(seed).integers(port.lowest, port.highest + 1, SAMPLES)
    codes[100:200] = port.highest
    codes[200:300] = port.lowest
    return codes


def designed(seed: int) -> sosmith.Design:
    design = made(seed)
    if design is None:
        pytest.skip("this specification is refused")
    return design


def test_most_are_possible() -> None:
    assert sum(made(seed) is not None for seed in FEW) == len(FEW)


@pytest.mark.slow
def test_most_of_all_are_possible() -> None:
    assert sum(made(seed) is not None for seed in SEEDS) >= 60


@pytest.mark.parametrize("seed", CASES)
def test_no_error_exceeds_the_bound(seed: int) -> None:
    design = designed(seed)
    output = design.core.spec.output
    (port,) = design.core.datapath.inputs
    x = port.decode(codes_for(design, seed))
    error = np.abs(design.run(x=x) - design.run_exact(x=x)).max()
    assert error <= float(design.bound) + DOUBLE * (output.highest - output.lowest) * float(output.lsb)
    assert float(design.bound) <= float(design.core.spec.max_error)


@pytest.mark.parametrize("seed", CASES)
def test_certificate_and_files_are_proven(seed: int, tmp_path: Path) -> None:
    design = designed(seed)
    name = f"turns{seed}"
    (tmp_path / f"{name}.toml").write_text(sosmith.Specification.load(drawn(seed)).toml(), encoding="utf-8")
    design.generate(tmp_path)
    proof = sosmith.Certificate.load(tmp_path / f"{name}.certificate.json").verify(
        spec=tmp_path / f"{name}.toml", files=tmp_path
    )
    assert not proof.missing
    assert proof.scope["hardware"].state.value == "proven"


@pytest.mark.parametrize(
    ("simulator", "seed"),
    [
        pytest.param(simulator, seed, marks=[] if simulator == "icarus" and seed in FEW[:2] else pytest.mark.slow)
        for simulator in ("verilator", "icarus")
        for seed in SEEDS
    ],
)
def test_hardware_equals_the_model(simulator: str, seed: int, tmp_path: Path) -> None:
    design = designed(seed)
    (port,) = design.core.datapath.inputs
    x = port.decode(codes_for(design, seed))
    assert design.simulate({"x": x}, folder=tmp_path, simulator=simulator, seed=seed).bit_exact
