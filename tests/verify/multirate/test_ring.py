"""What is proven of an FIR filter that decimates, and that whatever is changed in its SystemVerilog is found."""

from __future__ import annotations

import re
from functools import cache

import pytest
from tests.verify.multirate.single_cores import Made, changed, proven_alone

import sosmith
from sosmith.verify.certificate_file import DownsamplingEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.ring.check import check_rings
from sosmith.verify.verification import verify


@cache
def made(channels: int = 1, start: str = "zero", *, hold: bool = False) -> Made:
    """Make a small filter that decimates by 3, with a pair of taps, one that is subtracted, and one alone."""
    tree = {
        "name": "little",
        "sample_rate": 1000.0,
        "channels": channels,
        "input": {"x": {"bits": 7, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"taps": [0.3, 0.17, 0.0, -0.17, 0.3], "decimate": 3, "hold": hold},
        "output": {"bits": 7, "range": [-0.5, 0.5], "signed": True},
        "hardware": {"start": start, "clock": 1e6},
    }
    return proven_alone(sosmith.design(sosmith.Specification.load(tree)))


@cache
def wide(*, signed: bool = True) -> Made:
    """Make a filter all of whose results leave, and whose sums of two samples have two digits for a block."""
    tree = {
        "name": "little",
        "sample_rate": 1000.0,
        "input": {"x": {"bits": 20, "range": [-1.0 * signed, 1.0], "signed": signed}},
        "filter": {"taps": [0.3, 0.17, -0.17, 0.3]},
        "output": {"bits": 7, "range": [-1.0, 1.0], "signed": True},
        "hardware": {"clock": 1e6, "architecture": "folded"},
    }
    return proven_alone(sosmith.design(sosmith.Specification.load(tree)))


def check(core: Made, text: str = "") -> None:
    check_rings(text or core.text, core.certificate, core.item)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("start", ["zero", "steady"])
@pytest.mark.parametrize("channels", [1, 3])
def test_clocks_are_those_of_the_plan(channels: int, start: str, hold: bool) -> None:
    core = made(channels, start, hold=hold)
    verdict = check_rings(core.text, core.certificate, core.item)
    architecture = core.design.core.architecture
    assert verdict.clearing == architecture.reset_cycles
    assert verdict.latency == architecture.latency_cycles
    assert verdict.result_clocks == architecture.cycles_per_result
    assert verdict.interval == architecture.cycles_per_sample
    assert verify(core.certificate).bound == core.certificate.claims.bound


_ONE = {
    "the place of a tap": (r"(place_first \} = pointer) \+", r"\1 -"),
    "the place of a sample": (r"(pointer_plus_1_2 = pointer) \+", r"\1 -"),
    "how a ring is filled": (r"(pointer_plus_1 = pointer) \+", r"\1 -"),
    "sum for difference": (r"(\$signed\(ring_first_read_data\)) - (\$signed)", r"\1 + \2"),
    "a sum that begins late": (r"step == 3'h4", "step == 3'h5"),
    "an early end": (r"step == 3'h6", "step == 3'h5"),
    "half a step": (r"16'h0080 : total", "16'h0040 : total"),
    "a result that is overwritten": (r"(assign code_set = ends) & result_leaves", r"\1 & ends"),
    "a result that is lost": (r"(assign result_leaves = not_m_axis_tvalid) \| leaves", r"\1 | ends"),
    "a result that does not stay": (r"(assign leaves = m_axis_tvalid) & m_axis_tready", r"\1 & m_axis_tvalid"),
    "a rail that is forgotten": (r"rail_now = rail \|", "rail_now = rail_now_part |"),
    "a rail that stays": (r"rail_next = rail_now & any_phase", "rail_next = rail_now & rail_now"),
    "a phase": (r"phase == 2'h2", "phase == 2'h3"),
    "a limit": (r"above \? 8'h3f", "above ? 8'h3e"),
    "a count": (r"counted < 3'h5;\n  assign counted_next", "counted < 3'h4;\n  assign counted_next"),
    "samples while it is filled": (
        r"s_axis_tready = not_running & not_filling",
        "s_axis_tready = not_running & not_running",
    ),
    "a reset that does less": (
        r"ends_and_result_leaves, not_aresetn",
        "ends_and_result_leaves, ends_and_result_leaves",
    ),
    "a first value": (r"reg filling = 1'h1", "reg filling = 1'h0"),
}


def _with_bit_flipped(text: str, row: int, bit: int) -> str:
    """Return SystemVerilog with one bit of the program inverted."""
    at, width, value = re.findall(r"steps_memory\[(\d+)\] = (\d+)'h([0-9a-f]+);", text)[row]
    wrong = int(value, 16) ^ 1 << bit
    flipped = text.replace(f"steps_memory[{at}] = {width}'h{value};", f"steps_memory[{at}] = {width}'h{wrong:04x};")
    assert flipped != text
    return flipped


@pytest.mark.sweep(4)
@pytest.mark.parametrize(
    ("row", "bit"), [(0, 0), (0, 3), (1, 2), (1, 5), (1, 6), (2, 6), (2, 7), (2, 15), (3, 7), (3, 14)]
)
def test_no_bit_of_a_step_is_free(row: int, bit: int) -> None:
    """Offsets, sign and coefficient of a step, which stand in three rows."""
    core = made()
    with pytest.raises(RejectedError):
        check(core, _with_bit_flipped(core.text, row, bit))


@pytest.mark.sweep(9)
@pytest.mark.parametrize(("pattern", "by"), _ONE.values(), ids=_ONE)
def test_what_is_changed_is_found(pattern: str, by: str) -> None:
    core = made()
    text = changed(core.text, pattern, by)
    with pytest.raises(RejectedError):
        check(core, text)


@pytest.mark.parametrize("name", ["waits", "filling"])
def test_whatever_follows_the_clearing_is_known(name: str) -> None:
    """At the last clock of the clearing, which no other clock of it follows, a register takes what nothing says."""
    core = made(3)
    text = changed(core.text, r"  wire clearing_reset;", f"\\g<0>\n  wire late;\n  wire late_{name};")
    text = changed(text, rf"else {name} <= {name}_next;", f"else {name} <= late_{name};")
    text = changed(
        text,
        r"  assign clearing_reset =",
        f"  assign late = clearing_reset & pair[0];\n  assign late_{name} = {name}_next | late;\n\\g<0>",
    )
    with pytest.raises(RejectedError, match=rf"^{name} must follow from the samples and the clocks, not be anything$"):
        check(core, text)


@pytest.mark.parametrize("name", ["place_first", "place_second"])
def test_an_address_of_no_word_is_refused(name: str) -> None:
    """Of an address with one bit more, half are of no word: simulators read x there, synthesis another word."""
    core = made()
    text = changed(core.text, rf"wire \[2:0\] {name};", f"wire [3:0] {name};")
    with pytest.raises(
        RejectedError, match=r"^m_axis_tdata must be node \d+ \(clamp code\) of output_stage, not another value$"
    ):
        check(core, text)


def test_a_count_of_what_nothing_says_is_told() -> None:
    core = made()
    text = changed(core.text, r"counted <= counted_next\[2:0\]", "counted <= pair[2:0]")
    with pytest.raises(RejectedError, match=r"^counted must follow from the samples and the clocks, not be anything$"):
        check(core, text)


def test_a_count_that_changes_without_a_sample_is_told() -> None:
    """Where no sample is on offer, it is made of one."""
    core = made()
    text = changed(core.text, r"  wire counted_below_5;", r"\g<0>\n  wire quiet;\n  wire idle;")
    text = changed(
        text,
        r"  assign counted_below_5 =",
        r"  assign quiet = ~ s_axis_tvalid;\n  assign idle = quiet & s_axis_tready;\n\g<0>",
    )
    text = changed(
        text,
        r"else if \(taken\) counted <= counted_next\[2:0\];",
        r"\g<0>\n    else if (idle) counted <= s_axis_tdata[2:0];",
    )
    with pytest.raises(RejectedError, match=r"^counted must follow from the samples and the clocks, not be anything$"):
        check(core, text)


def test_a_certificate_that_says_otherwise() -> None:
    core = made()
    for factor in (2, 4):
        other = core.certificate.model_copy(update={"downsampling": DownsamplingEntry(factor=factor, filled=0)})
        with pytest.raises(RejectedError):
            check_rings(core.text, other, core.item)
    filled = core.certificate.model_copy(update={"downsampling": DownsamplingEntry(factor=3, filled=5)})
    with pytest.raises(RejectedError, match=r"^pointer must stay while nothing happens$"):
        check_rings(core.text, filled, core.item)
    steady = made(start="steady")
    short = steady.certificate.model_copy(update={"downsampling": DownsamplingEntry(factor=3, filled=3)})
    with pytest.raises(RejectedError, match=r"^a filter that decimates must be filled 4 times, not 3$"):
        verify(short)


@pytest.mark.parametrize("signed", [True, False])
def test_digits_are_proven(*, signed: bool) -> None:
    core = wide(signed=signed)
    verdict = check_rings(core.text, core.certificate, core.item)
    assert (verdict.interval, verdict.latency) == (10, 10)
    assert (core.design.cycles_per_sample, core.design.latency_cycles) == (10, 10)


@pytest.mark.sweep(3)
@pytest.mark.parametrize(("row", "bit"), [(1, 5), (2, 5), (4, 5), (3, 6), (4, 6), (6, 6), (2, 7), (3, 13)])
def test_no_digit_is_free(row: int, bit: int) -> None:
    """Which digit a step takes, and by how much its product is moved up, stand one and three rows below it."""
    core = wide()
    with pytest.raises(RejectedError):
        check(core, _with_bit_flipped(core.text, row, bit))


@pytest.mark.slow
def test_as_many_taps_as_a_filter_may_have_are_proven() -> None:
    """Each of 128 pairs takes four steps, for any of several channels."""
    half = [round((-1) ** k * 0.97**k + 1e-7 * k, 9) for k in range(128)]
    tree = {
        "name": "long",
        "sample_rate": 48000.0,
        "channels": 3,
        "input": {"x": {"bits": 24, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"taps": [*half, *half[::-1]]},
        "output": {"bits": 24, "range": [-128.0, 128.0], "signed": True, "max_error": 1.5e-5},
        "hardware": {"clock": 100e6, "architecture": "folded"},
    }
    core = proven_alone(sosmith.design(sosmith.Specification.load(tree)))
    verdict = check_rings(core.text, core.certificate, core.item)
    assert verdict.interval == core.design.cycles_per_sample > 500
