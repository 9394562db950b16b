"""Low-pass filters at random, of every family, with a decimator before them."""

import random
from typing import Any

FAMILIES = ("butterworth", "chebyshev1", "chebyshev2", "elliptic", "bessel")
_LOSSES = {
    "chebyshev1": ("passband_loss",),
    "chebyshev2": ("stopband_loss",),
    "elliptic": ("passband_loss", "stopband_loss"),
}


def lowpass(draw: random.Random, number: int, cutoff: float, factor: int) -> dict[str, Any]:
    """Return the table of a filter; every fifth leaves the factor to the design."""
    family = FAMILIES[number % len(FAMILIES)]
    least = 2 if family in {"chebyshev2", "elliptic"} else 1
    losses = {key: 0.5 if key == "passband_loss" else 50 for key in _LOSSES.get(family, ())}
    return {
        "family": family,
        "kind": "lowpass",
        "order": max(least, draw.randint(1, 7)),
        "cutoff": float(f"{cutoff:.4g}"),
        "decimate": "auto" if number % 5 == 4 else factor,
        **losses,
    }
