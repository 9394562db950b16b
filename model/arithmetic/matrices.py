"""Products of matrices that are the same on every machine: numpy's own depend on the processor's BLAS kernels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def product(a: Array, b: Array) -> Array:
    """Product of two matrices, its sums taken term by term from the first on.

    Parameters
    ----------
    a : ndarray, shape (m, n)
    b : ndarray, shape (n, k)
        Few of them in n: each takes one pass over the result.

    Returns
    -------
    ndarray, shape (m, k)

    Examples
    --------
    >>> product(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[5.0], [6.0]])).tolist()
    [[17.0], [39.0]]
    """
    total: Array = np.zeros((len(a), b.shape[1]))
    for column, row in zip(a.T, b, strict=True):
        total += np.multiply.outer(column, row)
    return total


def power(a: Array, exponent: int) -> Array:
    """Power of a square matrix with an exponent that is not negative, by repeated squaring.

    Examples
    --------
    >>> power(np.array([[1.0, 1.0], [0.0, 1.0]]), 5).tolist()
    [[1.0, 5.0], [0.0, 1.0]]
    """
    result: Array = np.eye(len(a))
    while exponent:
        if exponent & 1:
            result = product(result, a)
        a, exponent = product(a, a), exponent >> 1
    return result
