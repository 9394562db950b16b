"""The strict reader: what it prints is what was written, and what a tool could read otherwise is refused."""

from __future__ import annotations

import re
from copy import deepcopy
from dataclasses import fields

import pytest
from tests.verify.reader.example_cores import CORES, NAME, core

from sosmith.verify.graph import RejectedError
from sosmith.verify.reader.source import read_source
from sosmith.verify.reader.syntax import Number


def plain(text: str) -> str:
    """Text without comments, attributes and blank lines; Yosys cuts long lists of ports into lines."""
    lines = [line for line in text.split("\n") if line and not re.match(r" *//|/\*| *\(\*", line)]
    return re.sub(r"\n(, |\);)", r"\1", "\n".join(lines) + "\n")


@pytest.mark.sweep(1)
@pytest.mark.parametrize("kind", CORES)
def test_what_is_read_is_printed_as_it_was_written(kind: str) -> None:
    text = core(kind)
    source = read_source(text, NAME)
    assert source.text == plain(text)
    assert next(iter(source.modules)) == NAME
    assert read_source(source.text, NAME).text == source.text


LAST = "endmodule\n"
NET = "not_s_axis_tdata_15"
WIRE = f"  wire {NET};\n"
ANOTHER = "module other(a);\n  input a;\nendmodule\n"


def forged(edit: str) -> tuple[str, str]:
    """Return a forged text of the parallel core, and why it is refused."""
    text = core("parallel")
    assert WIRE in text
    first = text.index("module ")
    texts = {
        "another module": (f"{text}{ANOTHER}", r"every module must be part of audio_lowpass, not other"),
        "the module again": (f"{text}\n{text[first:]}", r"module audio_lowpass must be written once, not twice"),
        "the right one under another name": (
            text.replace(f"module {NAME}(", "module right(", 1) + f"module {NAME}(aclk);\n  input aclk;\nendmodule\n",
            r"every module must be part of audio_lowpass, not .*",
        ),
        "a tunnel": (text.replace(WIRE, f"  (* a /* *)\n{WIRE}  /* b */\n"), r".* plain subset, not have .*"),
        "a tunnel in a string": (text.replace(WIRE, f'  (* a = "/* *)" *)\n{WIRE}'), r".* plain subset, not have .*"),
        "an attribute in a line": (text.replace(WIRE, f"  (* keep = 32'd1 *) {WIRE}"), r".* plain subset, not have .*"),
        "a black box": (text[:first] + "(* blackbox *)\n" + text[first:], r".* plain subset, not have .*"),
        "a first value": (text.replace(WIRE, f"  (* init = 1'h1 *)\n{WIRE}"), r".* plain subset, not have .*"),
        "keep at a register": (
            re.sub(r"^(  reg .*)$", "  (* keep = 32'd1 *)\n\\1", text, count=1, flags=re.MULTILINE),
            r"line \d+ must be an attribute that changes no value, not .*",
        ),
        "a carriage return": (text.replace(WIRE, f"  // a\r  assign {NET} = 1'h0;\n{WIRE}"), r".* printable ASCII .*"),
        "a tab": (text.replace(WIRE, f"\t{WIRE}"), r".* printable ASCII .*"),
        "a no-break space": (text.replace(WIRE, f"\xa0{WIRE}"), r".* printable ASCII .*"),
        "translate_off": (text.replace(WIRE, f"  // synopsys translate_off\n{WIRE}"), r"line \d+ must be a comment .*"),
        "synthesis": (text.replace(WIRE, f"  // synthesis translate_off\n{WIRE}"), r"line \d+ must be a comment .*"),
        "verilator": (text.replace(WIRE, f"  // verilator lint_off WIDTH\n{WIRE}"), r"line \d+ must be a comment .*"),
        "a pragma": (text.replace(WIRE, f"  // pragma protect begin\n{WIRE}"), r"line \d+ must be a comment .*"),
        "a line that goes on": (text.replace(WIRE, f"  // a \\\n{WIRE}"), r"line \d+ must be a comment .*"),
        "a comment behind words": (text.replace(WIRE, f"  wire {NET}; // a\n"), r".* plain subset, not have '// a'"),
        "a comment over lines": (text.replace(WIRE, f"/*\n*/\n{WIRE}"), r".* plain subset, not have '/\*'"),
        "a directive": (text[:first] + "`define n1 n2\n" + text[first:], r".* plain subset, not have .*"),
        "an escaped name": (text.replace(WIRE, "  wire \\n1 ;\n"), r".* plain subset, not have .*"),
        "the name of an x": (text.replace(WIRE, f"  wire \\?0 ;\n{WIRE}"), r".* plain subset, not have .*"),
        "a net twice": (text.replace(WIRE, f"{WIRE}{WIRE}"), rf"{NET} must be declared once .*"),
        "a net and a register": (
            text.replace(WIRE, f"{WIRE}  reg {NET} = 1'h0;\n"),
            rf"{NET} must be declared once .*",
        ),
        "a word of the language": (text.replace(WIRE, f"  wire logic;\n{WIRE}"), r".* must have a name after .*"),
        "two drivers": (
            text.replace(LAST, f"  assign rst = 1'h0;\n{LAST}", 1),
            r"each bit of rst in audio_lowpass\w* must be driven once",
        ),
        "an initial block": (text.replace(LAST, f"  initial begin\n    rst = 1'h0;\n  end\n{LAST}", 1), r".* must .*"),
        "a parameter": (text.replace(WIRE, f"  parameter n = 1;\n{WIRE}"), r".* must have a name after .*"),
        "a module that is not there": (
            text.replace(LAST, f"  thing part (\n    .a(aclk)\n  );\n{LAST}", 1),
            r"part must be of a module in the text, not of thing",
        ),
        "another clock": (
            text.replace(".clk(aclk)", ".clk(s_axis_tvalid)", 1),
            r"audio_lowpass must have one clock, not aclk, s_axis_tvalid",
        ),
        "a bit of a clock": (
            text.replace(".clk(aclk)", ".clk(s_axis_tdata[0])", 1),
            r"the clock clk of \w+ must be a net, not computed or cut from one",
        ),
        "a clock as a value": (
            text.replace("  wire aclk;\n", "  wire aclk;\n  wire late;\n  assign late = aclk;\n", 1),
            r"the clock aclk of audio_lowpass must be nothing but a clock, not a value: what it is at its edge differs "
            r"from tool to tool",
        ),
        "an index of a scalar": (
            text.replace(".clk(aclk)", ".clk(aclk[0])", 1),
            r"aclk must be used as a whole, as it has no range",
        ),
        "a range in one declaration": (
            text.replace("  wire aclk;", "  wire [0:0] aclk;", 1),
            r"aclk must have a range in both declarations or none",
        ),
        "a number with a sign": (text.replace("1'h0", "1'sh0", 1), r".* must have blanks between words, not .*"),
        "a loop": (
            text.replace(LAST, f"  {NAME}_output_stage again (\n    .clk(aclk)\n  );\n{LAST}", 1),
            r"the ports of again must be .*",
        ),
    }
    return texts[edit]


EDITS = [
    "another module",
    "the module again",
    "the right one under another name",
    "a tunnel",
    "a tunnel in a string",
    "an attribute in a line",
    "a black box",
    "a first value",
    "keep at a register",
    "a carriage return",
    "a tab",
    "a no-break space",
    "translate_off",
    "synthesis",
    "verilator",
    "a pragma",
    "a line that goes on",
    "a comment behind words",
    "a comment over lines",
    "a directive",
    "an escaped name",
    "the name of an x",
    "a net twice",
    "a net and a register",
    "a word of the language",
    "two drivers",
    "an initial block",
    "a parameter",
    "a module that is not there",
    "another clock",
    "a clock as a value",
    "a bit of a clock",
    "an index of a scalar",
    "a range in one declaration",
    "a number with a sign",
    "a loop",
]


@pytest.mark.parametrize("edit", EDITS)
def test_what_tools_could_read_otherwise_is_refused(edit: str) -> None:
    text, sentence = forged(edit)
    assert text != core("parallel")
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        read_source(text, NAME)


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        (r"instructions\[11\] = ", "instructions[10+1] = ", r".* must have \] after .*, not '\+'"),
        (r"instructions\[11\] = ", "instructions [10] = ", r"word 10 of instructions must be given once, not twice"),
        (r"(instructions\[11\] = \S+;)", r"\1 // as before", r".* plain subset, not have .*"),
        (r"instructions\[11\] = \S+;\n", "", r"all \d+ words of instructions must be given, not \d+"),
        (r"(instructions\[11\] = \S+;)", r"\1 \1", r"word 11 of instructions must be given once, not twice"),
        (
            r"(  initial begin\n    instructions)",
            r"  initial begin\n    instructions[11] = 30'h00000000;\n  end\n\1",
            r"word 11 of instructions must be given once, not twice",
        ),
    ],
)
def test_a_program_has_each_word_once_wherever_it_is_written(right: str, wrong: str, sentence: str) -> None:
    text, count = re.subn(right, wrong, core("folded"), count=1)
    assert count == 1
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        read_source(text, NAME)


def test_what_is_read_again_is_not_what_others_have_changed() -> None:
    """A text is read once; each reader gets modules of its own."""
    text = core("folded")
    first = read_source(text)
    whole = deepcopy(first)
    for module in first.modules.values():
        for inside, _, ports in module.instances:
            ports[inside] = Number(0, 1)
        for words in module.contents.values():
            words.clear()
        for found in fields(module):
            getattr(module, found.name).clear()
    first.modules.clear()
    assert read_source(text) == whole
