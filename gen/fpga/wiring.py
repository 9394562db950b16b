"""What a board's top needs of its board beside clock, serial line and LEDs: pins of converters, and another clock."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.fpga.boards import Board
from sosmith.hdl.boards.pll import Pll
from sosmith.model.errors import SpecificationError

_BUS_PINS = 3
_ROW = 4


@dataclass(frozen=True, kw_only=True)
class Wiring:
    """What a board's top needs of its board.

    Attributes
    ----------
    selects : int
        Chip selects of converters on an SPI; 0 without one.
    audio : bool
        Whether there is an I2S.
    lines_in, lines_out : int
        Its data lines from ADCs and to DACs.
    dac_selects : int
        Chip selects of DACs on an SPI of their own.
    pll : Pll or None
        What makes the clock; None for that of the board.
    """

    selects: int = 0
    audio: bool = False
    lines_in: int = 0
    lines_out: int = 0
    dac_selects: int = 0
    pll: Pll | None = None

    def clock(self, board: Board) -> Fraction:
        """Return the clock of the design on a board, in Hz."""
        return Fraction(board.clock) if self.pll is None else self.pll.clock

    def audio_pins(self, board: Board) -> dict[str, tuple[str, ...]]:
        """Return the pins of the I2S; each clock has one for DACs and one for ADCs.

        Raises
        ------
        SpecificationError
            If the board has too few.
        """
        if not self.audio:
            return {}
        rows, rest = board.audio[: 2 * _ROW], list(board.audio[2 * _ROW :])
        more_out, more_in = max(self.lines_out - 1, 0), max(self.lines_in - 1, 0)
        if not rows or more_out + more_in > len(rest):
            most = 0 if not rows else 2 + len(rest)
            raise SpecificationError(
                f"audio converters must be at most {most} on the {board.title}, not {self.lines_in + self.lines_out}"
            )
        clocks = {name: (rows[n], rows[n + _ROW]) for n, name in enumerate(("mclk", "lrck", "bclk"))}
        dout = (rows[_ROW - 1], *rest[:more_out])[: self.lines_out]
        din = (rows[2 * _ROW - 1], *rest[more_out : more_out + more_in])[: self.lines_in]
        return clocks | {name: pins for name, pins in (("dout", dout), ("din", din)) if pins}

    def dac_pins(self, board: Board) -> dict[str, tuple[str, ...]]:
        """Return the pins of the DACs' SPI, from the last ones of the header on, without those that others take.

        Raises
        ------
        SpecificationError
            If the board has too few.
        """
        if not self.dac_selects:
            return {}
        others = (self.audio_pins(board), self.spi_pins(board))
        taken = {pin for used in others for pins in used.values() for pin in pins}
        free = [pin for pin in reversed(board.header) if pin not in taken]
        most = max(len(free) - 2, 0)
        if self.dac_selects > most:
            raise SpecificationError(f"DACs must be at most {most} on the {board.title}, not {self.dac_selects}")
        sck, mosi, *selects = free
        return {"dac_sck": (sck,), "dac_mosi": (mosi,), "dac_cs_n": tuple(selects[: self.dac_selects])}

    def spi_pins(self, board: Board) -> dict[str, tuple[str, ...]]:
        """Return the pins of the SPI, without those that the I2S takes.

        Raises
        ------
        SpecificationError
            If the board has too few.
        """
        taken = {pin for pins in self.audio_pins(board).values() for pin in pins}
        selects = [pin for pin in board.header[_BUS_PINS:] if pin not in taken]
        if self.selects > len(selects):
            raise SpecificationError(
                f"converters must be at most {len(selects)} on the {board.title}, not {self.selects}"
            )
        if not self.selects:
            return {}
        sck, mosi, miso = board.header[:_BUS_PINS]
        return {"sck": (sck,), "mosi": (mosi,), "miso": (miso,), "cs_n": tuple(selects[: self.selects])}


PLAIN = Wiring()
"""A board without converters, with its own clock."""
