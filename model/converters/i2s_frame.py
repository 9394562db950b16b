"""The clocks of an I2S, made from a board's clock: a frame holds the left and the right word of a sample.

::

    clock / (clocks / ratio)   = MCLK, `ratio` periods in a frame
    clock / (clocks / 64)      = BCLK, 64 bits in a frame
    clock / clocks             = LRCK, the sample rate
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from sosmith.model.converters.i2s_converter import I2sConverter
from sosmith.model.errors import SpecificationError

FRAME_BITS = 64
"""Bits of a frame, of which the left word has those from the second on, and the right word those from the 34th on."""

TOLERANCE = Fraction(1, 100)
"""Largest share by which the sample rate may differ from that of the specification."""

LATENCY = 2
"""Frames from the one in which an ADC sends a sample to the one in which a DAC gets its result."""

_RATIOS = (256, 384, 512)
_MULTIPLES = range(1, 17)


@dataclass(frozen=True, kw_only=True)
class I2sFrame:
    """The clocks of an I2S.

    Attributes
    ----------
    clocks : int
        Clocks of the board in a frame, a multiple of 128 and of twice `ratio`.
    ratio : int
        Periods of MCLK in a frame.

    Examples
    --------
    >>> from sosmith.model.converters.i2s_converter import I2S_CONVERTERS
    >>> I2sFrame.of([I2S_CONVERTERS["pcm1808"]], clock=Fraction(24_576_000), sample_rate=Fraction(48_000))
    I2sFrame(clocks=512, ratio=256)
    """

    clocks: int
    ratio: int

    @classmethod
    def of(cls, devices: Sequence[I2sConverter], *, clock: Fraction, sample_rate: Fraction) -> I2sFrame:
        """Return the clocks of converters, with the sample rate that is nearest to the wanted one.

        Parameters
        ----------
        devices : sequence of I2sConverter
            All converters at the I2S.
        clock : Fraction
            Clock of the board in Hz.
        sample_rate : Fraction
            Wanted sample rate in Hz.

        Raises
        ------
        SpecificationError
            If no sample rate within `TOLERANCE` can be made that all converters allow.
        """
        frames = [
            cls(clocks=2 * ratio * multiple, ratio=ratio)
            for ratio in _RATIOS
            for multiple in _MULTIPLES
            if all(device.allows(ratio, clock / (2 * ratio * multiple)) for device in devices)
        ]
        best = min(frames, key=lambda frame: (abs(frame.deviation(clock, sample_rate)), frame.ratio), default=None)
        if best is None or abs(best.deviation(clock, sample_rate)) > TOLERANCE:
            names = " and ".join(sorted({device.title for device in devices}))
            nearest = "none" if best is None else f"{float(clock / best.clocks):,.7g} Hz is the nearest"
            raise SpecificationError(
                f"the sample rate must be one that {names} can have at a clock of {float(clock):,.0f} Hz, to 1 %, "
                f"of which {nearest}, not {float(sample_rate):,.7g} Hz"
            )
        return best

    def deviation(self, clock: Fraction, sample_rate: Fraction) -> Fraction:
        """Return by which share the sample rate is above the wanted one."""
        return clock / self.clocks / sample_rate - 1

    @property
    def half_bit(self) -> int:
        """Clocks of half a period of BCLK."""
        return self.clocks // (2 * FRAME_BITS)

    @property
    def half_mclk(self) -> int:
        """Clocks of half a period of MCLK."""
        return self.clocks // (2 * self.ratio)
