"""How the checker of programs reads SystemVerilog: write ports, and parts of what is assigned."""

import re

import pytest
from tests.verify.program.programs import changed, number_of, small
from tests.verify.small_specifications import PLAIN

from sosmith.hdl.plan.instructions import encoded
from sosmith.model.dataflow.program import Opcode
from sosmith.verify.graph import RejectedError
from sosmith.verify.program.logic import Logic, _all, _any
from sosmith.verify.program.text import read_program


def test_the_parts_of_a_sum_that_is_assigned_to_several_signals() -> None:
    logic = Logic("  wire [2:0] high;\n  wire low;\n  assign { high, low } = 2'h3;\n")
    assert logic.value("low", {}) == [1]
    assert logic.value("high", {}) == [1, 0, 0]


def test_a_bit_that_decides_counts_beside_one_that_is_not_known() -> None:
    a, b = ("a", 0), ("b", 0)
    for of, decides in ((_any, 1), (_all, 0)):
        neutral = 1 - decides
        assert of([neutral, neutral]) == [neutral]
        assert of([decides, None]) == of([None, decides]) == of([a, decides, b]) == [decides]
        assert of([neutral, a]) == of([a, neutral, a]) == [a]
        assert of([a, b]) == of([a, None]) == of([neutral, None]) == [None]


def test_a_second_write_port_is_rejected() -> None:
    text = small(PLAIN).text
    (write,) = re.findall(r"^ *words0\[.*?\] <= .*;\n", text, re.MULTILINE)
    with pytest.raises(RejectedError, match=r"^the words must have one write port$"):
        read_program(text.replace(write, 2 * write))


def test_a_wrong_result_is_rejected() -> None:
    core = small(PLAIN)
    number = number_of(core, Opcode.GIVE)
    give = core.program.instructions[number]
    # Several bits, so that no other instruction is one bit away from this one.
    text = changed(core, number, encoded(give._replace(constant=give.constant ^ 0b10101), core.program))
    with pytest.raises(
        RejectedError, match=rf"^instruction {number} \(give, .*\) must give part 0 of .*, not another value$"
    ):
        core.check(text)
