"""The decimator of an instrument and its wires to the calibration: proven, and rejected when anything is wrong."""

import re
from functools import partial

import pytest
from tests.formal.prover import broken
from tests.verify.multirate.decimators import (
    Instrument,
    accepted,
    check_rejected,
    check_rejected_as_made,
    designed,
    written,
)

from sosmith.hdl.decimation import decimator as hardware
from sosmith.verify.multirate.cic import check_decimator

CASES = [
    Instrument(),
    Instrument("serial", signed=True),
    Instrument("parallel", signed=True, factor=2, hold=True),
    Instrument(output_bits=24),  # with a result of two digits, each a port of the calibration
    Instrument(signed=True, output_bits=24),
]

ENTERS = (
    "ahead.m_axis_tvalid = 1, decimator.filling = 0, decimator.waiting = 0, "
    "result of the calibration = 0..16777215, aresetn = 1, decimator.phase = 0"
)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_a_decimator_behind_a_calibration_is_proven(case: Instrument) -> None:
    _, certificate = designed(case)
    assert certificate.decimation is not None
    verdict = check_decimator(written(case), certificate)
    assert verdict.copies == (case.factor if case.hold else 1)
    assert verdict.registers == 8 + 8 * certificate.decimation.stages + 3 + 3 * case.hold


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_every_edit_is_rejected(case: Instrument) -> None:
    assert accepted(case) == set()


@pytest.mark.slow
def test_sentences() -> None:
    """The first register or port that is wrong is named."""
    text = written(CASES[0])

    def rejected(right: str, wrong: str, sentence: str) -> None:
        assert text.count(right) == 1
        check_rejected(CASES[0], text.replace(right, wrong), sentence)

    rejected(
        "else if (fills_set) first <= 1'h0;",
        "else if (first_and_s_axis_tvalid) first <= 1'h0;",
        "first must be what a decimator has there after a clock with aresetn = 1, first = 1, s_axis_tvalid = 1, "
        "fills = 0, filled = 0, ahead.s_axis_tready = 0, not another value",
    )
    rejected("reg first = 1'h1;", "reg first = 1'h0;", "first must be 1 before the first clock, not 0")
    rejected(
        "    .m_axis_tuser(i_flags),\n    .m_axis_tvalid(i_valid)",
        "    .m_axis_tuser({ i_flags[0], i_flags[1] }),\n    .m_axis_tvalid(i_valid)",
        "decimator.found must be what a decimator has there after a clock with aresetn = 1, ahead.m_axis_tvalid = 1, "
        "decimator.filling = 0, decimator.waiting = 0, decimator.phase = 1..2, decimator.found = 0, "
        "flag 0 of the calibration = 0, flag 1 of the calibration = 1, not another value",
    )
    rejected(
        ".m_axis_tvalid(i_valid),\n    .s_axis_tdata(s_axis_tdata),",
        ".m_axis_tvalid(i_valid),\n    .s_axis_tdata(s_axis_tdata[30:0]),",
        "the port s_axis_tdata of ahead must have 32 bits, not 31",
    )
    rejected(
        ".m_axis_tready(m_axis_tready_20),",
        ".m_axis_tready(1'h1),",
        "ahead.m_axis_tready must be what a decimator has there with decimator.filling = 0, decimator.phase = 0, "
        "decimator.waiting = 1, not another value",
    )
    rejected(
        ".judged(m_axis_tuser[1:0])",
        ".judged({ m_axis_tuser[0], m_axis_tuser[1] })",
        "bit 0 of m_axis_tuser must be its flag as the core gives it, not another value",
    )
    rejected(
        "m_axis_tuser[7:3] = 5'h00",
        "m_axis_tuser[7:3] = { 4'h0, aresetn }",
        "bit 3 of m_axis_tuser must be its flag as the core gives it, not another value",
    )


@pytest.mark.slow
def test_digits_that_are_wrong_are_rejected() -> None:
    """A result of two words leaves the calibration in two ports, the lower digit whole and below the other."""
    text, (_, certificate) = written(CASES[3]), designed(CASES[3])
    (lower,) = re.findall(r"\.(port_\w+)\(i_data\[14:0\]\)", text)  # that of the decimator
    upper, _ = re.findall(r"\.(port_\w+)\(i_data\[23:15\]\)", text)  # its own, after the calibration's
    low, high = ".given0(i_data[14:0])", f".{upper}(i_data[23:15])"
    assert (text.count(low), text.count(high)) == (1, 2)
    check_decimator(text, certificate)

    rejected = partial(check_rejected, CASES[3])
    digits = f"ahead.{upper} must be a digit of the result, as there are 2 outputs for it"
    driven = "  assign given1_8_0 = given1[8:0];\n"
    other = "not another value"
    rejected(
        text.replace(low, ".given0(i_data[23:9])").replace(high, f".{upper}(i_data[8:0])", 1),
        f"decimator.sum1 must be what a decimator has there after a clock with {ENTERS}, {other}",
    )
    rejected(
        text.replace(f"{{ {upper}, {lower} }}", f"{{ {lower}, {upper} }}"),
        f"decimator.sum1 must be what a decimator has there after a clock with {ENTERS}, {other}",
    )
    rejected(text.replace(driven, "  assign given1_8_0 = given1[9:1];\n"), digits)
    rejected(text.replace(driven, "  assign given1_8_0 = added[8:0];\n"), digits)
    elsewhere = "total_high must be declared in plain_ahead_result before it is used"
    rejected(text.replace(driven, "  assign given1_8_0 = total_high[8:0];\n"), elsewhere)
    rejected(text.replace(driven, ""), "each bit of given1_8_0 in plain_ahead_result that is read must be driven")
    rejected(
        text.replace(driven, "  assign given1_8_0 = given0[8:0];\n"),
        "the digits of the calibration must be 0..1, each once",
    )
    narrow = "the digits of the calibration must have 24 bits in all, and all of each but for the last"
    rejected(text.replace("given0", "given2").replace("given1", "given0").replace("given2", "given1"), narrow)


BROKEN = [
    ("a first sample twice", "(first | flows))", "(first | flows | filled))"),
    ("a first sample that is not accepted", "self.s_axis_tready.eq(filled |", "self.s_axis_tready.eq("),
    ("a calibration that is not asked", "(flows & calibration.s_axis_tready)", "flows"),
    (
        "filled before it is",
        "fills & calibration.m_axis_tvalid & decimator.i_ready",
        "fills & calibration.m_axis_tvalid",
    ),
    ("a result that gets lost", "calibration.m_axis_tready.eq(decimator.i_ready)", "calibration.m_axis_tready.eq(1)"),
    ("flags of one sample", 'kept.load("found", found | self.i_flags)', 'kept.load("found", self.i_flags)'),
    ("flags of the last sample", "self.o_flags.eq(found | self.i_flags)", "self.o_flags.eq(found)"),
    ("flags the wrong way round", "i_flags.eq(calibration.m_axis_tuser)", "i_flags.eq(calibration.m_axis_tuser[::-1])"),
    ("a reset that is not passed on", "calibration.aresetn.eq(self.aresetn)", "calibration.aresetn.eq(1)"),
    ("samples that are late", "calibration.s_axis_tdata.eq(self.s_axis_tdata)", "calibration.s_axis_tdata.eq(0)"),
]


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("right", "wrong"), [pytest.param(*case, id=subject) for subject, *case in BROKEN])
def test_hardware_that_is_wrong_is_rejected(right: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_rejected_as_made(
        CASES[0], monkeypatch, hardware, "DecimatedCore", broken(hardware, right, wrong).DecimatedCore
    )
