"""Hardware that gives all results of a stage: proven for each certificate, and nothing that was changed is accepted."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from tests.verify.chain.sealing import proven, replace_sealed

import sosmith
from sosmith.model.errors import ShortfallError
from sosmith.verify.graph import RejectedError
from sosmith.verify.verdict.shared_hardware import check_shared_hardware

TREE: dict[str, Any] = {
    "name": "rx",
    "sample_rate": 8000.0,
    "input": {"x": {"bits": 6, "range": [-1.0, 1.0], "signed": True}},
    "stage": [
        {"name": "up", "kind": "fir", "interpolate": 2, "taps": [0.25, 0.5, 1.0, 0.75, -0.25]},
        {"name": "half", "kind": "gain", "factor": 0.5},
    ],
    "output": {"bits": 8, "range": [-2.0, 2.0], "signed": True},
    "hardware": {"clock": 1e6},
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shared")
    chain = sosmith.design_chain(sosmith.ChainSpecification.load(TREE))
    chain.generate(folder)
    (folder / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "copy"))


@pytest.mark.parametrize("channels", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_all_of_a_start_from_zero_is_proven(channels: int, tmp_path: Path) -> None:
    tree = TREE | {"channels": channels, "hardware": {"clock": 1e6, "start": "zero"}}
    chain = sosmith.design_chain(sosmith.ChainSpecification.load(tree))
    chain.generate(tmp_path)
    (tmp_path / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    assert (tmp_path / "rx_up.sv").exists()
    assert not proven(tmp_path).missing


@pytest.mark.parametrize(
    ("taps", "given", "output"),
    [
        (
            [0.5, -0.825865, 0.5, -0.825865],
            {"range": [0.0, 16.0], "signed": False},
            {"bits": 12, "range": [0.0, 128.0], "signed": False},
        ),
        (
            [-0.00317, -725.86, 0.0003, -2903.44],
            {"range": [-0.5, 0.5], "signed": True},
            {"bits": 18, "range": [-128.0, 128.0], "signed": True},
        ),
    ],
    ids=["a result that is never above 0", "steps of more than half of the range"],
)
def test_limits_by_the_upper_bits_of_a_wide_sum_are_proven(
    taps: list[float], given: dict[str, Any], output: dict[str, Any], tmp_path: Path
) -> None:
    stage = {"name": "up", "kind": "fir", "interpolate": 2, "taps": taps}
    tree = TREE | {"input": {"x": {"bits": 5, **given}}, "stage": [stage], "output": output}
    chain = sosmith.design_chain(sosmith.ChainSpecification.load(tree))
    chain.generate(tmp_path)
    (tmp_path / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    assert (tmp_path / "rx_up.sv").exists()
    assert not proven(tmp_path).missing


def test_all_of_it_is_proven(folder: Path) -> None:
    proof = proven(folder)
    assert not proof.missing
    assert proof.scope["hardware"].state.value == proof.scope["rtlil"].state.value == "proven"
    assert {"rx_up.sv", "rx_up.il"} <= {path.name for path in folder.iterdir()}
    assert not (folder / "rx_up_p0.sv").exists()


@pytest.mark.sweep(3)
@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("[3] = 9'h080;", "[3] = 9'h0c0;", "m_axis_tdata must be .*, not another value"),
        ("[9] = 9'h015;", "[9] = 9'h014;", "m_axis_tdata must be .*, not another value"),
        ("turn_next = turn ? 2'h0", "turn_next = turn ? 2'h1", "turn must be 0 while the core waits for a sample"),
        ("_running = turn ? 1'h0 :", "_running = 1'h1 ? 1'h0 :", "a sample must bring 2 results, not 1 result"),
        ("if (!aresetn) turn <= 1'h0", "if (!aresetn) turn <= 1'h1", "turn must be 0 after a reset, not another value"),
        ("reg turn = 1'h0", "reg turn = 1'h1", "turn must be 0 before the first clock, not 1"),
    ],
)
def test_other_hardware_is_refused(old: str, new: str, sentence: str, folder: Path) -> None:
    replace_sealed(folder / "rx_up.sv", old, new)
    with pytest.raises(ShortfallError, match=rf"^stage up: {sentence}$"):
        proven(folder, spec=False)


def test_results_in_another_order_are_refused(written: Path) -> None:
    texts = [(written / f"rx_up.{end}").read_text(encoding="utf-8") for end in ("sv", "il")]
    first, second = (sosmith.Certificate.load(written / f"rx_up_p{k}.certificate.json").entries for k in (0, 1))
    right = check_shared_hardware(*texts, "rx_up", [first, second], lambda *_: None)
    assert [each.hardware.latency for each in right] == [8, 15]
    with pytest.raises(RejectedError, match=r"^m_axis_tdata must be .*, not another value$"):
        check_shared_hardware(*texts, "rx_up", [second, first], lambda *_: None)
    with pytest.raises(RejectedError, match=r"^m_axis_tdata must be .*, not another value$"):
        check_shared_hardware(*texts, "rx_up", [first], lambda *_: None)


def test_results_that_count_differently_are_refused(tmp_path: Path) -> None:
    tree = TREE | {"hardware": {"clock": 1e6, "start": "zero"}}
    sosmith.design_chain(sosmith.ChainSpecification.load(tree)).generate(tmp_path)
    texts = [(tmp_path / f"rx_up.{end}").read_text(encoding="utf-8") for end in ("sv", "il")]
    first, second = (sosmith.Certificate.load(tmp_path / f"rx_up_p{k}.certificate.json").entries for k in (0, 1))
    *stages, last = second.stages
    nodes = [
        node.model_copy(update={"high": 2}) if node.name in ("counted", "counted_next") else node for node in last.nodes
    ]
    assert nodes != list(last.nodes)
    other = second.model_copy(update={"stages": [*stages, last.model_copy(update={"nodes": nodes})]})
    with pytest.raises(RejectedError, match=r"^all results must count the samples since a start alike$"):
        check_shared_hardware(*texts, "rx_up", [first, other], lambda *_: None)


def test_other_rtlil_is_refused(folder: Path) -> None:
    replace_sealed(folder / "rx_up.il", "1'1", "1'0")
    with pytest.raises(ShortfallError, match=r"^stage up: "):
        proven(folder, spec=False)


def test_the_module_must_be_among_the_files(folder: Path) -> None:
    (folder / "rx_up.sv").unlink()
    with pytest.raises(sosmith.SosmithError, match=r"rx_up\.sv"):
        proven(folder, spec=False)


def test_a_result_by_itself_has_no_hardware(folder: Path) -> None:
    proof = sosmith.Certificate.load(folder / "rx_up_p1.certificate.json").verify(files=folder)
    assert proof.scope["hardware"].state.value == "not_read"
    assert proof.scope["hardware"].why == "its hardware is a module of a chain, and proven with that"
    assert proof.scope["c_model"].state.value == "proven"
