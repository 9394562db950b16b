"""Random specifications for the multiplexed architecture: filters of all kinds, with and without a calibration."""

from __future__ import annotations

import random
from typing import Any

_FAMILIES = {
    "butterworth": {},
    "chebyshev1": {"passband_loss": 0.5},
    "chebyshev2": {"stopband_loss": 50.0},
    "elliptic": {"passband_loss": 0.5, "stopband_loss": 50.0},
    "bessel": {},
}
_REALIZATIONS = ("auto", "auto", "auto", "df1", "df1_ef1", "df1_ef2", "df2t", "delta", "state_space")
_CLOCKS = (8.0, 40.0, 60.0, 100.0)
"""Clocks in MHz, for which a turn is spread over one clock to four."""


def drawn(seed: int) -> dict[str, Any]:
    """Return a specification, which may turn out not to be possible."""
    rng = random.Random(seed)
    family = rng.choice([*_FAMILIES])
    kind = rng.choice(("lowpass", "lowpass", "highpass", "bandpass", "bandstop"))
    cutoff = 10 ** rng.uniform(-2.4, -0.7)
    band = kind in {"bandpass", "bandstop"}
    order = rng.randint(2, 4) if band else rng.randint(4, 8)
    bits = rng.randint(8, 18)
    signed = rng.random() < 0.7
    low = -1.0 if signed else 0.0
    tree: dict[str, Any] = {
        "name": f"turns{seed}",
        "sample_rate": 1000.0,
        "input": {"x": {"bits": bits, "range": [low, 1.0], "signed": signed}},
        "filter": {
            "family": family,
            "kind": kind,
            "order": order,
            "cutoff": [cutoff * 1000, cutoff * rng.uniform(1.3, 2.0) * 1000] if band else cutoff * 1000,
            **_FAMILIES[family],
        },
        "output": {
            "bits": rng.randint(8, 18),
            "range": [-2.0, 2.0],
            "signed": True,
            "max_error": rng.choice((2.0**-4, 2.0**-6, 2.0**-9)),
        },
        "hardware": {
            "architecture": "multiplexed",
            "realization": rng.choice(_REALIZATIONS),
            "clock": rng.choice(_CLOCKS) * 1e6,
            "start": rng.choice(("steady", "zero")),
        },
    }
    return tree
