"""Bitstreams, between commands: one from the same files and programs is made once, and any other one is made."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from tests.gen.fpga.stubs import REPORT, Stub

from sosmith.gen.fpga import bitstream, kept_bitstreams
from sosmith.gen.fpga.bitstream import Bitstream, build
from sosmith.gen.fpga.boards import find_board
from sosmith.model.errors import ToolError

CACHE_FOLDER = kept_bitstreams.cache_folder
TOP = "module tiny(input clk, rst, rx, output tx, output [2:0] leds); assign tx = rx; assign leds = 0; endmodule\n"
MADE = ["yosys", "nextpnr-ice40", "icepack"]

Called = Callable[..., tuple[Bitstream, list[str]]]


@pytest.fixture
def called(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Called:
    """Build with stubs in place of the programs; return what was made, and the programs that were called for it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(kept_bitstreams, "cache_folder", CACHE_FOLDER)

    def built(
        text: str = TOP, board: str = "icestick", fails: str | None = None, version: str = "1.2"
    ) -> tuple[Bitstream, list[str]]:
        calls: list[list[str]] = []
        monkeypatch.setattr(bitstream, "find_tool", lambda name: Stub(name, calls, REPORT, fails, version))
        return build(text, "tiny", find_board(board)), [call[0] for call in calls]

    return built


def test_a_second_build_calls_no_program_and_is_the_same(called: Called) -> None:
    first, programs = called()
    assert programs == MADE
    assert called() == (first, [])


def test_another_design_board_or_version_is_made(called: Called) -> None:
    called()
    assert called(TOP.replace("leds = 0", "leds = 1"))[1] == MADE
    assert called(board="icebreaker")[1] == MADE
    made, programs = called(version="1.3")
    assert programs == MADE
    assert set(made.versions.values()) == {"1.3"}


def test_what_failed_is_tried_again(called: Called) -> None:
    with pytest.raises(ToolError, match=r"^yosys 1\.2 failed:\n"):
        called(fails="ERROR: no such thing")
    assert called()[1] == MADE


def test_a_file_that_has_changed_counts_as_none(called: Called, tmp_path: Path) -> None:
    first, _ = called()
    (file,) = (tmp_path / "sosmith" / "bitstreams").iterdir()
    text = file.read_text(encoding="utf-8")
    assert "70.1" in text
    file.write_text(text.replace("70.1", "99.1"), encoding="utf-8")
    assert called() == (first, MADE)
    assert called() == (first, [])


def test_without_a_place_to_keep_it_each_one_is_made(called: Called, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_bitstreams, "cache_folder", lambda: None)
    assert [called()[1], called()[1]] == [MADE, MADE]
