"""A small text in the plain subset, to be spoilt."""

import pytest

from sosmith.verify.graph import RejectedError
from sosmith.verify.reader.source import read_source

TEXT = """\
// top: a small design
module top(a, q, aclk);
  input [3:0] a;
  wire [3:0] a;
  output [3:0] q;
  wire [3:0] q;
  input aclk;
  wire aclk;
  wire [3:0] n1;
  reg [3:0] held = 4'h5;
  reg [3:0] table1 [3:0];
  initial begin
    table1[0] = 4'h1;
    table1[1] = 4'h2;
    table1[2] = 4'h3;
    table1[3] = 4'h4;
  end
  assign n1 = a + held;
  always_ff @(posedge aclk)
    if (a[0]) held <= n1;
    else held <= table1[a[1:0]];
  inner inner0 (
    .clk(aclk),
    .i(held),
    .o(q)
  );
endmodule
module inner(i, o, clk);
  input [3:0] i;
  wire [3:0] i;
  output [3:0] o;
  reg [3:0] o = 4'h0;
  input clk;
  wire clk;
  always_ff @(posedge clk)
    o <= i;
endmodule
"""


def refused(text: str, sentence: str = r"\S", name: str = "top") -> None:
    with pytest.raises(RejectedError, match=sentence):
        read_source(text, name)


def edited(old: str, new: str) -> str:
    assert TEXT.count(old) == 1
    return TEXT.replace(old, new)
