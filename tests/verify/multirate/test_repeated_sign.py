"""What is above a result behind a decimator: proven to be its sign or 0 through all modules, and rejected otherwise."""

import re
from fractions import Fraction

import pytest
from tests.verify.multirate.decimators import Case, designed, written

from sosmith.verify.certificate_file import PortEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.cic import check_decimator
from sosmith.verify.multirate.decimation import module_in
from sosmith.verify.multirate.repeated_sign import check_signs
from sosmith.verify.reader.source import read_modules

SIGNED = Case(output_bits=11)
FOLDED = Case(output_bits=12, hold=False, architecture="folded")
UNSIGNED = Case(signed=False, output_bits=9, cutoff=20, error=0.02, hold=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "pattern", "wrong", "bits"),
    [
        (SIGNED, r"(?<=output_stage_code\[)10(?=\],)", "9", {11, 12, 13, 14, 15}),
        (SIGNED, r"(?<=reg \[18:0\] o_next = 19'h0)0(?=0)", "8", {15}),
        (FOLDED, r"(?<=m_axis_tdata\[)15(?=\], m_axis_tdata\[15\])", "10", {12, 13, 14}),
        (UNSIGNED, r"(?<= <= 7'h)00", "40", {15}),
    ],
)
def test_every_bit_is_proven(case: Case, pattern: str, wrong: str, bits: set[int]) -> None:
    text, (_, certificate) = written(case), designed(case)
    check_decimator(text, certificate)
    what = f"the sign, bit {case.output_bits - 1}," if case.signed else "0"
    found = set()
    for place in re.finditer(pattern, text):
        with pytest.raises(RejectedError) as error:
            check_decimator(text[: place.start()] + wrong + text[place.end() :], certificate)
        sentence = re.fullmatch(
            rf"bit (\d+) of m_axis_tdata must be {what} at every clock, not another value", str(error.value)
        )
        assert sentence is not None
        found.add(int(sentence[1]))
    assert found == bits


PARTS = """
module top(clk, load, code, m_axis_tdata);
  input clk;
  wire clk;
  input load;
  wire load;
  input [4:0] code;
  wire [4:0] code;
  output [7:0] m_axis_tdata;
  wire [7:0] m_axis_tdata;
  reg [8:0] o_data = 9'h000;
  always_ff @(posedge clk)
    if (load) o_data[8] <= 1'h0;
  always_ff @(posedge clk)
    if (load) o_data[7:0] <= { code[4], code[4], code[4], code };
  assign m_axis_tdata = o_data[7:0];
endmodule
"""
PORT = PortEntry(name="y", bits=5, signed=True, lsb=Fraction(1), zero=Fraction(0), unit="")


def test_a_register_that_is_loaded_in_parts_is_taken_apart() -> None:
    """Where a core never limits its output, the flag for it is a bit of the same register that is always 0."""
    check_signs(dict(read_modules(PARTS, "top")), PORT, "clk")
    for wrong in (
        PARTS.replace("{ code[4], code[4], code[4], code }", "{ code[4], code[4], code[3], code }"),
        PARTS.replace("9'h000", "9'h080"),
        PARTS.replace("o_data[7:0];", "o_data[8:1];"),
    ):
        assert wrong != PARTS
        with pytest.raises(RejectedError, match=r"^bit [567] of m_axis_tdata must be the sign, bit 4, at every clock"):
            check_signs(dict(read_modules(wrong, "top")), PORT, "clk")


def test_no_comment_hides_a_module() -> None:
    """What a tool reads counts, not what looks like it in a comment."""
    text, (_, certificate) = written(FOLDED), designed(FOLDED)
    for name in ("plain_decimator", "plain_behind"):
        (found,) = re.findall(rf"^module {name}\(.*?^endmodule$", text, re.MULTILINE | re.DOTALL)
        wrong = found.replace(f"module {name}(", f" module {name}(").replace(" + ", " - ")
        hidden = text.replace(found, f"/*\n{found}\n*/\n{wrong}")
        assert hidden != text
        if name == "plain_behind":
            with pytest.raises(RejectedError, match=r"must be made of its plain subset, not have '/\*'$"):
                module_in(hidden, "plain", name)
        else:
            with pytest.raises(RejectedError):
                check_decimator(hidden, certificate)
