"""What is proven of a CIC filter of adders, and that whatever is changed in its SystemVerilog is found."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
from tests.verify.multirate.single_cores import Made, changed, proven_alone, rejected, rejection
from tests.verify.parallel.simulated import Inputs, run

import sosmith
from sosmith.verify.certificate_file import DownsamplingEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.decimating.cic import check_cic
from sosmith.verify.verification import verify

CASES = {
    "from zero, limited": ("zero", True, True),
    "from zero": ("zero", False, True),
    "steady, limited": ("steady", True, True),
    "steady": ("steady", False, True),
    "without a sign": ("steady", False, False),
    "held": ("zero", True, True, 3, True),
}


@cache
def made(start: str = "zero", limited: bool = True, signed: bool = True, middle: int = 3, hold: bool = False) -> Made:
    """Make two moving sums of three samples, which decimate by 3; with another tap in the middle, they are products."""
    most = 8.0 if limited else 16.0  # the largest result is 9
    architecture = "parallel" if middle == 3 else "folded"
    tree = {
        "name": "little",
        "sample_rate": 1000.0,
        "input": {"x": {"bits": 5, "range": [-1.0 * signed, 1.0], "signed": signed}},
        "filter": {"taps": [1, 2, middle, 2, 1], "decimate": 3, "hold": hold},
        "output": {"bits": 7, "range": [-most, most], "signed": True},
        "hardware": {"start": start, "clock": 1e5, "architecture": architecture},
    }
    return proven_alone(sosmith.design(sosmith.Specification.load(tree)))


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_clocks_are_those_of_the_plan(case: tuple[Any, ...]) -> None:
    core = made(*case)
    verdict = check_cic(core.text, core.certificate, core.item)
    architecture = core.design.core.architecture
    assert verdict.clearing == architecture.reset_cycles == (6 if case[0] == "steady" else 0)
    assert verdict.latency == architecture.latency_cycles == 6 + case[1]
    assert verdict.result_clocks == architecture.cycles_per_result == 3
    assert verdict.interval == architecture.cycles_per_sample == 1
    copies = architecture.copies_per_result
    # The result before may still have all of its copies before it.
    assert verdict.progress == (2 * copies, verdict.latency + 2 * (copies - 1), verdict.clearing)
    assert (verdict.adder_bits, verdict.states) == (4 * architecture.plan.width, 4)
    assert verify(core.certificate).bound == core.certificate.claims.bound


_CHANGES = {
    "a sum that forgets": (r"sum2_next = sum2 \+ sum1", "sum2_next = sum1"),
    "a sum that moves without a sample": (
        r"sum2_load = s_axis_tready & valid1",
        "sum2_load = s_axis_tready & s_axis_tready",
    ),
    "a sum that moves while the pipeline stands": (
        r"sum2_load = s_axis_tready & valid1",
        "sum2_load = valid1 & valid1",
    ),
    "a comb that takes the wrong side": (r"difference2_next = difference1 - comb2", "difference2_next = comb2"),
    "a comb that holds too long": (r"if \(comb2_load\) comb2 <= difference1", "if (comb2_load) comb2 <= comb2"),
    "a phase": (r"phase == 2'h2", "phase == 2'h3"),
    "a result that comes early": (r"moved2 <= moved1", "moved2 <= moved1_next"),
    "a rail that is forgotten": (r"rail_now = rail \|", "rail_now = rail_now_part |"),
    "a rail of the sample before": (r"rail3 <= rail2", "rail3 <= rail1"),
    "a rail of another result": (r"rail5 <= rail4", "rail5 <= rail3"),
    "a limit": (r"above \? 8'h3f", "above ? 8'h3e"),
    "a count": (r"reg \[1:0\] left = 2'h2", "reg [1:0] left = 2'h1"),
    "a count that does not end": (r"left_load = s_axis_tready_and_moved2 & any_left", "left_load = moved2 & any_left"),
    "a sum that a reset leaves": (r"if \(!aresetn\) sum1 <= 9'h000;\n    else if", "if"),
    "a result that is overwritten": (r"if \(o_valid_load\)", "if (o_ready)"),
    "half a step": (r"\$signed\(\d+'h0*1\)", "$signed(2'h0)"),
}


@pytest.mark.parametrize(("pattern", "by"), _CHANGES.values(), ids=_CHANGES)
def test_what_is_changed_is_found(pattern: str, by: str) -> None:
    core = made()
    assert rejection(check_cic, core, core.text) == ""
    assert rejection(check_cic, core, changed(core.text, pattern, by))


_HELD_CHANGES = {
    "a copy too few": (r"copies_is_2 = copies == 2'h2", "copies_is_2 = copies == 2'h1"),
    "copies that leave without a handshake": (r"leaves = m_axis_tready & \w+", "leaves = copies == 2'h2"),
    "a count without a handshake": (r"else if \((\w+)\) copies <=", "else if (m_axis_tready) copies <="),
    "a count that a reset leaves": (r"if \(!aresetn\) copies <= 2'h0;\n    else if", "if"),
    "a first count": (r"reg \[1:0\] copies = 2'h0", "reg [1:0] copies = 2'h1"),
    "a result that leaves with each handshake": (r"\.o_ready\(leaves\)", ".o_ready(m_axis_tready)"),
}


@pytest.mark.parametrize(("pattern", "by"), _HELD_CHANGES.values(), ids=_HELD_CHANGES)
def test_what_is_changed_of_a_held_result_is_found(pattern: str, by: str) -> None:
    core = made(hold=True)
    assert rejection(check_cic, core, core.text) == ""
    assert rejection(check_cic, core, changed(core.text, pattern, by))


def test_results_that_are_held_are_no_others() -> None:
    once, held = made(), made(hold=True)
    assert rejection(check_cic, once, held.text)
    sentence = "a core that holds results must have a net leaves, which says when one leaves"
    assert rejection(check_cic, held, once.text) == sentence


@pytest.mark.parametrize("seed", [1, 2])
def test_a_held_result_leaves_in_time(seed: int) -> None:
    """Once the sink is ready, whatever waited before."""
    core = made(hold=True)
    pace = check_cic(core.text, core.certificate, core.item).progress
    inputs = Inputs(core.text, 700, seed)
    for clock, row in enumerate(inputs.rows):
        row["aresetn"] = 1
        if clock % 50 > 12:
            row["m_axis_tready"] = 1
    seen = run(inputs)
    copies, samples, results = 0, 0, list[int]()
    for clock, (row, out) in enumerate(zip(inputs.rows, seen, strict=True)):
        if row["s_axis_tvalid"] and out["s_axis_tready"]:
            if samples % 3 == 0:
                results.append(clock)
            samples += 1
        if row["m_axis_tready"] and out["m_axis_tvalid"]:
            begun = results[copies // 3]
            if copies % 3 == 0 and all(row["m_axis_tready"] for row in inputs.rows[begun:clock]):
                assert clock - begun <= pace.given
            copies += 1
    for first in range(13, 650, 50):  # the sink is ready from here on
        assert any(row["s_axis_tready"] for row in seen[first : first + pace.taken])
    assert copies > 300


@pytest.mark.sweep(1)
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
@pytest.mark.parametrize("seed", range(4))
def test_whatever_is_edited_is_found(case: tuple[Any, ...], seed: int) -> None:
    """What is accepted all the same does the same in simulation."""
    assert rejected(check_cic, made(*case), 30, seed) > 15


def test_a_certificate_that_says_otherwise() -> None:
    core = made()
    for factor, sentence in (
        (2, r"^the core must have a register rail7$"),
        (4, r"^a CIC filter must remember a multiple of 3 samples, not 4$"),
        (5, r"^phase must have 3 bits, not 2$"),
    ):
        other = core.certificate.model_copy(update={"downsampling": DownsamplingEntry(factor=factor, filled=0)})
        with pytest.raises(RejectedError, match=sentence):
            check_cic(core.text, other, core.item)
    filled = core.certificate.model_copy(update={"downsampling": DownsamplingEntry(factor=3, filled=4)})
    with pytest.raises(RejectedError, match=r"^no result must be settling where the first sample fills the filter$"):
        check_cic(core.text, filled, core.item)


@pytest.mark.parametrize("change", ["moved2 & ~ any_left", "moved2 | any_left"])
def test_no_result_is_lost_or_made_while_it_settles(change: str) -> None:
    """With a start from zero, all results leave: those before it has settled, too, and nothing else."""
    core = made()
    name = "result_valid"
    assert f"else if (s_axis_tready) {name} <= moved2;" in core.text
    text = core.text.replace(f"else if (s_axis_tready) {name} <= moved2;", f"else if (s_axis_tready) {name} <= wrong;")
    left, sign, right = change.split(" ", 2)
    inverted = right.startswith("~")
    added = "  wire wrong;\n  wire others;\n"
    added += f"  assign others = {'~ ' if inverted else ''}any_left{'' if inverted else ' & any_left'};\n"
    text = text.replace("  assign rst =", f"{added}  assign wrong = {left} {sign} others;\n  assign rst =", 1)
    with pytest.raises(RejectedError, match=rf"^{name} must be 1 behind a result that counts, and 0 otherwise$"):
        check_cic(text, core.certificate, core.item)


def test_a_start_without_values_is_refused() -> None:
    core = made("steady", limited=False)
    text = changed(core.text, r"reg \[8:0\] sum1 = 9'h000;", "reg [8:0] sum1;")
    with pytest.raises(RejectedError, match=r"^sum1 must have a value before the first clock$"):
        check_cic(text, core.certificate, core.item)


def test_another_way_to_count_samples_is_refused() -> None:
    """A count that ends before its range does flags fewer samples than the range says."""
    core = made()
    *before, output = core.certificate.stages
    nodes = [
        node.model_copy(update={"parameter": 4, "low": 4, "high": 4}) if node.name == "samples" else node
        for node in output.nodes
    ]
    other = output.model_copy(update={"nodes": tuple(nodes)})
    assert other != output
    forged = core.certificate.model_copy(update={"stages": (*before, other)})
    with pytest.raises(RejectedError, match=r" must count samples one by one, up to as many as are flagged$"):
        check_cic(core.text, forged, core.item)


def test_a_certificate_of_other_taps() -> None:
    """Integrators and combs have the taps of moving sums, whatever the graph says."""
    other = made(middle=4)
    with pytest.raises(RejectedError, match=r"^m_axis_tdata must be node \d+ .* of output_stage, not another value$"):
        check_cic(made().text, other.certificate, other.item)
