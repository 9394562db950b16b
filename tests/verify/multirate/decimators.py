"""Cores behind a decimator with their SystemVerilog and their certificates, and edits of that text, one at a time."""

import re
from collections.abc import Iterator
from functools import cache
from types import ModuleType
from typing import NamedTuple

import pytest
from tests.gen.word_lengths.decimated import read, tree_of
from tests.verify.parallel.cores import specified

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.cic import check_decimator


class Case(NamedTuple):
    """What a core is made of."""

    bits: int = 8
    signed: bool = True
    factor: int = 4
    cutoff: float = 10
    error: float = 0.01
    hold: bool = True
    architecture: str = "parallel"
    output_bits: int = 8
    channels: int = 1
    core: str = "filter"
    wide: bool = False
    start: str = "steady"
    reload: bool = False

    @property
    def text(self) -> str:
        signed, low = str(self.signed).lower(), -1 if self.signed else 0
        ends = f"[{4 * low}.0, 4.0]" if self.wide else f"[{low}.0, 1.0]"
        return f"""
name = "plain"
sample_rate = 1000.0
channels = {self.channels}
input.x = {{ bits = {self.bits}, signed = {signed}, range = [{low}.0, 1.0] }}
[filter]
family = "butterworth"
kind = "lowpass"
order = 1
cutoff = {self.cutoff}
decimate = {self.factor}
hold = {str(self.hold).lower()}
[output]
bits = {self.output_bits}
signed = {signed}
range = {ends}
unit = ""
max_error = {self.error}
[hardware]
architecture = "{self.architecture}"
realization = "df1"
start = "{self.start}"
reload = {str(self.reload).lower()}
"""


class Instrument(NamedTuple):
    """What an instrument is made of."""

    architecture: str = "folded"
    signed: bool = False
    factor: int = 4
    hold: bool = False
    channels: int = 1
    core: str = "instrument"
    output_bits: int = 10
    start: str = "steady"

    @property
    def text(self) -> str:
        sign, low = ("-", -16) if self.signed else ("", 0)
        return f"""
name = "plain"
sample_rate = 100.0
channels = {self.channels}
input.voltage = {{ bits = 10, range = [0.0, 10.0] }}
input.temperature = {{ bits = 10, range = [0.0, 128.0] }}
calibration.coefficients = [[1.16, -0.0036], [0.3672, 0.0006618], [{sign}0.05812]]
[filter]
family = "butterworth"
kind = "lowpass"
order = 2
cutoff = 1.0
decimate = {self.factor}
hold = {str(self.hold).lower()}
[output]
bits = {self.output_bits}
range = [{low}.0, 16.0]
unit = "mm"
max_error = {'"faithful"' if self.output_bits == 10 else 0.01}
[hardware]
architecture = "{self.architecture}"
start = "{self.start}"
"""


@cache
def designed(case: Case | Instrument) -> tuple[CoreDesign, Certificate]:
    made = design_core(specified(case.text), core=case.core)
    return made, read(tree_of(made))


@cache
def written(case: Case | Instrument) -> str:
    made, _ = designed(case)
    return to_verilog(to_rtlil(made.architecture.component(), made.datapath.name))


def check_rejected(case: Case | Instrument, text: str, sentence: str | None = None) -> None:
    """Check that the verifier rejects a text instead of that of a core, by that sentence if one is given."""
    _, certificate = designed(case)
    assert text != written(case)
    with pytest.raises(RejectedError, match=None if sentence is None else f"^{re.escape(sentence)}$"):
        check_decimator(text, certificate, case.channels)


def check_rejected_as_made(
    case: Case | Instrument, patch: pytest.MonkeyPatch, module: ModuleType, name: str, wrong: type
) -> None:
    """Check that the verifier rejects what a core is written as with `wrong` hardware, a class of a module."""
    made, _ = designed(case)
    written(case)  # kept as it is right
    patch.setattr(module, name, wrong)
    check_rejected(case, to_verilog(to_rtlil(made.architecture.component(), made.datapath.name)))


EDITS = [
    (r"(?<= )& (?=\w)", "| "),
    (r"(?<= )\| (?=\w)", "& "),
    (r"(?<=\w )& ", "| "),
    (r"(?<=\w )\| ", "& "),
    (r"(?<=\w )\+ ", "- "),
    (r"(?<=\w )- ", "+ "),
    (r"~ ", ""),
    (r"! ", "| "),
    (r"'h0\b", "'h1"),
    (r"'h1\b", "'h0"),
    (r" == ", " != "),
    (r" != ", " == "),
    (r"\? (\S+) : (\S+);", r"? \2 : \1;"),
    (r"(?<!else )if \((?!front_rst)(\w+)\)", r"if (~ \1)"),
    (r"else if \((\w+)\)", r"else if (~ \1)"),
    (r"\bsum1\b(?! \+|;)", "sum2"),
    (r"\bdifference1\b(?! -|;)", "difference2"),
    (r"control0\b(?= <=|;$)", "control1"),
    (r"(?<=[=(&|] )\bo_ready\b", "o_valid"),
    (r"\bwaiting\b(?= [&|])", "filling"),
    (r"\[(\d+):2\];", r"[\1:1];"),
    (r"\bfirst\b(?= [&|])", "fills"),
    (r"\bfills\b(?= &)", "first"),
    (r"\bfound\b(?= \|)", "o_flags"),
    (r"\bi_flags\b(?=[,; ])", "found"),
    (r"\(i_ready\)", "(i_valid)"),
    (r"\(i_valid\)", "(s_axis_tvalid)"),
    (r"\(aresetn\)", "(first)"),
    (r"i_flags\[0\]", "i_flags[1]"),
    (r"\{ i_flags, (\w+) \}", r"{ i_flags[0], i_flags[1], \1 }"),
    (r"\btakes?\b|\bsignal32\b", "adds"),
    (r"\bsignal33\b", "signal32"),
    (r"\bsignal4[01]\b", "signal33"),
    (r"\badds\b", "combing"),
    (r"\bchannel\b(?=[,; ])", "step"),
    (r"\bstep\b(?= \})", "0"),
    (r"\bfirst\b(?= [<)])|\bfirst\b(?=,)", "sample"),
    (r"\bgathered\b(?=;)", "flags"),
    (r"\bstarted\b", "combing"),
    (r"\bwrites\b", "adds"),
    (r"signature__data_\[0\]", "signature__data_[1]"),
    (r"i_dest\b", "s_axis_tdest"),
    (r"\{ (port_\w+), (port_\w+) \}", r"{ \2, \1 }"),
    (r"\(i_data\[14:0\]\)", "({ i_data[0], i_data[14:1] })"),
    (r" < ", " > "),
    (r" >= ", " < "),
]
"""Patterns and what takes their place, one at a time, in every statement outside the core."""

SAME = re.compile(
    "|".join(
        (
            r"reg \w+_control[12] .*",  # nothing counts before it is loaded
            r"reg (\S+ )?(o_rail|o_flags|o_dest\w*|left|gathered|step|slice\d+) .*",
            r"if \(front_rst\) (o_rail|o_flags|o_data|o_dest\w*|step|slice\d+) <= .*",
            r"assign \w+ = difference\d - \d+'h0;",  # a rounding that rounds nothing
            r"assign \w+ = (phase|left|filled|channel) [-+] 1'h1;",  # in a counter of one bit
            r"assign states_read_address\[(\d:)?2\] = step;",  # bits that are not used
        )
    )
)
"""What may be otherwise."""


def edited(text: str) -> Iterator[tuple[str, str]]:
    """Yield each edited line, and the whole text with it."""
    for module in re.finditer(r"^module plain(_decimator|_holder|)\(.*?^endmodule$", text, re.MULTILINE | re.DOTALL):
        for line in re.finditer(r"^  .*$", module[0], re.MULTILINE):
            if re.match(r"  (wire|input|output) ", line[0]):
                continue
            for pattern, instead in EDITS:
                changed = re.sub(pattern, instead, line[0], count=1)
                if changed != line[0]:
                    start, end = module.start() + line.start(), module.start() + line.end()
                    yield changed.strip(), text[:start] + changed + text[end:]


def accepted(case: Case | Instrument) -> set[str]:
    """Return the edits of a core's text that are not rejected, but for those that change nothing."""
    _, certificate = designed(case)
    found, tried = set(), 0
    for line, text in edited(written(case)):
        tried += 1
        try:
            check_decimator(text, certificate, case.channels)
        except RejectedError:
            continue
        found.add(line)
    assert tried > 80
    return {line for line in found if not SAME.fullmatch(line)}
