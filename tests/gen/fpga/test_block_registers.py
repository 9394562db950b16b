"""Registers that move into multipliers and block RAMs of an ECP5, and those that must stay."""

from __future__ import annotations

import json
from typing import Any

import pytest

from sosmith.gen.fpga.block_registers import cells_of, with_block_registers
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.fpga.yosys import run_yosys

PORTS = "input clk, rst, en, input [17:0] x, y, input [7:0] from, output reg [35:0] p, output [17:0] other"
BOTH = "a <= x; b <= y;"
CASES = {
    "all of a multiplier": (f"{BOTH} p <= $signed(a) * $signed(b);", "0", {"A", "B", "P"}),
    "all with an enable": (f"if (en) begin {BOTH} p <= $signed(a) * $signed(b); end", "0", {"A", "B", "P"}),
    "all with the inverse of one": (f"if (!en) begin {BOTH} p <= $signed(a) * $signed(b); end", "0", {"A", "B", "P"}),
    "a product with an enable": (f"{BOTH} if (en) p <= $signed(a) * $signed(b);", "0", {"A", "B", "P"}),
    "a product with a reset": (f"{BOTH} if (rst) p <= 0; else p <= $signed(a) * $signed(b);", "0", {"A", "B"}),
    "factors with different enables": ("if (en) a <= x; b <= y; p <= $signed(a) * $signed(b);", "0", {"P"}),
    "a factor that something else reads": (f"{BOTH} p <= $signed(a) * $signed(b);", "a", {"A", "B", "P"}),
    "a factor without a register": ("b <= y; p <= $signed(x) * $signed(b);", "0", {"P"}),
    "a square": ("a <= x; p <= $signed(a) * $signed(a);", "0", {"A", "B", "P"}),
    "a product by a constant": ("a <= x; p <= $signed(a) * 18'sd74565;", "0", {"A", "B", "P"}),
    "a word": ("w <= words[from]; p <= w;", "0", {"DO"}),
    "a word with a reset": ("w <= words[from]; if (rst) p <= 0; else p <= w;", "0", set()),
    "a word that is read at some clocks": ("if (en) w <= words[from]; p <= w;", "0", set()),
    "a word that something else reads": ("w <= words[from]; p <= w;", "w[17:0]", set()),
}
FEW = (
    "all of a multiplier",
    "a product with a reset",
    "a factor that something else reads",
    "a word",
    "a word with a reset",
)
"""Those that run always, as each takes a second: both kinds of block, with and without what holds a register back."""

_NAMES = {"REG_INPUTA_CLK": "A", "REG_INPUTB_CLK": "B", "REG_OUTPUT_CLK": "P", "REGMODE_B": "DO"}


@pytest.fixture(scope="module")
def netlists(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return the netlist of every case that runs; one Yosys makes them all, as starting one takes longest."""
    tests = [
        each for each in request.session.items if isinstance(each, pytest.Function) and each.module is request.module
    ]
    asked = {test.callspec.params.get("case") for test in tests if hasattr(test, "callspec")}
    cases = {case: CASES[case] for case in CASES if case in asked}
    folder = tmp_path_factory.mktemp("netlists")
    synthesis = find_board("ulx3s_25f").device.synthesis
    script = []
    for number, (clocked, other, _) in enumerate(cases.values()):
        (folder / f"{number}.sv").write_text(
            f"""module top ({PORTS});
reg [17:0] a, b; reg [35:0] w; integer i;
(* ram_style = "block" *) reg [35:0] words [0:255];
initial for (i = 0; i < 256; i = i + 1) words[i] = i * 36'd4241838687;
assign other = {other};
always @(posedge clk) begin {clocked} end
endmodule
""",
            encoding="utf-8",
        )
        commands = (f"read_verilog -sv {number}.sv", f"{synthesis} -top top", f"write_json {number}.json")
        script += ["design -reset", *commands]
    run_yosys("; ".join(script), folder)
    return {case: json.loads((folder / f"{number}.json").read_text("utf-8")) for number, case in enumerate(cases)}


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=[] if case in FEW else [pytest.mark.slow]) for case in CASES]
)
def test_a_register_moves_that_needs_no_reset(case: str, netlists: dict[str, Any]) -> None:
    *_, wanted = CASES[case]
    netlist = netlists[case]
    before = cells_of(netlist).get("TRELLIS_FF", 0)
    packed = with_block_registers(netlist)
    parameters = [cell["parameters"] for cell in packed["modules"]["top"]["cells"].values()]
    moved = {_NAMES[k] for each in parameters for k, v in each.items() if k in _NAMES and v in {"CLK0", "OUTREG"}}
    assert moved == wanted
    # One register is both factors, a constant has none, and one stays for what else reads it.
    nothing = {"a square": "B", "a product by a constant": "B", "a factor that something else reads": "A"}.get(case)
    bits = {"A": 18, "B": 18, "P": 36, "DO": 36} | ({} if nothing is None else {nothing: 0})
    assert before - cells_of(packed).get("TRELLIS_FF", 0) == sum(bits[name] for name in wanted)
