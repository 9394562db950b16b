"""Boards with converters: when these are read, what is refused, and their pins."""

import re
from dataclasses import replace
from fractions import Fraction

import pytest
from tests.gen.output.converter_board import SPEC

import sosmith
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.fpga.boards import BOARDS
from sosmith.gen.fpga.wiring import Wiring
from sosmith.gen.output.board_top import schedule_of, wiring_of
from sosmith.model.errors import SpecificationError

CLOCK = Fraction(12_000_000)


@pytest.fixture(scope="module")
def made() -> CoreDesign:
    return sosmith.design(SPEC).core


def test_clocks_and_intervals_follow_from_the_data_sheets(made: CoreDesign) -> None:
    schedule = schedule_of(made, CLOCK)
    assert [(each.offset, each.gain) for each in schedule.readings] == [(0, 16), (1024, 8)]
    assert schedule.half == 6  # 1 MHz
    assert schedule.deselect == 6  # 500 ns
    assert schedule.intervals == (1, 11)  # more than 100 ms
    assert schedule.first == 19  # 200 ms at the end of the 20th period
    assert schedule.selects == (2, 5)
    assert wiring_of(made, BOARDS["icebreaker"]) == Wiring(selects=7)


def test_a_higher_supply_is_faster(made: CoreDesign) -> None:
    voltage, temperature = made.spec.converters
    fast = replace(made, spec=replace(made.spec, converters=(replace(voltage, supply=Fraction(5)), temperature)))
    assert schedule_of(fast, CLOCK).half == 3  # 2 MHz


def test_what_does_not_fit_is_refused(made: CoreDesign) -> None:
    def refused(message: str, design: CoreDesign, clock: Fraction = CLOCK) -> None:
        with pytest.raises(SpecificationError, match=rf"^{re.escape(message)}$"):
            schedule_of(design, clock)

    quick = replace(made, spec=replace(made.spec, sample_rate=Fraction(5000)))
    refused(
        "the sample rate must be at most 3,559 Hz with these converters at a clock of 12,000,000 Hz, not 5,000 Hz",
        quick,
    )
    alone = design_core(made.spec, core="filter")
    refused("the core must have the inputs voltage and temperature of the converters, not clearance_in", alone)
    many = replace(made, spec=replace(made.spec, channels=121))
    refused("inputs of all channels must be at most 241 with converters, not 242", many)
