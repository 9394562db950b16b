"""Physical meaning of the integer code at a core's input or output: ``value = zero + lsb * code``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sosmith.model.arrays import Codes, Values


@dataclass(frozen=True, kw_only=True)
class Port:
    """An input or output of a core: its quantity and its integer format.

    Attributes
    ----------
    name : str
        Name of the quantity and of its field in the stream.
    bits : int
        Width of the code in bits, 2 to 32.
    signed : bool
        Whether codes are two's complement; otherwise they are unsigned.
    lsb : Fraction
        Physical value of one LSB, in `unit`; positive.
    zero : Fraction
        Physical value of code 0, in `unit`.
    unit : str
        Physical unit; ``""`` for a dimensionless quantity.
    """

    name: str
    bits: int
    signed: bool
    lsb: Fraction
    zero: Fraction
    unit: str = ""

    def __post_init__(self) -> None:
        if not 2 <= self.bits <= 32:
            raise ValueError(f"bits must be in 2..32, not {self.bits!r}")
        if self.lsb <= 0:
            raise ValueError(f"lsb must be positive, not {self.lsb!r}")

    @classmethod
    def from_range(
        cls, name: str, bits: int, low: Fraction, high: Fraction, *, signed: bool = False, unit: str = ""
    ) -> Port:
        """Return the port whose codes divide [low, high) into ``2**bits`` equal steps.

        The range of a signed port must be symmetric (``low == -high``); its `zero` is 0.
        """
        if not low < high:
            raise ValueError(f"range must rise from low to high, not {float(low)!r} to {float(high)!r}")
        if signed and low != -high:
            raise ValueError(f"range of a signed port must be symmetric, not {float(low)!r} to {float(high)!r}")
        return cls(
            name=name,
            bits=bits,
            signed=signed,
            lsb=(high - low) / 2**bits,
            zero=Fraction(0) if signed else low,
            unit=unit,
        )

    @property
    def lowest(self) -> int:
        """Smallest code."""
        return -(1 << (self.bits - 1)) if self.signed else 0

    @property
    def highest(self) -> int:
        """Largest code."""
        return (1 << (self.bits - 1)) - 1 if self.signed else (1 << self.bits) - 1

    @property
    def bytes(self) -> int:
        """Bytes that the code occupies on an AXI4-Stream."""
        return (self.bits + 7) // 8

    def codes_between(self, low: float, high: float) -> tuple[int, int]:
        """Return the first and the last code that values from `low` to `high` have, limited to the format."""
        ends = (math.floor((Fraction(value) - self.zero) / self.lsb + Fraction(1, 2)) for value in (low, high))
        first, last = (min(max(end, self.lowest), self.highest) for end in ends)
        return first, last

    def decode(self, codes: Codes) -> Values:
        """Return the physical values of `codes` in `unit`, in double precision."""
        values = codes.astype("float64")
        values *= float(self.lsb)  # in place: a run has millions of samples
        values += float(self.zero)
        return values

    def outside(self, values: Values) -> int:
        """Return how many physical values are out of the range, by more than half an LSB beyond its codes.

        The end of a range, such as 1 of -1 to 1, is in it, though the highest code is an LSB below.
        """
        import numpy as np

        steps = (np.asarray(values, dtype=np.float64) - float(self.zero)) / float(self.lsb)
        return int(np.count_nonzero((steps < self.lowest - 0.5) | (steps > self.highest + 1.5)))

    def encode(self, values: Values) -> Codes:
        """Return the codes nearest to physical `values`, saturated to the format.

        Raises
        ------
        ValueError
            If a value is not finite.
        """
        import numpy as np  # a specification has ports too, and is read without numpy

        if not np.all(np.isfinite(values)):
            raise ValueError(f"values of {self.name} must be finite, not {float(values[~np.isfinite(values)][0])}")
        codes = np.floor((np.asarray(values, dtype=np.float64) - float(self.zero)) / float(self.lsb) + 0.5)
        return np.clip(codes, self.lowest, self.highest).astype(np.int64)
