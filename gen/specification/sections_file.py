"""The sections of `filter.sos_file`: read from another tool's file, in scipy's convention."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from sosmith.gen.specification.coefficients.content import StatedSections
from sosmith.gen.specification.coefficients.filter_file import read_filter_file
from sosmith.gen.specification.coefficients.signs import sentence, settled
from sosmith.model.errors import SpecificationError

MAX_SECTIONS = 10


def sections_of(path: Path) -> tuple[tuple[tuple[Fraction, ...], ...], str]:
    """Read second-order sections.

    Returns
    -------
    tuple of tuples of Fraction
        1 to 10 stable rows (b0, b1, b2, 1, a1, a2).
    str
        The format of the file, and the sign convention it was read in.

    Raises
    ------
    SpecificationError
        If the file cannot be read, holds no sections or too many, or they are not stable.
    """
    stated = read_filter_file(path)
    if not isinstance(stated, StatedSections):
        raise SpecificationError(
            f"{path}: filter.sos_file must hold second-order sections, not {stated.format}; "
            "`sosmith import` makes a specification of it"
        )
    try:
        sections = settled(stated)
    except SpecificationError as error:
        raise SpecificationError(f"{path}: {error}") from None
    if len(sections.rows) > MAX_SECTIONS:
        raise SpecificationError(f"{path}: sections must be at most {MAX_SECTIONS}, not {len(sections.rows)}")
    return sections.rows, sentence(stated, sections)
