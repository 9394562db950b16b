"""Small cores whose sections take turns, of every kind."""

from __future__ import annotations

from functools import cache
from typing import Any

from tests.verify.multirate.single_cores import Made, proven_alone

import sosmith

CASES: dict[str, dict[str, Any]] = {
    "direct form": {"realization": "df1_ef2"},
    "from zero": {"realization": "df1_ef2", "start": "zero"},
    "three clocks a turn": {"realization": "df1_ef2", "clock": 120e6},
    "from zero, three clocks a turn": {"realization": "df1_ef2", "clock": 120e6, "start": "zero"},
    "a section alone": {"realization": "df1", "order": 5},
    "three sections": {"realization": "df2t", "order": 6, "clock": 60e6},
    "delta": {"realization": "delta", "start": "zero"},
    "behind a calibration": {"realization": "df1_ef2", "calibrated": True},
    "other products": {"realization": "df1", "family": "chebyshev2", "kind": "highpass", "order": 5, "start": "zero"},
}


@cache
def made(case: str = "direct form") -> Made:
    asked = dict(CASES[case])
    family = asked.pop("family", "butterworth")
    losses = {"stopband_loss": 40.0} if family == "chebyshev2" else {}
    kind, order = asked.pop("kind", "lowpass"), asked.pop("order", 4)
    port = {"bits": 6, "range": [-1.0, 1.0], "signed": True}
    calibrated = asked.pop("calibrated", False)
    tree: dict[str, Any] = {
        "name": "turns",
        "sample_rate": 1000.0,
        "input": {"voltage": port, "temperature": port} if calibrated else {"x": port},
        "filter": {"family": family, "kind": kind, "order": order, "cutoff": 100.0, **losses},
        "output": {"bits": 7, "range": [-1.0, 1.0], "signed": True, "max_error": 0.05},
        "hardware": {"architecture": "multiplexed", "clock": 1e5} | asked,
    }
    if calibrated:
        tree |= {"calibration": {"coefficients": [[0.0, 0.1], [0.5, 0.1]]}}
        tree |= {"wear": {"initial": -0.5, "warning": 0.25, "limit": 0.5}}
    return proven_alone(sosmith.design(sosmith.Specification.load(tree)))
