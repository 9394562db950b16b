"""The comments in the SystemVerilog say what the core is, and change nothing of it."""

import hashlib
import re
import subprocess
from pathlib import Path

import pytest
from tests.gen.designs import example_design, parallel_design

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.comments import without_comments
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.generate import generated
from sosmith.gen.output.header import with_comments
from sosmith.gen.output.verilog import to_rtlil, to_verilog

CASES = ["audio_lowpass.toml", "flange_wear_bench.toml"]
"""One in the parallel architecture, one folded."""


@pytest.fixture(params=CASES)
def design(request: pytest.FixtureRequest) -> CoreDesign:
    return parallel_design(CASES[0]) if request.param == CASES[0] else example_design(request.param)


def header_of(design: CoreDesign) -> str:
    text = generated(design)[f"{design.spec.name}.sv"]
    (comment,) = re.findall(r"\A(?://.*\n)+", text)
    return "".join(line.removeprefix("//").removeprefix(" ") for line in comment.splitlines(keepends=True))


@pytest.mark.slow
def test_the_header_tells_where_the_core_comes_from(design: CoreDesign) -> None:
    header, facts = header_of(design), core_facts(design)
    name = design.spec.name
    assert header.startswith(f"{name}: ")
    assert hashlib.sha256(design.spec.text.encode()).hexdigest() in header
    (output,) = facts.interface.outputs.fields
    assert f"Proven for all inputs in range: |{output.port.name} - exact| <= {facts.error_bound:.6g}" in header
    assert f"at most {facts.interface.latency_cycles} clocks after its sample" in header
    every = "every clock at best" if facts.cycles_per_sample == 1 else f"every {facts.cycles_per_sample} clocks at best"
    assert every in header


@pytest.mark.sweep(1)
def test_the_ports_are_those_of_the_module(design: CoreDesign) -> None:
    text = generated(design)[f"{design.spec.name}.sv"]
    (ports,) = re.findall(rf"^module {design.spec.name}\((.*)\);", text, re.MULTILINE)
    stated = re.findall(r"^  (\w+) +(?:input|output) +(\d+)  ", header_of(design), re.MULTILINE)
    assert {name for name, _ in stated} == set(ports.split(", "))
    for name, width in stated:
        declared = re.search(rf"^  (?:input|output)(?: reg)? (?:\[(\d+):0\] )?{name}( = .*)?;$", text, re.MULTILINE)
        assert declared is not None
        assert int(declared[1] or 0) + 1 == int(width)


@pytest.mark.slow
def test_the_instance_is_one(design: CoreDesign, tmp_path: Path) -> None:
    instance = header_of(design).split("Instance:\n")[1]
    stated = re.findall(r"^  (\w+) +(?:input|output) +(\d+)  ", header_of(design), re.MULTILINE)
    wires = "".join(f"wire [{int(width) - 1}:0] {name};\n" for name, width in stated)
    (tmp_path / "core.sv").write_text(generated(design)[f"{design.spec.name}.sv"])
    (tmp_path / "top.sv").write_text(f"module top;\n{wires}{instance}endmodule\n")
    command = ["iverilog", "-g2012", "-Wall", "-t", "null", "-s", "top", "top.sv", "core.sv"]
    checked = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stderr
    assert "top.sv" not in checked.stderr


def test_each_section_is_written_out() -> None:
    design = parallel_design(CASES[0])
    text = generated(design)[f"{design.spec.name}.sv"]
    for section in core_facts(design).sections:
        (lines,) = re.findall(rf"((?:^//.*\n)+)module {design.spec.name}_{section.name}\(", text, re.MULTILINE)
        assert lines.startswith(f"// {section.name}: y[n] = ")
        for each in section.coefficients:
            assert f"{each.name} = {each.integer} / 2**{each.frac}" in lines
        terms = re.findall(r"([+-]?) ?([\d.e-]+) ([xy])\[n(?:-(\d))?\]", lines.splitlines()[0].split("=")[1])
        stated = {(signal, int(delay or 0)): float(sign + value) for sign, value, signal, delay in terms}
        expected = {("x", k): b for k, b in enumerate(section.b) if b}
        expected |= {("y", k): -a for k, a in enumerate(section.a) if a and k}
        assert stated == {key: pytest.approx(value, rel=1e-8) for key, value in expected.items()}


def test_without_comments_it_is_what_the_tools_wrote(design: CoreDesign) -> None:
    plain = to_verilog(to_rtlil(design.architecture.component(), design.datapath.name))
    commented = with_comments(plain, design, core_facts(design))
    assert "//" in commented
    assert without_comments(commented).lstrip("\n") == without_comments(plain).lstrip("\n")
