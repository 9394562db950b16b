"""The command `verify` with what a certificate can be held against."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.commands.invocation import Invocation
from tests.gen.designs import EXAMPLES, example_design
from tests.gen.word_lengths.decimated import small
from tests.verify.multirate.decimators import Instrument
from tests.verify.parallel.cores import specified
from tests.verify.small_specifications import PLAIN

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generate
from sosmith.model.errors import ShortfallError

NAME = "audio_lowpass"
SPEC = EXAMPLES / f"{NAME}.toml"

command = Invocation("verify", columns=200)


def partial(*arguments: str) -> str:
    """Call it with files: nothing is wrong, but not all of them are proven. Return the table."""
    result = command.run(*arguments)
    assert result.exit_code == 4
    return result.stdout


def entries(*arguments: str) -> Any:
    """Call it likewise, but content with a part; return what is said to programs."""
    return json.loads(command.good(*arguments, "--partial", "--json").stdout)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("verified")
    generate(example_design(f"{NAME}.toml"), folder)
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "copy"))


def test_against_everything(folder: Path) -> None:
    path = str(folder / f"{NAME}.certificate.json")
    table = command.good(path, "--spec", str(SPEC), "--files", str(folder), "--rebuild").stdout
    assert "proven: audio_lowpass, " in table
    assert "as specified: ports and allowed error and filter within a peak gain of " in table
    assert " instructions in the SystemVerilog compute these graphs, for all inputs and states\n" in table
    assert "unchanged: 5 files and the certificate itself, by their SHA-256\n" in table
    assert "rebuilt: 5 files, the same byte for byte\n" in table
    found = json.loads(command.good(path, "--spec", str(SPEC), "--files", str(folder), "--json").stdout)
    states = {name: part["state"] for name, part in found["scope"].items() if part["asked"]}
    assert states == {
        "arithmetic": "proven",
        "filter": "proven",
        "manifest": "proven",
        "hardware": "proven",
        "program": "proven",
        "unit": "proven",
        "flags": "proven",
        "liveness": "proven",
        "c_model": "proven",
        "rtlil": "proven",
    }
    assert found["proven"] is True
    words = " ".join(table.split())
    for name, part in found["scope"].items():
        assert (f"{part['state'].replace('_', ' ')}: {name}: {part['why']}" in words) == part["asked"]
    assert found["specification"]["core"] == "filter"
    assert found["specification"]["calibration_from_measurements"] is False
    assert 0 < found["specification"]["filter_distance"] < 1e-50
    assert (found["files_compared"], found["files_rebuilt"]) == (5, 0)
    assert found["program_instructions"] > 50


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("channels", "key"),
    [
        (1, {"realization": "df1_ef1"}),
        (2, {"realization": "df1_ef1"}),
        (1, {"realization": "df1_ef1", "samples_per_clock": 2}),
        (1, {"pipeline": "look-ahead"}),
    ],
)
def test_a_parallel_core(channels: int, key: dict[str, Any], tmp_path: Path) -> None:
    spec = specified(PLAIN.replace("sample_rate", f"channels = {channels}\nsample_rate"))
    hardware = replace(spec.hardware, **{"architecture": "parallel", **key})
    generate(design_core(replace(spec, hardware=hardware)), tmp_path)
    path = str(tmp_path / "plain.certificate.json")
    table = command.good(path, "--files", str(tmp_path), "--partial").stdout
    memories = r" and \d+ memories" if channels > 1 or "pipeline" in key else ""
    assert re.search(
        r"hardware: the SystemVerilog computes these graphs, each sample \d+ clocks later, in \d+ registers"
        + memories
        + r", \d+ of them states",
        table,
    )
    found = entries(path, "--files", str(tmp_path))
    assert found["hardware_registers"] > 10
    assert found["program_instructions"] is None


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("architecture", "key"),
    [
        (architecture, key)
        for architecture in ("folded", "parallel")
        for key in ({"protect": "detect"}, {"reload": True})
    ],
)
def test_what_is_not_read_is_said(architecture: str, key: dict[str, Any], tmp_path: Path) -> None:
    spec = specified(PLAIN)
    hardware = replace(spec.hardware, **{"architecture": architecture, "realization": "df1_ef1", **key})
    generate(design_core(replace(spec, hardware=hardware)), tmp_path)
    path = str(tmp_path / "plain.certificate.json")
    table = partial(path, "--files", str(tmp_path))
    assert table == command.good(path, "--files", str(tmp_path), "--partial").stdout
    why = "constants that can be loaded are" if "reload" in key else "hardware with protection against upsets is"
    assert f"not read: hardware: {why} not proven\n" in table


def test_without_anything_else_as_before(folder: Path) -> None:
    found = json.loads(command.good(str(folder / f"{NAME}.certificate.json"), "--json").stdout)
    assert (found["specification"], found["files_compared"], found["files_rebuilt"]) == (None, 0, 0)
    assert found["proven"] is True
    assert [name for name, part in found["scope"].items() if part["asked"]] == ["arithmetic"]


def test_disagreement_is_a_sentence(folder: Path, tmp_path: Path) -> None:
    path = folder / f"{NAME}.certificate.json"
    other = tmp_path / "other.toml"
    other.write_text(SPEC.read_text(encoding="utf-8") + "# a remark\n", encoding="utf-8")
    result = command.run(str(path), "--spec", str(other))
    assert isinstance(result.exception, ShortfallError)
    assert str(result.exception).startswith(f"{path}: the specification must have the SHA-256 ")
    assert str(result.exception).endswith(": it says the same in other words")
    (folder / f"{NAME}.h").write_text("", encoding="utf-8")
    result = command.run(str(path), "--files", str(folder))
    assert isinstance(result.exception, ShortfallError)
    assert str(result.exception).startswith(f"{path}: {folder / f'{NAME}.h'} must have the SHA-256 ")


@pytest.mark.slow
def test_a_certificate_without_a_subject_cannot_be_held_against_one(folder: Path) -> None:
    path = folder / f"{NAME}.certificate.json"
    tree = json.loads(path.read_text(encoding="utf-8"))
    del tree["about"]
    path.write_text(json.dumps(tree), encoding="utf-8")
    command.good(str(path))
    for option in (["--spec", str(SPEC)], ["--files", str(folder)], ["--rebuild"]):
        command.refused(
            f"{path}: the certificate must say which specification and files it is about, and does not",
            str(path),
            *option,
            kind=ShortfallError,
        )


@pytest.mark.slow
@pytest.mark.parametrize("core", ["filter", "instrument"])
def test_the_decimator_of_several_channels_is_read(core: str, tmp_path: Path) -> None:
    generate(small("channels = 3\n", core), tmp_path)
    found = entries(str(tmp_path / "slight.certificate.json"), "--files", str(tmp_path))
    assert found["program_instructions"] > 10


@pytest.mark.slow
def test_a_decimated_instrument_in_parallel_is_proven_whole(tmp_path: Path) -> None:
    case = Instrument("parallel")
    generate(design_core(specified(case.text), core=case.core), tmp_path)
    path = str(tmp_path / "plain.certificate.json")
    found = entries(path, "--files", str(tmp_path))
    assert found["program_instructions"] is None
    assert min(found[f"{part}_registers"] for part in ("calibration", "hardware", "decimator")) > 10
    table = partial(path, "--files", str(tmp_path))
    for part in ("calibration", "hardware"):
        sentence = rf"^{part}: the SystemVerilog computes these graphs, each sample \d+ clocks later, in \d+ registers"
        assert re.search(sentence, table, re.MULTILINE)
    assert "proven: hardware: " in table


@pytest.mark.slow
def test_a_decimated_instrument_has_two_programs(tmp_path: Path) -> None:
    generate(small(), tmp_path)
    path = str(tmp_path / "slight.certificate.json")
    found = entries(path, "--files", str(tmp_path))
    counts = found["calibration_instructions"], found["program_instructions"]
    assert min(counts) > 10
    assert (
        f"programs: {counts[0]} and {counts[1]} instructions in the SystemVerilog compute these graphs, for all "
        "inputs and states; the units that run them are not part of it\n"
    ) in partial(path, "--files", str(tmp_path))
