"""Requests for stages that are chosen, and the gain of what was chosen by a calculation of the tests' own."""

from __future__ import annotations

import copy
import random
from typing import Any

import numpy as np

import sosmith

TREE: dict[str, Any] = {
    "name": "rx",
    "sample_rate": 8000.0,
    "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    "stage": [
        {
            "name": "down",
            "kind": "auto",
            "decimate": 8,
            "passband_edge": 150.0,
            "passband_loss": 0.5,
            "stopband_loss": 40.0,
            "stopband_edge": 900.0,
        }
    ],
    "output": {"bits": 10, "range": [-1.0, 1.0], "signed": True},
}

Values = np.ndarray[Any, np.dtype[np.float64]]


def asked(**keys: Any) -> dict[str, Any]:
    """Return `TREE` with other keys of the stage; None takes one away."""
    tree = copy.deepcopy(TREE)
    tree["stage"][0] |= keys
    tree["stage"][0] = {key: value for key, value in tree["stage"][0].items() if value is not None}
    return tree


def draw(seed: int) -> dict[str, Any]:
    """Draw a request: factors that are prime, powers of two or anything; all in reach of some structure, mostly."""
    rng = random.Random(f"auto {seed}")
    small = [2, 3, 5, 7, 11, 13, 31, 61]
    factor = rng.choice([rng.choice(small), 2 ** rng.randint(1, 7), rng.choice(small[:5]) * 2 ** rng.randint(1, 4)])
    rate = rng.choice([1000.0, 8000.0, 48000.0])
    edge = round(rng.uniform(0.1, 0.42) * rate, 1)
    stage = {
        "decimate": factor,
        "passband_edge": edge,
        "passband_loss": rng.choice([0.02, 0.1, 0.5]),
        "stopband_loss": rng.randint(40, 90),
        "stopband_edge": round(rng.uniform(edge * 1.3, rate), 1) if rng.random() < 0.3 and factor > 2 else None,
    }
    tree = asked(**stage)
    tree["sample_rate"] = rate * factor
    tree["output"]["bits"] = rng.choice([10, 14])
    tree["hardware"] = {"clock": 48.0e6}
    return tree


def gains(chain: sosmith.Chain, frequency: Values) -> Values:
    """Gain from end to end at frequencies in units of the rate of the input, from the taps and poles of the stages."""
    total, step = np.ones(len(frequency)), 1
    for stage in chain.core.stages:
        (part,) = stage.parts
        u = np.exp(-2j * np.pi * frequency * step)
        for taps, poles in part.sections:
            over, under = (np.polyval([float(c) for c in each][::-1], u) for each in (taps, poles))
            total = total * np.abs(over / under)
        step *= part.factor
    return total


def losses(chain: sosmith.Chain, tree: dict[str, Any], points: int = 20_001) -> tuple[float, float, float | None]:
    """How much gains in the pass band differ, and how far aliases and the stop band are below the largest, in dB."""
    (stage,), rate = tree["stage"], tree["sample_rate"]
    edge, factor = stage["passband_edge"] / rate, stage["decimate"]
    passed = gains(chain, np.linspace(0, edge, points))
    ends = [(k / factor - edge, min(k / factor + edge, 0.5)) for k in range(1, factor // 2 + 1)]
    aliases = max(gains(chain, np.linspace(*each, max(101, points // factor))).max() for each in ends if each[0] < 0.5)
    stopped = None
    if "stopband_edge" in stage:
        stopped = gains(chain, np.linspace(stage["stopband_edge"] / rate, 0.5, 4 * points)).max()
    most, least = passed.max(), passed.min()
    down = [None if each is None else float(20 * np.log10(most / each)) for each in (aliases, stopped)]
    assert down[0] is not None
    return float(20 * np.log10(most / least)), down[0], down[1]
