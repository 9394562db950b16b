"""Converters of the inputs: what ``[converter.NAME]`` tables mean, and whether readings are codes of the inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from sosmith.gen.specification.values import UnfitError
from sosmith.model.converters.spi_converter import CONVERTERS, SUPPLY, Timing
from sosmith.model.converters.spi_reading import Reading, UnfitReadingError
from sosmith.model.port import Port

if TYPE_CHECKING:
    from sosmith.gen.specification.schema import ConverterTable


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
    def timing(self) -> Timing:
        """Limits of its SPI."""
        return self.reading.converter.at(self.supply)


def converters(ports: tuple[Port, ...], tables: Mapping[str, ConverterTable]) -> tuple[ConverterSpec, ...]:
    """Return the converters of the inputs, none without tables.

    Parameters
    ----------
    ports : tuple of Port
        The inputs.
    tables : mapping of str to ConverterTable
        Tables with the names of all inputs, or none.

    Raises
    ------
    UnfitError
        If a converter's readings are not codes of its input.
    """
    if not tables:
        return ()
    return tuple(_converter(port, tables[port.name]) for port in ports)


def _converter(port: Port, table: ConverterTable) -> ConverterSpec:
    try:
        reading = Reading.of(CONVERTERS[table.device], port, table.range)
    except UnfitReadingError as unfit:
        raise UnfitError(f"one that has {unfit.expected}", unfit.found, where=f"converter.{port.name}") from None
    return ConverterSpec(reading=reading, supply=SUPPLY if table.supply is None else table.supply)
