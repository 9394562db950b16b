"""Filters of several channels whose multipliers take turns: equal to the model in any order, after any reset."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.hdl.cores.resets import check_resets
from tests.interface.decimating_firs import OTHERS, draw

import sosmith

FEW = (0, 4)
CASES = [pytest.param(seed, marks=[] if seed in FEW else pytest.mark.slow) for seed in range(OTHERS)]


def drawn(seed: int) -> sosmith.Specification:
    """Draw a filter for 2 to 8 channels."""
    tree = draw(seed).specification.as_dict() | {"channels": 2 + seed % 7}
    tree["hardware"]["architecture"] = "parallel"
    return sosmith.Specification.load(tree)


@pytest.mark.parametrize("seed", CASES)
def test_results_are_those_of_the_model_after_any_reset(seed: int, tmp_path: Path) -> None:
    seen = check_resets(sosmith.design(drawn(seed)), tmp_path, seed)
    assert seen.results > 3
    assert seen.resets > 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(OTHERS))
def test_certificate_and_files_are_proven(seed: int, tmp_path: Path) -> None:
    spec = drawn(seed)
    (tmp_path / "down.toml").write_text(spec.toml(), encoding="utf-8")
    sosmith.design(spec).generate(tmp_path)
    read = sosmith.Certificate.load(tmp_path / f"down{seed}.certificate.json")
    proof = read.verify(spec=tmp_path / "down.toml", files=tmp_path)
    assert not proof.missing
    assert {part.state.value for name, part in proof.scope.items() if name != "calibration"} == {"proven"}


def test_the_draws_are_of_all_kinds() -> None:
    specs = [drawn(seed).checked for seed in range(OTHERS)]
    assert {spec.channels for spec in specs} == set(range(2, 9))
    assert {spec.filter.hold for spec in specs} == {False, True}
    assert {spec.hardware.start for spec in specs} == {"zero", "steady"}
    assert {spec.filter.decimate for spec in specs} == {2, 3, 4, 7, 16, 64}
