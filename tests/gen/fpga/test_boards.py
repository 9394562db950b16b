"""The table of boards."""

import re
from importlib import import_module

import pytest

from sosmith.gen.fpga.boards import BOARDS, find_board
from sosmith.model.errors import SpecificationError


def test_boards_are_found_by_name() -> None:
    assert all(find_board(name).name == name for name in BOARDS)
    families = {board.device.family for board in BOARDS.values()}
    assert families == {"ice40", "ecp5", "gowin", "gatemate", "xilinx"}


def test_hyphens_and_capitals_do_not_matter() -> None:
    assert find_board("Tang-Nano-9K") is BOARDS["tang_nano_9k"]
    assert find_board("ulx3s-85f") is BOARDS["ulx3s_85f"]


def test_a_name_that_is_nearly_right_is_suggested() -> None:
    with pytest.raises(SpecificationError, match=r", not icebraker \(did you mean icebreaker\?\)$"):
        find_board("icebraker")


def test_an_unknown_board_is_refused_with_those_that_exist() -> None:
    assert [*BOARDS][:2] == ["icebreaker", "upduino"]
    message = f"the board must be one of {', '.join(BOARDS)}, not kc705"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        find_board("kc705")


def test_pins_for_converters_are_at_a_connector() -> None:
    unchecked = set()
    for board in BOARDS.values():
        if not board.header:
            continue
        module, _, kind = (board.platform or "").partition(":")
        connectors = getattr(import_module(module), kind).connectors
        there = {pin for connector in connectors for pin in connector.mapping.values()}
        if not there:
            unchecked.add(board.name)
        else:
            assert {*board.header, *board.audio} <= there
    assert unchecked == {"tang_nano_9k", "tang_nano_20k"}  # amaranth-boards has no connectors of theirs


def test_what_a_device_lacks_is_told() -> None:
    up5k, ecp5 = find_board("icebreaker").device, find_board("colorlight_i5").device
    assert up5k.excess({"SB_LUT4": 5280, "SB_MAC16": 8, "SB_RAM40_4K": 30, "SB_CARRY": 9999}) == []
    assert up5k.excess({"SB_LUT4": 5281, "SB_MAC16": 13, "SB_RAM40_4K": 31}) == [
        "5,281 LUT4 of 5,280",
        "13 SB_MAC16 of 8",
        "31 SB_RAM40_4K of 30",
    ]
    assert ecp5.excess({"LUT4": 24000, "CCU2C": 100, "TRELLIS_DPR16X4": 22, "MULT18X18D": 28}) == []
    assert ecp5.excess({"LUT4": 24000, "CCU2C": 100, "TRELLIS_DPR16X4": 23}) == ["24,292 LUT4 of 24,288"]
