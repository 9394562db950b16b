"""From the frames of a converter to the codes of an input, and back: what the front-end of a board computes.

A reading n is the code ``offset + gain * n`` of the input, with whole numbers offset and gain: the input's LSB divides
the converter's step, and its code 0 is a whole number of LSB away from the converter's 0. So nothing is rounded.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from sosmith.model.converters.i2s_converter import I2sConverter
from sosmith.model.converters.spi_converter import THERMOCOUPLE_FAULTS, Converter, ReadingFault
from sosmith.model.port import Port

if TYPE_CHECKING:
    from sosmith.model.arrays import Codes


class UnfitReadingError(ValueError):
    """A converter whose readings are not codes of an input: what it must have, and what it has."""

    def __init__(self, expected: str, found: str) -> None:
        self.expected, self.found = expected, found
        super().__init__(f"the converter must have {expected}, not {found}")


@dataclass(frozen=True)
class Reading:
    """How an input is read from a converter.

    Attributes
    ----------
    converter : Converter or I2sConverter
        The converter.
    port : Port
        The input.
    offset, gain : int
        A reading n is the code ``offset + gain * n``.

    Examples
    --------
    >>> from fractions import Fraction
    >>> from sosmith.model.converters.spi_converter import CONVERTERS
    >>> port = Port.from_range("temperature", 16, Fraction(0), Fraction(128), unit="degC")
    >>> reading = Reading.of(CONVERTERS["max31855"], port)
    >>> reading.offset, reading.gain
    (0, 128)
    >>> reading.code(100 << 18)  # 25 degC
    (12800, ())
    """

    converter: Converter | I2sConverter
    port: Port
    offset: int
    gain: int

    @classmethod
    def of(
        cls, converter: Converter | I2sConverter, port: Port, span: tuple[Fraction, Fraction] | None = None
    ) -> Reading:
        """Return how a port is read from a converter.

        Parameters
        ----------
        converter : Converter or I2sConverter
            The converter.
        port : Port
            The input, in degC for a converter of temperatures.
        span : tuple of Fraction or None
            Values of the input at the lowest reading and a step above the highest one, rising; None for a converter of
            temperatures.

        Raises
        ------
        UnfitReadingError
            If a step is no whole number of LSB, or reading 0 lies between two codes.
        """
        if span is None:
            assert converter.step is not None
            zero, step = Fraction(0), converter.step
        else:
            step = (span[1] - span[0]) / 2**converter.width
            zero = span[0] - converter.lowest * step
        gain, offset = step / port.lsb, (zero - port.zero) / port.lsb
        if gain.denominator != 1:
            raise UnfitReadingError(f"steps of a whole number of LSB of {port.name}", f"of {_shown(gain)}")
        if offset.denominator != 1:
            raise UnfitReadingError(f"its reading 0 at a code of {port.name}", f"at {_shown(offset)}")
        if abs(offset) > _MAX_OFFSET or gain > _MAX_OFFSET:
            raise UnfitReadingError(f"a range of the size of that of {port.name}", "a far larger one")
        return cls(converter, port, int(offset), int(gain))

    def code(self, frame: int) -> tuple[int | None, tuple[ReadingFault, ...]]:
        """Return the code that a frame means, None with any fault, and the faults."""
        device = self.converter
        reading = frame >> device.low & (1 << device.width) - 1
        if device.signed and reading >> (device.width - 1):
            reading -= 1 << device.width
        code = self.offset + self.gain * reading
        faults = []
        if device.summary is not None:
            faults = [fault for bit, fault in enumerate(THERMOCOUPLE_FAULTS) if frame >> bit & 1]
        unexplained = device.summary is not None and frame >> device.summary & 1 and not faults
        if unexplained or any(frame >> bit & 1 for bit in device.zeros):
            faults.append(ReadingFault.FRAME)
        if not self.port.lowest <= code <= self.port.highest:
            faults.append(ReadingFault.RANGE)
        return (None if faults else code), tuple(faults)

    def frames(self, codes: Codes) -> Codes:
        """Return the frames of a converter whose input has the values of codes of the port.

        The reading is the last one whose code is not above; at the ends of its range the converter stays there.
        """
        readings = (codes - self.offset) // self.gain
        device = self.converter
        readings = readings.clip(device.lowest, device.highest) & (1 << device.width) - 1
        return readings << device.low

    def held(self, frames: Iterable[int]) -> tuple[list[int], list[bool]]:
        """Return the codes of consecutive frames with the last good one in place of a bad one, and where those are.

        Before the first good one it is code 0.
        """
        codes, faulty, last = [], [], 0
        for frame in frames:
            code, faults = self.code(frame)
            last = last if code is None else code
            codes.append(last)
            faulty.append(bool(faults))
        return codes, faulty


_MAX_OFFSET = 1 << 32


def _shown(value: Fraction) -> str:
    return f"{float(value):.9g}"
