"""Registers that hold several words are split into one for each, and every output stays as it is."""

import pytest
from tests.verify.parallel.cores import small
from tests.verify.parallel.simulated import Inputs, Simulation
from tests.verify.small_specifications import PLAIN, STEADY_INSTRUMENT

from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.parallel.split import split
from sosmith.verify.reader.source import read_modules

MODULE = """
module top(clk, a, b, e, q);
  input clk;
  input [3:0] a;
  input [2:0] b;
  input e;
  output [8:0] q;
  reg [8:0] held = 9'h0a5;
  reg [8:0] next = 9'h000;
  wire [8:0] chosen;
  assign chosen = e ? next : { b, a[3], a[3], a };
  assign q = next;
  always_ff @(posedge clk)
    if (e) next <= held;
  always_ff @(posedge clk)
    LOAD
endmodule
"""


def netlist(load: str) -> Netlist:
    return flattened(read_modules(MODULE.replace("LOAD", load)), "clk")


def test_words_are_split_and_signs_stay_with_them() -> None:
    made = split(netlist("held <= chosen;"), set())
    assert sorted(made.registers) == ["held[5:0]", "held[8:6]", "next[5:0]", "next[8:6]"]
    assert made.fields == {name: name[:4] for name in made.registers}
    assert made.registers["held[5:0]"].first == 0x25
    assert made.registers["held[8:6]"].first == 0x2


def test_what_is_computed_or_kept_stays_whole() -> None:
    assert not split(netlist("held <= chosen + 9'h001;"), set()).fields
    assert not split(netlist("held <= e ? 4'h3 : chosen;"), set()).fields
    assert split(netlist("held <= chosen;"), {"next"}).fields.keys() == {"held[5:0]", "held[8:6]"}


@pytest.mark.parametrize(
    ("load", "sentence"),
    [
        ("held[8:0] <= chosen;", ""),
        ("held[7:0] <= chosen[7:0];", "each bit of held in top must be loaded at one place"),
        ("if (e) held[7:0] <= chosen[7:0]; else held[8] <= 1'h0;", r"a process must load one register, not .*"),
        ("held[3:0] <= a;\n  always_ff @(posedge clk)\n    held[8:4] <= chosen[8:4];", ""),
        ("held[4:0] <= a;\n  always_ff @(posedge clk)\n    held[8:4] <= chosen[8:4];", "each bit of held .*"),
        ("held[8:0] <= a;\n  always_ff @(posedge clk)\n    held <= a;", r"each bit of held .* at one place"),
        ("chosen[8:0] <= a;\n  always_ff @(posedge clk)\n    held <= a;", r"chosen of top must be .*"),
    ],
)  # fmt: skip
def test_registers_loaded_in_parts(load: str, sentence: str) -> None:
    if not sentence:
        made = netlist(load)
        assert sum(made.widths[name] for name in made.fields) == 9
        return
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        netlist(load)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spec", "lanes"), [(PLAIN, 1), (PLAIN.replace("bits = 8", "bits = 11"), 2), (STEADY_INSTRUMENT, 4)]
)
def test_outputs_stay(spec: str, lanes: int) -> None:
    inputs = Inputs(small(spec, lanes=lanes).text, clocks=150, seed=9)
    other = split(inputs.netlist, set())
    assert len(other.fields) > 2 * lanes
    first, second = Simulation(inputs.netlist), Simulation(other)
    for row in inputs.rows:
        assert first.outputs(row) == second.outputs(row)
        first.clock()
        second.clock()
