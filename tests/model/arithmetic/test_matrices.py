"""Products and powers of matrices against exact ones."""

import numpy as np
import pytest

from sosmith.model.arithmetic.matrices import power, product


def test_products_of_integers_are_exact() -> None:
    draw = np.random.default_rng(1)
    a, b = draw.integers(-99, 99, (7, 5)), draw.integers(-99, 99, (5, 3))
    assert np.array_equal(product(a.astype(float), b.astype(float)), a @ b)


def test_powers_of_integers_are_exact() -> None:
    a = np.array([[1, 2], [-1, 1]])
    for exponent in range(12):
        assert np.array_equal(power(a.astype(float), exponent), np.linalg.matrix_power(a, exponent))


@pytest.mark.parametrize("rows", [4, 6])
def test_matrices_that_do_not_fit_have_no_product(rows: int) -> None:
    with pytest.raises(ValueError, match=r"^zip\(\) argument 2 is (shorter|longer) than argument 1$"):
        product(np.ones((7, 5)), np.ones((rows, 3)))
