"""The C model as firmware: it compiles under strict rules, filters in place, and its page shows its figures."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest
from benchmarks.firmware import PAGE, document, recorded
from tests.gen.designs import example_design

from sosmith.model.dataflow.c_model import c_header, c_source, state_bytes
from sosmith.model.dataflow.datapath import Datapath

STRICT = ["-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-pedantic", "-Werror", "-fPIC"]


def written(datapath: Datapath, folder: Path) -> str:
    """Write the model, and return its name."""
    (folder / f"{datapath.name}.h").write_text(c_header(datapath), encoding="utf-8")
    (folder / f"{datapath.name}.c").write_text(c_source(datapath), encoding="utf-8")
    return datapath.name


@pytest.mark.parametrize("example", ["audio_lowpass", "flange_wear_bench"])
def test_no_conversion_is_left_to_the_compiler(example: str, tmp_path: Path) -> None:
    datapath = example_design(f"{example}.toml").datapath
    name = written(datapath, tmp_path)
    subprocess.run(["cc", "-std=c99", *STRICT, "-c", f"{name}.c", "-o", "model.o"], cwd=tmp_path, check=True)
    codes = ", ".join("0" for _ in datapath.inputs)
    step = f"{name}_state state{{}}; return {name}_step(&state, {codes}, nullptr);"
    (tmp_path / "user.cpp").write_text(
        f'#include "{name}.h"\nint64_t first();\nint64_t first() {{ {step} }}\n', encoding="utf-8"
    )
    subprocess.run(["g++", "-std=c++11", *STRICT, "-c", "user.cpp", "-o", "user.o"], cwd=tmp_path, check=True)


@pytest.mark.parametrize("with_status", [False, True])
def test_a_block_of_one_input_may_be_filtered_in_place(with_status: bool, tmp_path: Path) -> None:
    datapath = example_design("audio_lowpass.toml").datapath
    name = written(datapath, tmp_path)
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", f"{name}.c", "-o", "model.so"], cwd=tmp_path, check=True)
    block = ctypes.CDLL(str(tmp_path / "model.so"))[f"{name}_block"]
    block.restype, block.argtypes = None, [ctypes.c_void_p, *[ctypes.c_size_t] * 2, *[ctypes.c_void_p] * 3]
    codes = np.random.default_rng(5).integers(-32768, 32768, (500, 3, 1))
    wanted = datapath.compute(codes)
    states, status = np.zeros((3, state_bytes(datapath)), np.uint8), np.zeros((500, 3), np.uint8)
    block(states.ctypes.data, 500, 3, codes.ctypes.data, codes.ctypes.data, status.ctypes.data if with_status else None)
    assert np.array_equal(codes[..., 0], wanted)
    assert "out may be in itself" in c_header(datapath)


def test_the_page_shows_the_figures_recorded() -> None:
    assert PAGE.read_text(encoding="utf-8") == document(recorded())
    assert {each.calls for each in recorded() if each.core == "Cortex-M4"} == {0}
