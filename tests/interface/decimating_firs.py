"""Random FIR filters that decimate, as specifications, with the exact taps."""

from __future__ import annotations

import random
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
from tests.interface.fir_draws import SHAPES, FirDraw, taps_of

import sosmith
from sosmith.model.dataflow.cic import impulse_response

OTHERS = 40
"""Number of the first seed of CIC filters."""


def draw(seed: int) -> FirDraw:
    """Draw a filter of 2 to 64 taps that decimates by 2 to 64; every 5 seeds in a row have all shapes.

    From `OTHERS` on, it is a CIC filter, of up to 190 taps.
    """
    rng = random.Random(f"decimating fir {seed}")
    shape = SHAPES[seed % len(SHAPES)] if seed < OTHERS else "cic"
    words = taps_of(rng, shape, rng.randint(2, 64)) if seed < OTHERS else []
    bits, output_bits = rng.randint(8, 24), rng.randint(8, 24)
    channels = rng.choice([1, 1, 1, 2, 5, 8])
    factor = rng.choice([2, 2, 3, 4, 7, 16, 64])
    if seed >= OTHERS:
        order = rng.randint(1, 3 if factor == 64 else 6)
        scale = Decimal(2) ** -rng.randint(0, 12)
        words = [tap * scale for tap in impulse_response(factor, order)]
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
    if random.Random(f"architecture of {seed}").random() < 0.5:
        tree["hardware"]["architecture"] = "parallel"
    return FirDraw(sosmith.Specification.load(tree), tuple(map(Fraction, words)), shape)
