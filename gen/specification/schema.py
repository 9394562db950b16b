"""Shape of a specification: its tables, their keys, and the type of each value.

Rules that involve several keys are in `sosmith.gen.specification.rules`. To add a key, add it to its table;
the messages about unknown and missing keys follow from that.
"""

from __future__ import annotations

import sys
from fractions import Fraction
from functools import partial
from typing import Annotated, Any, cast

from pydantic import BaseModel, ConfigDict, Field, PlainValidator, ValidationError, ValidationInfo
from pydantic_core import ErrorDetails

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
    MAX_TAPS,
    METHODS,
    PIPELINES,
    REALIZATIONS,
    SAMPLES_PER_CLOCK,
    STARTS,
)
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
    key_text,
    list_of,
    literal,
    number,
    one_of,
    one_or_more,
    positive,
    rising_pair,
    text,
    together,
    whole,
)
from sosmith.model.converters.i2s_converter import I2S_CONVERTERS
from sosmith.model.converters.spi_converter import CONVERTERS, SUPPLIES
from sosmith.model.converters.spi_dac import SPI_DACS
from sosmith.model.dataflow.protection import PROTECTIONS
from sosmith.model.suggestion import did_you_mean

MAX_ORDER = 20
"""Highest order of the digital filter, ten second-order sections."""

MAX_CHANNELS = 65536
"""Maximum number of channels: their numbers fit in two bytes."""

MAX_MULTIPLIERS = 9999
"""Largest number of multiplier blocks that can be asked for."""

LOSS_LIMITS = (Fraction(1, 10**6), Fraction(200))
"""Limits in dB: double precision can design ripples down to the first; the range of 32 bits is below the second."""

Rows = tuple[tuple[Fraction, ...], ...]
Loss = Annotated[Fraction | None, PlainValidator(between(*LOSS_LIMITS, "dB"))]
Freedom = Annotated[Fraction | None, PlainValidator(between(Fraction(1), Fraction(10**9), "degrees of freedom"))]
NOT_NEGATIVE = partial(between, Fraction(0), Fraction(10**6))
Edges = Annotated[tuple[Fraction, ...] | None, PlainValidator(edges)]


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


def read_decimate(value: object, info: ValidationInfo) -> int | str:
    """Read a factor of decimation, or "auto"; one of an FIR filter need not be a power of two."""
    if info.data.get("family") in FIR_FAMILIES or any(info.data.get(key) for key in ("taps", "taps_file")):
        return whole(2, MAX_DOWNSAMPLING)(value)
    is_power = isinstance(value, int) and not isinstance(value, bool) and value > 1 and not value & (value - 1)
    if value == AUTO or (is_power and cast("int", value) <= MAX_DECIMATION):
        return cast("int | str", value)
    raise UnfitError(f'"auto", or a power of two from 2 to {MAX_DECIMATION}', literal(value))


class Table(BaseModel):
    """A table of the specification: immutable, without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)  # tables of others build it in


class InputTable(Table):
    """``[input.NAME]``: the integer format of a sensor."""

    bits: Annotated[int, PlainValidator(whole(2, 32))] = Field(description="a whole number from 2 to 32")
    range: Annotated[tuple[Fraction, Fraction], PlainValidator(rising_pair)] = Field(
        description="a list of 2 numbers, [low, high]"
    )
    signed: Annotated[bool, PlainValidator(flag)] = False


class OutputTable(InputTable):
    """``[output]``: the integer format and the required accuracy of the result."""

    unit: Annotated[str, PlainValidator(text(16))] = ""
    max_error: Annotated[Fraction | None, PlainValidator(read_max_error)] = None


class CoefficientsTable(Table):
    """``[calibration.uncertainty]``: what the coefficients are worth."""

    covariance: Annotated[Rows, PlainValidator(list_of(list_of(number, 1, 64), 1, 64, "rows of numbers"))] = Field(
        description="rows of numbers, the covariance of the coefficients"
    )
    freedom: Freedom = None
    systematic: Annotated[Fraction, PlainValidator(NOT_NEGATIVE("mm"))] = Fraction(0)
    systematic_freedom: Freedom = None
    voltage: Annotated[tuple[Fraction, Fraction], PlainValidator(rising_pair)] = Field(
        description="a list of 2 numbers, [low, high], the voltages that the calibration was made at"
    )
    temperature: Annotated[tuple[Fraction, Fraction], PlainValidator(rising_pair)] = Field(
        description="a list of 2 numbers, [low, high], the temperatures that the calibration was made at"
    )


class UncertaintyTable(Table):
    """``[uncertainty]``: what is known of the instrument's errors."""

    noise: Annotated[Fraction | None, PlainValidator(NOT_NEGATIVE("V"))] = None
    temperature: Annotated[Fraction | None, PlainValidator(NOT_NEGATIVE("degC"))] = None
    voltage: Annotated[Fraction | None, PlainValidator(NOT_NEGATIVE("V"))] = None
    clearance_rate: Annotated[Fraction | None, PlainValidator(NOT_NEGATIVE("mm/s"))] = None
    motion: Annotated[Rows, PlainValidator(list_of(list_of(number, 2, 2), 0, 16, "pairs [frequency, amplitude]"))] = ()


class CalibrationTable(Table):
    """``[calibration]``: the polynomial, or measurements to fit it to."""

    coefficients: Annotated[
        Rows | None, PlainValidator(list_of(list_of(number, 1, 8), 1, 8, "rows of 1 to 8 numbers"))
    ] = None
    data: Annotated[str | None, PlainValidator(file_name)] = None
    uncertainty: CoefficientsTable | None = Field(default=None, description="a table [calibration.uncertainty]")


def _order(value: object, info: ValidationInfo) -> int:
    """Read the order of a filter with poles; one of FIR filters is refused by its key, not as too large."""
    largest = sys.maxsize if info.data.get("family") in FIR_FAMILIES else MAX_ORDER
    return whole(1, largest)(value)


class FilterTable(Table):
    """``[filter]``: given by order and cutoff, by edges and losses, by sections, or by taps."""

    family: Annotated[str | None, PlainValidator(choice((*FAMILIES, *FIR_FAMILIES), FAMILY_HINTS))] = None
    kind: Annotated[str | None, PlainValidator(choice(KINDS, KIND_HINTS))] = None
    method: Annotated[str | None, PlainValidator(choice(METHODS))] = None
    order: Annotated[int | None, PlainValidator(_order)] = None
    cutoff: Edges = None
    passband_edge: Edges = None
    stopband_edge: Edges = None
    passband_loss: Loss = None
    stopband_loss: Loss = None
    freedom: Annotated[str, PlainValidator(choice(FREEDOMS))] = "none"
    sos: Annotated[
        Rows | None,
        PlainValidator(list_of(list_of(number, 6, 6), 1, MAX_ORDER // 2, "rows [b0, b1, b2, 1.0, a1, a2]")),
    ] = None
    sos_file: Annotated[str | None, PlainValidator(file_name)] = None
    taps: Annotated[tuple[Fraction, ...] | None, PlainValidator(list_of(number, 1, MAX_TAPS))] = None
    taps_file: Annotated[str | None, PlainValidator(file_name)] = None
    decimate: Annotated[int | str | None, PlainValidator(read_decimate)] = None
    hold: Annotated[bool, PlainValidator(flag)] = False

    @property
    def is_fir(self) -> bool:
        """Whether it asks for an FIR filter."""
        return self.taps is not None or self.taps_file is not None or self.family in FIR_FAMILIES


class WearTable(Table):
    """``[wear]``: the wear limits behind the wear flags."""

    initial: Annotated[tuple[Fraction, ...], PlainValidator(one_or_more)] = Field(
        description="a number in the unit of the output, or a list of one for each channel"
    )
    warning: Annotated[Fraction, PlainValidator(above_zero)] = Field(description=ABOVE_ZERO)
    limit: Annotated[Fraction, PlainValidator(above_zero)] = Field(description=ABOVE_ZERO)
    sensor_range: Annotated[Fraction | None, PlainValidator(number)] = None


_DEVICES = (*CONVERTERS, *I2S_CONVERTERS, *SPI_DACS)


class ConverterTable(Table):
    """``[converter.NAME]``: the converter that a board reads an input from, or writes the output to."""

    device: Annotated[str, PlainValidator(choice(_DEVICES))] = Field(description=one_of(_DEVICES))
    range: Annotated[tuple[Fraction, Fraction] | None, PlainValidator(rising_pair)] = None
    supply: Annotated[Fraction | None, PlainValidator(between(*SUPPLIES, "V"))] = None


class HardwareTable(Table):
    """``[hardware]``: how the datapath is built."""

    realization: Annotated[str, PlainValidator(choice(REALIZATIONS))] = "auto"
    architecture: Annotated[str, PlainValidator(choice(ARCHITECTURES))] = "auto"
    clock: Annotated[Fraction, PlainValidator(positive("Hz"))] = Fraction(12_000_000)
    reload: Annotated[bool, PlainValidator(flag)] = False
    reload_lock: Annotated[bool, PlainValidator(flag)] = False
    reload_registers: Annotated[bool, PlainValidator(flag)] = True
    protect: Annotated[str, PlainValidator(choice(PROTECTIONS))] = "none"
    start: Annotated[str, PlainValidator(choice(STARTS))] = "steady"
    multipliers: Annotated[int | None, PlainValidator(read_multipliers)] = None
    pipeline: Annotated[str, PlainValidator(choice(PIPELINES))] = "auto"
    samples_per_clock: Annotated[int, PlainValidator(read_samples_per_clock)] = 1
    keep: Annotated[bool, PlainValidator(flag)] = False


class Document(Table):
    """The whole specification."""

    name: Annotated[str, PlainValidator(identifier)] = Field(description=IDENTIFIER)
    sample_rate: Annotated[Fraction, PlainValidator(positive("Hz"))] = Field(description="a positive number of Hz")
    channels: Annotated[int, PlainValidator(whole(1, MAX_CHANNELS))] = 1
    input: dict[str, InputTable] = Field(description="a table [input.NAME] per input")
    calibration: CalibrationTable | None = Field(default=None, description="a table [calibration]")
    filter: FilterTable = Field(description="a table [filter]")
    output: OutputTable = Field(description="a table [output]")
    wear: WearTable | None = Field(default=None, description="a table [wear]")
    uncertainty: UncertaintyTable | None = Field(default=None, description="a table [uncertainty]")
    converter: dict[str, ConverterTable] = Field(default={}, description="a table [converter.NAME] per input")
    hardware: HardwareTable = Field(default=HardwareTable(), description="a table [hardware]")


_TABLES: dict[str, type[Table]] = {
    "calibration": CalibrationTable,
    "filter": FilterTable,
    "output": OutputTable,
    "wear": WearTable,
    "uncertainty": UncertaintyTable,
    "hardware": HardwareTable,
}


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
    try:
        return Document.model_validate(tree)
    except ValidationError as error:
        findings = sorted(error.errors(), key=lambda finding: _position(tree, finding["loc"]))
    raise together([_unfit(finding) for finding in findings])


def _position(tree: Any, path: tuple[int | str, ...]) -> list[int]:
    """Return the position of a key in the file; a missing key is at the end of its table."""
    position = []
    for key in path:
        position.append(list(tree).index(key) if key in tree else len(tree))
        tree = tree.get(key)
    return position


def _unfit(finding: ErrorDetails) -> UnfitError:
    path = tuple(map(str, finding["loc"]))
    where = ".".join(map(key_text, path))
    if finding["type"] == "value_error":
        unfit = finding["ctx"]["error"]
        assert isinstance(unfit, UnfitError)
        return unfit.inside(where)
    keys = _table_at(path[:-1]).model_fields
    if finding["type"] == "extra_forbidden":
        return UnfitError(
            f"one of the keys {', '.join(keys)}", f"an unknown one{did_you_mean(path[-1], keys)}", where=where
        )
    given = "missing" if finding["type"] == "missing" else literal(finding["input"])
    # A table [input.NAME] is not a field of a model, so it has no description of its own.
    expected = keys[path[-1]].description if path[-1] in keys else "a table"
    return UnfitError(str(expected), given, where=where)


def _table_at(path: tuple[str, ...]) -> type[Table]:
    match path:
        case ():
            return Document
        case ("input" | "converter",):
            return Table
        case ("input", _):
            return InputTable
        case ("calibration", "uncertainty"):
            return CoefficientsTable
        case ("converter", _):
            return ConverterTable
        case _:
            return _TABLES[path[0]]
