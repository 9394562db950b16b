"""The page of the boards: its tables are those of the platforms and of the record; the examples fit where they must."""

import pytest
from benchmarks import boards

from sosmith.gen.fpga.boards import BOARDS

RECORD = boards.read()


def test_the_tables_are_up_to_date() -> None:
    text = boards.DOCUMENT.read_text(encoding="utf-8")
    assert boards.PARTS["boards"].findall(text) == [boards.board_table()]
    assert boards.PARTS["headers"].findall(text) == [boards.header_table()]
    assert boards.PARTS["converters"].findall(text) == [boards.converter_table()]
    assert boards.PARTS["dacs"].findall(text) == [boards.dac_table()]
    assert boards.PARTS["audio"].findall(text) == [boards.audio_table()]
    assert boards.PARTS["audio pins"].findall(text) == [boards.audio_pin_table()]
    assert boards.PARTS["audio clocks"].findall(text) == [boards.audio_clock_table()]
    assert boards.PARTS["faults"].findall(text) == [boards.fault_list()]
    assert boards.PARTS["built"].findall(text) == [boards.built_table(RECORD)]


def test_every_build_that_is_listed_is_recorded_once() -> None:
    recorded = [(row["example"], row["channels"], row["board"]) for row in RECORD]
    assert recorded == list(boards.BUILDS)


def test_each_example_closes_timing_on_five_boards_of_four_families() -> None:
    for example, channels in boards.DESIGNS:
        closed = [
            row["board"]
            for row in RECORD
            if (row["example"], row["channels"]) == (example, channels) and row.get("passed")
        ]
        assert len(closed) >= 5
        assert len({BOARDS[board].device.family for board in closed}) == 4


def test_audio_closes_timing_on_three_families() -> None:
    closed = [row["board"] for row in RECORD if row["example"] == boards.AUDIO[0] and row.get("passed")]
    assert {BOARDS[board].device.family for board in closed} == {"ice40", "ecp5", "gowin"}


def test_twelve_channels_fit_the_up5k_and_one_the_hx1k() -> None:
    passed = {(row["example"], row["channels"], row["board"]) for row in RECORD if row.get("passed")}
    assert ("flange_wear_locomotive", 12, "icebreaker") in passed
    assert ("flange_wear_locomotive", 1, "icestick") in passed


def test_builds_take_less_than_three_minutes_of_two_cores_by_their_processor_time() -> None:
    assert all(row["processor_seconds"] < 180 for row in RECORD if row.get("passed"))


def test_another_bitstream_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    row = {"example": "audio_lowpass", "channels": 1, "board": "icestick", "bitstream_sha256": "ab"}
    monkeypatch.setattr(boards, "built", lambda *_: row)
    assert boards.differences([row]) == []
    monkeypatch.setattr(boards, "built", lambda *_: {**row, "bitstream_sha256": "cd"})
    assert boards.differences([row]) == [
        "audio_lowpass, 1 channels, icestick: the bitstream must be the one recorded, byte for byte, not another one"
    ]
