"""The clock for an I2S on a board: its own, or the one of its PLL that comes nearest to the sample rate."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from sosmith.gen.fpga.boards import Board
from sosmith.hdl.boards.pll import Pll, pll_near
from sosmith.model.converters.i2s_converter import I2sConverter
from sosmith.model.converters.i2s_frame import I2sFrame
from sosmith.model.errors import SpecificationError

_SLOWEST = 20_000_000
"""Lowest clock in Hz that a PLL is asked for: the core has time, and the line is fast."""

_FRAMES = (512, 768, 1024, 1536, 2048)
"""Clocks of frames that a PLL is asked for."""


def audio_pll(board: Board, devices: Sequence[I2sConverter], sample_rate: Fraction) -> Pll | None:
    """Return the PLL that a board needs for audio converters; None if its own clock is as near to the sample rate.

    Parameters
    ----------
    board : Board
        The board.
    devices : sequence of I2sConverter
        All converters at the I2S.
    sample_rate : Fraction
        Wanted sample rate in Hz.

    Raises
    ------
    SpecificationError
        If neither is near enough.
    """
    device = board.device
    targets = [sample_rate * clocks for clocks in _FRAMES if _SLOWEST <= sample_rate * clocks <= device.pll_limit]
    plls = [pll_near(device.family, device.title.split()[-1], board.clock, target) for target in targets]
    best: tuple[Fraction, Pll | None] | None = None
    refused: list[SpecificationError] = []
    for pll in (None, *plls):
        clock = Fraction(board.clock) if pll is None else pll.clock
        try:
            frame = I2sFrame.of(devices, clock=clock, sample_rate=sample_rate)
        except SpecificationError as error:
            refused.append(error)
            continue
        off = abs(frame.deviation(clock, sample_rate))
        if best is None or off < best[0]:
            best = off, pll
    if best is None:
        raise refused[0]
    return best[1]
