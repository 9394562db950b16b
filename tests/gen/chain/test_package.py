"""The package of a chain: its bench passes in Icarus and in C, sees a change, and the linter has nothing to say."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
from tests.gen.chain.chains import GUARDED, PLAIN
from tests.gen.output.packages.made import called

import sosmith
from sosmith.gen.chain.package import packed_chain

PASS = re.compile(r"^PASS: (\d+) results, 0 mismatches$", re.MULTILINE)
TREES = {"plain": PLAIN, "guarded": GUARDED}


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
    ("way", "file", "old", "new"),
    [
        ("c", "rx.c", "state->kept = 0;", ""),
        ("icarus", "rx.sv", "assign next_kept = due ? 1'h0 : gathered;", "assign next_kept = gathered;"),
    ],
)
def test_flags_of_other_samples_fail(way: str, file: str, old: str, new: str, tmp_path: Path) -> None:
    folder = unpacked("plain", tmp_path)
    text = (folder / "core" / file).read_text(encoding="utf-8")
    assert old in text
    (folder / "core" / file).write_text(text.replace(old, new), encoding="utf-8")
    result = called("make", way, at=folder / "bench")
    assert result.returncode != 0
    assert "FAIL" in result.stdout


def test_verilator_says_nothing_beyond_what_is_waived(tmp_path: Path) -> None:
    folder = unpacked("plain", tmp_path)
    files = [f"core/{name}.sv" for name in ("rx_slow", "rx_double", "rx_out", "rx")]
    command = ["verilator", "--lint-only", "-Wall", "--top-module", "rx", "verilator/rx.vlt", *files]
    result = called(*command, at=folder, simulator="verilator")
    assert result.returncode == 0, result.stderr


@pytest.mark.slow
def test_the_core_file_has_the_modules_in_order() -> None:
    text = packed("plain")["rx.core"]
    assert re.findall(r"core/(\w+)\.sv", text) == ["rx_slow", "rx_double", "rx_out", "rx"]
    assert "| `s_axil_out_awaddr` | in |" in packed("guarded")["README.md"]
