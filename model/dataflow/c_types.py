"""Types of the C model, and how numbers are written in it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

TYPES = {32: "int32_t", 64: "int64_t", 128: "__int128"}
"""The types by their bits; all are signed, whatever the sign of the values."""


class Range(Protocol):
    """Whole numbers from `low` to `high`."""

    @property
    def low(self) -> int: ...

    @property
    def high(self) -> int: ...


class Span(NamedTuple):
    """A range of values that no node has."""

    low: int
    high: int


def bits_of(*ranges: Range) -> int:
    """Return the bits of the narrowest type that holds all values of all `ranges`.

    Raises
    ------
    ValueError
        If no type does.
    """
    width = max((signed_width(each.low, each.high) for each in ranges), default=1)
    narrowest = next((bits for bits in TYPES if width <= bits), None)
    if narrowest is None:
        raise ValueError(f"values of the C model must be at most {max(TYPES)} bits wide, not {width}")
    return narrowest


def signed_width(low: int, high: int) -> int:
    """Count the bits of two's complement that hold `low` to `high`, also where neither is negative.

    Examples
    --------
    >>> signed_width(0, 2**63 - 1), signed_width(0, 2**63), signed_width(-(2**63), 0)
    (64, 65, 64)
    """
    return max((-low - 1).bit_length() if low < 0 else 0, max(high, 0).bit_length()) + 1


def wire(stage: int, node: int) -> str:
    """Return the name of a node."""
    return f"n{stage}_{node}"


def literal(number: int) -> str:
    """Write a number in the narrowest type."""
    if -(1 << 31) < number < 1 << 31:
        return f"INT32_C({number})"
    if -(1 << 63) < number < 1 << 63:
        return f"INT64_C({number})"
    high, low = divmod(number, 1 << 62)
    return f"((__int128)INT64_C({high}) * (INT64_C(1) << 62) + INT64_C({low}))"
