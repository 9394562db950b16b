"""Rocq accepts the bound of a chain, at one rate and with stages that decimate, and refuses claims that are wrong."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from tests.verify.rocq.small import library, needs_coqc

import sosmith
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.chain.chain_file import ChainCertificate, read_chain
from sosmith.verify.chain.check import read_cores
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq import chain as door

GAIN: dict[str, Any] = {"name": "half", "kind": "gain", "factor": 0.7}
MEAN: dict[str, Any] = {"name": "mean", "kind": "fir", "taps": [0.25, 0.5, 0.25]}
LOW: dict[str, Any] = {"name": "low", "kind": "iir", "family": "butterworth", "order": 1, "cutoff": 2000.0}
DOWN: dict[str, Any] = {"name": "down", "kind": "cic", "order": 2, "decimate": 2}
Changed = tuple[ChainCertificate, list[tuple[Certificate, ...]]]


def tree(*stages: dict[str, Any], **hardware: Any) -> dict[str, Any]:
    return {
        "name": "duo",
        "sample_rate": 8000.0,
        "input": {"x": {"bits": 6, "range": [0.0, 2.0]}},
        "stage": list(stages),
        "output": {"bits": 6, "range": [0.0, 2.0], "max_error": 0.04},
        "hardware": {"start": "zero"} | hardware,
    }


def written(folder: Path, *stages: dict[str, Any], **hardware: Any) -> Changed:
    sosmith.design_chain(tree(*stages, **hardware)).generate(folder)
    chain = read_chain(folder / "duo.certificate.json")
    return chain, read_cores(chain, folder)


@pytest.fixture
def compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Take theories that are compiled already."""
    place = tmp_path / "library"
    place.mkdir()
    library(place)

    def copied(folder: Path, *_: object) -> None:
        for file in place.glob("*.vo"):
            shutil.copy(file, folder)

    monkeypatch.setattr(door, "compile_theories", copied)


@pytest.mark.slow
@needs_coqc
@pytest.mark.usefixtures("compiled")
def test_the_bound_of_a_chain_is_accepted(tmp_path: Path) -> None:
    verdict = door.check_chain_in_rocq(*written(tmp_path, GAIN, MEAN))
    assert [name for name in verdict.claims if ":" not in name] == [
        *("input_is_limited", "codes_1_within", "own_gain_0", "gain_up_to_0", "gain_behind_0", "stage_0"),
        *("no_port_limits", "chain_is_bounded", "chain_is_allowed"),
    ]
    assert "half: error_is_bounded" in verdict.claims
    assert "ClassicalDedekindReals.sig_forall_dec" in verdict.axioms
    assert not verdict.unchecked


@needs_coqc
@pytest.mark.slow
@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize(
    ("stages", "start"),
    [
        ([LOW, MEAN], "steady"),
        ([DOWN, LOW | {"cutoff": 800.0}], "zero"),
        ([DOWN, MEAN | {"decimate": 2}, GAIN], "steady"),
        ([LOW, DOWN, LOW | {"name": "last", "cutoff": 500.0}], "steady"),
        ([MEAN], "steady"),
    ],
    ids=["recursion", "decimates", "decimates twice", "recursions", "one stage"],
)
def test_chains_of_all_kinds_are_accepted(stages: list[dict[str, Any]], start: str, tmp_path: Path) -> None:
    verdict = door.check_chain_in_rocq(*written(tmp_path, *stages, start=start))
    assert "chain_is_bounded" in verdict.claims
    assert verdict.unchecked == (("what folds in the chain as a whole",) if DOWN in stages else ())


def _entry(k: int, **keys: Callable[[Fraction], Fraction]) -> Callable[[Changed], Changed]:
    def change(made: Changed) -> Changed:
        chain, groups = made
        stages = list(chain.stages)
        stages[k] = stages[k].model_copy(update={key: of(getattr(stages[k], key)) for key, of in keys.items()})
        return chain.model_copy(update={"stages": tuple(stages)}), groups

    return change


def _whole(key: str, of: Callable[[Fraction], Fraction]) -> Callable[[Changed], Changed]:
    return lambda made: (made[0].model_copy(update={key: of(getattr(made[0], key))}), made[1])


def _port(made: Changed) -> Changed:
    """Let the second stage take another unit than the first one gives."""
    chain, (first, (second,)) = made
    port = second.inputs[0].model_copy(update={"lsb": second.inputs[0].lsb * Fraction(101, 100)})
    return chain, [first, (second.model_copy(update={"inputs": (port,)}),)]


def _less(value: Fraction) -> Fraction:
    return value * Fraction(99, 100)


@needs_coqc
@pytest.mark.slow
@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize(
    ("change", "theorem"),
    [
        (_entry(0, error=_less), "stage_0 "),
        (_entry(0, gain=_less), "gain_behind_0 "),
        (_entry(1, error=_less), "chain_is_bounded "),
        (_whole("bound", _less), "chain_is_bounded "),
        (_whole("max_error", lambda value: value / 10), "chain_is_allowed "),
    ],
)
def test_a_claim_that_is_wrong_is_refused_by_the_kernel(
    change: Callable[[Changed], Changed], theorem: str, tmp_path: Path
) -> None:
    with pytest.raises(RejectedError, match=f"^Rocq must accept {theorem}"):
        door.check_chain_in_rocq(*change(written(tmp_path, GAIN, MEAN)))


@needs_coqc
@pytest.mark.slow
@pytest.mark.usefixtures("compiled")
def test_stages_that_do_not_fit_are_refused_by_the_kernel(tmp_path: Path) -> None:
    with pytest.raises(RejectedError, match=r"^(mean: )?Rocq must accept "):
        door.check_chain_in_rocq(*_port(written(tmp_path, GAIN, MEAN)))


@pytest.mark.parametrize(
    ("stages", "why"),
    [
        ([MEAN | {"taps": [0.5, 1.0, 0.5], "interpolate": 2}], "stage mean interpolates: give it with the certificate"),
        ([LOW | {"decimate": 2, "cutoff": 400.0}], "stage low has one: give it with the certificate of each stage"),
    ],
)
def test_other_chains_are_refused_with_a_sentence(stages: list[dict[str, Any]], why: str, tmp_path: Path) -> None:
    chain = tree(*stages)
    chain["output"]["bits"] = 8
    sosmith.design_chain(chain).generate(tmp_path)
    with pytest.raises(SpecificationError, match=f"^--rocq must have a chain of filters of which none .* {why}"):
        sosmith.ChainCertificate.load(tmp_path / "duo.certificate.json").check_in_rocq()


def test_the_same_theorems_are_written_for_other_machines(tmp_path: Path) -> None:
    made = written(tmp_path, GAIN, MEAN)
    paths = sosmith.ChainCertificate.load(tmp_path / "duo.certificate.json").export_rocq(tmp_path / "rocq")
    assert [path.name for path in paths[-4:]] == ["Stage0.v", "Stage1.v", "Whole.v", "Makefile"]
    assert {path.name: path.read_text(encoding="utf-8") for path in paths} == door.chain_texts(*made)
    (tmp_path / "duo_half.certificate.json").write_text("{}", encoding="utf-8")
    with pytest.raises(ShortfallError, match=r"must have the SHA-256 "):
        sosmith.ChainCertificate.load(tmp_path / "duo.certificate.json").export_rocq(tmp_path / "rocq")
