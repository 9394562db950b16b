"""Modules of a shared unit, put into the one that they are part of: the same hardware, or a refusal."""

from __future__ import annotations

import pytest

from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.netlist import flattened
from sosmith.verify.reader.inlined import inlined
from sosmith.verify.reader.source import read_source

TOP = """module top(aclk, a, o, p);
  input aclk;
  wire aclk;
  input a;
  wire a;
  output o;
  wire o;
  output p;
  wire p;
  wire n;
  wire m;
  INSTANCES
  assign o = n;
  assign p = m;
endmodule
"""
PART = """module top_PART(clk, a, q);
  input clk;
  wire clk;
  input a;
  wire a;
  output q;
  reg q = 1'hFIRST;
  always_ff @(posedge clk) q <= VALUE;
endmodule
"""
RESULT = PART.replace("PART", "result").replace("FIRST", "0").replace("VALUE", "a")
SEQUENCER = PART.replace("PART", "sequencer").replace("FIRST", "1").replace("VALUE", "~ a")
FIRST, SECOND = "top_result result (.clk(aclk), .a(a), .q(n));", "top_sequencer sequencer (.clk(aclk), .a(n), .q(m));"


def text(*instances: str, result: str = RESULT) -> str:
    return TOP.replace("INSTANCES", "\n  ".join(instances)) + result + SEQUENCER


def test_registers_keep_what_they_hold_and_nets_of_one_name_are_two() -> None:
    made = inlined(read_source(text(FIRST, SECOND), "top"), "top")
    (module,) = made.modules.values()
    assert module.registers == {"q": 0, "m": 1}
    assert len(flattened(made.modules, "aclk").registers) == 2


def test_a_net_inside_is_not_taken_for_one_outside_that_has_been_renamed() -> None:
    """The net n of the top becomes q, as the register is called; what else is called n is another net."""
    inner = SEQUENCER.replace("  always", "  wire n;\n  assign n = ~ a;\n  always").replace("<= ~ a", "<= n")
    last = PART.replace("PART", "word_memory").replace("FIRST", "0").replace("VALUE", "a")
    third = "top_word_memory word_memory (.clk(aclk), .a(n), .q(k));"
    whole = text(FIRST, SECOND.replace("(n)", "(a)"), third).replace("  wire m;\n", "  wire m;\n  wire k;\n", 1)
    (module,) = inlined(read_source(whole.replace(SEQUENCER, inner) + last, "top"), "top").modules.values()
    (loaded,) = [one.value for _, (one,) in module.clocked if one.target.name == "k"]
    assert loaded.name == "q"


@pytest.mark.parametrize(
    ("first", "second", "result"),
    [
        (FIRST, SECOND.replace("(m)", "(n)"), RESULT),
        (FIRST, SECOND + "\n  assign n = a;", RESULT),
        (FIRST, SECOND, RESULT.replace("  reg q", "  assign a = 1'h1;\n  reg q")),
        (FIRST.replace("(n)", "(a)"), SECOND, RESULT),
        (FIRST.replace("aclk", "m"), SECOND, RESULT),
        (FIRST.replace(", .q(n)", ""), SECOND, RESULT),
        (FIRST.replace(".a(a), ", ""), SECOND, RESULT),
        (FIRST.replace("(n)", "(1'h1)"), SECOND, RESULT),
        (FIRST, SECOND.replace(" sequencer ", " result "), RESULT),
        (FIRST, SECOND.replace("top_sequencer", "top"), RESULT),
    ],
    ids=[
        "two drivers",
        "a driver outside",
        "an input driven inside",
        "an input of the top driven",
        "another clock",
        "no output",
        "no input",
        "a number for an output",
        "two instances of one name",
        "the top in itself",
    ],
)
def test_what_would_be_other_hardware_is_refused(first: str, second: str, result: str) -> None:
    flattened(inlined(read_source(text(FIRST, SECOND), "top"), "top").modules, "aclk")
    with pytest.raises(RejectedError):
        flattened(inlined(read_source(text(first, second, result=result), "top"), "top").modules, "aclk")
