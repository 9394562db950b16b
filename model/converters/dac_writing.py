"""From the codes of an output to the words of a DAC, as the front-end of a board computes them.

A code n is the word ``offset + gain * n``, with whole numbers offset and gain, so that nothing is rounded; beyond the
range of the DAC it is the nearest word.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from sosmith.model.converters.i2s_converter import I2sConverter
from sosmith.model.converters.reading import UnfitReadingError
from sosmith.model.converters.spi_dac import SpiDac
from sosmith.model.port import Port

if TYPE_CHECKING:
    from sosmith.model.arrays import Codes

_MAX_GAIN = 1 << 32


@dataclass(frozen=True)
class Writing:
    """How an output is written to a DAC.

    Attributes
    ----------
    converter : I2sConverter or SpiDac
        The DAC.
    port : Port
        The output.
    offset, gain : int
        A code n is the word ``offset + gain * n``.

    Examples
    --------
    >>> from sosmith.model.converters.i2s_converter import I2S_CONVERTERS
    >>> port = Port.from_range("y", 16, Fraction(-2), Fraction(2), signed=True)
    >>> writing = Writing.of(I2S_CONVERTERS["pcm5102a"], port, (Fraction(-1), Fraction(1)))
    >>> writing.offset, writing.gain, writing.word(-3), writing.word(20_000)
    (0, 512, -1536, 8388607)
    """

    converter: I2sConverter | SpiDac
    port: Port
    offset: int
    gain: int

    @classmethod
    def of(cls, converter: I2sConverter | SpiDac, port: Port, span: tuple[Fraction, Fraction]) -> Writing:
        """Return how a port is written to a DAC.

        Parameters
        ----------
        converter : I2sConverter or SpiDac
            The DAC.
        port : Port
            The output.
        span : tuple of Fraction
            Values of the output at the ends of the DAC's range, rising: at its lowest word, and a step above its
            highest.

        Raises
        ------
        UnfitReadingError
            If an LSB is no whole number of steps of the DAC, or code 0 lies between two words.
        """
        step = (span[1] - span[0]) / 2**converter.width
        gain, offset = port.lsb / step, (port.zero - span[0]) / step + converter.lowest
        if gain.denominator != 1:
            raise UnfitReadingError(f"an LSB of {port.name} of a whole number of its steps", f"of {float(gain):.9g}")
        if offset.denominator != 1:
            raise UnfitReadingError(f"the code 0 of {port.name} at one of its words", f"at {float(offset):.9g}")
        if abs(offset) > _MAX_GAIN or gain > _MAX_GAIN:
            raise UnfitReadingError(f"a range of the size of that of {port.name}", "a far smaller one")
        return cls(converter, port, int(offset), int(gain))

    def word(self, code: int) -> int:
        """Return the word for a code."""
        return min(max(self.offset + self.gain * code, self.converter.lowest), self.converter.highest)

    def words(self, codes: Codes) -> Codes:
        """Return the words for codes, of the same shape."""
        return (self.offset + self.gain * codes).clip(self.converter.lowest, self.converter.highest)
