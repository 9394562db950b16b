"""Converters with an SPI: their frames and their timing, by their data sheets.

========  ==============================================================================================
MCP3202   Microchip DS21034: table 1-1 (timing), section 5.1 and figure 5-1 (frame)
MCP3204   Microchip DS21298: table 1-1 (timing), section 5.0 and figure 5-1 (frame)
MAX31855  Maxim Integrated 19-5793: serial interface characteristics, table 2 (frame), serial interface
AD7476A   Analog Devices AD7476A/AD7477A/AD7478A, Rev. F: table 4 (timing), figures 3 and 24 (frame)
========  ==============================================================================================

All take SPI mode 0: data is taken at rising edges of SCK and changes at falling ones, the highest bit first.

The frames were compared with the data sheets' own pages (DS21034D and DS21298E, section 5; 19-5793, table 2). Those
with the tables of timing were not at hand: a comment beside a figure names a public repository that states it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from fractions import Fraction

ns = Fraction(1, 10**9)
ms = Fraction(1, 10**3)


class ReadingFault(IntEnum):
    """What can be wrong with a reading: number of its bit in the answer to ``CONVERTERS``."""

    OPEN = 0
    SHORT_TO_GROUND = 1
    SHORT_TO_SUPPLY = 2
    FRAME = 3
    RANGE = 4

    @property
    def meaning(self) -> str:
        """The meaning, as a sentence without its stop."""
        return _MEANINGS[self]


_MEANINGS = {
    ReadingFault.OPEN: "the thermocouple is open",
    ReadingFault.SHORT_TO_GROUND: "the thermocouple is shorted to ground",
    ReadingFault.SHORT_TO_SUPPLY: "the thermocouple is shorted to the supply",
    ReadingFault.FRAME: "a bit that is always 0 is 1, as it is without a converter at a line with a pull-up",
    ReadingFault.RANGE: "the reading is outside the range of the input",
}

THERMOCOUPLE_FAULTS = (ReadingFault.OPEN, ReadingFault.SHORT_TO_GROUND, ReadingFault.SHORT_TO_SUPPLY)
"""Faults that a MAX31855 tells itself, by the bits of its frame from the lowest on."""


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Limits of an SPI, in s and Hz.

    Attributes
    ----------
    clock : Fraction
        Highest frequency of SCK, in Hz.
    high, low : Fraction
        Shortest time that SCK is high, and low.
    select : Fraction
        Shortest time from the falling edge of CS to the first rising one of SCK.
    deselect : Fraction
        Shortest time that CS is high between two frames.
    setup, hold : Fraction
        Shortest time that the command is stable before and after a rising edge of SCK.
    valid : Fraction
        Longest time from a falling edge of SCK, or of CS, to a valid output.
    conversion : Fraction
        Longest time of a conversion, which begins when CS rises and is lost when CS falls before its end; 0 where
        the frame itself is the conversion.
    power_up : Fraction
        Longest time from power-up to the end of the first conversion.
    """

    clock: Fraction
    high: Fraction
    low: Fraction
    select: Fraction
    deselect: Fraction
    setup: Fraction
    hold: Fraction
    valid: Fraction
    conversion: Fraction = Fraction(0)
    power_up: Fraction = Fraction(0)


@dataclass(frozen=True, kw_only=True)
class Converter:
    """A converter with an SPI.

    Attributes
    ----------
    title : str
        Name in the data sheet.
    inputs : int
        Analog inputs, a power of two.
    bits : int
        Clocks of a frame.
    command_bits : int
        How many of these carry the command, from the first one on; 0 for a converter that only sends.
    channel_place : int
        Place of the channel's lowest bit in the command.
    command : int
        The command for channel 0.
    low, width : int
        Where the reading lies in the frame: its lowest bit, and its bits.
    signed : bool
        Whether it is two's complement.
    zeros : tuple of int
        Bits of the frame that are always 0.
    summary : int or None
        Bit of the frame that is 1 with any of `THERMOCOUPLE_FAULTS`, which are the lowest bits then.
    step : Fraction or None
        Value of a step of the reading in degC; None where the reading is a share of a range.
    timing : Timing
        At a supply of less than `FULL_SUPPLY`.
    fast : Timing
        From there on.
    """

    title: str
    inputs: int
    bits: int
    command_bits: int = 0
    channel_place: int = 0
    command: int = 0
    low: int
    width: int
    signed: bool = False
    zeros: tuple[int, ...]
    summary: int | None = None
    step: Fraction | None = None
    timing: Timing
    fast: Timing

    def at(self, supply: Fraction) -> Timing:
        """Return the timing at a supply in V."""
        return self.fast if supply >= FULL_SUPPLY else self.timing

    @property
    def lowest(self) -> int:
        """Smallest reading."""
        return -(1 << (self.width - 1)) if self.signed else 0

    @property
    def highest(self) -> int:
        """Largest reading."""
        return (1 << (self.width - self.signed)) - 1


SUPPLIES = (Fraction("2.7"), Fraction("5.5"))
"""Limits of an MCP3202's and an MCP3204's supply in V."""

SUPPLY = Fraction("3.3")
"""Supply in V without another wish: that of the boards' headers."""

FULL_SUPPLY = Fraction(5)
"""Supply in V from which on the faster of the two timings of a data sheet holds."""

# Clocks: 50,000 conversions a second at 2.7 V and 100,000 at 5 V, by the first page of each data sheet, of 18 clocks in
# an MCP3202 and of 20 in an MCP3204: fivdi/mcp-spi-adc.
_MCP3202_SLOW = Timing(
    clock=Fraction(900_000),
    high=250 * ns,  # not confirmed; half a period of the highest clock is at least that
    low=250 * ns,  # likewise
    select=100 * ns,  # dominic-meads/SPI-master-for-MCP3202-ADC-and-MCP4822-DAC
    deselect=500 * ns,  # likewise
    setup=50 * ns,  # not confirmed; that of the MCP3008 in ma16/rpio
    hold=50 * ns,  # likewise
    valid=200 * ns,  # likewise
)
_MCP3204_SLOW = replace(_MCP3202_SLOW, clock=Fraction(1_000_000))
_MAX31855 = Timing(
    clock=Fraction(5_000_000),  # enjoyneering/MAX31855
    high=100 * ns,  # arendst/Tasmota, xsns_39_max31855
    low=100 * ns,  # likewise
    select=100 * ns,  # that of the MAX31856 in its data sheet
    deselect=200 * ns,  # not confirmed, and never that short: a conversion goes between two frames
    setup=0 * ns,
    hold=0 * ns,
    valid=100 * ns,  # behind the falling edge of CS; 40 ns behind one of SCK: arendst/Tasmota
    conversion=100 * ms,  # enjoyneering/MAX31855
    power_up=200 * ms,  # likewise
)

_AD7476A = Timing(
    clock=Fraction(20_000_000),
    high=20 * ns,  # 40 % of a period
    low=20 * ns,  # likewise
    select=10 * ns,
    deselect=90 * ns,  # quiet for 50 ns, behind the up to 36 ns in which the output is let go
    setup=0 * ns,
    hold=0 * ns,
    valid=40 * ns,
)

CONVERTERS = {
    # start, SGL/DIFF = 1, ODD/SIGN, MSBF = 1; null bit; 12 bits
    "mcp3202": Converter(
        title="MCP3202",
        inputs=2,
        bits=17,
        command_bits=4,
        channel_place=1,
        command=0b1101,
        low=0,
        width=12,
        zeros=(12,),
        timing=_MCP3202_SLOW,
        fast=replace(_MCP3202_SLOW, clock=Fraction(1_800_000)),
    ),
    # start, SGL/DIFF = 1, D2, D1, D0; a clock more to sample; null bit; 12 bits
    "mcp3204": Converter(
        title="MCP3204",
        inputs=4,
        bits=19,
        command_bits=5,
        channel_place=0,
        command=0b11000,
        low=0,
        width=12,
        zeros=(12,),
        timing=_MCP3204_SLOW,
        fast=replace(_MCP3204_SLOW, clock=Fraction(2_000_000)),
    ),
    # 14 bits of 0.25 degC, a 0, the fault; 12 bits of the cold junction, a 0, shorted to VCC, to GND, open
    "max31855": Converter(
        title="MAX31855",
        inputs=1,
        bits=32,
        low=18,
        width=14,
        signed=True,
        zeros=(3, 17),
        summary=16,
        step=Fraction(1, 4),
        timing=_MAX31855,
        fast=_MAX31855,
    ),
    # four zeros, 12 bits
    "ad7476a": Converter(
        title="AD7476A",
        inputs=1,
        bits=16,
        low=0,
        width=12,
        zeros=(12, 13, 14, 15),
        timing=_AD7476A,
        fast=_AD7476A,
    ),
}
"""Converters by their names in a specification."""

COLD_JUNCTION_PLACE, COLD_JUNCTION_STEP = 4, Fraction(1, 16)
"""Lowest bit of the cold junction's temperature in the frame of a MAX31855, and its step in degC."""
