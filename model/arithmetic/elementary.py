"""Elementary functions of arrays, value by value in the C library's scalar functions.

numpy's exponential, logarithms, powers and arc functions have an implementation for each set of vector instructions,
and their last bits differ. The same goes for products and magnitudes of complex arrays. Its sine, cosine, hypotenuse,
square root, Fourier transform, and sums and products of real arrays have only one.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def exp(values: npt.ArrayLike) -> Array:
    """Exponential of every value."""
    return _each(math.exp, values)


def log10(values: npt.ArrayLike) -> Array:
    """Decimal logarithm of every value, which must be positive."""
    return _each(math.log10, values)


def geometric(first: float, last: float, count: int) -> Array:
    """Values from `first` to `last`, both positive, each by the same factor above the one before; shape (count,)."""
    steps = np.arange(count) / max(count - 1, 1)
    values = exp(math.log(first) + steps * (math.log(last) - math.log(first)))
    values[0], values[-1] = first, last
    return values


def _each(function: Callable[[float], float], values: npt.ArrayLike) -> Array:
    given = np.asarray(values, dtype=np.float64)
    return np.array([function(value) for value in given.ravel().tolist()], dtype=np.float64).reshape(given.shape)
