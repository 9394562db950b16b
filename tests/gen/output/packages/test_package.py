"""A package: the same bytes on every run, its core the one that `generate` writes."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tests.commands.invocation import Invocation
from tests.gen.output.packages.made import SPECIFICATIONS, design_of, package_of, unpacked
from tests.suite.extras import needed

import sosmith
from sosmith.gen.estimate.silicon.libraries import LIBRARIES
from sosmith.gen.fpga.yosys import run_yosys
from sosmith.gen.output.generate import generated
from sosmith.gen.output.packages.facts import package_facts
from sosmith.model.errors import ToolError

PACKAGE = Invocation("package")


@pytest.mark.slow
def test_two_runs_write_the_same_bytes(tmp_path: Path) -> None:
    """The second run is another process with another hash seed."""
    spec = tmp_path / "plain.toml"
    spec.write_text(sosmith.Specification.load(SPECIFICATIONS["plain"]).toml(), encoding="utf-8")
    first = PACKAGE.good(str(spec), "-o", str(tmp_path / "one")).stdout.split()
    subprocess.run(
        [sys.executable, "-m", "sosmith.cli", "package", str(spec), "-o", str(tmp_path / "two")],
        check=True,
        capture_output=True,
        env=os.environ | {"PYTHONHASHSEED": "4242"},
    )
    paths = [Path(path).relative_to(tmp_path / "one") for path in first]
    assert len(paths) > 10
    for path in paths:
        assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "two" / path).read_bytes()


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_the_core_is_the_one_that_generate_writes(name: str) -> None:
    core = {path.removeprefix("core/"): text for path, text in package_of(name).items() if path.startswith("core/")}
    assert core == generated(design_of(name).core)


@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_the_readme_names_every_folder_and_only_files_that_exist(name: str) -> None:
    texts = package_of(name)
    readme = texts["README.md"]
    assert readme.splitlines()[2].casefold().startswith(design_of(name).core.core)
    assert f"{design_of(name).core.spec.output.unit}. Made by sosmith " in readme
    named = set(re.findall(r"[`(]([\w/]+/[\w.]*|[\w]+\.core)[`)]", readme))
    assert {path.split("/")[0] for path in texts} - {"README.md"} == {path.split("/")[0] for path in named}
    present = {*texts, *(f"{path.rpartition('/')[0]}/" for path in texts)}
    assert named <= present


def test_the_readme_has_a_row_for_every_port() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (in|out) \| (\d+) \| \S", package_of("tunable")["README.md"], flags=re.MULTILINE)
    pins = package_facts(design_of("tunable").core).pins
    assert rows == [(pin.name, "out" if pin.output else "in", str(pin.width)) for pin in pins]
    header = package_of("tunable")["core/tunable.sv"]
    assert set(re.findall(r"^  (?:input|output) (?:\[\d+:0\] )?(\w+);", header, flags=re.MULTILINE)) >= {
        pin.name for pin in pins
    }


@pytest.mark.parametrize("name", SPECIFICATIONS)
@pytest.mark.parametrize("tool", ["vivado", "quartus"])
def test_scripts_for_vendors_tools_name_files_that_exist(tool: str, name: str) -> None:
    """All that is checked of them here: neither tool is at hand."""
    texts = package_of(name)
    script = texts[f"{tool}/synthesize.tcl"]
    named = {tuple(path.split()) for path in re.findall(r"\[file join \$here ([\w. ]+)\]", script)}
    suffix = "xdc" if tool == "vivado" else "sdc"
    assert named == {("..", "core", f"{name}.sv"), (f"{name}.{suffix}",)}
    assert {f"{tool}/{name}.{suffix}", f"core/{name}.sv"} <= texts.keys()
    assert "sosmith has not run this script" in script
    period = "1000.000" if name == "tunable" else "83.333"
    assert f"-period {period} [get_ports aclk]" in texts[f"{tool}/{name}.{suffix}"]


@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_files_for_librelane_name_what_there_is(name: str) -> None:
    texts = package_of(name)
    told = json.loads(texts["librelane/config.json"])
    assert told.pop("meta") == {"version": 2, "flow": "Classic"}
    period = 1000.0 if name == "tunable" else 83.333
    assert told == {
        "DESIGN_NAME": name,
        "VERILOG_FILES": [f"dir::../core/{name}.sv"],
        "CLOCK_PORT": "aclk",
        "CLOCK_PERIOD": period,
        "PNR_SDC_FILE": f"dir::{name}.sdc",
        "SIGNOFF_SDC_FILE": f"dir::{name}.sdc",
    }
    constraints = texts[f"librelane/{name}.sdc"]
    assert f"-period {period:.3f} [get_ports aclk]" in constraints
    assert f"set_input_delay {0.2 * period:.3f} " in constraints


def test_yosys_finds_what_librelane_is_told(tmp_path: Path) -> None:
    folder = unpacked("gauge", tmp_path) / "librelane"
    told = json.loads((folder / "config.json").read_text(encoding="utf-8"))
    (source,) = (path.replace("dir::../", "") for path in told["VERILOG_FILES"])
    script = f"read_verilog -sv {source}; hierarchy -check -top {told['DESIGN_NAME']}; "
    run_yosys(script + f"select -assert-count 1 i:{told['CLOCK_PORT']}", tmp_path)


@pytest.mark.slow
def test_opensta_takes_the_constraints_for_librelane(tmp_path: Path) -> None:
    program = shutil.which("sta")
    try:
        (tmp_path / "cells.lib").write_bytes(LIBRARIES["osu018"].liberty)
    except ToolError:
        program = None
    if program is None:
        pytest.skip("opensta or qflow-tech-osu018 is not installed")
    unpacked("gauge", tmp_path)
    synthesis = "synth -flatten -noabc; dfflibmap -liberty cells.lib; abc -liberty cells.lib; clean -purge; "
    writing = "splitnets -ports; clean -purge; write_verilog -noattr -noexpr netlist.v"
    run_yosys(f"read_verilog -sv core/gauge.sv; hierarchy -top gauge; {synthesis}{writing}", tmp_path)
    lines = ("read_liberty cells.lib", "read_verilog netlist.v", "link_design gauge", "read_sdc librelane/gauge.sdc")
    (tmp_path / "read.tcl").write_text(
        "\n".join((*lines, "check_setup -verbose -no_clock -no_input_delay -no_output_delay", "exit")), encoding="utf-8"
    )
    done = subprocess.run(
        [program, "-no_splash", "-exit", "read.tcl"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.stdout + done.stderr == ""


SINGLE = "its sample", ["sample 0", "sample 1", "result 0", "result 1"]
TIMES = {
    "plain": SINGLE,
    "gauge": SINGLE,
    "tunable": SINGLE,
    "wide": ("their samples, a beat of 8", ["samples 0 to 7", "samples 8 to 15", "results 0 to 7", "results 8 to 15"]),
    "sparse": ("its sample, which is one of 4", ["sample 0", "sample 4", "result 0", "result 1"]),
    "slow_gauge": ("its sample, which is one of 16", ["sample 0", "sample 16", "result 0", "result 1"]),
    "held": ("its sample, which is one of 4; each", ["sample 0", "sample 4", "result 0, 4 times", "result 1, 4 times"]),
}


@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_the_timing_diagram_shows_two_samples_and_their_results(name: str) -> None:
    source = json.loads(package_of(name)[f"doc/{name}_timing.json"])
    waves = {signal["name"]: signal["wave"] for signal in source["signal"]}
    assert len({len(wave) for wave in waves.values()}) == 1
    latency, head = design_of(name).latency_cycles, source["head"]["text"]
    words, told = TIMES[name]
    assert f"{latency} clocks after {words}" in head
    picture = needed("lxml.etree").fromstring(package_of(name)[f"doc/{name}_timing.svg"].encode())
    shown = {text for text in picture.itertext() if text.strip()}
    assert {*waves, *told} <= shown
