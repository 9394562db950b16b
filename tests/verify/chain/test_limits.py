"""The proof of limits of a whole chain: of each claim, and of the words of both specifications."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from tests.gen.chain.automatic.asked import TREE, asked
from tests.verify.chain.sealing import CERTIFICATE, changed, sealed_again

import sosmith
from sosmith.model.errors import ShortfallError

KEPT = "folding.0.kept"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("chosen")
    sosmith.design_chain(TREE).generate(folder)
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "copy"))


def words(folder: Path, tree: dict[str, Any]) -> Path:
    path = folder / "asked.toml"
    path.write_text(sosmith.ChainSpecification.load(tree).toml(), encoding="utf-8")
    return path


def proven(folder: Path, spec: Path | None) -> sosmith.ChainProof:
    return sosmith.ChainCertificate.load(folder / CERTIFICATE).verify(files=folder, spec=spec)


@pytest.mark.slow
def test_what_was_chosen_is_proven_from_either_specification(folder: Path) -> None:
    for spec in (folder / "rx.toml", words(folder, TREE)):
        proof = proven(folder, spec)
        assert not proof.missing
        assert proof.scope["stages"].why.endswith("ask for, and the whole keeps to its limits")
        assert proof.scope["chain"].why.endswith("; gains in the pass band lie between those that are claimed")


def times(factor: Fraction) -> Callable[[str], str]:
    return lambda text: str(Fraction(text) * factor)


MORE, LESS = Fraction(1000004, 1000000), Fraction(999996, 1000000)
MUCH_MORE, MUCH_LESS = Fraction(102, 100), Fraction(98, 100)


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        (f"{KEPT}.least.gain", times(MORE), r"^the smallest gain in the pass band must be at most .*, not .*$"),
        (f"{KEPT}.least.gain", times(LESS), r"^the smallest gain in the pass band must be that at .* little less, not"),
        (f"{KEPT}.most.gain", times(LESS), r"^the largest gain in the pass band must be at least .*, not .*$"),
        (f"{KEPT}.most.gain", times(MORE), r"^the largest gain in the pass band must be that at .* little more, not"),
        (
            f"{KEPT}.least.at",
            lambda _: "1/4",
            r"^the smallest gain in the pass band must be reached there",
        ),
        (
            f"{KEPT}.most.at",
            lambda _: "1/4",
            r"^the largest gain in the pass band must be reached at a",
        ),
        (f"{KEPT}.stopped.gain", times(MUCH_LESS), r"^the largest gain in the stop band must be at least .*, not .*$"),
        (f"{KEPT}.stopped.gain", times(MUCH_MORE), r"^the largest gain in the stop band must be that at .*, not .*$"),
        (f"{KEPT}.stop", lambda _: "1/1000", r"^the stop band must begin behind the pass band, not at 1/1000$"),
        (f"{KEPT}.stopped", lambda _: None, r"^a stop band must have both an edge and a gain$"),
        ("folding.0.passing.gain", times(MUCH_LESS), r"^the largest gain into the pass band must be at least .*$"),
    ],
)
def test_a_gain_that_does_not_follow_is_refused(
    path: str, value: Callable[[Any], Any], sentence: str, folder: Path
) -> None:
    sealed_again(folder, changed(path, value))
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, None)


def drop(tree: dict[str, Any]) -> None:
    del tree["folding"][0]["kept"]


def other_stop(tree: dict[str, Any]) -> None:
    tree["folding"][0]["kept"] |= {"stop": None, "stopped": None}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (drop, r"^a chain with limits must claim the gains in its pass band, and what aliases into it$"),
        (other_stop, r"^the stop band must begin at 9/80 of the sample rate, not None$"),
    ],
)
def test_a_claim_that_is_left_out_is_missed(
    change: Callable[[dict[str, Any]], None], sentence: str, folder: Path
) -> None:
    sealed_again(folder, change)
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, folder / "rx.toml")


@pytest.mark.parametrize(
    ("limits", "sentence"),
    [
        ("passband_loss = 0.001", r"^gains in the pass band must differ by at most 0\.001 dB, not be 0\.\d+ to "),
        ("stopband_loss = 60.0", r"^what aliases into the pass band must be 60 dB below .*, not .*$"),
    ],
)
def test_limits_that_the_gains_do_not_keep_to_are_refused(limits: str, sentence: str, folder: Path) -> None:
    """The words of the certificate are changed with those of the file, so that only the limits speak against them."""
    key = limits.split(maxsplit=1)[0]
    text = (folder / "rx.toml").read_text(encoding="utf-8")
    head, _, rest = text.partition("[limits]")
    lines = [limits if line.startswith(key) else line for line in rest.splitlines()]
    other = head + "[limits]" + "\n".join(lines) + "\n"
    (folder / "rx.toml").write_text(other, encoding="utf-8")
    sealed_again(folder, changed("specification", lambda _: other))
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, folder / "rx.toml")


@pytest.mark.parametrize(
    ("tree", "sentence"),
    [
        (asked(passband_loss=0.4), r"^the limits must be as the specification says, .*, not .*$"),
        (asked(stopband_edge=None), r"^the limits must be as the specification says, .*, not .*$"),
        (asked(decimate=4), r"^all stages must decimate by 4, not 8$"),
        (asked() | {"sample_rate": 8001.0}, r"^sample_rate must be as the specification says, 8001\.0, not 8000\.0$"),
        (asked() | {"hardware": {"clock": 1e6}}, r"^hardware must be as the specification says, .*, not None$"),
        (asked() | {"channels": 2}, r"^channels must be as the specification says, 2, not None$"),
    ],
)
def test_stages_that_were_chosen_for_another_request_are_refused(
    tree: dict[str, Any], sentence: str, folder: Path
) -> None:
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, words(folder, tree))


def test_a_stage_that_is_no_filter_of_a_gain_of_one_is_none_that_was_chosen(folder: Path) -> None:
    text = (folder / "rx.toml").read_text(encoding="utf-8")
    amplified = text.replace("[limits]", '[[stage]]\nname = "amp"\nkind = "gain"\nfactor = 2.0\n\n[limits]')
    sealed_again(folder, changed("specification", lambda _: amplified))
    with pytest.raises(ShortfallError, match=r"^stage amp must be a filter that was chosen, not of the kind gain$"):
        proven(folder, words(folder, TREE))
