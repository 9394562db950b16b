"""What is proven of an FIR filter whose multipliers take turns, and that whatever is changed in it is found."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import pytest
from tests.verify.multirate.single_cores import Made, changed, proven_alone, rejected, rejection
from tests.verify.parallel.simulated import outputs

import sosmith
from sosmith.verify.certificate_file import DownsamplingEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.decimating.polyphase import check_polyphase
from sosmith.verify.verification import verify

CASES = {
    "from zero, limited": ("zero", 0.5, True),
    "from zero": ("zero", 2.0, True),
    "steady, limited": ("steady", 0.5, True),
    "steady": ("steady", 2.0, True),
    "without a sign": ("steady", 2.0, False),
    "held": ("steady", 2.0, True, True),
}


@cache
def made(start: str = "zero", reach: float = 0.5, signed: bool = True, hold: bool = False) -> Made:
    """Make a filter that decimates by 3 with two multipliers: a pair of taps, one that is subtracted, one alone."""
    tree = {
        "name": "little",
        "sample_rate": 1000.0,
        "input": {"x": {"bits": 5, "range": [-1.0 * signed, 1.0], "signed": signed}},
        "filter": {"taps": [0.3, 0.2, 0.15, 0.1, -0.15, 0.2, 0.3], "decimate": 3, "hold": hold},
        "output": {"bits": 7, "range": [-reach, reach], "signed": True},
        "hardware": {"start": start, "clock": 1e3, "architecture": "parallel"},
    }
    return proven_alone(sosmith.design(sosmith.Specification.load(tree)))


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_clocks_are_those_of_the_plan(case: tuple[Any, ...]) -> None:
    core = made(*case)
    verdict = check_polyphase(core.text, core.certificate, core.item)
    architecture = core.design.core.architecture
    assert architecture.plan.multipliers == 2
    assert verdict.clearing == architecture.reset_cycles == (6 if case[0] == "steady" else 0)
    assert verdict.latency == architecture.latency_cycles
    assert verdict.result_clocks == architecture.cycles_per_result == 3
    assert verdict.interval == architecture.cycles_per_sample == 1
    assert verify(core.certificate).bound == core.certificate.claims.bound


_CHANGES = {
    "a place of another sample": (r"line3 <= line2", "line3 <= line1"),
    "a line that moves without a sample": (r"if \(enters\) line2 <=", "if (s_axis_tready) line2 <="),
    "a line that a reset leaves": (r"if \(!aresetn\) line1 <= 5'h00;\n    else if", "if"),
    "a coefficient": (r"(coefficients_memory\[1\] = \d+'h\w*)\w;", r"\g<1>0;"),
    "a phase of the sample before": (r"phase3 <= phase2", "phase3 <= phase1"),
    "a total that keeps what was there": (r"begins \?", "~ begins ?"),
    "a total that takes part in another result": (
        r"total_load = s_axis_tready & valid\d",
        "total_load = s_axis_tready & s_axis_tready",
    ),
    "a total that a reset leaves": (r"if \(!aresetn\) total <= \d+'h\w+;\n    else if", "if"),
    "a first total": (r"(reg \[\d+:0\] total = \d+'h\w*)\w;", r"\g<1>1;"),
    "a rail of another result": (r"rail5 <= rail4", "rail5 <= rail3"),
    "a result that comes early": (r"valid3 <= valid2", "valid3 <= valid1"),
}


@pytest.mark.parametrize(("pattern", "by"), _CHANGES.values(), ids=_CHANGES)
def test_what_is_changed_is_found(pattern: str, by: str) -> None:
    core = made()
    assert rejection(check_polyphase, core, core.text) == ""
    assert rejection(check_polyphase, core, changed(core.text, pattern, by))


@pytest.mark.sweep(1)
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
@pytest.mark.parametrize("seed", range(4))
def test_whatever_is_edited_is_found(case: tuple[Any, ...], seed: int) -> None:
    """What is accepted all the same does the same in simulation."""
    assert rejected(check_polyphase, made(*case), 20, seed) > 8


@pytest.mark.parametrize("start", ["zero", "steady"])
@pytest.mark.parametrize(
    ("taps", "factor", "line", "choice"),
    [
        ([0.5, 0.3], 2, ["line1"], "phase1 ? line1 : line0"),
        ([0.5, 0.3, 0.2], 3, ["line1", "line2"], "phase1[0] ? line2 : line0"),
        ([0.5, 0.3, 0.2], 3, ["line1"], "phase1[0] ? line1 : line0"),
    ],
)
def test_no_sample_is_too_old(start: str, taps: list[float], factor: int, line: list[str], choice: str) -> None:
    """A longer line has samples that the graph does not remember, one sample later: none of them may be taken."""
    tree = {
        "name": "few",
        "sample_rate": 1000.0,
        "input": {"x": {"bits": 5, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"taps": taps, "decimate": factor},
        "output": {"bits": 7, "range": [-1.0, 1.0], "signed": True},
        "hardware": {"start": start, "clock": 1e3, "architecture": "parallel"},
    }
    core = proven_alone(sosmith.design(sosmith.Specification.load(tree)))
    assert rejection(check_polyphase, core, core.text) == ""
    text = changed(core.text, r"first0 <= [^;]+;", f"first0 <= {choice};")
    reset = "if (!aresetn) {0} <= 5'h00;\n    else if" if start == "zero" else "if"
    for number, name in enumerate(line):
        process = f"  always_ff @(posedge aclk)\n    {reset.format(name)} (enters) {name} <= line{number};\n"
        text = changed(text, rf"  reg \[4:0\] line{number} = 5'h00;\n", rf"\g<0>  reg [4:0] {name} = 5'h00;\n{process}")
    assert outputs(text, 400, 1) != outputs(core.text, 400, 1)
    assert rejection(check_polyphase, core, text)


def test_a_certificate_that_says_otherwise() -> None:
    core = made()
    for factor in (2, 4):
        other = core.certificate.model_copy(update={"downsampling": DownsamplingEntry(factor=factor, filled=0)})
        with pytest.raises(RejectedError, match=r"\bmust\b"):
            check_polyphase(core.text, other, core.item)
    filled = core.certificate.model_copy(update={"downsampling": DownsamplingEntry(factor=3, filled=6)})
    with pytest.raises(RejectedError, match=r"^no result must be settling where the first sample fills the filter$"):
        check_polyphase(core.text, filled, core.item)


@pytest.mark.parametrize(
    ("port", "bits", "first"), [("s_axis_tdata", "[7:0] ", "8'h00"), ("s_axis_tvalid", "", "1'h0")]
)
def test_a_register_is_not_taken_for_a_port_of_its_name(port: str, bits: str, first: str) -> None:
    core = made()
    text = changed(core.text, rf"(module little\([^;]*?){port}", r"\1other")
    text = changed(
        text,
        rf"  input {re.escape(bits)}{port};\n  wire {re.escape(bits)}{port};\n",
        f"  input {bits}other;\n  wire {bits}other;\n  reg {bits}{port} = {first};\n",
    )
    process = "  always_ff @(posedge aclk)\n"
    text = text.replace(process, f"{process}    {port} <= other;\n{process}", 1)
    with pytest.raises(RejectedError, match=r"^the ports must be aclk, aresetn, .*, not .*other.*$"):
        check_polyphase(text, core.certificate, core.item)
