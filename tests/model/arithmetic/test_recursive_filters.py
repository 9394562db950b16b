"""Recursive filters give what `scipy.signal` gives, to the last bit, with its compiled functions and without them."""

import numpy as np
import pytest
from scipy import signal

from sosmith.model.arithmetic import recursive_filters
from sosmith.model.arithmetic.recursive_filters import dc_gain, lfilter, sosfilt


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


def test_sections_with_more_taps_and_no_poles() -> None:
    """Whole numbers, so that nothing is rounded; in one piece and in several, of which one is empty."""
    random = np.random.default_rng(2)
    taps, x = random.integers(-9, 10, (3, 5)).astype(float), random.integers(-99, 100, 40).astype(float)
    sections = np.hstack([taps, np.zeros((3, 5))])
    sections[:, 5] = 2, 1, 4
    expected = x
    for row in sections:
        expected = np.convolve(expected, row[:5] / row[5])[:40]
    assert np.array_equal(sosfilt(sections, x), expected)
    states = np.zeros((3, 4))
    pieces = [sosfilt(sections, piece, states) for piece in np.split(x, [2, 2, 3, 20])]
    assert np.array_equal(np.concatenate(pieces), expected)
    assert np.array_equal(states[0], x[-4:])
    assert dc_gain(sections) == np.prod(taps.sum(axis=1)) / 8
    sections[1, 6] = 0.5
    with pytest.raises(ValueError, match=r"^sections of 5 taps must have no poles$"):
        sosfilt(sections, x)
