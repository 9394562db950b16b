"""Forms of the language that no core has: each is refused, wherever a tool would obey it."""

# ruff: noqa: E501
from __future__ import annotations

import pytest
from tests.verify.reader.small_text import TEXT, edited, refused

ITEMS = [
    "parameter p = 1;", "localparam p = 1;", "defparam inner0.p = 1;", "specparam s = 1;", "specify endspecify",
    "generate endgenerate", "generate if (1) wire z; endgenerate", "genvar g;", "if (1) wire z;", "case (1) endcase",
    "for (genvar g = 0; g < 1; g = g + 1) wire z;", "function f; input z; f = z; endfunction", "task t; endtask",
    "initial $finish;", "initial $readmemh(\"x\", table1);", "initial held = 4'h1;", "initial force a = 1;", "initial;",
    "initial begin #1 table1[0] = 4'h1; end", "initial fork join", "final;", "always #1;", "always @* n1 = a;",
    "always_comb n1 = a;", "always_latch n1 = a;", "and (n1, a);", "buf b1 (n1, a);", "pullup (n1);", "tran (n1, a);",
    "assert property (a);", "assume (a);", "cover property (a);", "let z = a;", "alias n1 = a;", "import p::*;",
    "export p::*;", "timeunit 1ns;", "timeprecision 1ns;", "typedef int t;", "enum { z } e;", "struct { int z; } s;",
    "event e;", "real r;", "realtime r;", "time t;", "integer z;", "int z;", "logic z;", "bit z;", "byte z;", "var z;",
    "string z;", "chandle z;", "tri z;", "tri0 z;", "tri1 z;", "wand z;", "wor z;", "trireg z;", "uwire z;", "supply0 z;",
    "supply1 z;", "wire signed z;", "wire vectored [3:0] z;", "wire scalared [3:0] z;", "wire [3:0] [1:0] z;",
    "wire z [3:0];", "wire [3:0] z [1:0];", "wire z, y;", "wire z = 1'h0;", "wire #1 z;", "wire (strong1, pull0) z = a;",
    "reg z, y;", "reg z = 0;", "reg signed z;", "reg [1:0][1:0] z;", "reg z [1:0][1:0];", "reg z [2];", "const reg z = 1'h0;",
    "static reg z;", "automatic reg z;", "inout z;", "ref z;", "input wire z;", "output reg z;", "input [3:0] a = 4'h0;",
    "module nested; endmodule", "interface i; endinterface", "program p; endprogram", "class c; endclass",
    "checker c; endchecker", "clocking c @(posedge aclk); endclocking", "covergroup c; endgroup", "property p; a; endproperty",
    "sequence s; a; endsequence", "bind top inner x (.i(a));", "modport m (input a);", "nettype t n;", "rand z;",
    "inner inner1 ();", "inner inner1 (a, q, aclk);", "inner inner1 (.i(a), .o(), .clk(aclk));", "inner inner1 (.*);",
    "inner inner1 (.i, .o, .clk);", "inner inner1 [1:0] (.clk(aclk), .i(a), .o(n1));", "inner #(1) inner1 (.i(a));",
    "inner #(.p(1)) inner1 (.i(a));", "inner inner1 (.clk(aclk), .i(a), .o(n1)), inner2 (.clk(aclk), .i(a), .o(n1));",
    "\"text\"", "$display;", "$display(\"x\");", "1", "1;", ";", "begin end", "end", "endmodule", "`a", "\\a ", "#1;", "@(a);",
    "-> e;", "wait (a);", "disable b;", "assign;", "assign n1 = a, n1 = a;", "assign #1 n1 = a;", "assign (weak0, weak1) n1 = a;",
    "deassign held;", "release a;", "force a = 1;", "default clocking c;", "extern module m;", "global clocking c;",
]  # fmt: skip

OUTSIDE = [
    "package p; endpackage", "import p::*;", "config c; design top; endconfig", "library a \"b\";", "include \"x\";",
    "primitive p(a, b); endprimitive", "interface i; endinterface", "program p; endprogram", "class c; endclass",
    "typedef int t;", "timeunit 1ns;", "timeunit 1ns / 1ps;", "function f; endfunction", "task t; endtask", "wire z;",
    "parameter p = 1;", "localparam p = 1;", "bind top inner x (.i(a));", "extern module m(a);", "checker c; endchecker",
    "macromodule m(a); input a; endmodule", "nettype t n;", "export p::*;", "$unit::a", "defparam top.p = 1;", "specify endspecify",
    "let z = a;", "covergroup c; endgroup", "table", "assign a = 1;", "initial;", "endmodule", "module", "module top;",
]  # fmt: skip

EXPRESSIONS = [
    "a + 4'hz", "a + 4'h?", "a + 4'bx1", "a + 4'd1_0", "a + 4'h1_0", "a + 4'sh1", "a + -4'h1", "a + +4'h1",
    "a + 'h1", "a + '1", "a + '0", "a + 'x", "a + 1", "a + 4 'h1", "a + 4'h 1", "a + 4'H1", "a + 4'o1", "a + 4'hg",
    "a + 4'h", "a + 0'h0", "a + 04'h1", "a + 4'h1F", "a + 99999999999'h1", "a + 4'h10", "a + 4'd16", "a + 1.0", "a + 1e3",
    "a + 1.5e-3", "a + 1ns", "a + 1step", "a + \"a\"", "a + $time", "a + $random", "a + $signed", "a + $bits(a)", "a + $clog2(4'h4)",
    "a + f(a)", "a + top.a", "a + inner0.i", "a + $root.top.a", "a + p::a", "a + this.a", "a + \\held ", "a + held++", "a + (held)",
    "(a) + held", "a + held + held", "a - held - held", "~ a + held", "a + ~ held", "a & held | held", "- a", "+ a", "~& a",
    "~| a", "~^ a", "! ~ a", "& & a", "a && held", "a || held", "a === held", "a !== held", "a ==? held", "a << held",
    "a >> 4'h1", "a <<< held", "a >>> held", "a / held", "a % held", "a ** held", "a ~^ held", "a -> held", "a inside { held }",
    "a ? held", "a ? held : a : a", "a ? a ? a : a : a", "a ?: held", "{2{a}}", "{ 2 { a } }", "{ }", "{ a, }", "{ a held }",
    "'{ a, held }", "{ << { a }}", "{ >> { a }}", "a[3:0][1:0]", "a[0][0]", "a[0:3]", "a[3-:2]", "a[0+:2]", "a[4]", "a[-1]",
    "a[held]", "a[1'h0]", "a[0+1]", "a[01]", "a[0:0:0]", "a[]", "table1", "table1[0][0]", "table1[4'h0][1:0]", "table1[3:0]",
    "held[3:0] [0]", "signed'(a)", "4'(a)", "int'(a)", "$unsigned(a)", "$signed()", "$signed(a, held)", "$signed a",
    "aclk[0]", "undeclared", "a b", "a,", "a +", "+", "", "=", "a = held", "a == = held", "a ! = held", "a < = held", "a @ held",
    "a # held", "a $ held", "a ` held", "a \\ held", "a ' held", "a // held", "a /* */ + held", "a + (* x *) held",
]  # fmt: skip

STATEMENTS = [
    "held = n1;", "held <= #1 n1;", "held <= repeat (2) @(aclk) n1;", "held <= @(posedge aclk) n1;", "#1 held <= n1;",
    "@(posedge aclk) held <= n1;", "held += n1;", "held++;", "held <= n1; held <= a;  end", "begin : b held <= n1; end",
    "begin held <= n1;", "case (a) default: held <= n1; endcase", "casez (a) 4'b1???: held <= n1; endcase",
    "casex (a) 4'bx: held <= n1; endcase", "case (a) 4'h1: held <= n1; 4'h1: held <= a; endcase",
    "case (a) inside [0:1]: held <= n1; endcase", "unique if (a) held <= n1;", "unique0 if (a) held <= n1;",
    "priority if (a) held <= n1;", "if (a) ; else held <= n1;", "if (a) begin end else", "if (a &&& n1) held <= n1;",
    "if a held <= n1;", "if () held <= n1;", "if (a = n1) held <= n1;", "for (i = 0; i < 1; i = i + 1) held <= n1;",
    "foreach (held[i]) held[i] <= a;", "while (a) held <= n1;", "repeat (2) held <= n1;", "do held <= n1; while (a);",
    "forever held <= n1;", "fork held <= n1; join", "wait (a) held <= n1;", "disable held;", "return;", "break;", "continue;",
    "$display(a);", "assign held = n1;", "force held = n1;", "release held;", "-> e;", "->> e;", "{ held } <= n1;",
    "{ held[0], held[1] } <= n1[1:0];", "held[a] <= n1;", "held[0+:2] <= n1;", "held.x <= n1;", "inner0.o <= n1;",
    "n1 <= a;", "a <= n1;", "q <= n1;", "table1 <= n1;", "table1[0][1:0] <= n1;", "integer z; held <= n1;", "reg z; held <= n1;",
    "assert (a) held <= n1;", "randcase 1: held <= n1; endcase", "void'(a);", ";",
]  # fmt: skip

HEADERS = [
    "module top;", "module top();", "module top(a, q, aclk)", "module top(a, q, aclk, );", "module top(a, q, aclk, aclk);",
    "module top(input [3:0] a, q, aclk);", "module top(.a(a), q, aclk);", "module top({ a, q }, aclk);", "module top(a[3:0], q, aclk);",
    "module automatic top(a, q, aclk);", "module static top(a, q, aclk);", "module top #(parameter p = 1) (a, q, aclk);",
    "module top import p::*; (a, q, aclk);", "module \\top (a, q, aclk);", "module top(a, q, aclk, .*);", "macromodule top(a, q, aclk);",
    "module top(a, q);", "module top(a, q, aclk, z);", "module 'top(a, q, aclk);", "module top (* x *) (a, q, aclk);",
    "extern module top(a, q, aclk);", "interface top(a, q, aclk);", "module top(a, q, aclk) ; ;", "module Top(a, q, aclk);",
]  # fmt: skip


@pytest.mark.parametrize("item", ITEMS)
def test_no_other_item(item: str) -> None:
    refused(edited("  assign n1", f"  {item}\n  assign n1"))
    refused(edited("endmodule\nmodule inner", f"{item}\nendmodule\nmodule inner"))


@pytest.mark.parametrize("item", OUTSIDE)
def test_nothing_stands_beside_modules(item: str) -> None:
    refused(f"{item}\n{TEXT}")
    refused(f"{TEXT}{item}\n")
    refused(edited("endmodule\nmodule inner", f"endmodule\n{item}\nmodule inner"))


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_no_other_expression(expression: str) -> None:
    refused(edited("n1 = a + held", f"n1 = {expression}"))


@pytest.mark.parametrize("statement", STATEMENTS)
def test_no_other_statement(statement: str) -> None:
    refused(edited("    if (a[0]) held <= n1;\n    else held <= table1[a[1:0]];", f"    {statement}"))


@pytest.mark.parametrize("header", HEADERS)
def test_no_other_header(header: str) -> None:
    refused(edited("module top(a, q, aclk);", header))


@pytest.mark.parametrize(
    "end", ["", "endmodule : top", "endmodule;", "endmodule endmodule", "end", "endmodule\nendmodule"]
)
def test_a_module_has_one_end(end: str) -> None:
    refused(edited("endmodule\nmodule inner", f"{end}\nmodule inner"))
