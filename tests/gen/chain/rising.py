"""Random chains with stages that interpolate, and what they compute exactly, by the definition of each stage."""

from __future__ import annotations

import random
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
from tests.gen.chain.chains import _filtered as filtered

import sosmith

UP: dict[str, Any] = {
    "name": "rx",
    "sample_rate": 8000.0,
    "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    "stage": [
        {"name": "fill", "kind": "fir", "interpolate": 2, "taps": [0.25, 0.5, 1.0, 0.75, 0.25]},
        {"name": "low", "kind": "iir", "family": "butterworth", "order": 1, "cutoff": 2000.0, "architecture": "folded"},
        {"name": "out", "kind": "cic", "order": 2, "interpolate": 4},
    ],
    "output": {"bits": 10, "range": [-2.0, 2.0], "signed": True},
}
SHAPES = ("u", "uu", "nu", "du", "ud", "nud", "ndu", "uni", "dudn", "ndnu", "nuud", "uddu")
"""Orders of stages: up, down, neither; i is one with poles."""


def draw(seed: int) -> dict[str, Any]:
    """Draw a specification; as many seeds in a row as there are shapes have all of them."""
    rng = random.Random(f"rising chain {seed}")
    shape, rate, stages = SHAPES[seed % len(SHAPES)], 64000.0, []
    for k, what in enumerate(shape):
        stage = _stage(rng, what, rate)
        stages.append({"name": f"s{k}", **stage})
        rate = rate * stage.get("interpolate", 1) / stage.get("decimate", 1)
    options = random.Random(f"hardware of rising chain {seed}")
    for stage in stages:
        if "decimate" not in stage:
            stage.update(options.choice([{}, {}, {"protect": "detect"}, {"protect": "correct"}]))
    bits, low = rng.randint(6, 16), rng.choice([0.0, -1.0])
    return {
        "name": f"rising{seed}",
        "sample_rate": 64000.0,
        "channels": rng.choice([1, 1, 3]),
        "input": {"x": {"bits": bits, "range": [low, 1.0], "signed": low < 0}},
        "stage": stages,
        "output": {"bits": rng.randint(8, 14), "range": [-2.0, 2.0], "signed": True},
        "hardware": {"clock": 96e6, **({"start": "zero"} if rng.random() < 0.4 else {})},
    }


def _stage(rng: random.Random, what: str, rate: float) -> dict[str, Any]:
    if what == "i":
        return {"kind": "iir", "family": "butterworth", "order": rng.randint(1, 3), "cutoff": rate / 10}
    if what == "n":
        if rng.random() < 0.5:
            return {"kind": "gain", "factor": rng.choice([-1, 1]) * rng.randint(3, 31) / 16}
        return {"kind": "fir", "taps": [0.5, *(rng.randint(-64, 64) / 128 for _ in range(rng.randint(1, 5)))]}
    key, factor = ("interpolate", rng.choice([2, 3, 4, 5])) if what == "u" else ("decimate", rng.choice([2, 3, 4]))
    kind = rng.choice(["fir", "cic", "halfband"])
    if kind == "cic":
        return {"kind": "cic", "order": rng.randint(1, 4), key: rng.choice([2, 4])}
    if kind == "halfband":
        top = rate * 2 if what == "u" else rate
        return {"kind": "halfband", "passband_edge": top / 10, "passband_loss": 0.1, "stopband_loss": 40.0, key: 2}
    taps = [rng.randint(1, 64) / 64 * rng.choice([-1, 1]) for _ in range(rng.randint(factor, 4 * factor))]
    return {"kind": "fir", "taps": taps, key: factor}


def steps_of(chain: sosmith.Chain) -> list[tuple[int, list[tuple[Sequence[Fraction], Sequence[Fraction]]], int]]:
    """Return what each stage does: zeros, sections, and by how much it decimates."""
    steps: list[tuple[int, list[tuple[Sequence[Fraction], Sequence[Fraction]]], int]] = []
    one = [Fraction(1)]
    for table, stage in zip(chain.specification.as_dict()["stage"], chain.core.stages, strict=True):
        rise, factor = table.get("interpolate", 1), table.get("decimate", 1)
        if table["kind"] == "cic":
            sums = [([Fraction(1, rise * factor)] * (rise * factor), one)] * table["order"]
            steps.append((rise, [([Fraction(rise)], one), *sums], factor))
        elif "taps" in table:
            steps.append((rise, [([Fraction(Decimal(repr(tap))) for tap in table["taps"]], one)], factor))
        elif rise > 1:
            phases = [core.quantized.filter.exact[0][0] for core in stage.cores if core.quantized.filter is not None]
            longest = max(map(len, phases))
            taps = [phase[n] if n < len(phase) else Fraction(0) for n in range(longest) for phase in phases]
            steps.append((rise, [(taps, one)], 1))
        else:
            assert stage.design.quantized.filter is not None
            steps.append((1, list(stage.design.quantized.filter.exact), factor))
    return steps


def exact(chain: sosmith.Chain, values: Sequence[Fraction]) -> list[Fraction]:
    """Results of one channel by definition, not limited: as if the first value had been there for ever, or 0."""
    steady = chain.core.spec.base.hardware.start == "steady"
    results = list(values)
    for rise, sections, factor in steps_of(chain):
        # Before the first value of a stage there were as many of it as any of its sections remembers, or zeros.
        before = sum(len(b) - 1 for b, _ in sections) // rise + 1 if rise > 1 else 0
        past = [results[0] if steady else Fraction(0)] * before
        spread = [value if n == 0 else Fraction(0) for value in [*past, *results] for n in range(rise)]
        for b, a in sections:
            spread = filtered(b, a, spread, steady=steady and rise == 1)
        results = spread[before * rise :][::factor]
    return results


def flags(chain: sosmith.Chain, codes: np.ndarray[Any, Any]) -> list[bool]:
    """Return `input_at_rail` of the results of one channel: of the samples since those of the results before."""
    (port,) = chain.core.spec.base.inputs
    numbers, rail = list(range(len(codes))), (codes == port.lowest) | (codes == port.highest)
    first = True
    told = list(rail)
    for rise, factor in chain.core.rates:
        numbers = [n for n in numbers for _ in range(rise)][::factor]
        if first and factor > 1:
            told = [bool(any(rail[max(0, n - factor + 1) : n + 1])) for n in numbers]
            rail, numbers = np.array(told), list(range(len(told)))
        elif first and rise > 1:
            rail, numbers = np.repeat(rail, rise), list(range(len(numbers)))
        first = False
    result, last, since = [], -1, False
    for n in numbers:
        if n != last:
            since, last = bool(any(rail[last + 1 : n + 1])), n
        result.append(since)
    return result


def stimulus(chain: sosmith.Chain, samples: int, seed: int) -> np.ndarray[Any, Any]:
    """Codes of shape (samples, channels): noise, and the ends of the range for a while."""
    (port,) = chain.core.spec.base.inputs
    rng = np.random.default_rng(seed)
    codes = rng.integers(port.lowest, port.highest, size=(samples, chain.core.spec.base.channels), endpoint=True)
    half = samples // 2
    codes[half:, 0] = np.where(rng.random(samples - half) < 0.5, port.lowest, port.highest)
    return codes
