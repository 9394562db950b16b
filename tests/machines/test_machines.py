"""What is generated is the same on every machine: made under the settings that make one machine compute like others."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.machines.made_files import ROOT, SUBJECTS

# X86_V4 is AVX-512, X86_V3 has AVX2 and FMA: OpenBLAS and numpy each choose their kernels by what they find.
SETTINGS = {
    "AVX2": {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"},
    "AVX-512": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "SSE": {"OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"},
}
"""Environments by the instructions that they leave; a name that numpy does not know is ignored by it."""


def runnable() -> list[str]:
    """Name the settings that this processor can run: one without AVX-512 cannot be made to compute with it."""
    flags = Path("/proc/cpuinfo").read_text(encoding="utf-8").split() if Path("/proc/cpuinfo").exists() else []
    needed = {"AVX2": {"avx2", "fma"}, "AVX-512": {"avx512f", "avx512bw", "avx512vl", "avx512dq", "avx512cd"}}
    return [name for name in SETTINGS if needed.get(name, set()) <= set(flags)]


def made(folder: Path, setting: str, *subjects: str) -> dict[str, bytes]:
    """Make `subjects` in a process of its own; return the content of every file by its path."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("OPENBLAS_", "NPY_"))}
    subprocess.run(
        [sys.executable, "-m", "tests.machines.made_files", str(folder), *subjects],
        cwd=ROOT,
        env=environment | SETTINGS[setting],
        check=True,
        capture_output=True,
    )
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def differences(folder: Path, *subjects: str) -> list[str]:
    """Make `subjects` under all settings; return the paths of the files that are not the same."""
    settings = runnable()
    if len(settings) < 2:
        pytest.skip("this processor can run one set of instructions only")
    first, *others = (made(folder / setting, setting, *subjects) for setting in settings)
    assert len(first) > len(subjects)
    return [path for other in others for path in sorted({*first, *other}) if first.get(path) != other.get(path)]


@pytest.mark.slow
def test_a_filter_is_the_same_everywhere(tmp_path: Path) -> None:
    assert differences(tmp_path, "elliptic_band_pass") == []


@pytest.mark.slow
@pytest.mark.parametrize("subject", SUBJECTS)
def test_everything_is_the_same_everywhere(subject: str, tmp_path: Path) -> None:
    assert differences(tmp_path, subject) == []
