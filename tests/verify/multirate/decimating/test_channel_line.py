"""What is proven of a filter of several channels whose multipliers take turns, and that what is changed is found."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import pytest
from tests.verify.multirate.single_cores import Made, changed, proven_alone, rejected, rejection, with_more
from tests.verify.parallel.simulated import outputs

import sosmith
from sosmith.verify.certificate_file import DownsamplingEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.decimating.polyphase import check_polyphase
from sosmith.verify.verification import verify

TAPS = (0.3, 0.2, 0.15, 0.1, -0.15, 0.2, 0.3)
CASES: dict[str, dict[str, Any]] = {
    "from zero, limited": {},
    "from zero, two": {"reach": 2.0, "channels": 2},
    "steady, limited": {"start": "steady"},
    "steady, four": {"start": "steady", "reach": 2.0, "channels": 4},
    "without a sign": {"start": "steady", "reach": 2.0, "signed": False},
    "held": {"hold": True},
    "steady, held": {"start": "steady", "hold": True, "channels": 4},
    "one sample in the line": {"taps": (0.5, 0.3), "reach": 2.0},
}


@cache
def made(
    start: str = "zero",
    reach: float = 0.5,
    signed: bool = True,
    channels: int = 3,
    hold: bool = False,
    taps: tuple[float, ...] = TAPS,
) -> Made:
    """Make a filter that decimates by 3, with two multipliers: a pair of taps, one that is subtracted, one alone."""
    tree = {
        "name": "little",
        "sample_rate": 1000.0,
        "channels": channels,
        "input": {"x": {"bits": 5, "range": [-1.0 * signed, 1.0], "signed": signed}},
        "filter": {"taps": list(taps), "decimate": 3, "hold": hold},
        "output": {"bits": 7, "range": [-reach, reach], "signed": True},
        "hardware": {"start": start, "clock": 1e4, "architecture": "parallel"},
    }
    return proven_alone(sosmith.design(sosmith.Specification.load(tree)))


@pytest.mark.sweep(4)
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_clocks_are_those_of_the_plan(case: dict[str, Any]) -> None:
    core = made(**case)
    verdict = check_polyphase(core.text, core.certificate, core.item)
    architecture = core.design.core.architecture
    assert verdict.clearing == architecture.reset_cycles == core.item.channels
    assert verdict.latency == architecture.latency_cycles
    assert verdict.result_clocks == architecture.cycles_per_result == 3
    assert verdict.interval == architecture.cycles_per_sample == 1
    assert verify(core.certificate).bound == core.certificate.claims.bound


_CHANGES = {
    "a line of another channel": (r"line_memory\[channel\] <=", "line_memory[channel1] <="),
    "a line that is read for another channel": (r"<= line_memory\[address\];", "<= line_memory[channel];"),
    "a line that channels share": (r"<= line_memory\[address\];", "<= line_memory[2'h0];"),
    "a line that moves without a sample": (r"if \(enters\)\n      line_memory", "if (advance)\n      line_memory"),
    "a line that does not move": (r"<= \{ line_of_channel\[24:0\], sample \}", "<= line_of_channel"),
    "a line that was there before": (r"line_of_channel = control_read_data\[0\] \?", "line_of_channel = 1'h1 ?"),
    "a place of another sample": (r"line_read_data\[29:25\]", "line_read_data[24:20]"),
    "a total of another channel": (r"total_memory\[channel5\] <=", "total_memory[channel4] <="),
    "a total that is read for another channel": (r"<= total_memory\[channel4\];", "<= total_memory[channel3];"),
    "a total that channels share": (r"total_memory\[channel5\] <=", "total_memory[2'h0] <="),
    "a total that moves without a sample": (r"total_write_enable = advance & valid5", "total_write_enable = advance"),
    "a total that is another in memory": (r"<= total_next;\n  end", "<= total;\n  end"),
    "a total that does not begin": (r"begins = phase5_is_1 \| fresh5", "begins = fresh5"),
    "a total that was there before": (r"begins = phase5_is_1 \| fresh5", "begins = phase5_is_1"),
    "a first total": (r"begins \? 16'h0040", "begins ? 16'h0000"),
    "a count of samples that channels share": (r"<= control_memory\[address\];", "<= control_memory[2'h0];"),
    "words that are not cleared": (r"control_write_enable = clearing \| enters", "control_write_enable = enters"),
    "a sample that does not wait for that of its channel": (r"near = valid1 &", "near = clearing &"),
    "a coefficient": (r"coefficients_memory\[1\] = 20'h0009a", "coefficients_memory[1] = 20'h0009b"),
    "a phase of the sample before": (r"phase3 <= phase2", "phase3 <= phase1"),
    "a channel of the result before": (r"channel6 <= channel5", "channel6 <= channel4"),
    "a first sample of another result": (r"fresh3 <= fresh2", "fresh3 <= fresh1"),
    "a rail of another result": (r"rail5 <= rail4", "rail5 <= rail3"),
    "a result of each sample": (r"result_valid_next = valid5 & not_any_phase5", "result_valid_next = valid5"),
}


@pytest.mark.sweep(5)
@pytest.mark.parametrize(("pattern", "by"), _CHANGES.values(), ids=_CHANGES)
def test_what_is_changed_is_found(pattern: str, by: str) -> None:
    core = made()
    assert rejection(check_polyphase, core, changed(core.text, pattern, by))


@pytest.mark.slow
def test_what_is_changed_does_something_else() -> None:
    core = made()
    right = [outputs(core.text, 600, seed, 3) for seed in range(3)]
    for name, (pattern, by) in _CHANGES.items():
        text = changed(core.text, pattern, by)
        assert [outputs(text, 600, seed, 3) for seed in range(3)] != right, name


def test_another_core_is_refused() -> None:
    """Other channels, other certificates, and lines that do not hold whole samples."""
    core = made()
    for channels in (1, 2, 4):
        with pytest.raises(RejectedError, match=r"\bmust\b"):
            check_polyphase(core.text, core.certificate, core.item.model_copy(update={"channels": channels}))
    other = core.certificate.model_copy(update={"downsampling": DownsamplingEntry(factor=4, filled=0)})
    with pytest.raises(RejectedError, match=r"\bmust\b"):
        check_polyphase(core.text, other, core.item)
    text = changed(core.text, r"reg \[29:0\] line_memory \[", "reg [28:0] line_memory [")
    with pytest.raises(RejectedError, match=r"\bmust\b"):
        check_polyphase(text, core.certificate, core.item)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
@pytest.mark.parametrize("seed", range(2))
def test_whatever_is_edited_is_found(case: dict[str, Any], seed: int) -> None:
    """What is accepted all the same does the same in simulation."""
    assert rejected(check_polyphase, made(**case), 20, seed) > 8


_OF_FIRST_SAMPLES = {
    "another result": (
        r"if \(below\) limited <= 7'h40;",
        "if (flip) limited <= 7'h00;\n      else if (below) limited <= 7'h40;",
        "  reg flip = 1'h0;\n  always_ff @(posedge aclk)\n    if (advance) flip <= fresh5;\n",
    ),
    "another channel": (
        r"if \(advance\) channel6 <= channel5;",
        "if (advance) if (fresh5) channel6 <= 2'h0; else channel6 <= channel5;",
        "",
    ),
    "another flag": (
        r"if \(advance\) settling <= settling5;",
        "if (advance) if (fresh5) settling <= 1'h0; else settling <= settling5;",
        "",
    ),
}


@pytest.mark.parametrize(("pattern", "by", "more"), _OF_FIRST_SAMPLES.values(), ids=_OF_FIRST_SAMPLES)
def test_what_the_first_sample_of_a_channel_does_otherwise_is_found(pattern: str, by: str, more: str) -> None:
    """It is followed by itself, as it finds nothing before it."""
    core = made()
    text = with_more(changed(core.text, pattern, by), more)
    assert "must take over for the first sample of a channel what it does for others" in rejection(
        check_polyphase, core, text
    )


def test_a_total_is_read_for_the_sample_at_the_position_before() -> None:
    core = made()
    text = re.sub(r"\bvalid2\b", "behind", core.text)
    with pytest.raises(RejectedError, match=r"^a core with several channels must have a register valid2$"):
        check_polyphase(text, core.certificate, core.item)


def test_a_second_reader_of_totals_that_nothing_uses_changes_nothing() -> None:
    core = made()
    more = "  reg [20:0] extra;\n  always_ff @(posedge aclk)\n    if (advance) extra <= total_memory[channel4];\n"
    assert rejection(check_polyphase, core, core.text.replace("endmodule", f"{more}endmodule", 1)) == ""
