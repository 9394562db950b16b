"""The bench of a package runs in Icarus, in Verilator and in C, and sees a coefficient that is off by one unit."""

import re
from pathlib import Path

import numpy as np
import pytest
from tests.gen.output.packages.made import SPECIFICATIONS, called, design_of, spoil, unpacked

from sosmith.gen.output.packages.stimuli import bench_stimuli
from sosmith.gen.stimuli import bench_of
from sosmith.model.scenarios.worst_case_inputs import sign_matched

PASS = re.compile(r"^PASS: (\d+) samples, 0 mismatches$", re.MULTILINE)
FAIL = re.compile(r"^FAIL: .*\b[1-9]\d* mismatches", re.MULTILINE)


@pytest.mark.parametrize(
    ("way", "name"),
    [("c", name) for name in SPECIFICATIONS]
    + [("icarus", "plain"), ("icarus", "gauge"), pytest.param("icarus", "tunable", marks=pytest.mark.slow)],
)
def test_the_bench_passes_and_counts(way: str, name: str, tmp_path: Path) -> None:
    folder = unpacked(name, tmp_path)
    result = called("make", way, at=folder / "bench")
    assert result.returncode == 0, result.stdout + result.stderr
    (count,) = PASS.findall(result.stdout)
    assert int(count) == bench_stimuli(design_of(name).core).vectors.responses.size > 1000


SPOILT = {"icarus": ("core/plain.sv", r"\* \$signed\(12'(h)([0-9a-f]+)\)"), "c": ("core/plain.c", r"(C)\((\d{4})\)")}


@pytest.mark.parametrize("way", SPOILT)
def test_one_unit_in_one_coefficient_fails(way: str, tmp_path: Path) -> None:
    folder = unpacked("plain", tmp_path)
    file, constant = SPOILT[way]
    assert spoil(folder / file, constant) >= 2
    result = called("make", way, at=folder / "bench")
    assert result.returncode != 0
    assert FAIL.search(result.stdout), result.stdout


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plain", "gauge"])
def test_verilator_takes_the_same_bench(name: str, tmp_path: Path) -> None:
    folder = unpacked(name, tmp_path)
    result = called("make", "verilator", at=folder / "bench", simulator="verilator")
    assert result.returncode == 0, result.stderr
    assert PASS.search(result.stdout)
    sv = folder / "core" / f"{name}.sv"
    assert (
        spoil(sv, r"\* \$signed\(\d+'(h)([0-9a-f]+)\)" if name != "tunable" else r"<= \d+'(h)([1-9a-f][0-9a-f]+);") > 0
    )
    result = called("make", "verilator", at=folder / "bench", simulator="verilator")
    assert result.returncode != 0
    assert "FAIL" in result.stdout


def test_a_core_that_stops_is_not_waited_for(tmp_path: Path) -> None:
    folder = unpacked("plain", tmp_path)
    sv = folder / "core" / "plain.sv"
    text, count = re.subn(r"(?m)^(?!//)(.*)\(m_axis_tvalid\)", r"\1()", sv.read_text(encoding="utf-8"))
    assert count == 1
    sv.write_text(text, encoding="utf-8")
    result = called("make", "icarus", at=folder / "bench")
    assert result.returncode != 0
    assert "FAIL: 0 of " in result.stdout


def test_payload_that_changes_while_it_waits_is_a_break_of_the_rules(tmp_path: Path) -> None:
    folder = unpacked("plain", tmp_path)
    sv = folder / "core" / "plain.sv"
    text, count = re.subn(
        r"assign (m_axis_tdata) = (.*);",
        r"assign \1 = m_axis_tready ? \2 : ~(\2);",
        sv.read_text(encoding="utf-8"),
    )
    assert count == 1
    sv.write_text(text, encoding="utf-8")
    result = called("make", "icarus", at=folder / "bench")
    assert result.returncode != 0
    assert re.search(r"FAIL: (\d+) of \1 samples, 0 mismatches, [1-9]\d* breaks", result.stdout), result.stdout


def test_the_worst_case_is_among_the_stimuli() -> None:
    core = design_of("plain").core
    (port,) = core.datapath.inputs
    worst = np.where(sign_matched(bench_of(core).impulse_response), port.highest, port.lowest)
    codes = bench_stimuli(core).vectors.stimuli[:, 0, 0]
    assert np.array_equal(codes[: len(worst)], worst)


def test_a_core_of_several_channels_gets_different_samples_in_each() -> None:
    vectors = bench_stimuli(design_of("gauge").core).vectors
    assert np.array_equal(vectors.stimuli[1:, 1], vectors.stimuli[:-1, 0])
    assert not np.array_equal(vectors.responses[:, 0], vectors.responses[:, 1])
