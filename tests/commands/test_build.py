"""`sosmith build`: what it prints, and its exit status; the programs are stubs here. And `design --silicon`."""

import json
from pathlib import Path

import pytest
from tests.commands.invocation import Invocation
from tests.gen.estimate.silicon.small_library import liberty
from tests.gen.fpga.stubs import REPORT, Stub

from sosmith.gen.estimate.silicon import libraries, timing
from sosmith.gen.fpga import bitstream
from sosmith.gen.fpga.boards import BUILDABLE, PROJECTS
from sosmith.model.errors import ShortfallError, ToolError

BUILD, DESIGN = Invocation("build"), Invocation("design")
SPEC = """\
name = "plain"
sample_rate = {rate}
[input.x]
bits = 8
signed = true
range = [-1.0, 1.0]
[filter]
family = "butterworth"
kind = "lowpass"
order = 1
cutoff = 100.0
[output]
bits = 8
signed = true
range = [-1.0, 1.0]
[hardware]
realization = "df1"
clock = 1.0e9
architecture = "serial"
"""


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Go to an empty folder with a specification; programs are stubs, and fail with the words that are put in here."""
    fails: dict[str, str] = {}
    monkeypatch.chdir(tmp_path)
    Path("plain.toml").write_text(SPEC.format(rate=1000.0), encoding="utf-8")
    monkeypatch.setattr(bitstream, "find_tool", lambda name: Stub(name, [], REPORT, fails.get(name)))
    return fails


def test_a_build_prints_cells_and_timing_and_writes_its_files(programs: dict[str, str]) -> None:
    result = BUILD.good("plain.toml", "--board", "iCEstick")
    assert "plain on iCEstick" in result.stdout
    assert "7 of 1,280, 1 %" in result.stdout
    assert "closes: 70.12 MHz, of which 12.00 MHz are needed" in result.stdout
    assert "sosmith: bitstream: build/plain/icestick/plain_board_icestick.bin\n" in result.stderr
    assert {path.name for path in Path("build/plain/icestick").iterdir()} >= {
        "build.json",
        "build.log",
        "plain.sv",
        "plain.json",
        "plain.certificate.json",
        "plain_board.sv",
        "plain_board_icestick.bin",
    }
    told = BUILD.good("plain.toml", "--board", "icestick", "--json", "-o", "other")
    assert json.loads(told.stdout) == json.loads(Path("other/build.json").read_text(encoding="utf-8"))
    assert json.loads(told.stdout)["passed"] is True


@pytest.mark.slow
def test_a_core_that_is_too_slow_at_the_clock_of_the_board_is_noted(programs: dict[str, str]) -> None:
    Path("fast.toml").write_text(SPEC.format(rate=1e6), encoding="utf-8")
    result = BUILD.good("fast.toml", "--board", "icestick")
    assert "sosmith: note: at the board's clock the core takes " in result.stderr
    assert "samples a second per channel, not 1,000,000\n" in result.stderr


@pytest.mark.slow
def test_timing_that_does_not_close_is_told_with_its_path(
    monkeypatch: pytest.MonkeyPatch, programs: dict[str, str]
) -> None:
    monkeypatch.setitem(REPORT, "fmax", {"board.clk": {"achieved": 11.5, "constraint": 12.0}})
    result = BUILD.run("plain.toml", "--board", "icestick")
    assert result.exit_code == 1
    assert "does not close: 11.50 MHz, of which 12.00 MHz are needed" in result.stdout
    assert result.stderr.endswith(
        "sosmith: error: plain must run at 12.00 MHz on iCEstick, not 11.50 MHz: the path takes 1.75 ns: "
        "clk-to-q 1.50 ns to a, setup 0.25 ns to b\n"
    )


def test_a_design_that_does_not_fit_is_told_with_what_it_lacks(programs: dict[str, str]) -> None:
    programs["nextpnr-ice40"] = "Info:   ICESTORM_LC:  1400/ 1280  109%\nERROR: no place left\n"
    message = "the design must fit the iCEstick, but: 1,400 ICESTORM_LC of 1,280"
    BUILD.refused(message, "plain.toml", "--board", "icestick", kind=ShortfallError)


def test_what_is_no_board_for_a_bitstream_is_refused(programs: dict[str, str]) -> None:
    known = ", ".join((*BUILDABLE, *PROJECTS))
    for name, hint in (("icebraker", " (did you mean icebreaker?)"), ("upduino", "")):
        BUILD.refused(f"the board must be one of {known}, not {name}{hint}", "plain.toml", "--board", name)


def test_a_line_rate_above_a_fourth_of_the_clock_is_refused(programs: dict[str, str]) -> None:
    message = "the line rate must be at most 3,000,000 baud at a clock of 12,000,000 Hz, not 3,000,001"
    BUILD.refused(message, "plain.toml", "--board", "icestick", "--baud", "3000001")


@pytest.mark.slow
def test_a_design_for_a_board_shows_what_it_takes_there_and_builds_it_once(
    programs: dict[str, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    design = Invocation("design")
    first = design.good("plain.toml", "--board", "icestick")
    assert "plain on iCEstick" in first.stdout
    assert "7 of 1,280, 1 %" in first.stdout
    assert "placement and routing" in first.stderr
    again = design.good("plain.toml", "--board", "icestick")
    assert again.stdout == first.stdout
    assert "placement and routing" not in again.stderr
    told = json.loads(design.good("plain.toml", "--board", "icestick", "--json").stdout)["board"]
    assert told["utilisation"] == {"ICESTORM_LC": {"used": 7, "available": 1280}}
    assert told["bitstream"]["file"] == "plain_board_icestick.bin"


@pytest.mark.slow
def test_a_project_for_a_vendors_tools_says_that_nothing_was_built(programs: dict[str, str]) -> None:
    result = BUILD.good("plain.toml", "--board", "cmod_s7")
    assert "plain on CMOD S7" in result.stdout
    assert "not known: Vivado was not run" in result.stdout
    assert result.stderr.endswith(
        "sosmith: no flow was run and no bitstream written; in that folder, "
        "vivado -mode batch -source plain_board_cmod_s7.tcl makes one\n"
    )
    assert {path.suffix for path in Path("build/plain/cmod_s7").glob("plain_board*")} == {".sv", ".v", ".xdc", ".tcl"}
    message = "--program must be left out for cmod_s7: no bitstream is made for it"
    BUILD.refused(message, "plain.toml", "--board", "cmod_s7", "--program")


@pytest.mark.slow
def test_silicon_shows_area_and_clock_before_layout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "_PLACE", tmp_path)
    monkeypatch.setattr(timing, "_PROGRAM", "no such program")
    spec, cells = tmp_path / "plain.toml", libraries.LIBRARIES["osu018"].path
    cells.parent.mkdir()
    cells.write_text(liberty(), encoding="utf-8")
    spec.write_text(SPEC.format(rate=1000.0), encoding="utf-8")
    found = json.loads(DESIGN.good(str(spec), "--silicon", "osu018", "--json").stdout)["silicon"]
    assert found["nand2_equivalents"] == round(found["area_um2"] / 24)
    assert (found["stage"], found["clock_hz"]) == ("before layout", None)
    shown = DESIGN.good(str(spec), "--silicon", "osu018").stdout
    assert f"{found['nand2_equivalents']:,} NAND2 equivalents" in shown
    assert "this is before layout" in shown


def test_missing_cells_are_told_before_anything_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "_PLACE", tmp_path)
    message = "the cells of osu035 are needed, and were not found: apt-get install qflow-tech-osu035"
    DESIGN.refused(message, "no such file", "--silicon", "osu035", kind=ToolError)
