"""Pins for converters on boards, and the clock of a PLL, in the files that Amaranth's platforms write."""

import re
from pathlib import Path

import pytest

from sosmith.gen.fpga.boards import BOARDS
from sosmith.gen.fpga.platform_plan import board_plan, text_of
from sosmith.gen.fpga.wiring import Wiring
from sosmith.hdl.boards.pll import pll_near
from sosmith.model.errors import SpecificationError

TOP = """\
module tiny(input clk, rst, rx, din, miso, output tx, mclk, lrck, bclk, dout, sck, mosi, cs_n, output [2:0] leds);
endmodule
"""
CELLS = {"ulx3s_25f": "EHXPLLL", "icebreaker": "SB_PLL40_PAD", "tang_nano_9k": "rPLL", "tang_nano_20k": "rPLL"}


@pytest.mark.parametrize("name", CELLS)
def test_converters_have_their_pins_and_their_clock(name: str) -> None:
    board = BOARDS[name]
    device = board.device
    pll = pll_near(device.family, device.title.split()[-1], board.clock, 512 * 48_000)
    wiring = Wiring(selects=1, audio=True, lines_in=1, lines_out=1, pll=pll)
    plan = board_plan(TOP, "tiny", "tiny_board", board, wiring)
    constraints = next(text_of(plan, file) for file in plan.files if Path(file).suffix in {".lpf", ".pcf", ".cst"})
    for signal, pins in (wiring.audio_pins(board) | wiring.spi_pins(board)).items():
        for pin in pins:
            assert re.search(rf"{signal}.*\b{pin}\b", constraints), signal
    assert f"\\{CELLS[name]} " in text_of(plan, "tiny_board.il")
    assert f"--freq {float(pll.clock) / 1e6:g} " in text_of(plan, "build_tiny_board.sh")


def test_a_board_has_pins_for_so_many_converters() -> None:
    def refused(message: str, wiring: Wiring, board: str) -> None:
        with pytest.raises(SpecificationError, match=rf"^{re.escape(message)}$"):
            wiring.spi_pins(BOARDS[board])

    assert len(Wiring(selects=21).spi_pins(BOARDS["icestick"])["cs_n"]) == 21
    refused("converters must be at most 21 on the iCEstick, not 22", Wiring(selects=22), "icestick")
    refused("converters must be at most 0 on the UPduino 3, not 1", Wiring(selects=1), "upduino")
    stereo = Wiring(selects=2, audio=True, lines_in=1, lines_out=1)
    refused("converters must be at most 1 on the Tang Nano 9K, not 2", stereo, "tang_nano_9k")
    many = Wiring(audio=True, lines_in=2, lines_out=1)
    refused("audio converters must be at most 2 on the Tang Nano 9K, not 3", many, "tang_nano_9k")
    refused("audio converters must be at most 0 on the UPduino 3, not 3", many, "upduino")
    for board in BOARDS.values():
        assert len(set(board.header)) == len(board.header)
        assert len(set(board.audio)) == len(board.audio)


def test_the_pins_of_a_pmod_are_in_its_order() -> None:
    wiring = Wiring(selects=20, audio=True, lines_in=2, lines_out=3)
    audio = wiring.audio_pins(BOARDS["ulx3s_25f"])
    assert audio == {
        "mclk": ("U18", "U17"),
        "lrck": ("N17", "P16"),
        "bclk": ("N16", "M17"),
        "dout": ("L16", "H18", "H17"),
        "din": ("L17", "F17"),
    }
    pmod = Wiring(selects=13, audio=True, lines_in=1, lines_out=1)
    spi = pmod.spi_pins(BOARDS["icebreaker"])["cs_n"]
    assert not set(spi) & {pin for pins in pmod.audio_pins(BOARDS["icebreaker"]).values() for pin in pins}


def test_dacs_have_what_is_left_of_a_header() -> None:
    wiring = Wiring(selects=2, audio=True, lines_in=1, dac_selects=1)
    board = BOARDS["icebreaker"]
    others = wiring.audio_pins(board) | wiring.spi_pins(board)
    taken = {pin for pins in others.values() for pin in pins}
    dacs = wiring.dac_pins(board)
    assert dacs == {"dac_sck": ("18",), "dac_mosi": ("20",), "dac_cs_n": ("23",)}
    assert not taken & {pin for pins in dacs.values() for pin in pins}
    with pytest.raises(SpecificationError, match=r"^DACs must be at most 6 on the Tang Nano 9K, not 10$"):
        Wiring(selects=1, dac_selects=10).dac_pins(BOARDS["tang_nano_9k"])
