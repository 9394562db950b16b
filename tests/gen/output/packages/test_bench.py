"""The bench of a package runs in Icarus, in Verilator and in C, and sees a coefficient that is off by one unit."""

import re
from pathlib import Path

import numpy as np
import pytest
from tests.gen.output.packages.made import SPECIFICATIONS, called, design_of, spoil, unpacked

from sosmith.gen.output.core_facts import InterfaceFacts
from sosmith.gen.output.packages.stimuli import Stimuli, bench_stimuli
from sosmith.gen.stimuli.core import bench_of
from sosmith.gen.stimuli.worst_case_inputs import sign_matched

PASS = re.compile(r"^PASS: (\d+) (?:samples|beats|results), 0 mismatches$", re.MULTILINE)
FAIL = re.compile(r"^FAIL: .*\b[1-9]\d* mismatches", re.MULTILINE)


def interface_of(name: str) -> InterfaceFacts:
    return design_of(name).facts.interface


def stimuli_of(name: str) -> Stimuli:
    return bench_stimuli(design_of(name).core, interface_of(name))


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("way", "name"),
    [("c", name) for name in SPECIFICATIONS]
    + [("icarus", name) for name in ("plain", "gauge", "wide", "sparse", "held")]
    + [pytest.param("icarus", name, marks=pytest.mark.slow) for name in ("tunable", "slow_gauge")],
)
def test_the_bench_passes_and_counts(way: str, name: str, tmp_path: Path) -> None:
    folder = unpacked(name, tmp_path)
    result = called("make", way, at=folder / "bench")
    assert result.returncode == 0, result.stdout + result.stderr
    (count,) = PASS.findall(result.stdout)
    beats = interface_of(name).inputs.lanes if way == "icarus" else 1
    assert int(count) * beats == stimuli_of(name).vectors.responses.size > 500


IN_HARDWARE = r"\* \$signed\(\d+'(h)([0-9a-f]+)\)"
SPOILT = {"icarus": ("sv", IN_HARDWARE), "c": ("c", r"(C)\((\d{3,4})\)")}


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", ["plain", "wide", "held"])
@pytest.mark.parametrize("way", SPOILT)
def test_one_unit_in_one_coefficient_fails(way: str, name: str, tmp_path: Path) -> None:
    folder = unpacked(name, tmp_path)
    suffix, constant = SPOILT[way]
    assert spoil(folder / "core" / f"{name}.{suffix}", constant) >= 2
    result = called("make", way, at=folder / "bench")
    assert result.returncode != 0
    assert FAIL.search(result.stdout), result.stdout


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plain", "gauge", "wide", "sparse", "held"])
def test_verilator_takes_the_same_bench(name: str, tmp_path: Path) -> None:
    folder = unpacked(name, tmp_path)
    result = called("make", "verilator", at=folder / "bench", simulator="verilator")
    assert result.returncode == 0, result.stderr
    assert PASS.search(result.stdout)
    sv = folder / "core" / f"{name}.sv"
    if name == "sparse":
        spoil_result(folder, name)
    else:
        assert spoil(sv, IN_HARDWARE) > 0
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
    codes = stimuli_of("plain").vectors.stimuli[:, 0, 0]
    assert np.array_equal(codes[: len(worst)], worst)


def test_a_core_of_several_channels_gets_different_samples_in_each() -> None:
    vectors = stimuli_of("gauge").vectors
    assert np.array_equal(vectors.stimuli[1:, 1], vectors.stimuli[:-1, 0])
    assert not np.array_equal(vectors.responses[:, 0], vectors.responses[:, 1])


def spoil_result(folder: Path, name: str) -> None:
    """Change the last digit of the last response."""
    path = folder / "bench" / f"{name}_responses.hex"
    *lines, last = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([*lines, f"{last[:-1]}{int(last[-1], 16) ^ 1:x}", ""]), encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wide", "sparse", "held"])
@pytest.mark.parametrize("way", ["icarus", "c"])
def test_the_last_result_is_compared_too(way: str, name: str, tmp_path: Path) -> None:
    """That of a group of samples that is not complete, and of what fills a beat."""
    samples, interface = len(stimuli_of(name).vectors.stimuli), interface_of(name)
    assert samples % interface.samples_per_result or name != "sparse"
    assert any("to fill its beat" in part for part in stimuli_of(name).parts) == (name == "wide")
    folder = unpacked(name, tmp_path)
    spoil_result(folder, name)
    result = called("make", way, at=folder / "bench")
    assert result.returncode != 0
    assert re.search(r"^FAIL: .*\b1 mismatches", result.stdout, re.MULTILINE), result.stdout


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", ["wide", "sparse", "held"])
def test_a_result_too_few_or_too_many_fails(name: str, tmp_path: Path) -> None:
    folder = unpacked(name, tmp_path)
    path = folder / "bench" / f"{name}_responses.hex"
    text = path.read_text(encoding="utf-8")
    for wrong in (text + text.splitlines()[-1] + "\n", "".join(text.splitlines(keepends=True)[:-1])):
        if name == "wide" and len(wrong) > len(text):
            continue  # the model's bench ends with its stimuli
        path.write_text(wrong, encoding="utf-8")
        result = called("make", "c", at=folder / "bench")
        assert "the files of vectors must fit each other and the core" in result.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sparse", "held"])
def test_a_decimator_that_hands_on_another_sample_is_seen(name: str, tmp_path: Path) -> None:
    """The core finds a result each time that the counter of samples is 0: let it be 1."""
    folder = unpacked(name, tmp_path)
    sv = folder / "core" / f"{name}.sv"
    text, count = re.subn(r"= \| phase;", "= phase != 2'h1;", sv.read_text(encoding="utf-8"))
    assert count == 1
    sv.write_text(text, encoding="utf-8")
    result = called("make", "icarus", at=folder / "bench")
    assert result.returncode != 0
    assert "FAIL" in result.stdout, result.stdout + result.stderr
