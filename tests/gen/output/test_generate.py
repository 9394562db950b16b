"""Generated files: the same bytes on every run, a manifest that tells the truth, a C model that compiles alone."""

import ctypes
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.gen.designs import ALL, EXAMPLES, example_design
from tests.gen.word_lengths.filters import stimulus

from sosmith.gen.output.generate import generate
from sosmith.model.dataflow.c_model import c_header, state_bytes
from sosmith.model.errors import SpecificationError
from sosmith.model.text_files import write_files


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if "locomotive" in name else []) for name in ALL]
)
def test_two_runs_write_the_same_bytes(name: str, tmp_path: Path) -> None:
    """The second run is another process with another hash seed."""
    design = example_design(name)
    first = generate(design, tmp_path / "one")
    subprocess.run(
        [sys.executable, "-m", "sosmith.cli", "generate", str(EXAMPLES / name), "-o", str(tmp_path / "two")],
        check=True,
        capture_output=True,
        env=os.environ | {"PYTHONHASHSEED": "4242"},
    )
    assert sorted(path.suffix for path in first) == [".c", ".h", ".il", ".json", ".json", ".sv"]
    for path in first:
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()


@pytest.mark.slow
def test_manifest_says_what_the_contract_asks(tmp_path: Path) -> None:
    design = example_design("flange_wear_locomotive.toml")
    generate(design, tmp_path)
    manifest = json.loads((tmp_path / f"{design.spec.name}.json").read_text(encoding="utf-8"))
    assert {
        "name",
        "core",
        "sosmith_version",
        "spec",
        "streams",
        "latency_cycles",
        "cycles_per_sample",
        "realization",
        "architecture",
        "sections",
        "formats",
        "error_bound",
        "cost",
    } <= manifest.keys()
    voltage, temperature = manifest["streams"]["s_axis"]["fields"]
    assert voltage == {
        "name": "voltage", "offset": 0, "width": 16, "signed": False, "lsb": 10 / 65536, "zero": 0.0, "unit": "V",
    }  # fmt: skip
    assert (temperature["offset"], temperature["unit"]) == (16, "degC")
    assert manifest["streams"]["m_axis"]["fields"][0]["unit"] == "mm"
    assert manifest["error_bound"] == pytest.approx(sum(manifest["error_parts"].values()))
    assert 0 < manifest["error_bound"] <= manifest["spec"]["output"]["max_error"]
    for section in manifest["sections"]:
        for coefficient in section["coefficients"]:
            assert coefficient["value"] == coefficient["integer"] / 2 ** coefficient["frac"]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("compiler", ["cc", "c++"])
def test_c_model_compiles_without_a_warning_and_computes(compiler: str, tmp_path: Path) -> None:
    """One sample at a time, as firmware would call it; the header also from C++."""
    design = example_design("flange_wear_bench.toml")
    generate(design, tmp_path)
    name = design.spec.name
    if compiler == "c++":
        (tmp_path / "use.cpp").write_text(f'#include "{name}.h"\nint main() {{ return sizeof({name}_state) == 0; }}\n')
        subprocess.run([compiler, "-Wall", "-Wextra", "-Werror", "-c", "use.cpp"], cwd=tmp_path, check=True)
        return
    flags = ["-O2", "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-shared", "-fPIC", "-o", "model.so"]
    subprocess.run([compiler, *flags, f"{name}.c"], cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "model.so"))
    step = library[f"{name}_step"]
    step.restype = ctypes.c_int64
    step.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p]
    state = np.zeros(64, dtype=np.int64)
    codes = stimulus(design.datapath.inputs, 6, 2000)
    computed = [step(state.ctypes.data, *sample, None) for sample in codes.tolist()]
    assert computed == design.datapath.compute(codes).tolist()


def test_c_model_of_many_samples_may_be_given_in_pieces(tmp_path: Path) -> None:
    """Its stages work on different samples at a time: pieces shorter than there are stages, none among them."""
    design = example_design("flange_wear_bench.toml")
    generate(design, tmp_path)
    name = design.spec.name
    command = [
        "cc",
        "-O2",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-pedantic",
        "-Werror",
        "-shared",
        "-fPIC",
        "-o",
        "model.so",
    ]
    subprocess.run([*command, f"{name}.c"], cwd=tmp_path, check=True)
    block = ctypes.CDLL(str(tmp_path / "model.so"))[f"{name}_block"]
    block.restype = None
    block.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t, *[ctypes.c_void_p] * 3]
    codes = stimulus(design.datapath.inputs, 7, 400).reshape(200, 2, 2)
    states = np.zeros((2, state_bytes(design.datapath)), dtype=np.uint8)
    result = np.empty((200, 2), dtype=np.int64)
    start = 0
    for length in (0, 1, 2, 3, 5, 8, 13, 21, 34, 113):
        block(states.ctypes.data, length, 2, codes[start:].ctypes.data, result[start:].ctypes.data, None)
        start += length
    assert start == 200
    assert np.array_equal(result, design.datapath.compute(codes))


def test_a_unit_cannot_end_the_comment_in_the_header() -> None:
    datapath = example_design("audio_lowpass.toml").datapath
    odd = replace(datapath, output=replace(datapath.output, unit="*/ #error"))
    assert c_header(odd).count("*/") == c_header(datapath).count("*/")


def test_modules_have_plain_names(tmp_path: Path) -> None:
    design = example_design("audio_lowpass.toml")
    generate(design, tmp_path)
    text = (tmp_path / "audio_lowpass.sv").read_text(encoding="utf-8")
    modules = re.findall(r"^module (\S+)\(", text, flags=re.MULTILINE)
    assert modules[0] == "audio_lowpass"
    assert all(re.fullmatch(r"audio_lowpass(_\w+)?", module) for module in modules)
    assert "always @" not in text


def test_an_output_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine")
    message = f"{tmp_path / 'taken'}: the output folder must be a folder that can be written, not: File exists"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        write_files(tmp_path / "taken", {"a": "b"})
    assert (tmp_path / "taken").read_text() == "mine"
