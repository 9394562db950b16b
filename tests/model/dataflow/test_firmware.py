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


@pytest.mark.slow
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


@pytest.mark.slow
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
    assert {each.calls for each in recorded().models} == {0}
    goal = next(each for each in recorded().models if (each.example, each.core) == ("audio_lowpass", "Cortex-M4"))
    assert goal.instructions <= 70
    ours, *others = recorded().peers
    assert ours.error < 1
    assert len(others) == 3


CHECKED = ["-fsanitize=undefined", "-fno-sanitize-recover=all", "-Wno-unused-function"]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("small", [False, True], ids=["", "16 bits by 16 bits"])
@pytest.mark.parametrize("name", ["audio_lowpass", "flange_wear_bench", "flange_wear_locomotive"])
def test_nothing_is_left_undefined_and_the_codes_are_those_of_the_graph(name: str, small: bool, tmp_path: Path) -> None:
    """Random codes, the ends of the range, and steps between them; also with products as small cores compute them."""
    datapath = example_design(f"{name}.toml").datapath.behind_decimator
    written(datapath, tmp_path)
    rng = np.random.default_rng(6)
    ends = np.array([[port.lowest, port.highest] for port in datapath.inputs]).T
    codes = rng.integers(ends[0], ends[1] + 1, (600, len(datapath.inputs)))
    codes[200:400] = ends[rng.integers(0, 2, 200)]
    codes[400:500], codes[500:] = ends[1], ends[0]
    rows = ", ".join("{" + ", ".join(map(str, row)) + "}" for row in codes.tolist())
    arguments = ", ".join(f"codes[n][{k}]" for k in range(len(datapath.inputs)))
    (tmp_path / "main.c").write_text(
        f'#include "{name}.c"\n#include <stdio.h>\n'
        f"static const int64_t codes[600][{len(datapath.inputs)}] = {{{rows}}};\n"
        f"int main(void)\n{{\n    {name}_state state;\n    {name}_reset(&state);\n"
        f"    for (int n = 0; n < 600; n++) {{\n        uint8_t status;\n"
        f'        printf("%lld\\n", (long long){name}_step(&state, {arguments}, &status));\n'
        "    }\n    return 0;\n}\n",
        encoding="utf-8",
    )
    options = ["-D__thumb__"] if small else []
    subprocess.run(["cc", "-O1", *CHECKED, *options, "main.c", "-o", "main"], cwd=tmp_path, check=True)
    found = subprocess.run(["./main"], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert found.stderr == ""
    assert [int(line) for line in found.stdout.split()] == datapath.compute_exact(codes)
