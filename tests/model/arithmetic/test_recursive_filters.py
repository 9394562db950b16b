"""Recursive filters give what `scipy.signal` gives, to the last bit, with its compiled functions and without them."""

import numpy as np
import pytest
from scipy import signal

from sosmith.model.arithmetic import recursive_filters
from sosmith.model.arithmetic.recursive_filters import lfilter, sosfilt


@pytest.fixture(name="places", params=["where they are", "elsewhere"], autouse=True)
def _places(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let scipy have its compiled functions where they are expected, or elsewhere."""
    functions = (recursive_filters._recursion, recursive_filters._cascade)
    if request.param == "elsewhere":
        monkeypatch.setattr(recursive_filters, "_compiled", lambda module, function: None)
    for function in functions:
        monkeypatch.setattr(recursive_filters, function.__name__, function.__wrapped__)


def test_they_are_those_of_scipy() -> None:
    random = np.random.default_rng(1)
    for order in range(4):
        x = random.standard_normal(500)
        b, a = random.standard_normal(order + 1), np.append(1.5, 0.2 * random.standard_normal(order))
        assert np.array_equal(lfilter(b, a, x), signal.lfilter(b, a, x))
        sos = 0.3 * random.standard_normal((order + 1, 6))
        sos[:, 3] = 1.0
        kept = x.copy()
        assert np.array_equal(sosfilt(sos, x), signal.sosfilt(sos, x))
        assert np.array_equal(x, kept)


def test_the_compiled_functions_are_found() -> None:
    assert recursive_filters._compiled("_sigtools", "no_such_function") is None
    assert recursive_filters._compiled("_no_such_module", "sosfilt") is None
