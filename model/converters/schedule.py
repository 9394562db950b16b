"""When a board's front-end reads which converter: clocks of its SPI and I2S, samples between readings, whether it fits.

With an I2S, its frame is the period of a sample: readings of an SPI follow those of the I2S within it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, floor

from sosmith.model.converters.dac_writing import Writing
from sosmith.model.converters.i2s_converter import I2sConverter
from sosmith.model.converters.i2s_frame import LATENCY, I2sFrame
from sosmith.model.converters.reading import Reading
from sosmith.model.converters.spi_converter import Timing
from sosmith.model.converters.spi_dac import DAC_FRAME_BITS, SpiDac
from sosmith.model.errors import SpecificationError

MIN_HALF = 2
"""Fewest clocks of half an SCK period: two flip-flops take the converter's output over."""

FRAME_OVERHEAD, SAMPLE_OVERHEAD, SCAN_OVERHEAD = 6, 4, 6
"""Most clocks for a frame, for a sample in the core, and for an input of a scan, beside what these themselves take."""


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """When a board's front-end reads which converter.

    Attributes
    ----------
    readings : tuple of Reading
        One for each input of the core.
    channels : int
        Number of channels.
    period : Fraction
        Clocks from one sample to the next.
    half : int
        Clocks of half an SCK period, at least `MIN_HALF`; also from the falling edge of CS to the first rising one of
        SCK.
    deselect : int
        Clocks for which CS is high between two frames, at least.
    intervals : tuple of int
        For each input, samples from one reading to the next.
    first : int
        Periods that pass before the one whose end is the first sample: all converters have a result then.
    writing : Writing or None
        How results are written to a DAC.
    frame : I2sFrame or None
        The clocks of the I2S; None without one.
    dac_half, dac_deselect : int
        As `half` and `deselect`, of the SPI of DACs.
    """

    readings: tuple[Reading, ...]
    channels: int
    period: Fraction
    half: int
    deselect: int
    intervals: tuple[int, ...]
    first: int
    writing: Writing | None = None
    frame: I2sFrame | None = None
    dac_half: int = 1
    dac_deselect: int = 1

    @classmethod
    def of(
        cls,
        readings: tuple[Reading, ...],
        timings: tuple[Timing | None, ...],
        *,
        writing: Writing | None = None,
        channels: int,
        clock: Fraction,
        sample_rate: Fraction,
        latency: int,
    ) -> Schedule:
        """Return the schedule of a front-end.

        Parameters
        ----------
        readings : tuple of Reading
            One for each input of the core.
        timings : tuple of Timing or None
            Limits of their converters, None for one with an I2S.
        writing : Writing or None
            How results are written to a DAC.
        channels : int
            Number of channels.
        clock : Fraction
            Clock of the board in Hz.
        sample_rate : Fraction
            Samples of a channel in a second.
        latency : int
            Clocks from a sample to its result in the core.

        Raises
        ------
        SpecificationError
            If a scan of all converters, and the core, take longer than a sample, or the converters of an I2S cannot
            have the sample rate.
        """
        users = (*readings, *([writing] if writing is not None else ()))
        audio = [user.converter for user in users if isinstance(user.converter, I2sConverter)]
        frame = I2sFrame.of(audio, clock=clock, sample_rate=sample_rate) if audio else None
        dac = None if writing is None else writing.converter
        spi = [timing for timing in timings if timing is not None]
        schedule = cls(
            readings=readings,
            channels=channels,
            period=Fraction(frame.clocks) if frame is not None else clock / sample_rate,
            half=max(MIN_HALF, *(max(_half(clock, each), _answer(clock, each)) for each in spi)) if spi else MIN_HALF,
            deselect=max(1, *(ceil(clock * timing.deselect) for timing in spi)) if spi else 1,
            intervals=(1,) * len(readings),
            # The first frame of an I2S has begun before its converters saw an edge of LRCK.
            first=max(int(frame is not None), *(ceil(sample_rate * timing.power_up) - 1 for timing in spi), 0),
            writing=writing,
            frame=frame,
            dac_half=_half(clock, dac.timing) if isinstance(dac, SpiDac) else 1,
            dac_deselect=max(1, ceil(clock * dac.timing.deselect)) if isinstance(dac, SpiDac) else 1,
        )
        busy = schedule.clocks / clock  # no converter has its CS low for longer
        intervals = tuple(
            1 + floor(sample_rate * (timing.conversion + busy)) if timing is not None and timing.conversion else 1
            for timing in timings
        )
        sent = channels * schedule.dac_clocks
        if sent > floor(schedule.period):
            raise SpecificationError(
                f"the sample rate must be at most {float(clock / sent):,.0f} Hz with these DACs at a clock of "
                f"{float(clock):,.0f} Hz, not {float(sample_rate):,.0f} Hz"
            )
        taken = schedule.clocks + channels * (latency + SAMPLE_OVERHEAD)
        if taken > floor(schedule.period):
            raise SpecificationError(
                f"the sample rate must be at most {float(clock / taken):,.0f} Hz with these converters at a clock of "
                f"{float(clock):,.0f} Hz, not {float(sample_rate):,.0f} Hz"
            )
        return replace(schedule, intervals=intervals)

    @property
    def selects(self) -> tuple[int, ...]:
        """For each input, how many converters there are on the SPI, each with a CS of its own."""
        return tuple(0 if _is_i2s(reading) else self.converters(reading) for reading in self.readings)

    @property
    def lines_in(self) -> tuple[int, ...]:
        """For each input, how many data lines of the I2S it has, each of one converter."""
        return tuple(self.converters(reading) if _is_i2s(reading) else 0 for reading in self.readings)

    @property
    def lines_out(self) -> int:
        """How many data lines of the I2S there are to DACs."""
        return self.converters(self.writing) if self.writing is not None and _is_i2s(self.writing) else 0

    @property
    def dac_selects(self) -> int:
        """How many DACs there are on an SPI of their own, each with a CS of its own."""
        return self.converters(self.writing) if self.writing is not None and not _is_i2s(self.writing) else 0

    @property
    def dac_clocks(self) -> int:
        """Most clocks of the frame of a DAC on an SPI; 0 without one."""
        if not self.dac_selects:
            return 0
        return 2 * self.dac_half * DAC_FRAME_BITS + self.dac_half + self.dac_deselect + FRAME_OVERHEAD

    @property
    def silent(self) -> int:
        """How many words a DAC gets before that of the first result: on an I2S, one in each frame."""
        return self.first - 1 + LATENCY if self.lines_out else 0

    def converters(self, user: Reading | Writing) -> int:
        """Return how many converters an input or the output has."""
        return -(-self.channels // user.converter.inputs)

    @property
    def clocks(self) -> int:
        """Most clocks of a scan of all converters."""
        frames = sum(
            FRAME_OVERHEAD
            if isinstance(reading.converter, I2sConverter)
            else 2 * self.half * reading.converter.bits + self.half + self.deselect + FRAME_OVERHEAD
            for reading in self.readings
        )
        return self.channels * frames + SCAN_OVERHEAD * len(self.readings)


def _is_i2s(user: Reading | Writing) -> bool:
    return isinstance(user.converter, I2sConverter)


def _half(clock: Fraction, timing: Timing) -> int:
    """Return the clocks of half an SCK period that a converter needs to follow."""
    shortest = max(1 / (2 * timing.clock), timing.high, timing.low, timing.select, timing.setup, timing.hold)
    return ceil(clock * shortest)


def _answer(clock: Fraction, timing: Timing) -> int:
    """Return the clocks of half an SCK period that a converter needs to answer in."""
    return 1 + ceil(clock * timing.valid / 2)
