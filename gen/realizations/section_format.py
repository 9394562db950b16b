"""Number formats of a section: its coefficients, its quantizers, and the ranges of its signals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from sosmith.gen.realizations.coefficients import Rounding
from sosmith.model.dataflow.graph import Range

WIDE = 1 << 256
"""Placeholder limit of a code whose range is not known yet; never used in hardware."""

MIN_BITS = 4
"""Significant bits of a coefficient at which the search starts."""

MAX_BITS = 40
"""Largest number of significant bits of a coefficient, and of fraction bits of a signal, that is tried. No useful
design needs more."""


def unknown_range(frac: int) -> Range:
    """Return the range of a signal for which only the fraction bits are known."""
    return Range(frac, -WIDE, WIDE)


_UNKNOWN = unknown_range(0)


@dataclass(frozen=True, kw_only=True)
class SectionFormat:
    """All number formats of a section.

    Attributes
    ----------
    x : Range
        Fraction bits and range of the input's code.
    beside : tuple of Range
        The same for each further input.
    coefficient_bits : int
        Significant bits of each coefficient that is not in `coefficients`; 0 if all are.
    coefficients : mapping of str to tuple of int
        Integer and fraction bits of coefficients, by name.
    fracs : mapping of str to int
        Fraction bits kept by each quantizer, by the name of the node that it quantizes. If the mapping is empty, all
        quantizers keep as many as the input has; otherwise, missing ones keep all.
    ranges : mapping of str to tuple of int
        Range of the code of every node with a stated range, by its name; `WIDE` if missing.
    """

    x: Range = _UNKNOWN
    beside: tuple[Range, ...] = ()
    coefficient_bits: int = 0
    coefficients: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    fracs: Mapping[str, int] = field(default_factory=dict)
    ranges: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    @property
    def rounding(self) -> Rounding:
        """How coefficients become integers."""
        longest = max((abs(integer).bit_length() for integer, _ in self.coefficients.values()), default=0)
        return Rounding(self.coefficient_bits or longest, self.coefficients)

    def with_frac(self, name: str, frac: int) -> SectionFormat:
        """Return a copy with different fraction bits for one quantizer."""
        return self._with("fracs", {**self.fracs, name: frac})

    def with_coefficient(self, name: str, value: tuple[int, int]) -> SectionFormat:
        """Return a copy with a different value for one coefficient."""
        return self._with("coefficients", {**self.coefficients, name: value})

    def _with(self, field_name: str, value: object) -> SectionFormat:
        """Do what `dataclasses.replace` does, in a fourth of the time: a search makes tens of thousands of formats."""
        other = object.__new__(SectionFormat)
        other.__dict__.update(self.__dict__)
        other.__dict__[field_name] = value
        return other
