"""Bitstreams: what the programs get, what comes of what they say, and, among the slow tests, the real ones."""

import json
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from tests.gen.fpga.stubs import REPORT, Stub
from tests.interface.small import filter_design

import sosmith
from sosmith.gen.fpga import bitstream, tools
from sosmith.gen.fpga.bitstream import Clock, Step, build
from sosmith.gen.fpga.boards import BOARDS, BUILDABLE, PROJECTS, find_board
from sosmith.gen.fpga.tools import Tool, find_tool
from sosmith.gen.output.board_top import board_verilog, top_name
from sosmith.model.errors import ShortfallError, SpecificationError, ToolError

TOP = "module tiny(input clk, rst, rx, output tx, output [2:0] leds); assign tx = rx; assign leds = 0; endmodule\n"


Install = Callable[..., list[list[str]]]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Install:
    """Put stubs in place of the programs; return the list of the calls that they get."""

    def installed(report: dict[str, Any] = REPORT, **fails: str) -> list[list[str]]:
        calls: list[list[str]] = []
        monkeypatch.setattr(
            bitstream, "find_tool", lambda name: Stub(name, calls, report, fails.get(name.replace("-", "_")))
        )
        return calls

    return installed


@pytest.mark.parametrize("name", BUILDABLE)
def test_every_board_has_its_clock_and_pins_from_its_platform(name: str, install: Install) -> None:
    board, calls = find_board(name), install()
    made = build(TOP, "tiny", board)
    assert made.content == b"bits"
    (placed,) = (call for call in calls if call[0].startswith("nextpnr"))
    assert placed[placed.index("--freq") + 1] == f"{board.clock / 1e6:g}"
    assert placed[placed.index("--seed") + 1] == "1"
    assert board.device.placer in placed
    if board.package:
        assert placed[placed.index("--package") + 1].upper() == board.package.upper()
    if board.speed:
        assert placed[placed.index("--speed") + 1] == board.speed
    if board.device.family == "gowin":
        assert placed[0] == "nextpnr-himbaechel-gowin"
        family, pins = (placed[k + 1] for k, word in enumerate(placed) if word == "--vopt")
        assert (family, pins) == (
            {"tang_nano_9k": "family=GW1N-9C", "tang_nano_20k": "family=GW2A-18C"}[name],
            f"cst=tiny_{name}.cst",
        )
    if board.device.family == "gatemate":
        assert placed[placed.index("--device") + 1] == "CCGM1A1"
        assert calls[-1] == ["gmpack", f"tiny_{name}.txt", f"tiny_{name}.bit"]


def test_what_is_read_off_the_report(install: Install) -> None:
    install()
    steps: list[str] = []
    made = build(TOP, "tiny", find_board("icestick"), steps.append)
    assert steps == ["synthesis", "placement and routing", "packing"]
    assert made.clocks == (Clock("board.clk", 70.12, 12.0),)
    assert made.used == {"ICESTORM_LC": (7, 1280)}
    assert made.path == (Step("clk-to-q", 1.5, "a"), Step("setup", 0.25, "b"))
    assert made.versions == {"yosys": "1.2", "nextpnr-ice40": "1.2", "icepack": "1.2"}
    assert made.log.count("well") == 3
    assert made.file == "tiny_icestick.bin"
    assert made.met


def test_paths_through_blocks_count_where_there_are_such_blocks(
    install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    install()
    slower = {**REPORT, "fmax": {"board.clk": {"achieved": 11.5, "constraint": 12.0}}}
    monkeypatch.setattr(bitstream, "with_block_paths", lambda report, sdf, netlist: slower)
    assert not build(TOP, "tiny", find_board("icebreaker")).met
    assert build(TOP, "tiny", find_board("icestick")).met


def test_a_design_that_does_not_fit_falls_short(install: Install) -> None:
    install(nextpnr_ice40="Info:   ICESTORM_LC:  1400/ 1280  109%\nInfo:  SB_IO:  7/ 96  7%\nERROR: no place left\n")
    message = "the design must fit the iCEstick, but: 1,400 ICESTORM_LC of 1,280"
    with pytest.raises(ShortfallError, match=f"^{re.escape(message)}$"):
        build(TOP, "tiny", find_board("icestick"))
    install(nextpnr_ice40="Info:   ICESTORM_LC:  1270/ 1280  99%\nERROR: no place left\n")
    with pytest.raises(ShortfallError, match=r"^the design must fit the iCEstick, but: no place left$"):
        build(TOP, "tiny", find_board("icestick"))


def test_a_program_that_fails_is_named_with_its_words(install: Install) -> None:
    install(yosys="first\nERROR: no such thing")
    with pytest.raises(ToolError, match=r"^yosys 1\.2 failed:\n.*\nfirst\nERROR: no such thing$"):
        build(TOP, "tiny", find_board("icestick"))


@pytest.mark.slow
def test_files_of_a_build_and_what_they_say(install: Install, tmp_path: Path) -> None:
    install()
    design = filter_design()
    made = design.build("icestick", folder=tmp_path)
    assert made.passed
    assert made.bitstream.read_bytes() == b"bits"
    assert made.fmax == 70.12e6
    told = json.loads((tmp_path / "build.json").read_text(encoding="utf-8"))
    assert told == made.summary
    assert told["bitstream"]["file"] == "plain_board_icestick.bin"
    assert (told["board"], told["clock_hz"], told["line_rate_baud"]) == ("icestick", 12_000_000, 1_000_000)
    assert told["samples_per_second"] == 12e6 / design.cycles_per_sample
    top = (tmp_path / "plain_board.sv").read_text(encoding="utf-8")
    assert top == board_verilog(design.core, clock=Fraction(12_000_000))
    assert repr(made) == "<sosmith.Build plain on iCEstick: timing closes, 70.12 MHz>"


@pytest.mark.slow
def test_timing_that_does_not_close_leaves_no_bitstream_and_names_the_path(install: Install, tmp_path: Path) -> None:
    install()
    (old,) = {filter_design().build("icestick", folder=tmp_path).bitstream}
    install({**REPORT, "fmax": {"board.clk": {"achieved": 11.5, "constraint": 12.0}}})
    made = filter_design().build("icestick", folder=tmp_path)
    assert not made.passed
    assert not old.exists()
    assert made.summary["bitstream"] is None
    message = (
        "plain must run at 12.00 MHz on iCEstick, not 11.50 MHz: the path takes 1.75 ns: clk-to-q 1.50 ns to a, "
        "setup 0.25 ns to b"
    )
    assert made.shortfall == message
    with pytest.raises(ShortfallError, match=f"^{re.escape(message)}$"):
        made.program()


def test_a_board_can_only_be_programmed_with_the_program_for_it(
    install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install()
    made = filter_design().build("icestick", folder=tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    message = "openFPGALoader is needed to program a board, and was not found: apt-get install openfpgaloader"
    with pytest.raises(ToolError, match=f"^{re.escape(message)}$"):
        made.program()
    loader = tmp_path / "openFPGALoader"
    loader.write_text(f"#!/bin/sh\necho $* >{tmp_path}/called\nexit ${{FAILS:-0}}\n", encoding="utf-8")
    loader.chmod(0o755)
    made.program()
    assert (tmp_path / "called").read_text(encoding="utf-8") == f"-b ice40_generic {made.bitstream}\n"
    loader.write_text("#!/bin/sh\necho no board\nexit 1\n", encoding="utf-8")
    with pytest.raises(ToolError, match=r"^openFPGALoader could not program the iCEstick:\nno board$"):
        made.program()


def test_a_board_without_a_platform_is_refused() -> None:
    message = f"the board must be one of {', '.join(BUILDABLE)}, not colorlight_i5"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        filter_design().build("colorlight_i5")
    rest = {"upduino", "colorlight_i5", "orangecrab_25f", "ecp5_evn"}
    assert rest == BOARDS.keys() - set(BUILDABLE) - set(PROJECTS)


def test_a_program_of_the_system_is_taken_if_it_is_new_enough(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    native = tmp_path / "yosys"
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    for version, taken in (("0.40", True), ("1.0", True), ("0.39", False)):
        native.write_text(f"#!/bin/sh\necho 'Yosys {version}'\n", encoding="utf-8")
        native.chmod(0o755)
        found = find_tool("yosys")
        assert (found.path == native) is taken
        assert (found.version == version) is taken


def test_without_the_programs_it_is_said_how_to_get_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tools.shutil, "which", lambda *_, **__: None)
    message = "icepack is needed to build for a board, and was not found: pip install 'sosmith[boards]'"
    with pytest.raises(ToolError, match=f"^{re.escape(message)}$"):
        find_tool("icepack")


def test_what_a_program_says_goes_to_the_log(tmp_path: Path) -> None:
    log = tmp_path / "log"
    shell = Tool("sh", Path("/bin/sh"), "0")
    assert shell.run(["-c", "echo one; echo two >&2; exit 3"], tmp_path, log) == 3
    assert shell.run(["-c", "pwd"], tmp_path, log) == 0
    assert log.read_text(encoding="utf-8").splitlines()[1:3] == ["one", "two"]
    assert log.read_text(encoding="utf-8").splitlines()[-1] == str(tmp_path.resolve())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["icestick", "ulx3s_12f", "tang_nano_9k", "tang_nano_20k", "olimex_gatemate"])
def test_a_bitstream_closes_timing_and_is_the_same_again(name: str) -> None:
    design = sosmith.design("examples/flange_wear_bench.toml", board=name).core
    board = find_board(name)
    verilog = board_verilog(design, clock=Fraction(board.clock))
    first, second = (build(verilog, top_name(design), board) for _ in range(2))
    assert first.met
    assert first.content == second.content
    assert len(first.content) > 10_000
