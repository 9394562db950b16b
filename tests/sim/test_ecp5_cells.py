"""Our models of ECP5 cells: synthesized multipliers and memories against the Verilog that they were made from."""

import re
import subprocess
from pathlib import Path

import pytest

from sosmith.gen.fpga.boards import find_board
from sosmith.gen.fpga.synthesis import Netlist, synthesize
from sosmith.sim import gate_level
from sosmith.sim.gate_level import with_cell_models

PRODUCTS = {
    "product_unsigned": "x * y",
    "product_signed": "$signed(x) * $signed(y)",
    "product_mixed": "$signed({1'b0, x[16:0]}) * $signed(y)",
    "product_narrow": "$signed(x[6:0]) * $signed(y[16:0])",
    "product_constant": "$signed(x) * 18'sd98765",
}
REGISTERED = """reg [17:0] held_x = 0, held_y = 0, late_y = 0; reg [35:0] held_product = 0;
reg [35:0] deep_read, deep_late = 0;
always @(posedge clk) begin
  held_x <= x; held_y <= y; late_y <= held_y; held_product <= $signed(held_x) * $signed(held_y);
  deep_read <= deep[from % 512]; deep_late <= deep_read;
end
assign registered_product = held_product;
reg [17:0] some_x = 0, some_y = 0; reg [35:0] some_product = 0;
always @(posedge clk) begin
  if (!enable[0]) begin some_x <= x; some_y <= y; end
  if (enable[1]) some_product <= $signed(some_x) * $signed(some_y);
end
assign enabled_product = some_product;
assign registered_word = deep_late;
(* ram_style = "block" *) reg [35:0] deep [0:511];
initial for (i = 0; i < 512; i = i + 1) deep[i] = i * 40503 + (i >> 3);
"""
WIDTHS = (1, 2, 4, 9, 18, 36)
INITIALIZED = 64
PORTS = "input clk, read, write, input [3:0] enable, input [17:0] x, y, input [13:0] from, to, input [35:0] data"


def memory(name: str, width: int, depth: int, writing: str, reading: str) -> str:
    """Declare a block RAM with some content, and its output."""
    return (
        f'(* ram_style = "block" *) reg [{width - 1}:0] {name}[0:{depth - 1}]; reg [{width - 1}:0] {name}_read;\n'
        f"initial for (i = 0; i < {INITIALIZED}; i = i + 1) {name}[i] = i * 40503 + (i >> 3);\n"
        f"always @(posedge clk) begin {writing} {reading} end\n"
    )


def design() -> str:
    """Write a module with a multiplier of each kind, and memories of each width and way to read and write."""
    outputs = dict.fromkeys(PRODUCTS, 36)
    body = "".join(f"assign {name} = {product};\n" for name, product in PRODUCTS.items())
    for width in WIDTHS:
        name, depth = f"wide{width}", 16384 // (width - width // 9)
        write = f"if (write) {name}[to % {depth}] <= data[{width - 1}:0];"
        body += memory(name, width, depth, write, f"if (read) {name}_read <= {name}[from % {depth}];")
        outputs[f"{name}_out"] = width
    parts = [f"if (enable[{k}]) bytes[to % 512][{9 * k} +: 9] <= data[{9 * k} +: 9];" for k in range(4)]
    body += memory("bytes", 36, 512, " ".join(parts), "if (read) bytes_read <= bytes[from % 512];")
    outputs["bytes_out"] = 36
    one_port = {"keeping": "if (!write) ", "old": "", "fresh": "if (write) fresh_read <= data[17:0]; else "}
    for name, unless in one_port.items():
        write = f"if (write) {name}[to % 1024] <= data[17:0];"
        body += memory(name, 18, 1024, write, f"{unless}{name}_read <= {name}[to % 1024];")
        outputs[f"{name}_out"] = 18
    body += "".join(f"assign {name} = {name[:-4]}_read;\n" for name in outputs if name.endswith("_out"))
    body += REGISTERED
    outputs |= {"registered_product": 36, "enabled_product": 36, "registered_word": 36}
    ports = ", ".join(f"output [{width - 1}:0] {name}" for name, width in outputs.items())
    return f"module cells ({PORTS}, {ports});\ninteger i;\n{body}endmodule\n"


def bench(outputs: list[tuple[str, int]]) -> str:
    """Write a bench that gives module and netlist the same inputs; reads what has content first, then writes."""
    wires = "".join(f"wire [{width - 1}:0] {name}, {name}_gates;\n" for name, width in outputs)
    inputs = ", ".join(f".{name}({name})" for name in re.findall(r"(\w+)(?=,|$)", PORTS))
    ours = ", ".join(f".{name}({name})" for name, _ in outputs)
    gates = ", ".join(f".{name}({name}_gates)" for name, _ in outputs)
    compare = "".join(
        f'if (i > 0 && {name} !== {name}_gates) $display("{name} %0d: %h, not %h", i, {name}_gates, {name});\n'
        for name, _ in outputs
    )
    return f"""module bench;
reg clk = 0, read = 1, write = 0; reg [3:0] enable = 0; reg [17:0] x = 0, y = 0; reg [13:0] from = 0, to = 0;
reg [35:0] data = 0;
integer i;
{wires}reference reference ({inputs}, {ours});
cells cells ({inputs}, {gates});
initial begin
  for (i = 0; i < 2000; i = i + 1) begin
    #1 clk = 1;
    #1 clk = 0;
    {compare}
    x = $urandom;
    y = $urandom;
    data = {{$urandom, $urandom}};
    if (i < {INITIALIZED}) begin
      from = i;
      to = i;
    end else begin
      // Each of 256 places is written before it is read.
      read = i > 400 ? $urandom : 0;
      write = i > 400 ? $urandom : i > 80;
      enable = i > 400 ? $urandom : {{4{{write}}}};
      to = i > 400 ? place($urandom) : place(i - 81);
      from = place($urandom);
    end
  end
  $display("done");
end
function [13:0] place(input [7:0] number);
  place = {{number[7:4], 6'b0, number[3:0]}};
endfunction
endmodule
"""


def said_by(folder: Path, files: dict[str, str]) -> str:
    """Run the module `bench` in Icarus; return what it prints."""
    for name, content in files.items():
        (folder / name).write_text(content, encoding="utf-8")
    subprocess.run(["iverilog", "-g2012", "-s", "bench", "-o", "bench.vvp", *files], cwd=folder, check=True)
    return subprocess.run(["vvp", "-n", "bench.vvp"], cwd=folder, capture_output=True, text=True, check=False).stdout


def differences(models_and_netlist: str, folder: Path) -> set[str]:
    """Run module and netlist side by side; return the outputs that differ."""
    text = design()
    outputs = [(name, int(high) + 1) for high, name in re.findall(r"output \[(\d+):0\] (\w+)", text)]
    reference = text.replace("module cells", "module reference")
    said = said_by(folder, {"reference.sv": reference, "bench.sv": bench(outputs), "gates.v": models_and_netlist})
    assert said.endswith("done\n"), said
    return set(re.findall(r"^\w+(?= \d+: )", said, flags=re.MULTILINE))


@pytest.fixture(scope="module")
def netlist(tmp_path_factory: pytest.TempPathFactory) -> Netlist:
    folder = tmp_path_factory.mktemp("cells")
    source = folder / "cells.sv"
    source.write_text(design(), encoding="utf-8")
    return synthesize(source, "cells", find_board("ulx3s_85f"), folder)


@pytest.mark.slow
def test_models_do_what_was_synthesized(netlist: Netlist, tmp_path: Path) -> None:
    text = netlist.path.read_text(encoding="utf-8")
    assert netlist.cells["MULT18X18D"] == len(PRODUCTS) + 2
    registers = re.findall(r"(REG_\w+_CLK\(\"CLK0\"\)|REGMODE_\w\(\"OUTREG\"\))", text)
    assert sorted(name.partition("(")[0] for name in registers) == [
        *("REGMODE_A", "REGMODE_B"),
        *(f"REG_{place}_CLK" for place in ("INPUTA", "INPUTB", "OUTPUT") for _ in range(2)),
    ]
    assert {int(width) for width in re.findall(r"DATA_WIDTH_\w\(32'd(\d+)\)", text)} == set(WIDTHS)
    assert set(re.findall(r"WRITEMODE_A\(\"(\w+)\"\)", text)) == {"NORMAL", "WRITETHROUGH", "READBEFOREWRITE"}
    # Yosys has registers before some of the memories, and what they start with may be written.
    models = with_cell_models(netlist, scrambled=False).read_text(encoding="utf-8")
    assert differences(models, tmp_path) == set()


WRONG = {
    "SIGNEDA & a[17]": ("a[17]", {"product_unsigned"}),
    "if (CE1) held_product": ("held_product", {"enabled_product"}),
    "place = (address[3] ? 9 : 0) + 4": ("place = (address[3] ? 8 : 0) + 4", {"wide4_out"}),
    "{{9{address[1]}}, {9{address[0]}}}": ("{{9{address[0]}}, {9{address[1]}}}", {"bytes_out"}),
    'CEA & WRITEMODE_A == "WRITETHROUGH"': ("1'b0", {"fresh_out"}),
    "(~WEA |": ("(1'b1 |", {"keeping_out", "fresh_out"}),
}
"""What stands in the models, what in its place is wrong, and the outputs that must show it."""


@pytest.mark.slow
def test_wrong_models_are_found(netlist: Netlist, tmp_path: Path) -> None:
    models = with_cell_models(netlist, scrambled=False).read_text(encoding="utf-8")
    expected: set[str] = set()
    for right, (wrong, shown_by) in WRONG.items():
        assert models.count(right) == 1
        models = models.replace(right, wrong)
        expected |= shown_by
    assert differences(models, tmp_path) == expected


REFUSED = {
    'MULT18X18D #(.REG_OUTPUT_CLK("CLK1")) cell_ ();': "MULT18X18D must have no other register and no bypass, unlike",
    'MULT18X18D #(.REG_PIPELINE_CLK("CLK0")) cell_ ();': "MULT18X18D must have no other register and no bypass,",
    'MULT18X18D #(.REG_OUTPUT_CLK("CLK0")) cell_ ();': "MULT18X18D must have no other register and no bypass, unlike",
    "MULT18X18D cell_ (.CLK0(clk), .CE0(1'b1), .RST0(1'b1));": "MULT18X18D must have registers that are never reset",
    "MULT18X18D cell_ (.SOURCEA(1'b1), .SOURCEB(1'b0));": "MULT18X18D must take A and B, not shifted operands as in",
    'TRELLIS_FF #(.SRMODE("ASYNC")) cell_ ();': "TRELLIS_FF must have a rising edge and a synchronous reset, unlike",
    'DP16KD #(.REGMODE_A("OUTREG")) cell_ ();': "DP16KD must have rising edges, no register at an output alone and no",
    'DP16KD #(.REGMODE_B("OUTREG")) cell_ (.CLKB(clk), .OCEB(1\'b0));': "DP16KD must have output registers that are",
    "DP16KD cell_ (.CLKB(clk), .RSTB(1'b1));": "DP16KD must have no reset and no chip select, unlike",
    "DP16KD cell_ (.CLKA(clk), .CSA1(1'b1));": "DP16KD must have no reset and no chip select, unlike",
    "DP16KD #(.DATA_WIDTH_B(36)) cell_ (.CLKB(clk), .WEB(1'b1));": "DP16KD must write 36 bits by port A, unlike",
}


@pytest.mark.parametrize(("instance", "message"), REFUSED.items())
def test_another_use_of_a_cell_is_refused(instance: str, message: str, tmp_path: Path) -> None:
    models = (Path(gate_level.__file__).parent / "ecp5_cells.v").read_text(encoding="utf-8")
    text = f"module bench; reg clk = 0; initial #1 clk = 1;\n{instance}\nendmodule\n"
    said = said_by(tmp_path, {"cells.v": "`define START(configured) (configured)\n" + models, "bench.sv": text})
    assert message in said
    assert said.splitlines()[0].endswith("bench.cell_")
