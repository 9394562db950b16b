"""The decimator of several channels: proven register by register and word by word, and rejected when it is wrong."""

import re
from pathlib import Path

import pytest
from tests.formal.prover import broken
from tests.verify.multirate.decimators import (
    Case,
    Instrument,
    accepted,
    check_rejected,
    check_rejected_as_made,
    designed,
    written,
)

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.specification.specification import from_text
from sosmith.hdl.decimation import channel_decimator as hardware
from sosmith.hdl.decimation import decimator as top
from sosmith.interface.certificate import Certificate as Saved
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.cic import check_decimator

SMALL = Case(hold=False, architecture="folded", channels=2)
CASES: list[Case | Instrument] = [
    SMALL,
    Case(bits=9, factor=16, architecture="serial", channels=3),
    Case(signed=False, output_bits=9, cutoff=20, error=0.02, channels=3),
    Case(bits=6, factor=2, cutoff=1, error=0.5, channels=2),
    Instrument(channels=3),
    Instrument("serial", signed=True, factor=2, channels=5),
    Instrument("parallel", hold=True, channels=2),
]


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    "case", [CASES[0], CASES[4], *(pytest.param(case, marks=pytest.mark.slow) for case in (*CASES[1:4], *CASES[5:]))]
)
def test_a_decimator_of_several_channels_is_proven(case: Case | Instrument) -> None:
    verdict = check_decimator(written(case), designed(case)[1], case.channels)
    assert verdict.copies == (case.factor if case.hold else 1)
    assert verdict.registers == 17 + 3 * case.hold
    assert verdict.channels == case.channels


@pytest.mark.slow
def test_it_is_proven_with_its_files(tmp_path: Path) -> None:
    generate(design_core(from_text(SMALL.text, tmp_path / "plain.toml")), tmp_path)
    proof = Saved.load(tmp_path / "plain.certificate.json").verify(files=tmp_path)
    assert proof.program is not None
    assert proof.decimator is not None
    assert proof.decimator.channels == 2


@pytest.mark.sweep(1)
@pytest.mark.parametrize("memory", ["control", "states"])
def test_a_word_that_is_written_beside_another_one_is_found(memory: str) -> None:
    old = rf"if \((\w+)\)\n *({memory}\[.*\]) <= (.*);"
    new = rf"if (\1) begin {memory}[1'h0] <= 1'h0; \2 <= \3; end"
    text, count = re.subn(old, new, written(SMALL))
    assert count == 1
    sentence = rf"^decimator\.{memory} must not be loaded at two places at a clock$"
    with pytest.raises(RejectedError, match=sentence):
        check_decimator(text, designed(SMALL)[1], SMALL.channels)


@pytest.mark.slow
@pytest.mark.parametrize("case", [CASES[0], CASES[2], CASES[4]])
def test_every_edit_is_rejected(case: Case | Instrument) -> None:
    assert accepted(case) == set()


BROKEN = [
    ("a sum that is not written back", "write.en.eq(adds)", "write.en.eq(adds & combing)"),
    ("a comb of another delay", "check.written(Mux(combing, acc, total))", "check.written(total)"),
    ("a sum that is taken away", "Mux(combing, ~state, state) + combing", "~state + 1"),
    ("states of the channel before", "state.eq(Mux(started, word.data, 0))", "state.eq(word.data)"),
    ("states of another channel", "read.addr.eq(Cat(Mux(adds, step + 1, 0)[:steps], channel))", "read.addr.eq(step)"),
    ("a state too early", "Mux(adds, step + 1, 0)[:steps]", "step"),
    ("a first sample that is lost", "m.d.comb += kept.first.eq(sample)", "m.d.comb += kept.first.eq(0)"),
    ("a first sample added once", "<< cic.growth", "<< (cic.growth - 1)"),
    ("a rounding down", "+ (1 << cic.dropped >> 1)", "+ 0"),
    ("a phase that stands", "(phase + 1)[:phases]", "phase"),
    ("flags of one sample", "flags[:count]", "gathered"),
    ("flags that are not told", "self.o_flags.eq(kept.flags | gathered)", "self.o_flags.eq(gathered)"),
    ("a result that is overwritten", "gives & (~self.o_valid | self.o_ready)", "gives"),
    ("one channel that is not cleared", "channel == self.channels - 1", "channel == self.channels - 2"),
    ("a channel that does not exist", "self.i_valid & (self.i_dest < self.channels)", "self.i_valid"),
    ("results of one channel", "self.o_dest.eq(channel)", "self.o_dest.eq(0)"),
    ("control that is not written", "write.en.eq(kept.clears | kept.writes)", "write.en.eq(kept.clears)"),
    ("control of another channel", "read.addr.eq(self.i_dest)", "read.addr.eq(0)"),
    ("a sample that is not kept", "read.en.eq(kept.reads)", "read.en.eq(1)"),
]

BROKEN_AROUND = [
    ("samples before it is open", "self.s_axis_tvalid & ~closed.any()", "self.s_axis_tvalid"),
    ("samples that get lost", "self.s_axis_tready.eq(ready & ~closed.any())", "self.s_axis_tready.eq(ready)"),
    ("a gate that stays shut", "closed.eq(closed - closed.any())", "closed.eq(closed)"),
    ("results with the channel of none", "self.m_axis_tdest.eq(handed.dest)", "self.m_axis_tdest.eq(0)"),
    ("channels that get lost", "core.s_axis_tdest.eq(decimator.o_dest)", "core.s_axis_tdest.eq(0)"),
]


ROUNDED = Case(signed=False, output_bits=9, cutoff=20, error=0.02, hold=False, architecture="folded", channels=2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        pytest.param(*case, id=subject, marks=[pytest.mark.slow] * (k % 4 > 0))
        for k, (subject, *case) in enumerate(BROKEN)
    ],
)
def test_hardware_that_is_wrong_is_rejected(right: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_rejected_as_made(
        ROUNDED, monkeypatch, top, "ChannelDecimator", broken(hardware, right, wrong).ChannelDecimator
    )


@pytest.mark.slow
@pytest.mark.parametrize(("right", "wrong"), [pytest.param(*case, id=subject) for subject, *case in BROKEN_AROUND])
def test_wires_that_are_wrong_are_rejected(right: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_rejected_as_made(SMALL, monkeypatch, top, "DecimatedCore", broken(top, right, wrong).DecimatedCore)


@pytest.mark.slow
def test_sentences() -> None:
    """The first register, word or port that is wrong is named."""
    text = written(SMALL)

    def named(pattern: str, wrong: str, sentence: str) -> None:
        changed, count = re.subn(pattern, wrong, text)
        assert count == 1
        check_rejected(SMALL, changed, sentence)

    named(
        r"assign states_write_data = combing \? acc : total;",
        "assign states_write_data = combing ? total : acc;",
        "decimator.states must be what a decimator has there after a clock with state of the decimator = 3, "
        "decimator.step = 0, decimator.channel = 0, start of the channel = 1, not another value",
    )
    named(
        r"if \(control_write_enable\)",
        "if (writes)",
        "decimator.control must be what a decimator has there after a clock with state of the decimator = 0, "
        "decimator.channel = 0, not another value",
    )
    sentence = "m_axis_tdest must be the channel, and zeros above"
    named(r"m_axis_tdest\[7:1\] = 7'h00", "m_axis_tdest[7:1] = 7'h01", sentence)
    missing = "decimator.clears, decimator.i_ready, decimator.takes, decimator.adds, decimator.gives"
    with pytest.raises(RejectedError, match=f"^the decimator must have a register {missing}$"):
        check_decimator(written(SMALL._replace(channels=1)), designed(SMALL)[1], 2)


@pytest.mark.slow
def test_a_port_that_is_too_narrow_for_the_channel_is_rejected() -> None:
    text, (_, certificate) = written(CASES[4]), designed(CASES[4])
    (behind,) = re.findall(r"^module plain_behind\(.*?^endmodule$", text, re.MULTILINE | re.DOTALL)
    narrow = behind.replace(" [7:0] s_axis_tdest", " s_axis_tdest").replace(
        "s_axis_tdest[1:0]", "{ 1'h0, s_axis_tdest }"
    )
    with pytest.raises(RejectedError, match=r"^the port s_axis_tdest of behind must have 1 bits, not 8$"):
        check_decimator(text.replace(behind, narrow), certificate, 3)


@pytest.mark.parametrize(
    ("port", "whole", "part"),
    [
        ("s_axis_tdest", ".i_dest(s_axis_tdest)", ".i_dest({ 7'h00, s_axis_tdest })"),
        ("m_axis_tdest", "  assign m_axis_tdest[15:9] = 7'h00;\n", ""),
    ],
)
def test_more_channels_than_a_byte_tells_take_two(port: str, whole: str, part: str) -> None:
    case = SMALL._replace(channels=300)
    text = written(case)
    start = text.index("\nmodule plain(")
    end = text.index("endmodule", start)
    assert text[start:end].count(whole) == 1
    narrow = text[start:end].replace(f"[15:0] {port};", f"[8:0] {port};").replace(whole, part)
    check_rejected(case, text[:start] + narrow + text[end:], f"{port} must have 16 bits, not 9")
