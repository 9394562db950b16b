"""Small designs for the tests of the interface, each made once."""

from functools import cache
from typing import Any

import sosmith

FILTER: dict[str, Any] = {
    "name": "plain",
    "sample_rate": 1000,
    "input": {"x": {"bits": 10, "range": [-1.0, 1.0], "signed": True}},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 100.0},
    "output": {"bits": 10, "range": [-1.0, 1.0], "signed": True},
    "hardware": {"realization": "df1_ef1", "architecture": "parallel"},
}

INSTRUMENT: dict[str, Any] = {
    "name": "gauge",
    "sample_rate": 100,
    "channels": 2,
    "input": {"voltage": {"bits": 12, "range": [0.0, 10.0]}, "temperature": {"bits": 10, "range": [0.0, 128.0]}},
    "calibration": {"coefficients": [[1.16, -0.0036], [0.3672]]},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 1, "cutoff": 10.0},
    "output": {"bits": 12, "range": [0.0, 16.0], "unit": "mm", "max_error": 0.01},
    "hardware": {"realization": "df1_ef1", "architecture": "parallel"},
}


@cache
def filter_design() -> sosmith.Design:
    """Design a plain filter of one section."""
    return sosmith.design(FILTER)


@cache
def instrument_design() -> sosmith.Design:
    """Design an instrument of two channels."""
    return sosmith.design(INSTRUMENT)
