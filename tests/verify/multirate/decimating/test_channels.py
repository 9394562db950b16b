"""What is proven of a CIC filter of adders for several channels, and that whatever is changed in it is found."""

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
from sosmith.verify.multirate.decimating.cic import check_cic
from sosmith.verify.verification import verify

CASES: dict[str, dict[str, Any]] = {
    "from zero, limited": {},
    "from zero, two": {"limited": False, "channels": 2},
    "steady, limited": {"start": "steady"},
    "steady, four": {"start": "steady", "limited": False, "channels": 4},
    "without a sign": {"start": "steady", "limited": False, "signed": False},
    "held": {"hold": True},
    "steady, held": {"start": "steady", "hold": True, "channels": 4},
    "one sum": {"taps": (1, 1, 1)},
}


@cache
def made(
    start: str = "zero",
    limited: bool = True,
    signed: bool = True,
    channels: int = 3,
    hold: bool = False,
    taps: tuple[int, ...] = (1, 2, 3, 2, 1),
) -> Made:
    """Make moving sums of three samples, two by default, which decimate by 3."""
    most = 8.0 if limited else 16.0  # the largest result of two is 9
    tree = {
        "name": "little",
        "sample_rate": 1000.0,
        "channels": channels,
        "input": {"x": {"bits": 5, "range": [-1.0 * signed, 1.0], "signed": signed}},
        "filter": {"taps": list(taps), "decimate": 3, "hold": hold},
        "output": {"bits": 7, "range": [-most, most], "signed": True},
        "hardware": {"start": start, "clock": 1e5, "architecture": "parallel"},
    }
    return proven_alone(sosmith.design(sosmith.Specification.load(tree)))


@pytest.mark.sweep(4)
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_clocks_are_those_of_the_plan(case: dict[str, Any]) -> None:
    core = made(**case)
    verdict = check_cic(core.text, core.certificate, core.item)
    architecture = core.design.core.architecture
    assert verdict.clearing == architecture.reset_cycles == core.item.channels
    assert verdict.latency == architecture.latency_cycles
    assert verdict.result_clocks == architecture.cycles_per_result == 3
    assert verdict.interval == architecture.cycles_per_sample == 1
    assert verdict.memories == 1 + verdict.states
    assert verdict.adder_bits == architecture.plan.adder_bits
    assert verify(core.certificate).bound == core.certificate.claims.bound


_CHANGES = {
    "a sum of another channel": (r"sum2_memory\[channel1\] <=", "sum2_memory[channel2] <="),
    "a sum that is read for another channel": (r"<= sum2_memory\[channel\];", "<= sum2_memory[channel1];"),
    "a first sum that is read for a sample that does not stay": (
        r"<= sum1_memory\[address\];",
        "<= sum1_memory[s_axis_tdest[1:0]];",
    ),
    "a comb of another channel": (r"comb1_memory\[channel2\] <=", "comb1_memory[channel1] <="),
    "a comb that channels share": (r"comb2_memory\[channel3\] <=", "comb2_memory[2'h0] <="),
    "a count of samples that channels share": (r"<= control_memory\[address\];", "<= control_memory[2'h0];"),
    "words that are not cleared": (
        r"control_write_enable = clearing \| enters",
        "control_write_enable = enters | enters",
    ),
    "a word too few that is cleared": (r"channel_is_2 = channel == 2'h2", "channel_is_2 = channel == 2'h1"),
    "words that are cleared to something": (r"clearing \? 6'h00", "clearing ? 6'h01"),
    "a sample that does not wait for that of its channel": (r"near = valid1 &", "near = clearing &"),
    "a sample that waits for others as well": (r"near = valid1 & \w+", "near = valid1 & valid1"),
    "a sample that is taken while words are cleared": (r"s_axis_tready = not_clearing &", "s_axis_tready ="),
    "a sample of a channel that does not exist": (r"s_axis_tdest < 2'h3", "s_axis_tdest < 3'h4"),
    "a sum that moves without a sample": (r"sum2_write_enable = advance & valid1", "sum2_write_enable = advance"),
    "a sum that moves while the pipeline stands": (
        r"sum2_write_enable = advance & valid1",
        "sum2_write_enable = valid1",
    ),
    "a comb that moves with each sample": (
        r"comb1_write_enable = advance & \w+",
        "comb1_write_enable = advance & valid2",
    ),
    "a sum that was there before": (r"sum2_of_channel = fresh1 \? 9'h000", "sum2_of_channel = fresh1 ? sum2_read_data"),
    "the first sample of another sum": (r"sum2_of_channel = fresh1", "sum2_of_channel = fresh2"),
    "a channel of the result before": (r"channel5 <= channel4", "channel5 <= channel3"),
    "a channel of the result behind": (r"channel2 <= channel1", "channel2 <= channel3"),
    "channels that are swapped at the output": (
        r"m_axis_tdest = \{ 6'h00, o_data\[15:14\] \}",
        "m_axis_tdest = { 6'h00, o_data[14], o_data[15] }",
    ),
    "a rail of the sample before": (r"rail3 <= rail2", "rail3 <= rail1"),
    "a rail that is not forgotten": (r"rail_after = rail_now & \w+", "rail_after = rail_now"),
    "a result that settles with another": (r"settling3 <= settling2", "settling3 <= settling1"),
    "a count of each sample": (r"completes_and_settling_now = completes &", "completes_and_settling_now ="),
    "a phase": (r"last = control_read_data\[2:1\] == 2'h2", "last = control_read_data[2:1] == 2'h1"),
    "a sample that is lost while the pipeline stands": (r"enters = there_and_advance &", "enters = there &"),
    "a memory with a word too much": (
        r"sum2_memory \[2:0\];\n  initial begin\n",
        "sum2_memory [3:0];\n  initial begin\n    sum2_memory[3] = 9'h000;\n",
    ),
}

_STEADY = {
    "a sample that does not fill the filter": (r"filling = ~ control_read_data\[0\]", "filling = control_read_data[0]"),
    "a filter that is filled for a part": (r"started_after = control_read_data\[0\] \| \w+", "started_after = enters"),
    "a result that counts while the filter fills": (
        r"result_valid_next = moved2 & counts4",
        "result_valid_next = moved2",
    ),
    "a count of the result before": (r"counts3 <= counts2", "counts3 <= counts1"),
    "a count that a reset leaves": (r"if \(!aresetn\) filled <= 1'h0;\n    else if", "if"),
    "a count that begins elsewhere": (r"reg filled = 1'h0", "reg filled = 1'h1"),
    "a sample that leaves while the filter fills": (
        r"enters_and_control_read_data_0 = enters & control_read_data\[0\]",
        "enters_and_control_read_data_0 = enters",
    ),
    "a rail of what fills the filter": (r"(rail_after = \w+) & control_read_data\[0\]", r"\1"),
}


@pytest.mark.sweep(6)
@pytest.mark.parametrize(("pattern", "by"), _CHANGES.values(), ids=_CHANGES)
def test_what_is_changed_is_found(pattern: str, by: str) -> None:
    core = made()
    assert rejection(check_cic, core, changed(core.text, pattern, by))


@pytest.mark.sweep(3)
@pytest.mark.parametrize(("pattern", "by"), _STEADY.values(), ids=_STEADY)
def test_what_is_changed_of_a_steady_start_is_found(pattern: str, by: str) -> None:
    core = made("steady")
    assert rejection(check_cic, core, changed(core.text, pattern, by))


@pytest.mark.slow
def test_what_is_changed_does_something_else() -> None:
    """All show in a short simulation, but where the same word is written again, or a reset would have to come."""
    same = set()
    for start, changes in (("zero", _CHANGES), ("steady", _STEADY)):
        core = made(start)
        right = [outputs(core.text, 600, seed, 3) for seed in range(3)]
        for name, (pattern, by) in changes.items():
            text = changed(core.text, pattern, by)
            if [outputs(text, 600, seed, 3) for seed in range(3)] == right:
                same.add(name)
    assert same <= {
        "a memory with a word too much",
        "a sum that moves while the pipeline stands",
        "a rail of what fills the filter",
        "a count that begins elsewhere",
        "a count that a reset leaves",
    }


def test_results_that_are_held_are_no_others() -> None:
    once, held = made(), made(hold=True)
    assert rejection(check_cic, once, held.text)
    assert rejection(check_cic, held, once.text)


def test_another_number_of_channels_is_refused() -> None:
    for core, channels in ((made(), 2), (made(), 4), (made(channels=4), 3)):
        item = core.item.model_copy(update={"channels": channels})
        with pytest.raises(RejectedError, match=r"\bmust\b"):
            check_cic(core.text, core.certificate, item)
    with pytest.raises(RejectedError, match=r"^the ports must be aclk, aresetn, .*, not .*tdest.*$"):
        check_cic(made().text, made().certificate, made().item.model_copy(update={"channels": 1}))


def test_a_certificate_that_says_otherwise() -> None:
    core = made()
    for factor in (2, 4, 5):
        other = core.certificate.model_copy(update={"downsampling": DownsamplingEntry(factor=factor, filled=0)})
        with pytest.raises(RejectedError, match=r"\bmust\b"):
            check_cic(core.text, other, core.item)


@pytest.mark.parametrize(
    ("pattern", "by", "sentence"),
    [
        (r"\bnear\b", "close", r"^a core with several channels must have near$"),
        (r"\bchannel1\b", "next_to_it", r"^the core must have a register channel1$"),
        (r"\bchannel2\b", "behind", r"^the core must have a register channel2$"),
        (r"\bsum2_memory_read\b", "others", r"^the core must have a register sum2_memory_read$"),
    ],
)
def test_names_count(pattern: str, by: str, sentence: str) -> None:
    core = made()
    with pytest.raises(RejectedError, match=sentence):
        check_cic(re.sub(pattern, by, core.text), core.certificate, core.item)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
@pytest.mark.parametrize("seed", range(2))
def test_whatever_is_edited_is_found(case: dict[str, Any], seed: int) -> None:
    """What is accepted all the same does the same in simulation."""
    assert rejected(check_cic, made(**case), 25, seed) > 12


def test_a_register_called_rest_is_one_of_its_own() -> None:
    """It is no part of a word that others are read from."""
    core = made()
    text = changed(core.text, r"rail1 <= rail_now", "rail1 <= rail_more")
    more = "  reg rest = 1'h0;\n  always_ff @(posedge aclk)\n    if (advance) rest <= s_axis_tdata[0];\n"
    more += "  wire same;\n  wire same_and_rest;\n  wire rail_more;\n"
    more += "  assign same = control_read_data == control_read_data;\n  assign same_and_rest = same & rest;\n"
    more += "  assign rail_more = same_and_rest | rail_now;\n"
    assert "rail1" in rejection(check_cic, core, with_more(text, more))


def test_a_second_reader_of_sums_that_nothing_uses_changes_nothing() -> None:
    core = made()
    more = "  reg [8:0] extra;\n  always_ff @(posedge aclk)\n    if (advance) extra <= sum2_memory[channel];\n"
    assert rejection(check_cic, core, core.text.replace("endmodule", f"{more}endmodule", 1)) == ""


def test_an_output_buffer_that_is_never_full_is_refused() -> None:
    core = made()
    full = r"  reg full = 1'h0;\n"
    text = changed(core.text, full, "  wire full;\n  assign full = 1'h0;\n")
    text = changed(
        text, r"  always_ff @\(posedge \w+\)\n    if \(\w+\) full <=[^;]*;\n(    else[^;]*full <=[^;]*;\n)*", ""
    )
    with pytest.raises(RejectedError, match=r"^a core with several channels must have a register output_buffer.full$"):
        check_cic(text, core.certificate, core.item)
