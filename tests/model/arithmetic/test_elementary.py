"""Elementary functions of arrays: the C library's values in the array's shape."""

import math

import numpy as np
import pytest

from sosmith.model.arithmetic.elementary import exp, geometric, log10


def test_every_value_is_the_c_librarys() -> None:
    values = np.random.default_rng(2).uniform(0.01, 9, (3, 4))
    assert exp(values).tolist() == [[math.exp(value) for value in row] for row in values.tolist()]
    assert log10(values).tolist() == [[math.log10(value) for value in row] for row in values.tolist()]
    assert exp(0.0).shape == ()


def test_geometric_values_keep_their_ends() -> None:
    found = geometric(0.3, 70.0, 30)
    assert (found[0], found[-1], len(found)) == (0.3, 70.0, 30)
    assert found[1:] / found[:-1] == pytest.approx((70 / 0.3) ** (1 / 29), rel=1e-13)
    assert geometric(2.0, 2.0, 1).tolist() == [2.0]
