"""Audio converters with an I2S: their words, clocks and timing, by their data sheets.

=========  ================================================================================================
PCM1808    Texas Instruments SLES177A, figure 22 (interface timing in slave mode); rates of its system clock
CS5343     Cirrus Logic DS687, its clock ratios as in Digilent's reference manual of the Pmod I2S2
PCM5102A   Texas Instruments SLAS764B, tables 3 and 7, which are those of SLAS859 for the A version
CS4344     Cirrus Logic DS613PP2, switching characteristics of the serial audio interface
=========  ================================================================================================

All are slaves here: the board makes the master clock MCLK (SCKI, SCK), the bit clock BCLK (BCK, SCLK) and LRCK. The
data sheets agree on the format: LRCK is low for the left word; words are two's complement, the highest bit first, a bit
behind the edge of LRCK; data changes at falling edges of BCLK and is taken at rising ones. MCLK may have any phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from sosmith.model.converters.spi_converter import ns

Rates = tuple[tuple[int, int], ...]
"""Lowest and highest sample rates in Hz."""

MAX_WIDTH = 24
"""Bits of a word."""


@dataclass(frozen=True, kw_only=True)
class I2sTiming:
    """Limits of an I2S, in s.

    Attributes
    ----------
    pulse : Fraction
        Shortest time that BCLK is high, and low.
    pulse_mclk : Fraction
        The same in periods of MCLK.
    before, after : Fraction
        Shortest time between an edge of LRCK and a rising edge of BCLK, before that and behind it.
    setup, hold : Fraction
        Shortest time that the data of a DAC is stable before and behind a rising edge of BCLK.
    early, valid : Fraction
        From a falling edge of BCLK on, or an edge of LRCK: how long before it the data of an ADC may change, and the
        longest time to valid data.
    """

    pulse: Fraction = Fraction(0)
    pulse_mclk: Fraction = Fraction(0)
    before: Fraction
    after: Fraction
    setup: Fraction = Fraction(0)
    hold: Fraction = Fraction(0)
    early: Fraction = Fraction(0)
    valid: Fraction = Fraction(0)


@dataclass(frozen=True, kw_only=True)
class I2sConverter:
    """A stereo converter with an I2S: two channels on a data line.

    Attributes
    ----------
    title : str
        Name in the data sheet.
    is_dac : bool
        Whether it takes words, rather than gives them.
    ratios : tuple of tuple
        Periods of MCLK in a sample that it allows, and the sample rates for each.
    timing : I2sTiming
        Limits of its I2S.
    width : int
        Bits of a word that are used, the highest ones.
    """

    title: str
    is_dac: bool
    ratios: tuple[tuple[int, Rates], ...]
    timing: I2sTiming
    width: int = MAX_WIDTH

    inputs: ClassVar[int] = 2
    low: ClassVar[int] = 0
    signed: ClassVar[bool] = True
    zeros: ClassVar[tuple[int, ...]] = ()
    summary: ClassVar[None] = None
    step: ClassVar[None] = None

    @property
    def lowest(self) -> int:
        """Smallest word."""
        return -(1 << (self.width - 1))

    @property
    def highest(self) -> int:
        """Largest word."""
        return (1 << (self.width - 1)) - 1

    def allows(self, ratio: int, sample_rate: Fraction) -> bool:
        """Return whether it runs with so many periods of MCLK in a sample, at a sample rate in Hz."""
        return any(low <= sample_rate <= high for low, high in dict(self.ratios).get(ratio, ()))


_PCM1808_RATES = ((8_000, 96_000),)
# The common rates, with a tolerance of 4 %.
_PCM5102A_RATES = tuple(
    (rate * 96 // 100, rate * 104 // 100) for rate in (8_000, 16_000, 32_000, 44_100, 48_000, 88_200, 96_000)
)

I2S_CONVERTERS = {
    "pcm1808": I2sConverter(
        title="PCM1808",
        is_dac=False,
        ratios=tuple((ratio, _PCM1808_RATES) for ratio in (256, 384, 512)),
        timing=I2sTiming(pulse_mclk=Fraction(3, 2), before=50 * ns, after=10 * ns, early=10 * ns, valid=40 * ns),
    ),
    "cs5343": I2sConverter(
        title="CS5343",
        is_dac=False,
        ratios=(
            (256, ((4_000, 24_000), (43_000, 54_000), (86_000, 108_000))),
            (384, ((4_000, 24_000), (43_000, 54_000), (86_000, 108_000))),
            (512, ((43_000, 54_000),)),
        ),
        # not confirmed: those of the PCM1808, which are slower than any figure of the CS4344
        timing=I2sTiming(pulse=20 * ns, before=50 * ns, after=20 * ns, early=10 * ns, valid=40 * ns),
    ),
    "pcm5102a": I2sConverter(
        title="PCM5102A",
        is_dac=True,
        ratios=tuple((ratio, _PCM5102A_RATES) for ratio in (256, 384, 512)),
        timing=I2sTiming(pulse=16 * ns, before=8 * ns, after=8 * ns, setup=8 * ns, hold=8 * ns),
    ),
    "cs4344": I2sConverter(
        title="CS4344",
        is_dac=True,
        ratios=(
            (256, ((2_000, 50_000), (84_000, 134_000))),
            (384, ((2_000, 50_000), (84_000, 134_000))),
            (512, ((42_000, 67_000),)),
        ),
        timing=I2sTiming(pulse=20 * ns, before=20 * ns, after=20 * ns, setup=20 * ns, hold=20 * ns),
    ),
}
"""Converters by their names in a specification."""
