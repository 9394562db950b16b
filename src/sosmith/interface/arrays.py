"""Arrays of numbers that callers pass, or the sentence that refuses them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sosmith.model.errors import SpecificationError


def real_numbers(values: npt.ArrayLike, what: str) -> npt.NDArray[np.float64]:
    """Return an array of `values` in double precision; `what` begins the sentence that refuses others.

    Raises
    ------
    SpecificationError
        If a value is masked or not a real number, or rows differ in length.
    """
    array = number_array(values, what)
    if array.dtype.kind in _NO_REAL_NUMBERS:
        raise SpecificationError(f"{what} must be real numbers, not {_NO_REAL_NUMBERS[array.dtype.kind]}")
    try:
        return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):  # an array of objects: fractions are numbers, others are not
        raise SpecificationError(f"{what} must be real numbers in the range of a double, not other objects") from None


_NO_REAL_NUMBERS = {"c": "complex ones", "U": "text", "S": "bytes", "M": "dates", "m": "durations", "V": "records"}
"""What arrays hold that numpy would convert to other numbers than are meant, or to none, by the kind of their type."""


def number_array(values: npt.ArrayLike, what: str) -> npt.NDArray[np.generic]:
    """Return an array of any numbers: what numpy would ignore or refuse in its own words is refused here.

    Raises
    ------
    SpecificationError
        If a value is masked, or rows differ in length.
    """
    masked = int(np.sum(values.mask)) if isinstance(values, np.ma.MaskedArray) else 0
    if masked:
        raise SpecificationError(f"{what} must all be known, not masked ({masked} of {np.size(values)}): fill the gaps")
    try:
        return np.asarray(values)
    except ValueError:
        raise SpecificationError(f"{what} must be in rows of one length, not in rows of different ones") from None
