"""Random chains of stages, and what they compute exactly, by the definition of each stage."""

from __future__ import annotations

import random
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np

import sosmith

_GRID = 1 << 220
"""Recursions are computed to this step: what it rounds is far below any claim."""

PLAIN: dict[str, Any] = {
    "name": "rx",
    "sample_rate": 8000.0,
    "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    "stage": [
        {"name": "slow", "kind": "cic", "order": 2, "decimate": 2},
        {"name": "double", "kind": "fir", "taps": [0.5, 0.5], "architecture": "parallel"},
        {"name": "out", "kind": "fir", "taps": [0.25, 0.5, 0.25], "decimate": 2, "architecture": "folded"},
    ],
    "output": {"bits": 10, "range": [-1.0, 1.0], "signed": True},
}
GUARDED: dict[str, Any] = {
    "name": "rx",
    "sample_rate": 8000.0,
    "channels": 2,
    "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    "stage": [
        {"name": "slow", "kind": "cic", "order": 2, "decimate": 2},
        {"name": "low", "kind": "iir", "family": "butterworth", "order": 2, "cutoff": 400.0, "protect": "detect"},
        {"name": "out", "kind": "fir", "taps": [0.25, 0.5, 0.25], "reload": True},
    ],
    "output": {"bits": 10, "range": [-1.0, 1.0], "signed": True},
    "hardware": {"start": "zero"},
}

KINDS = ("gain", "fir", "cic", "halfband", "iir", "decimated iir")


def instrument() -> dict[str, Any]:
    """Return a calibration of two inputs before an FIR filter that decimates."""
    return {
        "name": "gauge",
        "sample_rate": 100.0,
        "input": {
            "voltage": {"bits": 10, "range": [0.0, 10.0]},
            "temperature": {"bits": 10, "range": [0.0, 128.0]},
        },
        "stage": [
            {"name": "cal", "kind": "polynomial", "coefficients": [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]},
            {"name": "low", "kind": "fir", "taps": [0.25, 0.5, 0.25], "decimate": 2},
        ],
        "output": {"bits": 12, "range": [0.0, 16.0], "unit": "mm"},
    }


def draw(seed: int) -> dict[str, Any]:
    """Draw a specification of 2 to 4 stages; six seeds in a row begin with all kinds."""
    rng = random.Random(f"chain {seed}")
    rate, stages = 64000.0, []
    for k in range(rng.randint(2, 4)):
        kind = KINDS[seed % len(KINDS)] if k == 0 else rng.choice(KINDS)
        stage = _stage(rng, kind, rate)
        stages.append({"name": f"s{k}", **stage})
        rate /= stage.get("decimate", 1)
    options = random.Random(f"hardware of chain {seed}")
    start: dict[str, Any] = {}
    if options.random() < 0.4:
        start = {"start": "zero"}
    for stage in stages:
        guards: list[dict[str, Any]] = [{"protect": "detect"}, {"protect": "correct"}]
        stage.update(options.choice([{}, {"reload": True}, *guards]))
    bits, low = rng.randint(6, 16), rng.choice([0.0, -1.0])
    return {
        "name": f"chain{seed}",
        "sample_rate": 64000.0,
        "channels": rng.choice([1, 1, 1, 3]),
        "input": {"x": {"bits": bits, "range": [low, 1.0], "signed": low < 0}},
        "stage": stages,
        "output": {"bits": rng.randint(8, 16), "range": [-0.5, 0.5], "signed": True},
        "hardware": {"clock": 48e6, **start},
    }


def _stage(rng: random.Random, kind: str, rate: float) -> dict[str, Any]:
    decimate: dict[str, Any] = {"decimate": rng.choice([2, 4])} if rng.random() < 0.7 else {}
    match kind:
        case "gain":
            return {"kind": "gain", "factor": rng.choice([-1, 1]) * rng.randint(3, 31) / 16}
        case "fir":
            taps = [rng.randint(-64, 64) / 128 for _ in range(rng.randint(2, 12))]
            return {"kind": "fir", "taps": [0.5, *taps], **decimate}
        case "cic":
            return {"kind": "cic", "order": rng.randint(1, 4), "decimate": rng.choice([2, 4, 8])}
        case "halfband":
            edges = {"passband_edge": rate / 16, "passband_loss": 0.1, "stopband_loss": 40.0}
            return {"kind": "halfband", **edges, **({"decimate": 2} if decimate else {})}
        case "iir":
            return {"kind": "iir", "family": "butterworth", "order": rng.randint(1, 3), "cutoff": rate / 10}
        case _:
            cutoff = {"family": "butterworth", "order": rng.randint(2, 3), "cutoff": rate / 40}
            return {"kind": "iir", **cutoff, "decimate": rng.choice([2, 4])}


def steps_of(chain: sosmith.Chain) -> list[tuple[list[tuple[Sequence[Fraction], Sequence[Fraction]]], int]]:
    """Return what each stage does: sections, and by how much it decimates; a CIC filter and filter are two."""
    steps: list[tuple[list[tuple[Sequence[Fraction], Sequence[Fraction]]], int]] = []
    for table, stage in zip(chain.specification.as_dict()["stage"], chain.core.stages, strict=True):
        filter_ = stage.design.quantized.filter
        assert filter_ is not None
        one, factor = [Fraction(1)], table.get("decimate", 1)
        if table["kind"] == "cic":
            steps.append(([([Fraction(1, factor)] * factor, one)] * table["order"], factor))
        elif table["kind"] == "iir" and factor > 1:
            decimator = stage.design.datapath.decimator
            assert decimator is not None
            steps.append(([([Fraction(1, factor)] * factor, one)] * decimator.stages, factor))
            steps.append((list(filter_.exact), 1))
        elif "taps" in table:
            steps.append(([([Fraction(Decimal(repr(tap))) for tap in table["taps"]], one)], factor))
        else:
            steps.append((list(filter_.exact), factor))
    return steps


def exact(chain: sosmith.Chain, values: Sequence[Fraction]) -> list[Fraction]:
    """Results of one channel by definition, not limited: as if the first value had been there for ever, or 0."""
    steady = chain.core.spec.base.hardware.start == "steady"
    for sections, factor in steps_of(chain):
        for numerator, denominator in sections:
            values = _filtered(numerator, denominator, values, steady=steady)
        values = values[::factor]
    return list(values)


def flags(chain: sosmith.Chain, codes: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return `input_at_rail` of the results of one channel, by definition: of any sample since the result before."""
    (port,) = chain.core.spec.base.inputs
    at_rail = (codes == port.lowest) | (codes == port.highest)
    ends = range(0, len(codes), chain.factor)
    return np.array([at_rail[max(end - chain.factor + 1, 0) : end + 1].any() for end in ends])


def _filtered(
    b: Sequence[Fraction], a: Sequence[Fraction], values: Sequence[Fraction], *, steady: bool
) -> list[Fraction]:
    first = values[0] if steady else Fraction(0)
    steady = first * sum(b, Fraction(0)) / sum(a, Fraction(0))
    past, results = [first] * (len(b) - 1), list[Fraction]()
    before = [steady] * (len(a) - 1)
    for value in values:
        past = [value, *past][: len(b)]
        result = sum((c * x for c, x in zip(b, past, strict=True)), Fraction(0))
        result -= sum((c * y for c, y in zip(a[1:], before, strict=True)), Fraction(0))
        if len(a) > 1:
            result = Fraction(round(result * _GRID), _GRID)
        before = [result, *before][: len(a) - 1]
        past = past[: len(b) - 1] if len(b) > 1 else []
        results.append(result)
    return results


def response(chain: sosmith.Chain, count: int = 4000) -> np.ndarray[Any, Any]:
    """Impulse response from end to end at the rate of the input, in doubles."""
    total, step = np.zeros(count), 1
    total[0] = 1
    for sections, factor in steps_of(chain):
        for b, a in sections:
            total = _spread_filter(b, a, step, total)
        step *= factor
    return total


def _spread_filter(
    b: Sequence[Fraction], a: Sequence[Fraction], step: int, x: np.ndarray[Any, Any]
) -> np.ndarray[Any, Any]:
    result = np.zeros(len(x))
    for k, c in enumerate(b):
        if k * step < len(x):
            result[k * step :] += float(c) * x[: len(x) - k * step]
    if len(a) > 1:
        for n in range(len(x)):
            for k in range(1, len(a)):
                if n >= k * step:
                    result[n] -= float(a[k]) * result[n - k * step]
    return result


def stimulus(chain: sosmith.Chain, samples: int, seed: int) -> np.ndarray[Any, Any]:
    """Codes of shape (samples, channels): noise, and the ends of the range in the order that reaches furthest."""
    (port,) = chain.core.spec.base.inputs
    rng = np.random.default_rng(seed)
    codes = rng.integers(port.lowest, port.highest, size=(samples, chain.core.spec.base.channels), endpoint=True)
    worst = response(chain, min(samples - samples // 3, 600))
    ends = np.where(worst[::-1] > 0, port.highest, port.lowest)
    last = (samples - 1) // chain.factor * chain.factor
    codes[last - len(ends) + 1 : last + 1, 0] = ends
    return codes
