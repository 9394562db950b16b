"""The taps of `filter.taps_file`: a row or a column of numbers, in another tool's file."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from sosmith.gen.quantity import count
from sosmith.gen.specification.choices import MAX_GIVEN_TAPS
from sosmith.gen.specification.coefficients.content import TransferFunction
from sosmith.gen.specification.coefficients.filter_file import read_filter_file
from sosmith.model.errors import SpecificationError


def taps_of(path: Path) -> tuple[tuple[Fraction, ...], str]:
    """Read the taps of an FIR filter.

    Returns
    -------
    tuple of Fraction
        1 to 512 numbers, not all 0.
    str
        The format of the file, a sentence.

    Raises
    ------
    SpecificationError
        If the file cannot be read, holds no FIR filter, or one with too many taps or with zeros only.
    """
    read = read_filter_file(path)
    if not isinstance(read, TransferFunction) or read.taps is None:
        raise SpecificationError(f"{path}: filter.taps_file must hold the taps of an FIR filter, not {read.format}")
    if len(read.taps) > MAX_GIVEN_TAPS:
        raise SpecificationError(f"{path}: taps must be at most {MAX_GIVEN_TAPS}, not {len(read.taps)}")
    if not any(read.taps):
        raise SpecificationError(f"{path}: taps must not all be 0")
    return read.taps, f"{count(len(read.taps), 'tap')} from {read.format}"
