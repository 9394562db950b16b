"""Random FIR filters that decimate, as specifications, with the exact taps."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np
from tests.interface.fir_draws import SHAPES, FirDraw, taps_of

import sosmith


def draw(seed: int) -> FirDraw:
    """Draw a filter of 2 to 64 taps that decimates by 2 to 64; every 5 seeds in a row have all shapes."""
    rng = random.Random(f"decimating fir {seed}")
    shape = SHAPES[seed % len(SHAPES)]
    words = taps_of(rng, shape, rng.randint(2, 64))
    bits, output_bits = rng.randint(8, 24), rng.randint(8, 24)
    channels = rng.choice([1, 1, 1, 2, 5, 8])
    factor = rng.choice([2, 2, 3, 4, 7, 16, 64])
    low, high = rng.choice([(-1.0, 1.0), (-2.0, 2.0), (0.0, 4.0)])
    gain = float(sum(map(abs, words))) * max(-low, high)
    reach = 2.0 ** np.ceil(np.log2(gain)) / rng.choice([1, 1, 4])
    tree: dict[str, Any] = {
        "name": f"down{seed}",
        "sample_rate": 1000.0,
        "channels": channels,
        "input": {"x": {"bits": bits, "range": [low, high], "signed": low == -high}},
        "filter": {"taps": words, "decimate": factor, "hold": rng.random() < 0.3},
        "output": {"bits": output_bits, "range": [-reach, reach], "signed": rng.random() < 0.8},
        "hardware": {"start": rng.choice(["zero", "steady"]), "clock": 48e6},
    }
    if rng.random() < 0.5:
        tree["output"]["max_error"] = round(2 * reach / 2**output_bits * rng.uniform(0.6, 3), 12)
    return FirDraw(sosmith.Specification.load(tree), tuple(map(Fraction, words)), shape)
