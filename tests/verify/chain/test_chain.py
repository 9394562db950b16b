"""The proof of a chain: what it accepts, and that it refuses each claim, wire and word that was changed."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from tests.verify.chain.sealing import CERTIFICATE, changed, less, more, proven, replace_sealed, sealed_again

import sosmith
from sosmith.gen.chain import design as chain_design
from sosmith.gen.chain.response import Segment, gain_into_passband
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.verify.certificate_file import SectionEntry, on_grid
from sosmith.verify.chain.responses import Part, peak_gain

TREE: dict[str, Any] = {
    "name": "rx",
    "sample_rate": 8000.0,
    "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    "stage": [
        {"name": "slow", "kind": "cic", "order": 2, "decimate": 2},
        {"name": "low", "kind": "iir", "family": "butterworth", "order": 2, "cutoff": 400.0, "architecture": "folded"},
        {"name": "out", "kind": "fir", "taps": [0.25, 0.5, 0.25], "decimate": 2},
    ],
    "output": {"bits": 10, "range": [-1.0, 1.0], "signed": True},
}
COMMENT = r"^line \d+ of rx\.c must have a comment of plain letters$"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("chain")
    chain = sosmith.design_chain(TREE)
    chain.generate(folder)
    (folder / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "copy"))


def test_all_of_a_chain_is_proven(folder: Path) -> None:
    proof = proven(folder)
    assert not proof.missing
    assert {"chain", "stages", "top"} <= {name for name, part in proof.scope.items() if part.state.value == "proven"}
    assert proof.files == 19
    assert sum(proof.budget.values()) == pytest.approx(proof.bound)
    assert proof.bound <= proof.allowed


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        {"channels": 2},
        {"hardware": {"realization": "auto", "architecture": "auto", "multipliers": "auto", "keep": True}},
        {"hardware": {"clock": 24.0e6, "architecture": "folded", "multipliers": 1}},
    ],
)
def test_words_of_the_whole_are_those_of_its_stages(words: dict[str, Any], tmp_path: Path) -> None:
    chain = sosmith.design_chain(TREE | words)
    chain.generate(tmp_path)
    (tmp_path / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    assert not proven(tmp_path).missing


@pytest.mark.slow
def test_a_filter_inside_a_mask_is_a_stage(tmp_path: Path) -> None:
    edges = {"passband_edge": 200.0, "stopband_edge": 900.0, "passband_loss": 1.0, "stopband_loss": 20.0}
    masked = {"name": "low", "kind": "iir", "family": "butterworth", "freedom": "mask", **edges}
    chain = sosmith.design_chain({**TREE, "stage": [TREE["stage"][0], masked]})
    chain.generate(tmp_path)
    words = chain.specification.toml()
    (tmp_path / "rx.toml").write_text(words, encoding="utf-8")
    proof = proven(tmp_path)
    assert not proof.missing
    assert "low: it keeps to the edges and losses" in str(proof.scope["filter"])


def test_sealing_again_changes_nothing(folder: Path) -> None:
    before = (folder / CERTIFICATE).read_bytes()
    sealed_again(folder)
    assert (folder / CERTIFICATE).read_bytes() == before


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        ("stages.0.gain", less, r"^the gain behind stage slow must be .*, not .*$"),
        ("stages.0.gain", more, r"^the gain behind stage slow must be .*, not .*$"),
        ("stages.1.error", less, r"^the error of stage low must be .*, not .*$"),
        ("bound", less, r"^the bound of the chain must be .*, not .*$"),
        ("max_error", lambda _: "1/4096", r"^the bound of the chain must be at most 0\.000244141, not .*$"),
        ("folding.0.anywhere.gain", less, r"^the largest gain of what folds must be at least .*, not .*$"),
        (
            "folding.0.anywhere.gain",
            more,
            r"^the largest gain of what folds must be that at .* or little more, not .*$",
        ),
        ("folding.0.passing.gain", less, r"^the largest gain into the pass band must be at least .*, not .*$"),
        ("folding.0.factor", lambda _: 8, r"^the factor of what folds must be 4, not 8$"),
        ("settling", lambda _: 1, r"^settling of the chain must be 0 results, not 1$"),
        ("channels", lambda _: 2, r"^stage slow must have 2 channels, not 1$"),
        ("stages.2.kind", lambda _: "polynomial", r"^stage out must have a polynomial if it is one, and no other$"),
    ],
)
def test_a_claim_that_does_not_follow_is_refused(
    path: str, value: Callable[[Any], Any], sentence: str, folder: Path
) -> None:
    sealed_again(folder, changed(path, value))
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, spec=False)


def test_a_certificate_that_was_changed_is_refused(folder: Path) -> None:
    text = (folder / CERTIFICATE).read_text(encoding="utf-8")
    (folder / CERTIFICATE).write_text(text.replace('"channels": 1', '"channels": 2'), encoding="utf-8")
    with pytest.raises(ShortfallError, match=r"^the SHA-256 of the certificate itself must be .*: it was changed$"):
        proven(folder)


def test_a_stage_that_was_changed_is_refused(folder: Path) -> None:
    path = folder / "rx_low.certificate.json"
    path.write_text(path.read_text(encoding="utf-8") + " ", encoding="utf-8")
    with pytest.raises(ShortfallError, match=r"rx_low\.certificate\.json must have the SHA-256 .*, not .*$"):
        proven(folder)


@pytest.mark.parametrize("name", ["rx_low.certificate.json", "rx.sv", "rx_slow.sv"])
def test_a_link_out_of_the_folder_is_not_followed(name: str, folder: Path) -> None:
    elsewhere = folder.parent / name
    (folder / name).rename(elsewhere)
    (folder / name).symlink_to(elsewhere)
    with pytest.raises(ShortfallError, match=r"must be a file that can be read, not: it is a symbolic link$"):
        proven(folder, spec=False)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            ".s_axis_tvalid(gated_tvalid)",
            ".s_axis_tvalid(stage_slow_tvalid)",
            r"^s_axis_tvalid of rx_low must be the net gated_tvalid, not stage_slow_tvalid$",
        ),
        (
            ".i_tuser(stage_slow_tuser)",
            ".i_tuser(stage_low_tuser)",
            r"^i_tuser of rx_flags must be the net stage_slow_",
        ),
        (".m_axis_tuser(last_tuser)", ".m_axis_tuser(m_axis_tuser)", r"."),
        (".s_axis_tdata(stage_low_tdata)", ".s_axis_tdata(stage_slow_tdata)", r"^s_axis_tdata of rx_out must be the "),
        (
            ".aresetn(aresetn),\n    .s_axis_tdata(stage_low",
            ".aresetn(s_axis_tvalid),\n    .s_axis_tdata(stage_low",
            r"^aresetn of rx_out must be that of rx, not s_axis_tvalid$",
        ),
        ("endmodule", "  reg held;\n  always_ff @(posedge aclk) held <= aresetn;\nendmodule", r"alone$"),
        (
            "endmodule",
            "  wire spare;\n  assign spare = aresetn;\nendmodule",
            r"^rx must have instances and wires alone$",
        ),
        ("  rx_low stage_low (", "  rx_slow stage_low (", r"."),
    ],
)
def test_another_wire_is_refused(old: str, new: str, sentence: str, folder: Path) -> None:
    path = folder / "rx.sv"
    text = path.read_text(encoding="utf-8")
    assert old in text
    before, after = text.rsplit(old, 1)
    path.write_text(before + new + after, encoding="utf-8")
    sealed_again(folder)
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, spec=False)


@pytest.mark.parametrize(
    ("file", "old", "new", "sentence"),
    [
        ("rx.c", "result, &flags))", "result, NULL))", r"^rx\.c must have & after "),
        ("rx.c", "flags & 1", "flags & 3", r"^rx\.c must have 1 after "),
        ("rx.c", "state->kept = 0;", "", r"^rx\.c must have state after "),
        ("rx.c", "return 1;", "return 0;", r"^rx\.c must have 1 after "),
        (
            "rx.c",
            "return 1;",
            "/* *\\\n/ return 0; /* */ return 1;",
            r"^line \d+ of rx\.c must have a comment of plain letters$",
        ),
        (
            "rx.c",
            "return 1;",
            "/* *??/\n/ return 0; /* */ return 1;",
            r"^line \d+ of rx\.c must have a comment of plain letters$",
        ),
        ("rx.c", "return 1;", "return\u00a01;", r"^line \d+ of rx\.c must be of the C that is written for a model$"),
        ("rx.c", "return 1;", "return 1; // 0", r"^line \d+ of rx\.c must not have what means something else$"),
        ("rx.c", "return 1;", "return 1%:;", r"^line \d+ of rx\.c must not have what means something else$"),
        ("rx.h", "rx_low_state stage_low;", "rx_slow_state stage_low;", r"^rx\.h must have rx_low_state after "),
        ("rx.json", '"decimate": 4', '"decimate": 2', r"^decimate of the manifest must be 4, not 2$"),
        ("rx.json", '"channels": 1', '"channels": true', r"^channels of the manifest must be 1, not True$"),
        ("rx.json", '"kind": "iir"', '"kind": "other", "kind": "iir"', r"^the manifest must be JSON$"),
    ],
)
def test_another_model_or_manifest_is_refused(file: str, old: str, new: str, sentence: str, folder: Path) -> None:
    replace_sealed(folder / file, old, new)
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, spec=False)


@pytest.mark.parametrize("name", ["../other/rx", "", "rx\0", "/rx", "rx.y"])
def test_a_name_that_leads_out_of_the_folder_is_refused_before_a_file_is_read(name: str, folder: Path) -> None:
    def change(tree: dict[str, Any]) -> None:
        tree["name"] = name

    before = sorted(path.name for path in folder.iterdir())
    sealed_again(folder, change)
    with pytest.raises(ShortfallError, match=r"^the name of a chain must be a plain identifier, not "):
        proven(folder, spec=False)

    def change_stage(tree: dict[str, Any]) -> None:
        tree["name"] = "rx"
        change(tree["stages"][0])

    sealed_again(folder, change_stage)
    with pytest.raises(ShortfallError, match=r"^the name of a stage must be a plain identifier, not "):
        proven(folder, spec=False)
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('architecture = "folded"', 'architecture = "parallel"'),
        ('architecture = "folded"', 'architecture = "folded"\nrealization = "df1"'),
        ("[output]", "[hardware]\nclock = 24.0e6\n\n[output]"),
        ("[output]", "[hardware]\nkeep = true\n\n[output]"),
    ],
)
def test_other_hardware_than_the_words_ask_for_is_refused(old: str, new: str, folder: Path) -> None:
    path = folder / "rx.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    sealed_again(folder, lambda tree: tree.update(specification=path.read_text(encoding="utf-8")))
    with pytest.raises(
        ShortfallError, match=r"^the hardware of stage \w+ must be as the specification of the chain says"
    ):
        sosmith.ChainCertificate.load(folder / CERTIFICATE).verify(spec=path)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("edge", [None, "1/40"])
def test_another_pass_band_than_that_of_the_words_is_refused(edge: str | None, folder: Path) -> None:
    """What is claimed of it is true, of another band than the one that the specification states."""
    change = changed("folding.0.edge", lambda _: "1/20") if edge is None else changed("folding.0.edge", lambda _: edge)

    def narrow(tree: dict[str, Any]) -> None:
        change(tree)
        if edge is None:
            tree["folding"][0] |= {"edge": None, "passing": None}
        else:
            tree["folding"][0]["passing"] = passing

    passing = tight_passing(folder, Fraction(edge)) if edge is not None else None
    sealed_again(folder, narrow)
    proven(folder, spec=False)
    with pytest.raises(ShortfallError, match=r"^the edge of the pass band, in units of the highest rate, must be as "):
        proven(folder)


def tight_passing(folder: Path, edge: Fraction) -> dict[str, str]:
    """Return what is reached of what folds into a pass band that ends at `edge`."""
    parts = sosmith.design_chain(folder / "rx.toml").core.parts
    peak = gain_into_passband(Segment(parts), edge)
    return {"gain": str(on_grid(peak.gain)), "at": str(peak.at)}


def test_another_name_of_the_output_than_that_of_the_words_is_refused(folder: Path) -> None:
    sealed_again(folder, changed("output.name", lambda _: "z"))
    proven(folder, spec=False)
    with pytest.raises(ShortfallError, match=r"^the output must be as the specification of the chain says, "):
        proven(folder)


def test_a_manifest_in_another_encoding_is_refused(folder: Path) -> None:
    path = folder / "rx.json"
    path.write_bytes(path.read_text(encoding="utf-8").encode("utf-16"))
    sealed_again(folder)
    with pytest.raises(ShortfallError, match=r"^rx\.json must be UTF-8$"):
        proven(folder, spec=False)


def test_other_words_are_refused(folder: Path) -> None:
    path = folder / "rx.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("cutoff = 400.0", "cutoff = 401.0"), encoding="utf-8")
    with pytest.raises(ShortfallError, match=r"^the specification must have the text in the certificate of the chain$"):
        proven(folder)
    other = path.read_text(encoding="utf-8")
    sealed_again(folder, lambda tree: tree.update(specification=other))
    with pytest.raises(
        ShortfallError, match=r"^the filter of stage low must be as the specification of the chain says"
    ):
        proven(folder)


@pytest.mark.slow
def test_a_port_between_stages_that_limits_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each core is proven by itself; that nothing is limited between them is proven of the chain alone."""
    wide = chain_design._Budget._port

    def narrow(self: Any, *arguments: Any) -> Any:
        port = wide(self, *arguments)
        return replace(port, bits=port.bits - 2)

    monkeypatch.setattr(chain_design._Budget, "_port", narrow)
    sosmith.design_chain(TREE).generate(tmp_path)
    certificate = sosmith.ChainCertificate.load(tmp_path / CERTIFICATE)
    with pytest.raises(ShortfallError, match=r"^the port behind stage slow must hold magnitudes of .*, not end at .*$"):
        certificate.verify()


def test_a_response_too_long_to_compute_is_refused_before_it_is_computed() -> None:
    moving = SectionEntry(numerator=(Fraction(1, 64),) * 64, denominator=(Fraction(1),))
    with pytest.raises(ShortfallError, match=r"^the response of a chain must have at most 4194304 samples$"):
        peak_gain([Part((moving,), 64)] * 5, steady=True)


def test_a_certificate_without_a_file_has_no_stages_beside_it() -> None:
    certificate = sosmith.design_chain(TREE | {"stage": TREE["stage"][2:]}).certificate
    with pytest.raises(
        SpecificationError, match=r"^the certificate of a chain must be read from a file, beside those of"
    ):
        certificate.verify()
    assert json.loads(certificate.text())["format"] == "sosmith chain certificate 1"
