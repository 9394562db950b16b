"""Three witnesses: what Icarus, Verilator and Yosys make of texts, as traces of one bench with the same inputs.

Yosys reads a text and writes a netlist of plain assignments, which Icarus simulates. A bench holds many texts at once,
each under names of its own.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

from benchmarks.attacks.cores import NAME

from sosmith.gen.fpga.yosys import run_yosys
from sosmith.model.errors import ToolError
from sosmith.sim.simulators import find_simulator
from sosmith.verify.reader.syntax import Module

TOOLS = ("icarus", "verilator", "yosys")
AT_ONCE = 100
"""Texts of a bench."""

_SECONDS = 900
_DRIVER = """#include "Vbench.h"
int main() {
    Vbench bench;
    for (int half = 0; half < 2 * CLOCKS; ++half) {
        bench.clk = half & 1;
        bench.eval();
    }
}
"""
_CLOCK = """module clocked;
  reg clk = 1'b0;
  integer half;
  bench bench0 (.clk(clk));
  initial begin
    for (half = 0; half < 2 * CLOCKS; half = half + 1) begin
      clk = half % 2;
      #1;
    end
    $finish;
  end
endmodule
"""
_BENCH = """module bench(input wire clk);
  reg [31:0] clock = 0;
  reg [63:0] noise = 64'h9e3779b97f4a7c15;
  reg valid = 0, ready = 0, resetn = 0;
  reg [DATA:0] data = 0;
  reg [7:0] dest = 0;
  always @(posedge clk) begin
    clock <= clock + 1;
    noise <= noise * 64'd6364136223846793005 + 64'd1442695040888963407;
    resetn <= clock > 2 && noise[63:57] != 0;
    valid <= noise[56:55] != 0 || clock[6];
    ready <= noise[54:53] != 0 || clock[5];
    data <= noise[52] ? {64{noise[51]}} : noise[50:24];
    dest <= noise[62:55] % CHANNELS;
  end
"""
_PORT = """
    .s_axil_awaddr({noise[20:18], 2'd0}), .s_axil_awprot(3'd0), .s_axil_awvalid(noise[17]), .s_axil_awready(takenNN[0]),
    .s_axil_wdata(noise[16] ? 32'd1 : {noise[15:8], noise[31:8]}), .s_axil_wstrb(noise[7] ? 4'd15 : noise[6:3]),
    .s_axil_wvalid(noise[38]), .s_axil_wready(takenNN[1]), .s_axil_bresp(takenNN[3:2]), .s_axil_bvalid(takenNN[4]),
    .s_axil_bready(noise[39]), .s_axil_araddr({noise[37:35], 2'd0}), .s_axil_arprot(3'd0), .s_axil_arvalid(noise[34]),
    .s_axil_arready(takenNN[5]), .s_axil_rdata(readNN), .s_axil_rresp(takenNN[7:6]), .s_axil_rvalid(takenNN[8]),
    .s_axil_rready(noise[33]),
"""
_ANSWERS = """
  wire [8:0] takenNN;
  wire [31:0] readNN;
"""
_REGISTERS = (
    "{takenNN[5:4], takenNN[1:0], takenNN[8] ? {takenNN[7:6], readNN} : 34'd0, takenNN[4] ? takenNN[3:2] : 2'd0}"
)
_WATCHED = """
  wire [OUT:0] dataNN, maskedNN;
  wire [7:0] destNN;
  wire [USER:0] userNN;
  wire validNN, readyNN;
  reg [63:0] traceNN = 0;
  assign maskedNN = validNN ? dataNN : 0;
  mNN coreNN (
    .aclk(clk), .aresetn(resetn), .s_axis_tvalid(valid), .s_axis_tready(readyNN), .s_axis_tdata(data[IN:0]), MORE
    .m_axis_tdata(dataNN), .m_axis_tuser(userNN), .m_axis_tvalid(validNN), .m_axis_tready(ready)
  );
  always @(posedge clk) begin
    traceNN <= {traceNN[60:0], traceNN[63:61]} + maskedNN + {validNN ? userNN : USERS'd0, 12'd0}
      + {validNN ? destNN : 8'd0, 30'd0} + {readyNN, validNN, 40'd0};
    if (clock == CLOCKS - 2) $display("NN %h", traceNN);
  end
"""


def traces(texts: Sequence[str], top: Module, channels: int, clocks: int, folder: Path) -> dict[str, list[str]]:
    """Return what each tool sees of each text: a digest of the outputs over a run, or why it takes none.

    Parameters
    ----------
    texts : sequence of str
        Texts whose top is `cores.NAME`, with ports as those of `top`.
    top : Module
    channels, clocks : int
    folder : Path
        For files.
    """
    found: dict[str, list[str]] = {tool: [] for tool in TOOLS}

    def bench(count: int) -> str:
        return _bench(top, count, channels, clocks)

    for start in range(0, len(texts), AT_ONCE):
        for tool in TOOLS:
            place = folder / f"{tool}{start}"
            found[tool] += _seen(tool, texts[start : start + AT_ONCE], bench, clocks, place)
    return found


def named(text: str, number: int) -> str:
    """Give the modules of a text names of their own."""
    return re.sub(rf"\b{NAME}(?=_|\b)", f"m{number}", text)


def _bench(top: Module, count: int, channels: int, clocks: int) -> str:
    watched, more = _WATCHED, ""
    if "s_axil_awaddr" in top.ports:
        watched = watched.replace("+ {readyNN", f"+ {_REGISTERS} + {{readyNN")
        watched = _ANSWERS + watched
        more = _PORT
    if "s_axis_tdest" in top.ports:
        more += ".s_axis_tdest(dest), .m_axis_tdest(destNN),"
    else:
        watched = watched.replace("destNN;", "destNN = 0;", 1)
    widths = {"IN": "s_axis_tdata", "OUT": "m_axis_tdata", "USER": "m_axis_tuser"}
    text = watched.replace("MORE", more).replace("USERS", str(top.widths["m_axis_tuser"]))
    for word, port in widths.items():
        text = re.sub(rf"\b{word}\b", str(top.widths[port] - 1), text)
    text = _BENCH + "".join(text.replace("NN", str(number)) for number in range(count)) + "endmodule\n"
    text = text.replace("DATA", str(top.widths["s_axis_tdata"] - 1))
    return text.replace("CHANNELS", str(channels)).replace("CLOCKS", str(clocks))


def _seen(tool: str, texts: Sequence[str], bench: Callable[[int], str], clocks: int, folder: Path) -> list[str]:
    """Return what a tool sees of each text; where one makes it fail, halves are tried."""
    folder.mkdir(parents=True)
    own = [named(text, number) for number, text in enumerate(texts)]
    try:
        if tool == "yosys":
            own = _through_yosys(own, folder)
        output = _simulated(tool, own, bench(len(own)), clocks, folder)
    except ToolError as error:
        if len(texts) == 1:
            return [f"no trace: {str(error)[:300]}"]
        half = len(texts) // 2
        parts = (("a", texts[:half]), ("b", texts[half:]))
        return [seen for name, part in parts for seen in _seen(tool, part, bench, clocks, folder / name)]
    found = dict(re.findall(r"^(\d+) ([0-9a-fxXzZ]+)$", output, re.MULTILINE))
    return [found.get(str(number), "no trace") for number in range(len(texts))]


def _simulated(tool: str, texts: Sequence[str], bench: str, clocks: int, folder: Path) -> str:
    """Return what a simulator prints."""
    for number, text in enumerate(texts):
        (folder / f"core{number}.sv").write_text(text, encoding="ascii")
    (folder / "bench.sv").write_text(bench, encoding="ascii")
    sources = ["bench.sv", *(f"core{number}.sv" for number in range(len(texts)))]
    if tool == "verilator":
        (folder / "main.cpp").write_text(_DRIVER.replace("CLOCKS", str(clocks)), encoding="ascii")
        _done(["verilator", "--cc", "-Wno-fatal", "-Wno-lint", "--top-module", "bench", *sources], folder, tool)
        parts = [*sorted((folder / "obj_dir").glob("*.cpp")), folder / "main.cpp"]
        (folder / "all.cpp").write_text("".join(f'#include "{part}"\n' for part in parts), encoding="utf-8")
        options, objects = _verilated()
        _done([*options, "-I", "obj_dir", "all.cpp", *objects, "-pthread", "-o", "run"], folder, tool)
        return _done(["./run"], folder, tool)
    (folder / "clocked.sv").write_text(_CLOCK.replace("CLOCKS", str(clocks)), encoding="ascii")
    _done(["iverilog", "-g2012", "-s", "clocked", "-o", "run", "clocked.sv", *sources], folder, tool)
    return _done(["vvp", "run"], folder, tool)


@cache
def _environment(tool: str) -> dict[str, str]:
    return find_simulator("verilator" if tool == "verilator" else "icarus", Path(mkdtemp())).environment


def _done(command: Sequence[str], folder: Path, tool: str) -> str:
    """Run a command and return what it prints.

    Raises
    ------
    ToolError
        If it fails.
    """
    done = subprocess.run(
        command, cwd=folder, env=_environment(tool), capture_output=True, text=True, check=False, timeout=_SECONDS
    )
    if done.returncode:
        raise ToolError(done.stderr + done.stdout)
    return done.stdout


@cache
def _verilated() -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the compiler with its options, and Verilator's library, compiled once for all benches."""
    folder = Path(mkdtemp())
    root = _done(["verilator", "--getenv", "VERILATOR_ROOT"], folder, "verilator").strip()
    options = ("g++", "-std=c++17", "-O0", "-I", f"{root}/include", "-I", f"{root}/include/vltstd")
    names = ("verilated", "verilated_threads")
    for name in names:
        _done([*options, "-c", f"{root}/include/{name}.cpp"], folder, "verilator")
    return options, tuple(str(folder / f"{name}.o") for name in names)


def _through_yosys(texts: Sequence[str], folder: Path) -> list[str]:
    """Return the netlists that Yosys makes, written as Verilog."""
    script = []
    for number, text in enumerate(texts):
        (folder / f"in{number}.sv").write_text(text, encoding="ascii")
        script.append(
            f"design -reset; read_verilog -sv in{number}.sv; hierarchy -check -top m{number}; proc; flatten; "
            f"memory_collect; opt_clean; write_verilog -noattr out{number}.v"
        )
    run_yosys("; ".join(script), folder)
    return [(folder / f"out{number}.v").read_text(encoding="ascii") for number in range(len(texts))]
