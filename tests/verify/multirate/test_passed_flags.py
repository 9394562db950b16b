"""What leaves a core behind a decimator: each output of the core once, and flags in their places."""

import re

import pytest
from tests.verify.multirate.decimators import Case, designed, written

from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.cic import check_decimator

WORD = "o_data_30"
ENTERING = "i_data_24"
ALL = f"{{ 5'h00, {WORD}[10:8] }}"
IN_ORDER = "m_axis_tuser must have its flags from bit 0 on, each once, and zeros above"


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        (f"{{ 5'h00, {ENTERING}[10:8] }}", "what leaves must be 0 or a bit of holder.o_data, not one of behind.o_data"),
        (f"{{ 4'h0, aresetn, {WORD}[10:8] }}", "what leaves must be 0 or a bit of holder.o_data, not one of aresetn"),
        (f"{{ 5'h01, {WORD}[10:8] }}", "what leaves must be 0 or a bit of holder.o_data, not one of 1"),
        (f"{{ 5'h00, {WORD}[9:7] }}", "m_axis_tuser must have no bit that leaves elsewhere"),
        (f"{{ 6'h00, {WORD}[9:8] }}", "bit 10 of behind.o_data must leave the core"),
        ("8'h00", IN_ORDER),
        (f"{{ 4'h0, {WORD}[10:8], 1'h0 }}", IN_ORDER),
        (f"{{ 4'h0, {WORD}[8], {WORD}[10:8] }}", IN_ORDER),
        (f"{{ 5'h00, {WORD}[10], {WORD}[8], {WORD}[9] }}", "m_axis_tuser must have the flags in their order"),
    ],
)
def test_flags_that_are_wrong_are_rejected(wrong: str, sentence: str) -> None:
    text, (_, certificate) = written(Case()), designed(Case())
    assert text.count(ALL) == 1
    with pytest.raises(RejectedError, match=f"^{re.escape(sentence)}$"):
        check_decimator(text.replace(ALL, wrong), certificate)


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        (r"\.judged\(m_axis_tuser\[1:0\]\)", ".judged({ m_axis_tuser[0], m_axis_tuser[1] })", "bit 0"),
        (r"m_axis_tuser\[7:3\] = 5'h00", "m_axis_tuser[7:3] = { 4'h0, aresetn }", "bit 3"),
        (r"user\[1:0\]\)(.*)\(m_axis_tuser\[2\]\)", r"user[2:1])\1(m_axis_tuser[0])", "bit 1"),
    ],
)
def test_flags_have_their_places(right: str, wrong: str, sentence: str) -> None:
    case = Case(hold=False, architecture="folded")
    text, (_, certificate) = written(case), designed(case)
    changed, count = re.subn(right, wrong, text, flags=re.DOTALL)
    assert count == 1
    with pytest.raises(
        RejectedError, match=f"^{sentence} of m_axis_tuser must be its flag as the core gives it, not another value$"
    ):
        check_decimator(changed, certificate)


@pytest.mark.slow
def test_a_core_whose_output_is_never_limited_has_fewer_flags() -> None:
    case = Case(factor=4, architecture="folded", hold=False, bits=16, output_bits=18, wide=True, error=0.0001)
    text, (_, certificate) = written(case), designed(case)
    assert re.search(r"assign m_axis_tuser\[7:2\] = 6'h00;", text)
    check_decimator(text, certificate)
