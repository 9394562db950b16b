"""Operators over words with unknown bits: what is known is what every word that fits gives."""

from __future__ import annotations

import itertools

import pytest

from sosmith.verify.parallel.netlist import flattened
from sosmith.verify.reader.source import read_source
from sosmith.verify.unit.ternary import Ternary

TEXT = """module top(clk, a, b, y);
  input clk;
  wire clk;
  input [2:0] a;
  wire [2:0] a;
  input [2:0] b;
  wire [2:0] b;
  output [3:0] y;
  wire [3:0] y;
  assign y = EXPRESSION;
endmodule
"""
UNARY = {
    "~ a": lambda a, b: ~a & 15,
    "! a": lambda a, b: int(a == 0),
    "& a": lambda a, b: int(a == 7),
    "| a": lambda a, b: int(a != 0),
    "^ a": lambda a, b: a.bit_count() & 1,
    "^ { a, b }": lambda a, b: (a.bit_count() + b.bit_count()) & 1,
}
BINARY = {
    "a & b": lambda a, b: a & b,
    "a | b": lambda a, b: a | b,
    "a ^ b": lambda a, b: a ^ b,
    "a + b": lambda a, b: (a + b) & 15,
    "a - b": lambda a, b: (a - b) & 15,
    "a * b": lambda a, b: (a * b) & 15,
    "a == b": lambda a, b: int(a == b),
    "a != b": lambda a, b: int(a != b),
    "a < b": lambda a, b: int(a < b),
    "a >= b": lambda a, b: int(a >= b),
}


@pytest.mark.parametrize("expression", [*UNARY, *BINARY])
def test_what_is_known_is_so_for_every_word(expression: str) -> None:
    netlist = flattened(read_source(TEXT.replace("EXPRESSION", expression), "top").modules, "clk")
    right = (UNARY | BINARY)[expression]
    ternary, certain = Ternary(netlist, {}), 0
    masks = [0, 1, 5, 6, 7]
    for mask_a, mask_b, a, b in itertools.product(masks, masks, range(8), range(8)):
        value, mask = ternary.net("y", {"a": (a & mask_a, mask_a), "b": (b & mask_b, mask_b)})
        assert right(a, b) & mask == value & mask
        certain += mask == 15
    assert certain >= 64  # at least where all bits are known
