"""Stacks of small matrices against numpy's own, one by one, in whole numbers: nothing is rounded."""

import numpy as np

from sosmith.model.arithmetic.stacked_matrices import (
    applied,
    cholesky,
    dot,
    identity,
    product,
    solved,
    solved_transposed,
    transposed,
)

STACK = (2, 3)


def whole(seed: int, *shape: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(-9, 10, (*shape, *STACK)).astype(float)


def one_by_one(a: np.ndarray) -> np.ndarray:
    """Return the stack with rows and columns last, as numpy takes it."""
    return np.moveaxis(a, (0, 1), (-2, -1))


def triangular(size: int) -> np.ndarray:
    lower = whole(3, size, size)
    for k in range(size):
        lower[k, k] = 1 + np.abs(lower[k, k])
        lower[k, k + 1 :] = 0
    return lower


def test_products() -> None:
    a, b, x, y = whole(1, 3, 4), whole(2, 4, 2), whole(4, 4), whole(5, 4)
    assert np.array_equal(one_by_one(product(a, b)), one_by_one(a) @ one_by_one(b))
    assert np.array_equal(applied(a, x), np.einsum("pq...,q...->p...", a, x))
    assert np.array_equal(dot(x, y), (x * y).sum(axis=0))
    assert np.array_equal(one_by_one(transposed(a)), one_by_one(a).swapaxes(-2, -1))
    assert np.array_equal(product(a, identity(4, STACK)), a)
    assert np.array_equal(identity(4), np.eye(4))


def test_a_root_is_found_again() -> None:
    for size in range(1, 6):
        lower = triangular(size)
        assert np.array_equal(cholesky(product(lower, transposed(lower))), lower)


def test_equations_are_solved() -> None:
    for size in range(1, 6):
        lower, x = triangular(size), whole(6, size, 2)
        assert np.array_equal(solved(lower, product(lower, x)), x)
        assert np.array_equal(solved_transposed(lower, product(transposed(lower), x)), x)


def test_one_right_side_is_for_all_of_a_stack() -> None:
    lower = identity(3, STACK) * 2
    right = np.arange(6.0).reshape(3, 2, 1, 1)
    for solve in (solved, solved_transposed):
        assert np.array_equal(solve(lower, right), np.broadcast_to(right / 2, (3, 2, *STACK)))
