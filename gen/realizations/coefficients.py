"""How a section's ideal coefficients become integers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from sosmith.model.dataflow.adder_graph import signed_digits


@dataclass(frozen=True)
class Rounding:
    """Rounds the coefficients of one section.

    Attributes
    ----------
    bits : int
        Significant bits of each coefficient.
    chosen : mapping of str to tuple of int
        Integer and fraction bits, by name, of the coefficients that are not rounded to the nearest value.
    """

    bits: int
    chosen: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    def __call__(self, name: str, value: float) -> tuple[int, int]:
        """Integer and fraction bits of the coefficient `name`, which is ideally `value`."""
        if name in self.chosen:
            return self.chosen[name]
        return round_significant(value, self.bits)


def round_significant(value: float, bits: int) -> tuple[int, int]:
    """Round `value` to `bits` significant bits; return the integer and its fraction bits, in lowest terms."""
    if not value:
        return 0, 0
    frac = bits - math.frexp(value)[1]
    return lowest_terms(round(math.ldexp(value, frac)), frac)


def lowest_terms(integer: int, frac: int) -> tuple[int, int]:
    """Drop the trailing zeros of ``integer * 2**-frac``; the number of fraction bits is never negative."""
    while integer and integer % 2 == 0:
        integer //= 2
        frac -= 1
    if frac < 0:
        return integer << -frac, 0
    return integer, frac


def with_fewer_digits(integer: int, exact: float) -> Iterator[int]:
    """Yield integers near `exact`, above and below, with fewer signed digits than `integer`."""
    least = len(signed_digits(integer))
    for whole in (math.floor(exact), math.ceil(exact)):
        digits = signed_digits(whole)[::-1]
        for count in range(1, len(digits) + 1):
            near = sum(sign << power for sign, power in digits[:count])
            for other in (near, near + (1 << digits[count - 1][1]), near - (1 << digits[count - 1][1])):
                if other and other != integer and len(signed_digits(other)) < least:
                    yield other
