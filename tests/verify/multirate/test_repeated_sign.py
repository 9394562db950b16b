"""What is above a result behind a decimator: proven to be its sign or 0 through all modules, and rejected otherwise."""

import re

import pytest
from tests.verify.multirate.decimators import Case, designed, written

from sosmith.verify.decimation import module_in
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.cic import check_decimator

SIGNED = Case(output_bits=11)
FOLDED = Case(output_bits=12, hold=False, architecture="folded")
UNSIGNED = Case(signed=False, output_bits=9, cutoff=20, error=0.02, hold=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "pattern", "wrong", "bits"),
    [
        (SIGNED, r"(?<=output_stage_code\[)10(?=\],)", "9", {11, 12, 13, 14, 15}),
        (SIGNED, r"(?<=reg \[18:0\] o_next = 19'h0)0(?=0)", "8", {15}),
        (FOLDED, r"(?<=\? 14'h0)7(?=ff)", "f", {12, 13, 14, 15}),
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
