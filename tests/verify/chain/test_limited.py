"""The proof of limits of some stages of a chain, those that were chosen beside others."""

from __future__ import annotations

import copy
import shutil
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from tests.gen.chain.automatic.asked import TREE
from tests.verify.chain.sealing import CERTIFICATE, changed, sealed_again

import sosmith
from sosmith.model.errors import ShortfallError

BESIDE: dict[str, Any] = TREE | {
    "stage": [
        {"name": "level", "kind": "gain", "factor": 0.75},
        *TREE["stage"],
        {"name": "pole", "kind": "iir", "family": "butterworth", "order": 1, "cutoff": 100.0, "realization": "df1_ef1"},
    ]
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("beside")
    sosmith.design_chain(BESIDE).generate(folder)
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "copy"))


def asked(folder: Path, change: Callable[[dict[str, Any]], object] = lambda tree: None) -> Path:
    tree = copy.deepcopy(BESIDE)
    change(tree)
    path = folder / "asked.toml"
    path.write_text(sosmith.ChainSpecification.load(tree).toml(), encoding="utf-8")
    return path


def proven(folder: Path, spec: Path | None) -> sosmith.ChainProof:
    return sosmith.ChainCertificate.load(folder / CERTIFICATE).verify(spec=spec)


@pytest.mark.slow
def test_what_was_chosen_beside_others_is_proven_from_either_specification(folder: Path) -> None:
    for spec in (folder / "rx.toml", asked(folder)):
        proof = sosmith.ChainCertificate.load(folder / CERTIFICATE).verify(files=folder, spec=spec)
        assert not proof.missing
        assert proof.scope["stages"].why.endswith("ask for, and some of them by themselves keep to their limits")
        assert proof.scope["chain"].why.endswith("; gains in the pass band lie between those that are claimed")


def times(factor: Fraction) -> Callable[[str], str]:
    return lambda text: str(Fraction(text) * factor)


def drop(tree: dict[str, Any]) -> None:
    tree["limited"] = None


def drop_kept(tree: dict[str, Any]) -> None:
    tree["limited"]["kept"] = None


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (changed("limited.kept.least.gain", times(Fraction(11, 10))), r"^the smallest gain in the pass band must be"),
        (changed("limited.kept.most.gain", times(Fraction(9, 10))), r"^the largest gain in the pass band must be"),
        (changed("limited.kept.stopped.gain", times(Fraction(9, 10))), r"^the largest gain in the stop band must be"),
        (changed("limited.passing.gain", times(Fraction(9, 10))), r"^the largest gain into the pass band must be"),
        (changed("limited.factor", lambda _: 4), r"^the factor of what folds must be 8, not 4$"),
        (changed("limited.first", lambda _: 0), r"^the largest gain of what folds must be that at"),
        (changed("limited.last", lambda _: 7), r"^limits must be of stages that there are, 0 to 2, not 1 to 7$"),
        (changed("limited.edge", times(Fraction(1, 2))), r"^the largest gain into the pass band must be reached at"),
        (drop, r"^the stages with limits of their own must be as the specification of the chain says, \(1, 1\), not"),
        (drop_kept, r"^some stages with limits must claim the gains in their pass band$"),
    ],
)
def test_a_claim_that_does_not_follow_is_refused(
    change: Callable[[dict[str, Any]], None], sentence: str, folder: Path
) -> None:
    sealed_again(folder, change)
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, folder / "rx.toml")


def factor(tree: dict[str, Any]) -> None:
    tree["stage"][0]["factor"] = 0.5


def loss(tree: dict[str, Any]) -> None:
    tree["stage"][1]["passband_loss"] = 0.4


def alone(tree: dict[str, Any]) -> None:
    del tree["stage"][2]


def more(tree: dict[str, Any]) -> None:
    tree["stage"][1]["decimate"] = 16


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (factor, r"^the stages before those that were chosen must be as the specification says, .*$"),
        (loss, r"^the limits must be as the specification says, .*$"),
        (alone, r"^the limits must be as the specification says, .*$"),
        (more, r"^all stages must decimate by 16, not 8$"),
    ],
)
def test_stages_that_were_chosen_for_another_request_are_refused(
    change: Callable[[dict[str, Any]], None], sentence: str, folder: Path
) -> None:
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, asked(folder, change))


def test_limits_of_other_stages_than_those_that_were_chosen_are_refused(folder: Path) -> None:
    """The words of the certificate say that the pole is among the stages that keep to the limits."""
    text = (folder / "rx.toml").read_text(encoding="utf-8").replace('last = "down_fir"', 'last = "pole"')
    sealed_again(folder, changed("specification", lambda _: text))
    with pytest.raises(ShortfallError, match=r"^the limits must be as the specification says, .*$"):
        proven(folder, asked(folder))
