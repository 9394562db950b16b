"""Where samples are in a core whose sections take turns: how far they are apart, and what is refused."""

from __future__ import annotations

import pytest
from tests.verify.multiplexed.small_cores import made
from tests.verify.multirate.single_cores import changed

from sosmith.verify.graph import RejectedError
from sosmith.verify.multiplexed.turns import Turns, turns_of
from sosmith.verify.parallel.control import Buffer
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.reader.source import read_source


def netlist_of(text: str) -> Netlist:
    return flattened(read_source(text, "turns").modules, "aclk")


def test_positions_are_those_of_the_plan() -> None:
    core = made("three clocks a turn")
    found = turns_of(netlist_of(core.text))
    plan = core.design.core.architecture.plan
    assert found.interval == plan.interval == 6
    assert len(found.valid) == plan.depth + 1
    assert found.valid[0] == "s_axis_tvalid"
    assert found.names == {*found.valid[1:], "output_buffer.o_valid", "output_buffer.full", "rest"}


@pytest.mark.parametrize(("position", "other", "apart"), [(5, 8, True), (8, 5, True), (5, 7, False), (5, 5, False)])
def test_samples_are_an_interval_apart(position: int, other: int, apart: bool) -> None:
    turns = Turns((), Buffer("", "", "", ""), 3)
    assert turns.apart(position, other) is apart


@pytest.mark.parametrize(
    ("pattern", "by", "sentence"),
    [
        (r"reg rest = 1'h0", "reg rest = 1'h1", "rest must be 0 before the first clock, not 1"),
        (
            r"rest_or_enters = rest \| enters",
            "rest_or_enters = 1'h1",
            "rest must be 0 after a clock with aresetn = 1, output_buffer.full = 0, rest = 0, s_axis_tvalid = 0",
        ),
        (r"\brest\b", "pause", "the core must have a register rest"),
        (
            r"enters = s_axis_tvalid & [^;]*;",
            "enters = s_axis_tvalid;",
            "start.valid1 must be 0 after a clock with aresetn = 1, output_buffer.full = 0, rest = 1, "
            "s_axis_tvalid = 1, start.valid1 = 0",
        ),
    ],
)
def test_samples_that_move_otherwise_are_refused(pattern: str, by: str, sentence: str) -> None:
    text = made().text
    text = text.replace("rest", "pause") if by == "pause" else changed(text, pattern, by)
    with pytest.raises(RejectedError) as refused:
        turns_of(netlist_of(text))
    assert str(refused.value) == sentence
