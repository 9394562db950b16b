"""When a board's front-end reads which converter: clocks of its SPI, samples between readings, whether it all fits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, floor

from sosmith.model.converters.spi_converter import Timing
from sosmith.model.converters.spi_reading import Reading
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
    """

    readings: tuple[Reading, ...]
    channels: int
    period: Fraction
    half: int
    deselect: int
    intervals: tuple[int, ...]
    first: int

    @classmethod
    def of(
        cls,
        readings: tuple[Reading, ...],
        timings: tuple[Timing, ...],
        *,
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
        timings : tuple of Timing
            Limits of their converters.
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
            If a scan of all converters, and the core, take longer than a sample.
        """
        shortest = max(
            max(1 / (2 * timing.clock), timing.high, timing.low, timing.select, timing.setup, timing.hold)
            for timing in timings
        )
        made = cls(
            readings=readings,
            channels=channels,
            period=clock / sample_rate,
            half=max(MIN_HALF, ceil(clock * shortest), 1 + ceil(clock * max(timing.valid for timing in timings) / 2)),
            deselect=max(1, *(ceil(clock * timing.deselect) for timing in timings)),
            intervals=(1,) * len(readings),
            first=max(0, *(ceil(sample_rate * timing.power_up) - 1 for timing in timings)),
        )
        busy = made.clocks / clock  # no converter has its CS low for longer
        intervals = tuple(
            1 + floor(sample_rate * (timing.conversion + busy)) if timing.conversion else 1 for timing in timings
        )
        taken = made.clocks + channels * (latency + SAMPLE_OVERHEAD)
        if taken > floor(made.period):
            raise SpecificationError(
                f"the sample rate must be at most {float(clock / taken):,.0f} Hz with these converters at a clock of "
                f"{float(clock):,.0f} Hz, not {float(sample_rate):,.0f} Hz"
            )
        return replace(made, intervals=intervals)

    @property
    def selects(self) -> tuple[int, ...]:
        """For each input, how many converters there are, each with a CS of its own."""
        return tuple(-(-self.channels // reading.converter.inputs) for reading in self.readings)

    @property
    def clocks(self) -> int:
        """Most clocks of a scan of all converters."""
        frames = sum(
            2 * self.half * reading.converter.bits + self.half + self.deselect + FRAME_OVERHEAD
            for reading in self.readings
        )
        return self.channels * frames + SCAN_OVERHEAD * len(self.readings)
