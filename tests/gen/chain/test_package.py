"""The package of a chain: its bench passes in Icarus and in C, sees a change, and the linter has nothing to say."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
from tests.gen.chain import rising
from tests.gen.chain.chains import GUARDED, PLAIN
from tests.gen.output.packages.made import called

import sosmith
from sosmith.gen.chain.package import packed_chain

PASS = re.compile(r"^PASS: (\d+) results, 0 mismatches$", re.MULTILINE)
THIRD = {"name": "third", "kind": "fir", "taps": [0.25, 0.5, 0.25], "decimate": 3}
UP = {**rising.UP, "channels": 2, "stage": [rising.UP["stage"][0], THIRD]}
"""Two results for three samples of two channels."""
TREES = {"plain": PLAIN, "guarded": GUARDED, "up": UP}


CORES = {
    "plain": ("rx_slow", "rx_double", "rx_out", "rx"),
    "up": ("rx_fill", "rx_third", "rx"),
}


@cache
def packed(name: str) -> dict[str, str]:
    return packed_chain(sosmith.design_chain(TREES[name]).core)


def unpacked(name: str, folder: Path) -> Path:
    for path, text in packed(name).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    return folder


@pytest.mark.sweep(1)
@pytest.mark.parametrize("way", ["c", "icarus", pytest.param("verilator", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", TREES)
def test_the_bench_passes(name: str, way: str, tmp_path: Path) -> None:
    folder = unpacked(name, tmp_path)
    result = called("make", way, at=folder / "bench", simulator="verilator" if way == "verilator" else "icarus")
    assert result.returncode == 0, result.stdout + result.stderr
    (count,) = PASS.findall(result.stdout)
    assert int(count) == packed(name)["bench/rx_responses.hex"].count("\n") > 500


@pytest.mark.parametrize(
    ("name", "way", "file", "old", "new"),
    [
        ("plain", "c", "rx.c", "state->kept = 0;", ""),
        ("plain", "icarus", "rx.sv", "assign next_kept = due ? 1'h0 : gathered;", "assign next_kept = gathered;"),
        ("up", "c", "rx.c", "state->kept = 0;", ""),
        pytest.param(
            "up", "icarus", "rx_fill.sv", "steps_memory[2] = 8'h20;", "steps_memory[2] = 8'h40;", marks=pytest.mark.slow
        ),
    ],
)
def test_flags_or_results_of_other_samples_fail(
    name: str, way: str, file: str, old: str, new: str, tmp_path: Path
) -> None:
    folder = unpacked(name, tmp_path)
    text = (folder / "core" / file).read_text(encoding="utf-8")
    assert old in text
    (folder / "core" / file).write_text(text.replace(old, new), encoding="utf-8")
    result = called("make", way, at=folder / "bench")
    assert result.returncode != 0
    assert "FAIL" in result.stdout


@pytest.mark.parametrize("chain", CORES)
def test_verilator_says_nothing_beyond_what_is_waived(chain: str, tmp_path: Path) -> None:
    folder = unpacked(chain, tmp_path)
    files = [f"core/{name}.sv" for name in CORES[chain]]
    command = ["verilator", "--lint-only", "-Wall", "--top-module", "rx", "verilator/rx.vlt", *files]
    result = called(*command, at=folder, simulator="verilator")
    assert result.returncode == 0, result.stderr


@pytest.mark.slow
def test_the_core_file_has_the_modules_in_order() -> None:
    text = packed("plain")["rx.core"]
    assert re.findall(r"core/(\w+)\.sv", text) == ["rx_slow", "rx_double", "rx_out", "rx"]
    assert "| `s_axil_out_awaddr` | in |" in packed("guarded")["README.md"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(len(rising.SHAPES)))
def test_the_bench_of_a_chain_that_interpolates_passes(seed: int, tmp_path: Path) -> None:
    chain = sosmith.design_chain(rising.draw(seed))
    chain.package(tmp_path)
    for way in ("c", "icarus") if seed % 3 == 0 else ("c",):
        result = called("make", way, at=tmp_path / "bench", simulator="icarus")
        assert result.returncode == 0, result.stdout + result.stderr
        (count,) = PASS.findall(result.stdout)
        assert int(count) == (tmp_path / f"bench/{chain.name}_responses.hex").read_text().count("\n") > 20
