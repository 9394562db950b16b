"""DACs with an SPI: their frames and their timing, by their data sheets.

=======  ================================================================================
MCP4921  Microchip DS21897A: AC characteristics (timing), section 5.0 (frame)
=======  ================================================================================

They take SPI mode 0, the highest bit first, and give their output when CS rises, with LDAC at ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from sosmith.model.converters.spi_converter import Timing, ns

DAC_FRAME_BITS = 16
"""Bits of a frame."""


@dataclass(frozen=True, kw_only=True)
class SpiDac:
    """A DAC of one channel with an SPI.

    Attributes
    ----------
    title : str
        Name in the data sheet.
    command : int
        Bits of the frame above the word.
    width : int
        Bits of a word, which has no sign.
    timing : Timing
        Limits of its SPI.
    """

    title: str
    command: int
    width: int
    timing: Timing

    inputs: ClassVar[int] = 1
    lowest: ClassVar[int] = 0

    @property
    def highest(self) -> int:
        """Largest word."""
        return (1 << self.width) - 1


SPI_DACS = {
    # channel A, without buffer of the reference, gain 1, on; 12 bits. Settled in 4.5 us: 222 kS/s
    "mcp4921": SpiDac(
        title="MCP4921",
        command=0b0011,
        width=12,
        timing=Timing(
            clock=Fraction(20_000_000),
            high=15 * ns,
            low=15 * ns,
            select=40 * ns,
            deselect=15 * ns,
            setup=15 * ns,
            hold=10 * ns,
            valid=0 * ns,
        ),
    ),
}
"""DACs by their names in a specification."""
