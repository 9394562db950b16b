"""Numbers in a manifest, which are doubles, against exact ones."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import inf

_ROUNDING = Fraction(1, 2**46)
"""Relative distance from an exact figure that the arithmetic of doubles may have brought."""


@dataclass(frozen=True)
class Figure:
    """A number that a double must stand for: within the rounding of doubles, and `below` or `above` by as much more."""

    value: Fraction
    below: Fraction = Fraction(0)
    above: Fraction = Fraction(0)

    def holds(self, stated: object) -> bool:
        """Whether a number in a manifest is this one."""
        if isinstance(stated, bool) or not isinstance(stated, int | float) or not -inf < stated < inf:
            return False
        off, unsure = Fraction(stated) - self.value, abs(self.value) * _ROUNDING
        return -self.below - unsure <= off <= self.above + unsure

    def __str__(self) -> str:
        return repr(float(self.value))
