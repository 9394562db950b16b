"""The hardware around a core at a lower rate: proven register by register, and rejected when anything is wrong."""

import re

import pytest
from tests.formal.prover import broken
from tests.verify.multirate.decimators import (
    Case,
    accepted,
    check_rejected,
    check_rejected_as_made,
    designed,
    written,
)

from sosmith.hdl.decimation import decimator as hardware
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.cic import check_decimator

CASES = [
    (Case(), 2),
    (Case(hold=False, architecture="folded"), 2),
    (Case(bits=12, signed=False, factor=2, cutoff=20, error=0.02), 2),
    (Case(bits=9, factor=16, architecture="serial"), 3),
    (Case(signed=False, factor=8, cutoff=2, error=0.5, hold=False), 1),
    (Case(bits=6, factor=2, cutoff=1, error=0.5), 1),
    (Case(bits=2, factor=4, error=0.02), 2),
    (Case(output_bits=11), 2),  # with signs above it, each a port of the core
    (Case(output_bits=12, hold=False, architecture="folded"), 2),
    (Case(signed=False, output_bits=9, cutoff=20, error=0.02, architecture="folded"), 2),  # with zeros
    (Case(signed=False, output_bits=9, cutoff=20, error=0.02), 2),  # with zeros that a port of the core has
    (Case(signed=False, output_bits=9, cutoff=20, error=0.02, hold=False), 2),
]


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("case", "stages"), CASES)
def test_a_decimator_is_proven(case: Case, stages: int) -> None:
    _, certificate = designed(case)
    assert certificate.decimation is not None
    assert certificate.decimation.stages == stages
    verdict = check_decimator(written(case), certificate)
    assert verdict.copies == (case.factor if case.hold else 1)
    assert verdict.registers == 8 + 8 * stages + 3 * case.hold


@pytest.mark.slow
@pytest.mark.parametrize("case", [CASES[0][0], CASES[1][0], CASES[2][0]])
def test_every_edit_is_rejected(case: Case) -> None:
    assert accepted(case) == set()


BROKEN = [
    ("a comb of another delay", "difference.eq(value - before), before.eq(value)", "difference.eq(value - before)"),
    ("a rounding down", "(value + (1 << cic.dropped >> 1)) >>", "value >>"),
    ("a first sample that counts once", "filled == cic.stages - 1", "filled == 0"),
    ("a result that is not waited for", "~(waiting & completes)", "~(waiting & completes & 0)"),
    ("a sum that takes what is not there", "with m.If(valid):", "with m.If(1):"),
    ("a flag of one sample", "(rail | at_end) & ~completes", "at_end & ~completes"),
    ("one copy less", "left.eq(self.copies - 1)", "left.eq(self.copies - 2)"),
    ("a word that is not held", "self.i_ready.eq(~self.o_valid | (self.o_ready & ~left.any()))", "self.i_ready.eq(1)"),
    ("a reset that is not passed on", "core.aresetn.eq(self.aresetn)", "core.aresetn.eq(1)"),
    ("a reset the wrong way round", 'ResetSignal("front").eq(~self.aresetn)', 'ResetSignal("front").eq(self.aresetn)'),
    ("a flag that gets lost", "or several else decimator.o_rail", "or several else Const(0, 1)"),
    ("a sink that is not asked", "core.m_axis_tready.eq(ready)", "core.m_axis_tready.eq(1)"),
    ("results the wrong way round", "self.m_axis_tdata.eq(handed.data)", "self.m_axis_tdata.eq(handed.data[::-1])"),
]


def test_sentences() -> None:
    """The first register or port that is wrong is named."""
    text = written(CASES[0][0])

    def rejected(right: str, wrong: str, sentence: str) -> None:
        assert text.count(right) == 1
        check_rejected(CASES[0][0], text.replace(right, wrong), sentence)

    rejected(
        "sum2 <= sum2_next[11:0];",
        "sum2 <= sum1;",
        "decimator.sum2 must be what a decimator has there after a clock with decimator.integrator1_control0 = 1, "
        "aresetn = 1, not another value",
    )
    rejected("reg waiting = 1'h0;", "reg waiting = 1'h1;", "decimator.waiting must be 0 before the first clock, not 1")
    rejected(
        "assign i_ready = not_filling_2 & not_waiting_and_completes;",
        "assign i_ready = not_filling_2;",
        "s_axis_tready must be what a decimator has there with decimator.filling = 0, decimator.phase = 0, "
        "decimator.waiting = 1, not another value",
    )
    rejected(
        ".o_ready(o_ready),\n    .o_valid(s_axis_tvalid_20)\n  );",
        ".o_ready(s_axis_tvalid),\n    .o_valid(s_axis_tvalid_20)\n  );",
        "decimator.o_ready must be an output of the core",
    )
    narrow = text.replace("reg [11:0] sum1 = 12'h000;", "reg [10:0] sum1 = 11'h000;")
    narrow = re.sub(r"sum1 <= (n\d+)\[11:0\]", r"sum1 <= \1[10:0]", narrow)
    check_rejected(CASES[0][0], narrow, "decimator.sum1 must have 12 bits, not 11")
    wide = text.replace("reg [1:0] phase = 2'h0;", "reg [2:0] phase = 3'h0;").replace("= & phase;", "= & phase[1:0];")
    wide = re.sub(r"phase <= (n\d+)\[1:0\]", r"phase <= \1[2:0]", wide)
    check_rejected(CASES[0][0], wide, "decimator.phase must have 2 bits, not 3")
    rejected("sum2 <= sum2_next[11:0];", "sum2 <= sum3;", "sum3 must be declared in plain_decimator before it is used")
    other = designed(CASES[0][0]._replace(hold=False))[1]
    with pytest.raises(RejectedError, match=r"^results must not be held, as specified$"):
        check_decimator(text, other)


@pytest.mark.sweep(2)
@pytest.mark.parametrize(("right", "wrong"), [pytest.param(*case, id=subject) for subject, *case in BROKEN])
def test_hardware_that_is_wrong_is_rejected(right: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_rejected_as_made(
        CASES[2][0], monkeypatch, hardware, "DecimatedCore", broken(hardware, right, wrong).DecimatedCore
    )
