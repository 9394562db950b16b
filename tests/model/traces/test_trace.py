"""Traces: what they must be, and what follows from them."""

from __future__ import annotations

import re
from fractions import Fraction

import numpy as np
import pytest

from sosmith.model.port import Port
from sosmith.model.traces.trace import Trace

VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
TEMPERATURE = Port.from_range("temperature", 16, Fraction(0), Fraction(128), unit="degC")
SENSORS = (VOLTAGE, TEMPERATURE)
RATE = Fraction(100)


def test_time_and_values_are_physical() -> None:
    trace = Trace(name="t", ports=SENSORS, sample_rate=RATE, codes=np.array([[32768, 8192], [0, 65535]]))
    assert trace.time.tolist() == [0.0, 0.01]
    assert trace.values().tolist() == [[5.0, 16.0], [0.0, 128 - 128 / 65536]]
    assert len(trace) == 2


def test_arrays_are_read_only_copies() -> None:
    codes = np.zeros((2, 2), dtype=np.int64)
    trace = Trace(name="t", ports=SENSORS, sample_rate=RATE, codes=codes, truth=np.ones(2), reading=np.ones(2, bool))
    codes[0, 0] = 7
    assert trace.codes[0, 0] == 0
    for array in (trace.codes, trace.truth, trace.reading):
        assert array is not None
        assert not array.flags.writeable


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sample_rate": Fraction(0)}, "sample_rate must be positive, not 0"),
        ({"codes": np.zeros((0, 2))}, "codes must be of shape (n, 2) with n > 0, not (0, 2)"),
        ({"codes": np.zeros((4, 1))}, "codes must be of shape (n, 2) with n > 0, not (4, 1)"),
        ({"codes": np.array([[0, 0], [0, 65536]])}, "temperature must be in 0..65535, not 65536"),
        ({"codes": np.array([[-1, 0], [0, 0]])}, "voltage must be in 0..65535, not -1"),
        ({"truth": np.ones(3)}, "truth must be 2 finite numbers, not of shape (3,)"),
        ({"truth": np.array([1.0, np.nan])}, "truth must be 2 finite numbers, not of shape (2,)"),
        ({"reading": np.ones(1, bool)}, "reading must be 2 flags, not of shape (1,)"),
    ],
)
def test_construction_refusals(changes: dict[str, object], message: str) -> None:
    arguments = {"name": "t", "ports": SENSORS, "sample_rate": RATE, "codes": np.zeros((2, 2)), **changes}
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Trace(**arguments)
