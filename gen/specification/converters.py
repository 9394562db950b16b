"""Converters of inputs and output: what ``[converter.NAME]`` tables mean, and whether their words are codes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING

from sosmith.gen.specification.values import UnfitError
from sosmith.model.converters.dac_writing import Writing
from sosmith.model.converters.i2s_converter import I2S_CONVERTERS, I2sConverter
from sosmith.model.converters.reading import Reading, UnfitReadingError
from sosmith.model.converters.spi_converter import CONVERTERS, SUPPLY, Converter, Timing
from sosmith.model.converters.spi_dac import SPI_DACS, SpiDac
from sosmith.model.port import Port

if TYPE_CHECKING:
    from sosmith.gen.specification.schema import ConverterTable


OUTPUT = "output"
"""Name of the table of the output's converter, unless an input has this name."""

ADCS: dict[str, Converter | I2sConverter] = {
    **CONVERTERS,
    **{name: device for name, device in I2S_CONVERTERS.items() if not device.is_dac},
}
"""Converters of inputs by their names."""

DACS: dict[str, I2sConverter | SpiDac] = {
    **{name: device for name, device in I2S_CONVERTERS.items() if device.is_dac},
    **SPI_DACS,
}
"""Converters of the output by their names."""


@dataclass(frozen=True, kw_only=True)
class ConverterSpec:
    """The converter of an input.

    Attributes
    ----------
    reading : Reading
        The converter, the input, and which code a reading is.
    supply : Fraction
        Its supply in V.
    """

    reading: Reading
    supply: Fraction

    @property
    def timing(self) -> Timing | None:
        """Limits of its SPI; None for one with an I2S."""
        converter = self.reading.converter
        return None if isinstance(converter, I2sConverter) else converter.at(self.supply)


def converters(ports: tuple[Port, ...], tables: Mapping[str, ConverterTable]) -> tuple[ConverterSpec, ...]:
    """Return the converters of the inputs, none without tables.

    Parameters
    ----------
    ports : tuple of Port
        The inputs.
    tables : mapping of str to ConverterTable
        Tables with the names of all inputs, or none; beside them that of the output.

    Raises
    ------
    UnfitError
        If a converter's readings are not codes of its input.
    """
    if not tables:
        return ()
    return tuple(_converter(port, tables[port.name]) for port in ports)


def dac(ports: tuple[Port, ...], output: Port, tables: Mapping[str, ConverterTable]) -> Writing | None:
    """Return how the output is written to its converter; None without a table for it.

    Parameters
    ----------
    ports, output
        The inputs, and the output.
    tables
        As for `converters`.

    Raises
    ------
    UnfitError
        If codes of the output are no words of the converter.
    """
    if not has_dac(tables, [port.name for port in ports]):
        return None
    table = tables[OUTPUT]
    try:
        return Writing.of(DACS[table.device], output, table.range or _range(output))
    except UnfitReadingError as unfit:
        raise UnfitError(f"one that has {unfit.expected}", unfit.found, where=f"converter.{OUTPUT}") from None


def has_dac(tables: Mapping[str, ConverterTable], inputs: Sequence[str]) -> bool:
    """Return whether one of the tables is that of the output."""
    return OUTPUT in tables and OUTPUT not in inputs


def _converter(port: Port, table: ConverterTable) -> ConverterSpec:
    device, span = ADCS[table.device], table.range
    if isinstance(device, I2sConverter):
        # Of each word only as many bits are used as the input has; full scale is that of the input.
        device, span = replace(device, width=min(device.width, port.bits)), span or _range(port)
    try:
        reading = Reading.of(device, port, span)
    except UnfitReadingError as unfit:
        raise UnfitError(f"one that has {unfit.expected}", unfit.found, where=f"converter.{port.name}") from None
    return ConverterSpec(reading=reading, supply=SUPPLY if table.supply is None else table.supply)


def _range(port: Port) -> tuple[Fraction, Fraction]:
    return port.zero + port.lowest * port.lsb, port.zero + (port.highest + 1) * port.lsb
