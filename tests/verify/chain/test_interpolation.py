"""The proof of a chain that interpolates: what it accepts, and that it refuses each claim, wire and word changed."""

from __future__ import annotations

import copy
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.gen.chain.rising import UP
from tests.verify.chain.sealing import CERTIFICATE, changed, less, more, proven, replace_sealed, sealed_again

import sosmith
from sosmith.gen.specification.exact_values import exact
from sosmith.gen.specification.toml_text import toml_text
from sosmith.model.errors import ShortfallError

TREE = UP | {
    "stage": [UP["stage"][0] | {"architecture": "parallel"}, *UP["stage"][1:]],
    "hardware": {"start": "zero"},
}
"""Cores side by side in the first stage, one multiplier for all results in the last."""


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rising")
    chain = sosmith.design_chain(TREE)
    chain.generate(folder)
    (folder / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "copy"))


@pytest.mark.slow
def test_all_of_a_chain_that_interpolates_is_proven(folder: Path) -> None:
    proof = proven(folder)
    assert not proof.missing
    assert {"chain", "stages", "top", "c_model"} <= {n for n, p in proof.scope.items() if p.state.value == "proven"}
    assert proof.files == 4 + 5 * 3 + 2 + 3 * 4


@pytest.mark.slow
@pytest.mark.parametrize(
    "stages",
    [
        [UP["stage"][0] | {"family": "equiripple", "taps": None, "passband_edge": 3000.0, "stopband_edge": 5000.0}],
        [UP["stage"][0] | {"taps": [0.125, 0.25, 0.375, 0.5, 0.375, 0.25, 0.125], "interpolate": 3}],
        [{"name": "half", "kind": "halfband", "interpolate": 2, "passband_edge": 3000.0}],
        [{"name": "down", "kind": "cic", "order": 3, "decimate": 4}, UP["stage"][2]],
    ],
    ids=["equiripple", "by 3", "halfband", "down first"],
)
def test_filters_of_all_kinds_are_proven(stages: list[dict[str, Any]], tmp_path: Path) -> None:
    tree = copy.deepcopy(TREE | {"stage": stages})
    losses = {"passband_loss": 0.1, "stopband_loss": 40.0}
    full = [stage | (losses if "passband_edge" in stage else {}) for stage in tree["stage"]]
    tree["stage"] = [{key: value for key, value in stage.items() if value is not None} for stage in full]
    chain = sosmith.design_chain(tree)
    chain.generate(tmp_path)
    (tmp_path / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    assert not proven(tmp_path).missing


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        ("stages.0.gain", less, r"^the gain behind stage fill must be .*, not .*$"),
        ("stages.0.error", more, r"^the error of stage fill must be .*, not .*$"),
        ("folding.0.rise", lambda _: 4, r"^the rise of what folds must be 8, not 4$"),
        ("folding.0.anywhere.gain", less, r"^the largest gain of what folds must be at least .*, not .*$"),
        ("folding.0.passing.gain", less, r"^the largest gain into the pass band must be at least .*, not .*$"),
        ("folding", lambda _: [], r"^what folds must be claimed of each of 1 parts of the chain .*, not of 0$"),
        ("settling", lambda old: old + 1, r"^settling of the chain must be \d+ results, not \d+$"),
        ("stages.0.kind", lambda _: "iir", r"^the cores of stage fill must be one for the kind iir, not 2$"),
        ("stages.0.certificates", lambda old: old[:1], r"^the certificate of stage fill must be rx_fill\.certificate"),
        ("stages.0.certificates", lambda old: old[::-1], r"^the certificate of stage fill_p0 must be rx_fill_p0\."),
    ],
)
def test_a_claim_that_does_not_follow_is_refused(
    path: str, value: Callable[[Any], Any], sentence: str, folder: Path
) -> None:
    sealed_again(folder, changed(path, value))
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, spec=False)


@pytest.mark.sweep(4)
@pytest.mark.parametrize(
    ("file", "old", "new", "sentence"),
    [
        (
            "rx.sv",
            ".s_axis_tvalid(stage_fill_p1_given)",
            ".s_axis_tvalid(stage_fill_p0_given)",
            r"^s_axis_tvalid of rx_fill_p1 must be the net stage_fill_p1_given, not stage_fill_p0_given$",
        ),
        ("rx.sv", ".i1_tdata(stage_fill_p1_tdata)", ".i1_tdata(stage_fill_p0_tdata)", r"^i1_tdata of rx_fill_turns "),
        (
            "rx.sv",
            "  rx_fill_p1 stage_fill_p1 (",
            "  rx_fill_p0 stage_fill_p1 (",
            r"^every module must be part of rx, not rx_fill_p1, ",
        ),
        ("rx.sv", "assign stays = ~all1;", "assign stays = all1;", r"^rx_fill_turns must assign "),
        (
            "rx.c",
            "rx_fill_p1_step(&state->stage_fill_p1",
            "rx_fill_p1_step(&state->stage_fill_p0",
            r"^rx\.c must have ",
        ),
        ("rx.c", "return total;", "return i;", r"^rx\.c must have total after "),
        ("rx.h", "#define RX_RESULTS 8", "#define RX_RESULTS 7", r"^rx\.h must have #define RX_RESULTS 8 after "),
        ("rx.json", '"interpolate": 8', '"interpolate": 4', r"^interpolate of the manifest must be 8, not 4$"),
    ],
)
def test_another_file_is_refused(file: str, old: str, new: str, sentence: str, folder: Path) -> None:
    replace_sealed(folder / file, old, new)
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, spec=False)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            "taps = [0.25, 0.5,",
            "taps = [0.5, 0.5,",
            r"^the taps of stage fill, phase 0, must be as the specification of ",
        ),
        ("order = 2", "order = 3", r"^the taps of stage out, phase 0, must be as the specification of the chain says"),
        ("cutoff = 2000.0", "cutoff = 2001.0", r"^the filter of stage low must be as the specification of the chain"),
        ("interpolate = 4", "decimate = 4", r"^the number of cores of stage out must be as .* says, 1, not 4$"),
    ],
)
def test_other_words_are_refused(old: str, new: str, sentence: str, folder: Path) -> None:
    path = folder / "rx.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    sealed_again(folder, lambda tree: tree.update(specification=path.read_text(encoding="utf-8")))
    with pytest.raises(ShortfallError, match=sentence):
        sosmith.ChainCertificate.load(folder / CERTIFICATE).verify(spec=path)


def test_a_file_of_taps_is_read_by_the_proof(tmp_path: Path) -> None:
    """And another file than the one that the stage was made from is refused."""
    stage = {"name": "fill", "kind": "fir", "interpolate": 2, "taps_file": "taps.csv"}
    taps = ["0.25", "0.5", "1.0", "0.75", "0.25", "0.1", "0.0"]
    (tmp_path / "taps.csv").write_text("\n".join(taps), encoding="utf-8")
    text = toml_text(exact(TREE | {"stage": [stage]}))
    (tmp_path / "rx.toml").write_text(text, encoding="utf-8")
    sosmith.design_chain(tmp_path / "rx.toml").generate(tmp_path)
    assert not proven(tmp_path).missing
    for k, other in ((5, "0.2"), (6, "0.125"), (0, "-0.25")):
        (tmp_path / "taps.csv").write_text("\n".join([*taps[:k], other, *taps[k + 1 :]]), encoding="utf-8")
        with pytest.raises(
            ShortfallError, match=rf"^the taps of stage fill, phase {k % 2}, must be as the specification"
        ):
            proven(tmp_path)


@pytest.mark.slow
def test_check_bits_of_all_cores_are_proven(tmp_path: Path) -> None:
    """But for the hardware of such cores; and a fault of one core that is not one of all is refused."""
    tree = TREE | {"stage": [TREE["stage"][0] | {"protect": "detect"}, UP["stage"][1]]}
    chain = sosmith.design_chain(tree)
    chain.generate(tmp_path)
    (tmp_path / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    scope = proven(tmp_path).scope
    assert all(scope[name].state.value == "proven" for name in ("chain", "stages", "top", "c_model"))
    assert scope["hardware"].is_missing
    path = tmp_path / "rx.sv"
    text = path.read_text(encoding="utf-8")
    for old, new in (("own | {1'h0, any1, 6'h0}", "own"), ("any1 = fault1 | any0", "any1 = any0")):
        replace_sealed(path, old, new)
        with pytest.raises(ShortfallError, match=r"^rx_fill_turns must assign "):
            proven(tmp_path)
        path.write_text(text, encoding="utf-8")
    sealed_again(tmp_path)
    other = sosmith.design_chain(tree | {"stage": TREE["stage"][:2]})
    other.generate(tmp_path / "plain")
    for file in (tmp_path / "plain").glob("rx_fill_p1.*"):
        shutil.copy(file, tmp_path)
    sealed_again(tmp_path)
    with pytest.raises(ShortfallError, match=r"^the cores of stage fill must have the same protect$"):
        proven(tmp_path, spec=False)


@pytest.mark.slow
def test_registers_that_cores_share_are_joined_to_them(tmp_path: Path) -> None:
    """What the registers do is not proven, and `verify` says so; each wire to them is."""
    tree = TREE | {"stage": [UP["stage"][0] | {"reload": True}]}
    chain = sosmith.design_chain(tree)
    chain.generate(tmp_path)
    (tmp_path / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    scope = proven(tmp_path).scope
    assert all(scope[name].state.value == "proven" for name in ("chain", "stages", "arithmetic", "c_model"))
    assert scope["top"].why.endswith("; not proven are the registers that the cores of fill share")
    path = tmp_path / "rx.sv"
    text = path.read_text(encoding="utf-8")
    for old, new, sentence in (
        (
            ".reload_bank(stage_fill_reload_bank)",
            ".reload_bank(stage_fill_p0_reload_begun)",
            "the pins of rx_fill_p0 at",
        ),
        (".reload_write(stage_fill_p1_", ".reload_write(stage_fill_p0_", "the pins of rx_fill_p1 at which constants"),
        (".i_between(stage_fill_between)", ".i_between(aresetn)", "the ports of rx_fill_registers must be at "),
        (".i1_free(stage_fill_p1_", ".i1_free(stage_fill_p0_", "the ports of rx_fill_registers must be at "),
        (".i1_begun(stage_fill_p1_", ".i1_begun(stage_fill_p0_", "i1_begun of rx_fill_turns must be the net "),
        ("assign between = none | every1;", "assign between = none | every0;", "rx_fill_turns must assign "),
        (".s_axil_awaddr(s_axil_fill_awaddr)", ".s_axil_awaddr(s_axil_fill_araddr)", "the registers' net s_axil_"),
    ):
        replace_sealed(path, old, new)
        with pytest.raises(ShortfallError, match=f"^{sentence}"):
            proven(tmp_path, spec=False)
        path.write_text(text, encoding="utf-8")
    sealed_again(tmp_path, lambda tree: tree["files"].pop())
    with pytest.raises(
        ShortfallError, match=r"^the files of the chain must be .*, rx_fill_registers\.h, rx_fill\.rdl, not "
    ):
        proven(tmp_path, spec=False)
