"""Edits of a core's SystemVerilog, by class: what mistakes and malice make of it.

Each edit is drawn at random and may leave the text as it was. None of them knows whether it is harmless: that is what
the tools are asked.
"""

# ruff: noqa: E501
from __future__ import annotations

import random
import re
from collections.abc import Callable, Sequence

from tests.verify.parallel.edits import edits as wrong_lines

Edit = Callable[[random.Random, str], str]

_WORD = r"(?<![\w'$.])[a-z_]\w*\b"
_NUMBER = r"\b\d+'h[0-9a-f]+\b"


def within(pattern: str, *replacements: str) -> Edit:
    """Replace a place of a pattern by one of the templates."""

    def edit(rng: random.Random, text: str) -> str:
        places = list(re.finditer(pattern, text, re.MULTILINE))
        if not places:
            return text
        place = rng.choice(places)
        return text[: place.start()] + place.expand(rng.choice(replacements)) + text[place.end() :]

    return edit


def inserted(*lines: str) -> Edit:
    """Put one of the lines somewhere in the text: between any two lines."""

    def edit(rng: random.Random, text: str) -> str:
        found = text.split("\n")
        at = rng.randrange(len(found))
        return "\n".join([*found[:at], rng.choice(lines), *found[at:]])

    return edit


def in_a_module(*lines: str) -> Edit:
    """Put one of the items in front of the end of a module."""
    return within(r"^endmodule$", *(f"{line}\\nendmodule".replace("\n", "\\n") for line in lines))


def _moved(rng: random.Random, text: str) -> str:
    """Move an item of one line to another place."""
    lines = text.split("\n")
    items = [k for k, line in enumerate(lines) if re.match(r"  (?:wire|reg|input|output|assign)\b.*;$", line)]
    if not items:
        return text
    line = lines.pop(rng.choice(items))
    lines.insert(rng.randrange(len(lines)), line)
    return "\n".join(lines)


def _swapped(rng: random.Random, text: str) -> str:
    lines = text.split("\n")
    at = rng.randrange(len(lines) - 1)
    lines[at], lines[at + 1] = lines[at + 1], lines[at]
    return "\n".join(lines)


def _shuffled(rng: random.Random, text: str) -> str:
    """Bring the declarations of a module, or its assignments, in another order."""
    kind = rng.choice(["  wire ", "  assign "])
    lines = text.split("\n")
    places = [k for k, line in enumerate(lines) if line.startswith(kind)]
    start = rng.randrange(max(len(places) - 8, 1))
    chosen = places[start : start + 8]
    others = [lines[k] for k in chosen]
    rng.shuffle(others)
    for place, line in zip(chosen, others, strict=True):
        lines[place] = line
    return "\n".join(lines)


def _modules_reversed(rng: random.Random, text: str) -> str:
    head, *modules = re.split(r"(?m)^(?=module )", text)
    rng.shuffle(modules)
    return head + "".join(module if module.endswith("\n") else module + "\n" for module in modules)


def _parts_rotated(rng: random.Random, text: str) -> str:
    """Turn the ports of a header or an instance round."""
    places = list(re.finditer(r"(?<=\()[^()]*,[^()]*(?=\);)", text))
    if not places:
        return text
    place = rng.choice(places)
    parts = [part.strip() for part in place[0].split(",")]
    return text[: place.start()] + ", ".join([*parts[1:], parts[0]]) + text[place.end() :]


def _renamed(new: Callable[[random.Random, str], str], *, everywhere: bool) -> Edit:
    def edit(rng: random.Random, text: str) -> str:
        names = sorted(set(re.findall(r"(?<=^  wire )\w+(?=;)|(?<=^  reg )\w+(?= =)|(?<=\d\] )\w+(?=;)", text, re.M)))
        if not names:
            return text
        old = rng.choice(names)
        wanted = new(rng, old)
        if everywhere:
            return re.sub(rf"\b{old}\b", lambda _: wanted, text)
        place = rng.choice(list(re.finditer(rf"\b{old}\b", text)))
        return text[: place.start()] + wanted + text[place.end() :]

    return edit


def _twice(pattern: str) -> Edit:
    def edit(rng: random.Random, text: str) -> str:
        places = list(re.finditer(pattern, text, re.MULTILINE | re.DOTALL))
        if not places:
            return text
        place, other = rng.choice(places), rng.choice(places)
        return text[: other.end()] + place[0] + text[other.end() :]

    return edit


def _again(change: Callable[[str], str], *, before: bool) -> Edit:
    """Add a module that is like one that is there, but for a change."""

    def edit(rng: random.Random, text: str) -> str:
        module = change(rng.choice(re.findall(r"(?ms)^module .*?^endmodule\n", text)))
        return module + text if before else text + module

    return edit


def _wrong_line(rng: random.Random, text: str) -> str:
    """Change what is computed, as a mistake in the generator would."""
    places = wrong_lines(text)
    kind = rng.choice(sorted(places))
    number, line = rng.choice(places[kind])
    lines = text.splitlines()
    return "\n".join([*lines[:number], line, *lines[number + 1 :]]) + "\n"


def _other_word(rng: random.Random, text: str) -> str:
    """Change a digit of a word of a memory or of a first value."""
    return within(r"(?<=[=] )(\d+'h[0-9a-f]*)[0-9a-f](?=;)", *(rf"\g<1>{digit}" for digit in "01378f"))(rng, text)


def _deep(template: str, inside: str) -> Callable[[random.Random], str]:
    def built(rng: random.Random) -> str:
        depth = rng.choice([60, 500, 5_000])
        left, _, right = template.partition("@")
        return left * depth + inside + right * depth

    return built


def _long(rng: random.Random, text: str) -> str:
    """Add what is deep, long, wide or many."""
    count = rng.choice([500, 3_000])
    chain = "\n".join(f"  wire z{k};\n  assign z{k} = z{k + 1};" for k in range(count))
    built = rng.choice(
        [
            lambda: f"  assign z = {_deep('{ @ }', 'a')(rng)};",
            lambda: f"  assign z = {_deep('(@)', 'a')(rng)};",
            lambda: f"  assign z = {_deep('$signed(@)', 'a')(rng)};",
            lambda: f"  assign z = {_deep('~ @', 'a')(rng)};",
            lambda: f"  always_ff @(posedge aclk) {_deep('if (a) @', 'z <= a;')(rng)}",
            lambda: f"  always_ff @(posedge aclk) {_deep('begin @ end', 'z <= a;')(rng)}",
            lambda: f"{chain}\n  wire z{count};\n  assign z{count} = z0;",
            lambda: f"  wire [{'9' * count}:0] z;",
            lambda: f"  wire [{10**9}:0] z;",
            lambda: f"  assign z = {10**9}'h1;",
            lambda: f"  assign z = 8'h{'0' * count}1;",
            lambda: f"  assign z = 4096'd{'9' * count};",
            lambda: f"  wire {'z' * count};",
            lambda: "  reg [7:0] z [999999999:0];",
            lambda: (
                "  reg z [7:0];\n  initial begin : z_held\n    integer i;\n"
                "    for (i = 0; i < 999999999; i = i + 1) z[i] = 1'h0;\n  end"
            ),
            lambda: "\n".join(f"  wire z{k};" for k in range(count)),
        ]
    )()
    if rng.random() < 0.2:
        return text + "".join(f"module z{k}(a);\n  input a;\n  z{k + 1} z (.a(a));\nendmodule\n" for k in range(count))
    return re.sub(r"^endmodule$", lambda _: f"{built}\nendmodule", text, count=1, flags=re.MULTILINE)


CLASSES: dict[str, Sequence[Edit]] = {
    "layout": [
        within(r" ", "  ", "   ", "\\n", "\\n  ", ""),
        within(r"(?<=[;,(]) ?", " ", "\\n", "\\n\\n    "),
        within(r"\n", "\\n\\n", " \\n", " ", ""),
        within(r"(?=[\[({;,=?:])", " ", "\\n"),
        within(r"\b", " ", "\\n"),
        within(r"(?m)^ *", "", "        ", "   "),
    ],
    "characters": [
        within(r" ", "\\t", "\\v", "\\f", "\\r", "\\r\\n", "\\0", "\xa0", "\u2028", "\u200b", "\x1b", "\x7f", "\x85"),
        within(r"\n", "\\r\\n", "\\r", "\\n\\r", "\\v", "\\f", "\x1a\\n", "\u2029"),
        within(r"\A", "\ufeff", "\\0", "\x04"),
        within(_WORD, "\\g<0>\u0301", "\\g<0>é", "\u0430"),
        within(r"(?=\n)", " // a\\r  assign a = b;", "\\\\", "\\\\ "),
    ],
    "comments": [
        inserted("// a plain line", "//", "  // another: with ; and endmodule", "// `define a", "// (* a *)"),
        inserted(*(f"{lead}{word}" for lead in ("// ", "//", "  //   ") for word in (
            "synopsys translate_off", "synthesis translate_off", "pragma translate_off", "verilator lint_off WIDTH",
            "synthesis full_case", "Synopsys Translate_Off", "rtl_synthesis off", "pragma protect begin", "vhdl_comp_off",
        ))),
        inserted("/* a */", "/* a\n b */", "/**/", "/* /* a */", "/* // */", "// /*", "// */", "/* Generated by Yosys 1 */"),
        inserted("// a \\", "//\\", "/ / a", "/", "*/", "/*", "# a", "-- a", "; // a"),
        within(r"(?<=;)$", " // a", " /* a */", "// synthesis translate_off", " /* a", "/**/"),
        within(r" ", "/**/", " /* a */ ", " // a\\n"),
    ],
    "attributes": [
        inserted("  (* keep = 32'd1 *)", '  (* ram_style = "block" *)', "  (* no_rw_check = 32'd1 *)"),
        inserted("(* blackbox *)", "(* keep *)", "  (* a /* *)", '  (* a = "*)" *)', '  (* a = "/*" *)', "(*)", "(* *)"),
        inserted("  (* init = 1'h1 *)", "  (* full_case, parallel_case *)", "(* top *)", "  (* anyconst *)", "(* whitebox *)"),
        inserted("  (* nowrshmsk *)", "  (* mem2reg *)", "  (* rom_block *)", "  (* syn_keep = 1 *) wire syn;", "  (* gclk *)"),
        within(r"(?=\b(?:wire|reg|assign|input|if|module)\b)", "(* keep *) ", "(* a *)(* b *) ", "(* keep = 32'd1 *)\\n"),
        within(r"(?<= = )", "(* a *) ", "(* + *) "),
    ],
    "directives": [
        inserted("`timescale 1ns/1ps", "`default_nettype none", "`define wire reg", "`include \"x\"", "`ifdef A", "`endif"),
        inserted("`resetall", "`celldefine", "`line 1 \"a\" 0", "`pragma a", "`undef a", "`begin_keywords \"1364-2001\"", "`\"a`\""),
        within(_WORD, "`\\\\g<0>", "`a", "\\\\g<0>`"),
    ],
    "names": [
        _renamed(lambda rng, old: f"{old}_new", everywhere=True),
        _renamed(lambda rng, old: old.upper() + "0", everywhere=True),
        _renamed(lambda rng, old: rng.choice(["logic", "do", "bit", "signed", "table", "config", "cell"]), everywhere=True),
        _renamed(lambda rng, old: rng.choice(["nor", "reg", "edge", "cross", "strong0", "matches"]), everywhere=True),
        _renamed(lambda rng, old: f"\\{old} ", everywhere=True),
        _renamed(lambda rng, old: f"\\{old} ", everywhere=False),
        _renamed(lambda rng, old: rng.choice([old + "$", "$" + old, "_", "x" * 300, "é", "0" + old, "a.b", "a b"]), everywhere=True),
        _renamed(lambda rng, old: rng.choice([old + "_", old[:-1] or "a", old.upper(), "clk", "undeclared"]), everywhere=False),
        within(r"\btiny\w*", "TINY", "tiny_", "other", r"\\\\\g<0> ", "inner.tiny"),
    ],
    "widths": [
        within(r"\[(\d+):0\]", r"[\g<1>:1]", r"[0:\g<1>]", r"[\g<1>:-1]", r"[\g<1>+0:0]", r"[(\g<1>):0]", r"[\g<1>:0][0:0]", ""),
        within(r"\[(\d+):0\]", r"[1\g<1>:0]", r"[0\g<1>:0]", r"[\g<1>'d3:0]", r"[\g<1>:00]", r"[ \g<1> : 0 ]", r"[\g<1>_0:0]"),
        within(r"(?<=wire )(?=\w)", "[0:0] ", "[1:0] ", "[0:1] ", "signed ", "[7:0] "),
        within(r"(?<=reg )(?=\w)", "[0:0] ", "[1:0] ", "signed ", "[7:0] "),
        within(r"(\w+)\[(\d+):(\d+)\]", r"\g<1>[\g<2>-:1]", r"\g<1>[\g<3>+:1]", r"\g<1>[\g<3>:\g<2>]", r"\g<1>[\g<2>]", r"\g<1>"),
        within(r"(\w+)\[(\d+)\]", r"\g<1>[1'd0]", r"\g<1>[\g<2>:\g<2>]", r"\g<1>", r"\g<1>[-1]", r"\g<1>[9\g<2>]", r"\g<1>[\g<2>][0]"),
    ],
    "duplicates": [
        _twice(r"^  (?:wire|reg|input|output) .*?;\n"),
        _twice(r"^  assign .*?;\n"),
        _twice(r"^  always_ff .*?;\n"),
        _twice(r"^    \w+\[\d+\] = .*?;\n"),
        _twice(r"^  initial begin.*?^  end\n"),
        _twice(r"^  \w+ \w+ \(\n.*?\);\n"),
        _twice(r"^    \.\w+\(.*?\),\n"),
        within(r"(?<=[(,] )(\w+)(?=,)", r"\g<1>, \g<1>"),
        within(r"^  wire (\w+);$", r"  wire \g<1>, \g<1>;", r"  wire \g<1>;\\n  reg \g<1>;", r"  wire \g<1>;\\n  integer \g<1>;"),
    ],
    "order": [_moved, _swapped, _shuffled, _modules_reversed, _parts_rotated],
    "numbers": [
        within(r"\b(\d+)'h([0-9a-f]+)\b", r"\g<1>'H\g<2>", r"\g<1>'sh\g<2>", r"'h\g<2>", r"\g<1>'h0\g<2>", r"\g<1>'h_\g<2>"),
        within(r"\b(\d+)'h([0-9a-f]+)\b", r"\g<1> 'h\g<2>", r"\g<1>'h \g<2>", r"\g<1>'o\g<2>", r"\g<1>'d\g<2>", r"\g<1>'b\g<2>"),
        within(r"\b(\d+)'h([0-9a-f]+)\b", r"0\g<1>'h\g<2>", r"\g<1>'h\g<2>_0", r"+\g<1>'h\g<2>", r"-\g<1>'h\g<2>", r"\g<1>'hx"),
        within(r"\b(\d+)'h([0-9a-f]+)\b", r"\g<1>'hz", r"\g<1>'h?", r"\g<1>'bx", r"1\g<1>'h\g<2>", r"\g<1>'h1\g<2>", "'0", "'1", "'x"),
        within(r"\b(\d+)'h([0-9a-f]+)\b", "1.0", "1e3", "1.5e-3", '"a"', r"\g<1>", r"(\g<1>'h\g<2>)", "1step", "2ns", r"\g<2>"),
        _other_word,
    ],
    "two modules": [
        _again(lambda module: module, before=False),
        _again(lambda module: module, before=True),
        _again(lambda module: module.replace("module ", "module other_", 1), before=False),
        _again(lambda module: module.replace("module ", "module a_", 1), before=True),
        _again(lambda module: module.replace("module ", "macromodule ", 1), before=False),
        _again(lambda module: module.replace("endmodule", "endmodule : tiny"), before=False),
        _again(lambda module: re.sub(r"module \w+", "module TINY", module, count=1), before=True),
        _again(lambda module: re.sub(r"(?s)module (\w+).*", r"module \1(aclk);\n  input aclk;\nendmodule\n", module), before=True),
        within(r"^endmodule$", "", "endmodule endmodule", "endmodule;", "endmodule : a", "  module a; endmodule\\nendmodule"),
        inserted("package p; endpackage", "import p::*;", "bind tiny tiny b (.*);", "config c; design tiny; endconfig"),
        inserted("library a \"b\";", "program p; endprogram", "interface i; endinterface", "primitive p(a, b); endprimitive"),
    ],
    "operators": [
        within(r"(?<= )(\+|-|\*|&|\||\^|==|!=|<|>|<=)(?= [$\w{])", "===", "!==", "==?", "<<", ">>", "<<<", ">>>", "**", "%", "/"),
        within(r"(?<= )(\+|-|\*|&|\||\^|==|!=|<|>|<=)(?= [$\w{])", "&&", "||", "~^", "^~", "->", "+ +", "- -", "& ~", "| |", "inside"),
        within(r"(?<= )(\+|-|\*|&|\||\^|==|!=|<|>|<=)(?= [$\w{])", "+", "-", "*", "&", "|", "^", "==", "!=", "<", ">", ">="),
        within(r"(?<= = )([$\w{][^;?]*);$", r"(\g<1>);", r"+ \g<1>;", r"- \g<1>;", r"~& \g<1>;", r"~| \g<1>;", r"! \g<1>;", r"^ \g<1>;"),
        within(r"(?<= = )([$\w{][^;?]*);$", r"\g<1> + 1'h1;", r"\g<1> & \g<1>;", r"{2{\g<1>}};", r"\g<1> ? 1'h1 : 1'h0;", r"~ \g<1>;"),
        within(r" \? (.*) : (.*);$", r" ? \g<2> : \g<1>;", r" ? (\g<1>) : \g<2>;", r" ? \g<1> : \g<2> ? 1'h0 : 1'h1;", r" & \g<1>;"),
        within(r"\{ ([^{}]*) \}", r"{\g<1>}", r"{ 1{ \g<1> }}", r"'{ \g<1> }", r"{ >> { \g<1> }}", r"{ << { \g<1> }}", r"{ \g<1>, }", "{ }"),
    ],
    "signs": [
        within(r"\$signed\((\w+)\)", r"\g<1>", r"$unsigned(\g<1>)", r"signed'(\g<1>)", r"$signed (\g<1>)", r"$signed($signed(\g<1>))"),
        within(r"(?<== )(\w+)(?=;)", r"$signed(\g<1>)", r"$unsigned(\g<1>)", r"$signed({ \g<1>, 1'h0 })"),
        within(r"(?<=[-+*<>] )(\w+)(?=;)", r"$signed(\g<1>)", r"$unsigned(\g<1>)", r"int'(\g<1>)"),
        within(r"^  (wire|reg|input|output) ", r"  \g<1> signed ", r"  \g<1> unsigned "),
    ],
    "statements": [
        within(r"^    if \((.*)\) (\w.*;)$", r"    case (\g<1>) 1'h1: \g<2> endcase", r"    casez (\g<1>) 1'b?: \g<2> endcase"),
        within(r"^    if \((.*)\) (\w.*;)$", r"    unique if (\g<1>) \g<2>", r"    case (\g<1>) default: \g<2> endcase"),
        within(r"^    if \((.*)\) (\w.*;)$", r"    if (\g<1>) begin \g<2> end", r"    if (\g<1>) if (\g<1>) \g<2>", r"    \g<2>"),
        within(r"\belse\b", "", "else begin end else", "else else", "else;"),
        within(r"(?<=\w) <= (?=.*;$)", " = ", " <= #1 ", " <= @(posedge aclk) ", " += ", " <- ", " ->> ", " <= repeat (2) @(aclk) "),
        within(r"always_ff", "always", "always_comb", "always_latch", "final", "initial", "always_ff always_ff"),
        within(r"@\(posedge (\w+)\)", r"@(negedge \g<1>)", r"@(\g<1>)", r"@*", r"@(*)", r"@(posedge \g<1> or negedge \g<1>)"),
        within(r"@\(posedge (\w+)\)", r"@ ( posedge \g<1> )", r"@(edge \g<1>)", r"@(posedge \g<1>, posedge \g<1>)", r"#1", ""),
        within(r"^  assign ", "  assign #1 ", "  assign (strong1, weak0) ", "  always_comb ", "  initial assign ", "  force ", "  alias "),
    ],
    "memories": [
        within(r"^    (\w+)\[(\d+)\] = (.*);$", r"    \g<1>[\g<2>] <= \g<3>;", r"    \g<1>[0\g<2>] = \g<3>;", r"    \g<1>[\g<2>+0] = \g<3>;"),
        within(r"^    (\w+)\[(\d+)\] = (.*);$", r"    \g<1> [ \g<2> ] = \g<3> ;", r"    #1 \g<1>[\g<2>] = \g<3>;", r"    \g<1>[9\g<2>] = \g<3>;"),
        within(r"^    (\w+)\[(\d+)\] = (.*);$", r'    $readmemh("x", \g<1>);', r"    \g<1>[\g<2>][0] = 1'h1;", r"    \g<1>[\g<2>:\g<2>] = \g<3>;"),
        within(r"i = (\d+); i < (\d+); i = i \+ 1", r"i = \g<1>; i <= \g<2>; i = i + 1", r"i = \g<1>; i < \g<2>; i++", r"i = 1; i < \g<2>; i = i + 2"),
        within(r"^(  initial begin)", r"\g<1> : a", r"  initial #1 begin", r"\g<1> ;", r"  always_comb begin", r"\g<1> fork join"),
        within(r"(reg (?:\[\d+:0\] )?\w+) \[(\d+):0\];", r"\g<1> [0:\g<2>];", r"\g<1> [\g<2>:1];", r"\g<1> [1\g<2>:0];", r"\g<1> [\g<2>];"),
        within(r"(?<=reg )(.*) = (.*);$", r"\g<1>;", r"\g<1> = 0;", r"\g<1> = 1'h1;", r"\g<1>; initial \g<1> = \g<2>;", r"\g<1> = 'x;"),
        within(r"\[(\w+)\];$", r"[\g<1> + 1'h1];", r"[~ \g<1>];", r"[\g<1>][0];", r"[0];", r"[{ \g<1>, 1'h0 }];"),
        _other_word,
    ],
    "declarations": [
        within(r"^  wire ", "  tri ", "  wand ", "  supply0 ", "  logic ", "  uwire ", "  var ", "  wire vectored ", "  trireg "),
        within(r"^  wire .*?;\n", "", "  genvar g;\\n"),
        within(r"^  (input|output) (.*);$", r"  \g<1> wire \g<2>;", r"  inout \g<2>;", r"  \g<1> var \g<2>;", r"  \g<1> logic \g<2>;"),
        within(r"^  (input|output) (.*);$", r"  \g<1> \g<2>, z;", r"  (\g<1> \g<2>);", r"  ref \g<2>;", ""),
        within(r"^  wire (.*);$", r"  wire \g<1> = 1'h0;", r"  wire #1 \g<1>;", r"  wire (strong1, pull0) \g<1>;", r"  const \g<1>;"),
        within(r"(?<=^module )(\w+)\(", r"\g<1> #(parameter p = 1) (", r"automatic \g<1>(", r"\g<1> import p::*; (", r"\g<1> (input "),
        within(r"(\w+ \w+) \($", r"\g<1> [1:0] (", r"\g<1>0 (), \g<1> (", r"#(1) \g<1> ("),
        within(r"^    \.(\w+)\((.*)\)", r"    .\g<1>", r"    .*", r"    .\g<1>()", r"    \g<2>", r"    .\g<1>(\g<2> + 1'h0)", r"    .\g<1>((\g<2>))"),
    ],
    "language": [
        in_a_module("  parameter p = 1;", "  localparam p = 1;", "  defparam a.p = 1;", "  generate endgenerate", "  specify endspecify"),
        in_a_module("  function f; input a; f = a; endfunction", "  task t; endtask", "  initial $finish;", "  initial $display;"),
        in_a_module("  initial force a = 1;", "  and (a, b);", "  buf b1 (a, b);", "  assert property (a);", "  timeunit 1ns;"),
        in_a_module("  genvar g;", "  for (genvar g = 0; g < 1; g = g + 1) wire a;", "  if (1) wire a;", "  typedef int t;", "  ;"),
        in_a_module("  import p::*;", "  let a = b;", "  event e;", "  modport m (input a);", "  covergroup c; endgroup", "  always;"),
        in_a_module("  wire z9;\n  assign z9 = 1'h0;", "  reg z9 = 1'h0;", "  wire z9;", "  reg [7:0] z9 [1:0];", "  initial begin\n  end"),
        inserted("1", "a", "begin", "end", "endmodule", ";", ".", "(", ")", "assign", "\"a\"", "module", "$finish;", "#1;", "@", "\\a "),
    ],
    "depth and size": [_long],
    "meaning": [_wrong_line],
}  # fmt: skip
"""Edits by class."""


def mutant(text: str, seed: str) -> tuple[str, str]:
    """Return a class and a text with one edit of it, or now and then another one beside it; it differs from `text`."""
    rng = random.Random(seed)
    while True:
        kind = rng.choice(sorted(CLASSES))
        found = rng.choice(CLASSES[kind])(rng, text)
        if rng.random() < 0.15:
            found = rng.choice(CLASSES[rng.choice(["layout", "order", "names"])])(rng, found)
        if found != text:
            return kind, found
