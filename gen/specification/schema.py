"""Shape of a specification: its tables, their keys, and the type of each value.

Rules that involve several keys are in `sosmith.gen.specification.rules`. To add a key, add it to its table;
the messages about unknown and missing keys follow from that.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from typing import Any, cast

from sosmith.gen.specification.choices import (
    ARCHITECTURES,
    AUTO,
    FAMILIES,
    FAMILY_HINTS,
    FIR_FAMILIES,
    FREEDOMS,
    KIND_HINTS,
    KINDS,
    MAX_DECIMATION,
    MAX_DOWNSAMPLING,
    MAX_GIVEN_TAPS,
    METHODS,
    PIPELINES,
    REALIZATIONS,
    SAMPLES_PER_CLOCK,
    STARTS,
)
from sosmith.gen.specification.tables import Table, key, key_after, read_whole, table, tables
from sosmith.gen.specification.values import (
    ABOVE_ZERO,
    IDENTIFIER,
    UnfitError,
    above_zero,
    between,
    choice,
    edges,
    file_name,
    flag,
    identifier,
    list_of,
    literal,
    number,
    one_of,
    one_or_more,
    positive,
    rising_pair,
    text,
    whole,
)
from sosmith.model.converters.i2s_converter import I2S_CONVERTERS
from sosmith.model.converters.spi_converter import CONVERTERS, SUPPLIES
from sosmith.model.converters.spi_dac import SPI_DACS
from sosmith.model.dataflow.cic import order_of
from sosmith.model.dataflow.protection import PROTECTIONS

MAX_ORDER = 20
"""Highest order of the digital filter, ten second-order sections."""

MAX_CHANNELS = 65536
"""Maximum number of channels: their numbers fit in two bytes."""

MAX_MULTIPLIERS = 9999
"""Largest number of multiplier blocks that can be asked for."""

LOSS_LIMITS = (Fraction(1, 10**6), Fraction(200))
"""Limits in dB: double precision can design ripples down to the first; the range of 32 bits is below the second."""

Rows = tuple[tuple[Fraction, ...], ...]
Edges = tuple[Fraction, ...] | None
_loss = between(*LOSS_LIMITS, "dB")
_freedom = between(Fraction(1), Fraction(10**9), "degrees of freedom")
_not_negative = partial(between, Fraction(0), Fraction(10**6))


def read_max_error(value: object) -> Fraction | None:
    """Read the maximum error; "faithful" gives None."""
    if value == "faithful":
        return None
    expected = 'a positive number in the unit of the output, or "faithful"'
    exact = number(value, expected)
    if exact <= 0:
        raise UnfitError(expected, literal(value))
    return exact


def read_multipliers(value: object) -> int | None:
    """Read a number of multiplier blocks; "auto" gives None."""
    if value == "auto":
        return None
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MAX_MULTIPLIERS:
        raise UnfitError(f'"auto", or a whole number from 0 to {MAX_MULTIPLIERS}', literal(value))
    return value


def read_samples_per_clock(value: object) -> int:
    """Read a number of samples in a beat."""
    if isinstance(value, bool) or not isinstance(value, int) or value not in SAMPLES_PER_CLOCK:
        raise UnfitError(f"one of {', '.join(map(str, SAMPLES_PER_CLOCK))}", literal(value))
    return value


def read_decimate(value: object, earlier: Mapping[str, Any]) -> int | str:
    """Read a factor of decimation, or "auto"; one of an FIR filter need not be a power of two."""
    if earlier.get("family") in FIR_FAMILIES or any(earlier.get(key) for key in ("taps", "taps_file")):
        return whole(2, MAX_DOWNSAMPLING)(value)
    is_power = isinstance(value, int) and not isinstance(value, bool) and value > 1 and not value & (value - 1)
    if value == AUTO or (is_power and cast("int", value) <= MAX_DECIMATION):
        return cast("int | str", value)
    raise UnfitError(f'"auto", or a power of two from 2 to {MAX_DECIMATION}', literal(value))


class InputTable(Table):
    """``[input.NAME]``: the integer format of a sensor."""

    bits: int = key(whole(2, 32), "a whole number from 2 to 32")
    range: tuple[Fraction, Fraction] = key(rising_pair, "a list of 2 numbers, [low, high]")
    signed: bool = key(flag, default=False)


class OutputTable(InputTable):
    """``[output]``: the integer format and the required accuracy of the result."""

    unit: str = key(text(16), default="")
    max_error: Fraction | None = key(read_max_error, default=None)


class CoefficientsTable(Table):
    """``[calibration.uncertainty]``: what the coefficients are worth."""

    covariance: Rows = key(
        list_of(list_of(number, 1, 64), 1, 64, "rows of numbers"), "rows of numbers, the covariance of the coefficients"
    )
    freedom: Fraction | None = key(_freedom, default=None)
    systematic: Fraction = key(_not_negative("mm"), default=Fraction(0))
    systematic_freedom: Fraction | None = key(_freedom, default=None)
    voltage: tuple[Fraction, Fraction] = key(
        rising_pair, "a list of 2 numbers, [low, high], the voltages that the calibration was made at"
    )
    temperature: tuple[Fraction, Fraction] = key(
        rising_pair, "a list of 2 numbers, [low, high], the temperatures that the calibration was made at"
    )


class UncertaintyTable(Table):
    """``[uncertainty]``: what is known of the instrument's errors."""

    noise: Fraction | None = key(_not_negative("V"), default=None)
    temperature: Fraction | None = key(_not_negative("degC"), default=None)
    voltage: Fraction | None = key(_not_negative("V"), default=None)
    clearance_rate: Fraction | None = key(_not_negative("mm/s"), default=None)
    motion: Rows = key(list_of(list_of(number, 2, 2), 0, 16, "pairs [frequency, amplitude]"), default=())


class CalibrationTable(Table):
    """``[calibration]``: the polynomial, or measurements to fit it to."""

    coefficients: Rows | None = key(list_of(list_of(number, 1, 8), 1, 8, "rows of 1 to 8 numbers"), default=None)
    data: str | None = key(file_name, default=None)
    uncertainty: CoefficientsTable | None = table(CoefficientsTable, "a table [calibration.uncertainty]", default=None)


def _order(value: object, earlier: Mapping[str, Any]) -> int:
    """Read the order of a filter with poles; one of FIR filters is refused by its key, not as too large."""
    largest = sys.maxsize if earlier.get("family") in FIR_FAMILIES else MAX_ORDER
    return whole(1, largest)(value)


class FilterTable(Table):
    """``[filter]``: given by order and cutoff, by edges and losses, by sections, or by taps."""

    family: str | None = key(choice((*FAMILIES, *FIR_FAMILIES), FAMILY_HINTS), default=None)
    kind: str | None = key(choice(KINDS, KIND_HINTS), default=None)
    method: str | None = key(choice(METHODS), default=None)
    order: int | None = key_after(_order, default=None)
    cutoff: Edges = key(edges, default=None)
    passband_edge: Edges = key(edges, default=None)
    stopband_edge: Edges = key(edges, default=None)
    passband_loss: Fraction | None = key(_loss, default=None)
    stopband_loss: Fraction | None = key(_loss, default=None)
    freedom: str = key(choice(FREEDOMS), default="none")
    sos: Rows | None = key(
        list_of(list_of(number, 6, 6), 1, MAX_ORDER // 2, "rows [b0, b1, b2, 1.0, a1, a2]"), default=None
    )
    sos_file: str | None = key(file_name, default=None)
    taps: tuple[Fraction, ...] | None = key(list_of(number, 1, MAX_GIVEN_TAPS), default=None)
    taps_file: str | None = key(file_name, default=None)
    decimate: int | str | None = key_after(read_decimate, default=None)
    hold: bool = key(flag, default=False)

    @property
    def is_fir(self) -> bool:
        """Whether it asks for an FIR filter."""
        return self.taps is not None or self.taps_file is not None or self.family in FIR_FAMILIES

    @property
    def is_cic(self) -> bool:
        """Whether it gives the taps of a CIC filter that decimates."""
        factor = self.decimate if isinstance(self.decimate, int) else 1
        return self.taps is not None and order_of(self.taps, factor) is not None


class WearTable(Table):
    """``[wear]``: the wear limits behind the wear flags."""

    initial: tuple[Fraction, ...] = key(
        one_or_more, "a number in the unit of the output, or a list of one for each channel"
    )
    warning: Fraction = key(above_zero, ABOVE_ZERO)
    limit: Fraction = key(above_zero, ABOVE_ZERO)
    sensor_range: Fraction | None = key(number, default=None)


_DEVICES = (*CONVERTERS, *I2S_CONVERTERS, *SPI_DACS)


class ConverterTable(Table):
    """``[converter.NAME]``: the converter that a board reads an input from, or writes the output to."""

    device: str = key(choice(_DEVICES), one_of(_DEVICES))
    range: tuple[Fraction, Fraction] | None = key(rising_pair, default=None)
    supply: Fraction | None = key(between(*SUPPLIES, "V"), default=None)


class HardwareTable(Table):
    """``[hardware]``: how the datapath is built."""

    realization: str = key(choice(REALIZATIONS), default="auto")
    architecture: str = key(choice(ARCHITECTURES), default="auto")
    clock: Fraction = key(positive("Hz"), default=Fraction(12_000_000))
    reload: bool = key(flag, default=False)
    reload_lock: bool = key(flag, default=False)
    reload_registers: bool = key(flag, default=True)
    protect: str = key(choice(PROTECTIONS), default="none")
    start: str = key(choice(STARTS), default="steady")
    multipliers: int | None = key(read_multipliers, default=None)
    pipeline: str = key(choice(PIPELINES), default="auto")
    samples_per_clock: int = key(read_samples_per_clock, default=1)
    keep: bool = key(flag, default=False)


class Document(Table):
    """The whole specification."""

    name: str = key(identifier, IDENTIFIER)
    sample_rate: Fraction = key(positive("Hz"), "a positive number of Hz")
    channels: int = key(whole(1, MAX_CHANNELS), default=1)
    input: dict[str, InputTable] = tables(InputTable, "a table [input.NAME] per input")
    calibration: CalibrationTable | None = table(CalibrationTable, "a table [calibration]", default=None)
    filter: FilterTable = table(FilterTable, "a table [filter]")
    output: OutputTable = table(OutputTable, "a table [output]")
    wear: WearTable | None = table(WearTable, "a table [wear]", default=None)
    uncertainty: UncertaintyTable | None = table(UncertaintyTable, "a table [uncertainty]", default=None)
    converter: dict[str, ConverterTable] = tables(ConverterTable, "a table [converter.NAME] per input", default={})
    hardware: HardwareTable = table(HardwareTable, "a table [hardware]", default=HardwareTable({}))


def parse(tree: dict[str, Any]) -> Document:
    """Check the shape of a specification.

    Parameters
    ----------
    tree : dict
        As `tomllib` gives it, with every float as `decimal.Decimal`.

    Raises
    ------
    UnfitError
        For all errors, in the order of the file.
    """
    return read_whole(Document, tree)
