"""Projects for Vivado, which is not run: every port has its pin, the script is Tcl, the Verilog is clean."""

import json
import re
import shutil
import subprocess
from fractions import Fraction
from pathlib import Path

import pytest
from tests.interface.small import filter_design
from tests.sim.lint import lint

import sosmith
from sosmith.gen.fpga.boards import BOARDS, PROJECTS
from sosmith.gen.fpga.vendor_project import Project, project
from sosmith.gen.fpga.wiring import Wiring
from sosmith.gen.output.board_top import board_verilog, top_name
from sosmith.gen.output.packages.lint_waivers import WAIVERS
from sosmith.model.errors import SpecificationError

SELECTS = 7
TOP = f"""\
module tiny(input clk, rst, rx, miso, output tx, sck, mosi, output [2:0] leds, output [{SELECTS - 1}:0] cs_n);
endmodule
"""
PORTS = re.compile(r"^module (?P<name>\w+)\((?P<ports>[^)]*)\);", re.MULTILINE)
SCRIPT = """
proc unknown {args} { puts [lindex $args 0]; return {} }
source [lindex $argv 0]
"""
# Ports by Xilinx UG953, as far as the wrapper connects them.
PRIMITIVES = """\
module IBUF(input I, output O); assign O = I; endmodule
module OBUFT(input I, T, output O); assign O = T ? 1'bz : I; endmodule
module STARTUPE2(output EOS); assign EOS = 1'b1; endmodule
module BUFGCTRL #(parameter SIM_DEVICE = "7SERIES")(input CE0, CE1, I0, I1, IGNORE0, IGNORE1, S0, S1, output O);
  assign O = (CE0 & S0 & ~IGNORE0) ? I0 : (CE1 & S1 & IGNORE1) & I1;
endmodule
module FDPE #(parameter [0:0] INIT = 1'b1)(input C, CE, D, PRE, output reg Q);
  initial Q = INIT;
  always @(posedge C, posedge PRE) if (PRE) Q <= 1'b1; else if (CE) Q <= D;
endmodule
"""

WAIVED = (
    *WAIVERS,
    "WIDTHTRUNC",  # `!` of a word: whether it is 0
    "CASEOVERLAP",  # the choice among the states of a machine, of which one is active
    "VARHIDDEN",  # the instance `crc` has a register `crc`
)
WAIVED_HERE = ("UNUSEDPARAM",)  # of the primitives above


@pytest.fixture(scope="module", params=PROJECTS)
def made(request: pytest.FixtureRequest) -> Project:
    return project(TOP, "tiny", BOARDS[request.param], wiring=Wiring(selects=SELECTS))


def ports_of(text: str, top: str) -> set[str]:
    """Return the ports of a module, each bit of a vector by itself."""
    (names,) = (found["ports"] for found in PORTS.finditer(text) if found["name"] == top)
    ports = set()
    for name in names.split(", "):
        width = re.search(rf"^  (?:input|output) \[(\d+):0\] {name};$", text, re.MULTILINE)
        ports |= {name} if width is None else {f"{name}[{bit}]" for bit in range(int(width[1]) + 1)}
    return ports


@pytest.mark.sweep(1)
def test_every_port_has_a_pin_of_its_own(made: Project) -> None:
    constraints = made.files[f"{made.name}.xdc"]
    placed = re.findall(r'^set_property LOC (\w+) \[get_ports "([^"]+)"\]$', constraints, re.MULTILINE)
    names = {port.replace("\\", "") for _, port in placed}
    assert names == ports_of(made.files[f"{made.name}.v"], made.name)
    assert len({pin for pin, _ in placed}) == len(placed) == len(names)
    sck, mosi, miso, *cs_n = made.board.header
    assert {(sck, "converters_0__sck__io"), (mosi, "converters_0__mosi__io")} <= set(placed)
    assert [pin for pin, port in placed if "cs_n" in port] == cs_n[:SELECTS]
    assert (miso, "converters_0__miso__io") in placed
    assert 'set_property PULLUP "TRUE" [get_ports "converters_0__miso__io"]' in constraints
    standards = re.findall(r'^set_property IOSTANDARD "LVCMOS33" \[get_ports "([^"]+)"\]$', constraints, re.MULTILINE)
    assert len(standards) == len(placed)
    period = re.search(r"^create_clock .* -period ([0-9.]+) ", constraints, re.MULTILINE)
    assert period is not None
    assert abs(float(period[1]) * made.board.clock / 1e9 - 1) < 1e-6


@pytest.mark.skipif(shutil.which("tclsh") is None, reason="needs tclsh")
def test_script_and_constraints_are_tcl(made: Project, tmp_path: Path) -> None:
    (tmp_path / "try.tcl").write_text(SCRIPT)
    ran = {}
    for kind in ("tcl", "xdc"):
        (tmp_path / f"{made.name}.{kind}").write_text(made.files[f"{made.name}.{kind}"])
        done = subprocess.run(
            ["tclsh", "try.tcl", f"{made.name}.{kind}"], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr) == (0, "")
        ran[kind] = done.stdout.split()
    steps = ["create_project", "read_xdc", "synth_design", "place_design", "route_design", "write_bitstream"]
    assert [word for word in ran["tcl"] if word in steps] == steps
    assert set(ran["xdc"]) == {"set_property", "get_ports", "create_clock", "get_nets"} | (
        {"current_design", "get_iobanks"} if made.board.name == "arty_a7" else set()
    )
    part = {"arty_a7": "xc7a35ticsg324-1L", "cmod_s7": "xc7s25csga225-1"}[made.board.name]
    assert f"-part {part}\n" in made.files[f"{made.name}.tcl"]
    for file in made.files:
        assert file in made.files[f"{made.name}.tcl"] or file.endswith(".tcl")


@pytest.mark.slow
def test_the_verilog_is_clean(tmp_path: Path) -> None:
    core = filter_design().core
    board, top = BOARDS["cmod_s7"], top_name(core)
    text = board_verilog(core, clock=Fraction(board.clock))
    (tmp_path / "board.sv").write_text(text)
    assert lint(tmp_path / "board.sv", top, tmp_path / "lint", waived=WAIVED) == []
    wrapper = project(text, top, board)
    whole = tmp_path / "whole.sv"
    whole.write_text(PRIMITIVES + text + wrapper.files[f"{wrapper.name}.v"])
    assert lint(whole, wrapper.name, tmp_path / "lint", waived=(*WAIVED, *WAIVED_HERE)) == []


@pytest.mark.slow
def test_what_is_written_says_that_nothing_was_built(tmp_path: Path) -> None:
    told = filter_design().project("CMOD-S7", folder=tmp_path)
    assert json.loads((tmp_path / "build.json").read_text()) == told
    assert (told["passed"], told["bitstream"], told["device"]) == (None, None, "Spartan-7 XC7S25")
    assert told["project"]["command"] == "vivado -mode batch -source plain_board_cmod_s7.tcl"
    assert {path.name for path in tmp_path.iterdir()} == {"build.json", *told["project"]["files"]}
    with pytest.raises(SpecificationError, match=r"^the board must be one of arty_a7, cmod_s7, not icebreaker$"):
        filter_design().project("icebreaker")
    with pytest.raises(sosmith.SpecificationError, match=r", not arty_a7$"):
        filter_design().build("arty_a7")
