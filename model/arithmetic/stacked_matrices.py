"""Algebra of many small matrices at once, the same to the last bit on every machine.

A stack of matrices has its rows and columns first: shape (rows, columns, ...). Every operation is a sum, product,
quotient or root of whole arrays, element by element, in a fixed order; the kernels behind numpy's own matrix products
differ from machine to machine, and with them the last bits.
"""

from __future__ import annotations

import numpy as np

from sosmith.model.arrays import Values


def product(a: Values, b: Values) -> Values:
    """Return the matrix products, shape (p, r, ...), of shapes (p, q, ...) and (q, r, ...)."""
    total = a[:, 0, None] * b[None, 0]
    for k in range(1, a.shape[1]):
        total = total + a[:, k, None] * b[None, k]
    return np.asarray(total)


def applied(a: Values, x: Values) -> Values:
    """Return matrices times vectors, shape (p, ...), of shapes (p, q, ...) and (q, ...)."""
    return product(a, x[:, None])[:, 0]


def dot(x: Values, y: Values) -> Values:
    """Return the scalar products of two stacks of vectors, shapes (q, ...)."""
    return np.asarray(product(x[None], y[:, None])[0, 0])


def transposed(a: Values) -> Values:
    """Return the transposed matrices."""
    return np.swapaxes(a, 0, 1)


def identity(size: int, stack: tuple[int, ...] = ()) -> Values:
    """Return a stack of unit matrices."""
    return np.broadcast_to(np.eye(size).reshape(size, size, *[1] * len(stack)), (size, size, *stack)).copy()


def cholesky(a: Values) -> Values:
    """Return the lower triangular L with ``L L' = a``; `a` must be symmetric and positive definite."""
    rest, lower = a.copy(), np.zeros_like(a)
    for k in range(len(a)):
        lower[k:, k] = rest[k:, k] / np.sqrt(rest[k, k])
        rest[k + 1 :, k + 1 :] -= lower[k + 1 :, k, None] * lower[None, k + 1 :, k]
    return lower


def solved(lower: Values, b: Values) -> Values:
    """Return x with ``lower x = b``, for stacks of matrices b."""
    x = np.broadcast_arrays(b, lower[:, :1])[0].copy()
    for k in range(len(x)):
        x[k] = x[k] / lower[k, k]
        x[k + 1 :] -= lower[k + 1 :, k, None] * x[None, k]
    return x


def solved_transposed(lower: Values, b: Values) -> Values:
    """Return x with ``lower' x = b``, for stacks of matrices b."""
    x = np.broadcast_arrays(b, lower[:, :1])[0].copy()
    for k in reversed(range(len(x))):
        x[k] = x[k] / lower[k, k]
        x[:k] -= lower[k, :k, None] * x[None, k]
    return x
