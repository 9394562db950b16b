"""Clocks for an I2S: dividers of PLLs within their limits, and the rates that boards make."""

import re
from dataclasses import replace
from fractions import Fraction

import pytest

import sosmith
from sosmith.gen.fpga.audio_clock import audio_pll
from sosmith.gen.fpga.boards import BOARDS
from sosmith.gen.output import board_build, identity
from sosmith.hdl.boards.pll import Pll, pll_near
from sosmith.model.converters.i2s_converter import I2S_CONVERTERS
from sosmith.model.converters.i2s_frame import I2sFrame
from sosmith.model.errors import SpecificationError

PAIR = [I2S_CONVERTERS["pcm1808"], I2S_CONVERTERS["cs4344"]]


def made(board: str, rate: float) -> tuple[Pll | None, float]:
    """Return the PLL, and the sample rate in ppm above the wanted one."""
    wanted, target = Fraction(rate), BOARDS[board]
    pll = audio_pll(target, PAIR, wanted)
    clock = Fraction(target.clock) if pll is None else pll.clock
    frame = I2sFrame.of(PAIR, clock=clock, sample_rate=wanted)
    return pll, 1e6 * float(frame.deviation(clock, wanted))


@pytest.mark.parametrize(
    ("board", "ppm"), [("ulx3s_25f", -286.2), ("icebreaker", 7080.1), ("tang_nano_9k", 540.6), ("tang_nano_20k", 540.6)]
)
def test_48_khz_on_boards(board: str, ppm: float) -> None:
    pll, off = made(board, 48_000)
    assert pll is not None
    assert pll.clock <= BOARDS[board].device.pll_limit
    assert round(off, 1) == ppm


def test_a_rate_that_the_board_makes_itself_needs_no_pll() -> None:
    assert made("ulx3s_25f", 48_828.125) == (None, 0.0)
    assert made("icebreaker", 23_437.5) == (None, 0.0)
    pll, off = made("icebreaker", 46_875)
    assert (pll is not None and pll.clock, off) == (24_000_000, 0.0)


def test_a_rate_that_no_clock_makes_is_refused() -> None:
    message = (
        "the sample rate must be one that CS4344 and PCM1808 can have at a clock of 12,000,000 Hz, to 1 %, of which "
        "23,437.5 Hz is the nearest, not 48,000 Hz"
    )
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        made("cmod_s7", 48_000)


@pytest.mark.parametrize(
    ("family", "reference", "vco", "detector"),
    [
        ("ecp5", 25_000_000, (400e6, 800e6), (10e6, 400e6)),
        ("ice40", 12_000_000, (533e6, 1066e6), (10e6, 133e6)),
        ("gowin", 27_000_000, (500e6, 1200e6), (3e6, 400e6)),
    ],
)
def test_dividers_keep_to_the_limits_of_the_pll(
    family: str, reference: int, vco: tuple[float, float], detector: tuple[float, float]
) -> None:
    for wanted in (22_579_200, 24_576_000, 36_864_000, 49_152_000):
        pll = pll_near(family, "any", reference, Fraction(wanted))
        own = Fraction(reference * pll.feedback * pll.scale, pll.divider)
        assert vco[0] <= own <= vco[1]
        assert detector[0] <= reference / pll.divider <= detector[1]
        assert abs(pll.clock / wanted - 1) < Fraction(1, 100)
        assert pll.clock == own / (pll.output * pll.scale)


@pytest.mark.parametrize(("board", "waits"), [("ulx3s_25f", True), (None, False)])
def test_the_link_waits_for_a_pll(board: str | None, waits: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The link of a board whose clock is its own has no reset."""
    own = replace(BOARDS["ulx3s_25f"], clock=24_576_000)
    given: list[bool] = []
    monkeypatch.setattr(identity, "core_verilog", lambda design: "")
    monkeypatch.setattr(board_build, "board_verilog", lambda design, *, waits, **others: given.append(waits) or "")
    board_build.texts(sosmith.design(LIVE).core, BOARDS[board] if board else own, 1_000_000, lambda step: None)
    assert given == [waits]


LIVE = {
    "name": "stereo",
    "sample_rate": 48000,
    "channels": 2,
    "input": {"x": {"bits": 16, "signed": True, "range": [-1.0, 1.0]}},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 3000.0},
    "output": {"bits": 16, "signed": True, "range": [-1.0, 1.0]},
    "converter": {"x": {"device": "pcm1808"}, "output": {"device": "pcm5102a"}},
    "hardware": {"clock": 24.576e6},
}
