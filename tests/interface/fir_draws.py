"""Random FIR filters as specifications, and what they compute in exact arithmetic, by definition."""

from __future__ import annotations

import random
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import sosmith

ARCHITECTURES = ("parallel", "folded", "serial")
SHAPES = ("symmetric", "antisymmetric", "half-band", "any", "few")


class FirDraw(NamedTuple):
    """A random specification, the exact taps, and how a filter with them was drawn."""

    specification: sosmith.Specification
    taps: tuple[Fraction, ...]
    shape: str


def draw(seed: int) -> FirDraw:
    """Draw an FIR filter of 2 to 64 taps; every 3 seeds in a row have all architectures, every 5 all shapes."""
    rng = random.Random(f"fir {seed}")
    shape = SHAPES[seed % len(SHAPES)]
    words = taps_of(rng, shape, rng.randint(2, 64))
    bits, output_bits = rng.randint(8, 24), rng.randint(8, 24)
    channels = rng.choice([1, 1, 1, 2, 5])
    architecture = ARCHITECTURES[seed % len(ARCHITECTURES)]
    low, high = rng.choice([(-1.0, 1.0), (-1.0, 1.0), (0.0, 10.0), (-3.0, 7.0)])
    gain = float(sum(map(abs, words))) * max(-low, high)
    reach = 2.0 ** np.ceil(np.log2(gain)) / rng.choice([1, 1, 4])
    tree: dict[str, Any] = {
        "name": f"fir{seed}",
        "sample_rate": 1000.0,
        "channels": channels,
        "input": {"x": {"bits": bits, "range": [low, high], "signed": low == -high}},
        "filter": {"taps": words},
        "output": {"bits": output_bits, "range": [-reach, reach], "signed": True},
        "hardware": {
            "architecture": architecture,
            "start": rng.choice(["zero", "steady"]),
            "clock": 48e6,
        },
    }
    if rng.random() < 0.5:
        tree["output"]["max_error"] = round(2 * reach / 2**output_bits * rng.uniform(0.6, 3), 12)
    if architecture == "parallel" and rng.random() < 0.3:
        tree["hardware"]["multipliers"] = 0
    return FirDraw(sosmith.Specification.load(tree), tuple(map(Fraction, words)), shape)


def taps_of(rng: random.Random, shape: str, length: int) -> list[Decimal]:
    """Draw taps of a shape, of which some may be 0."""
    half = [_tap(rng) for _ in range((length + 1) // 2)]
    mirrored = half[::-1][length % 2 :]
    if shape == "symmetric":
        return half + mirrored
    if shape == "antisymmetric":
        middle = [Decimal(0)] * (length % 2)
        return half[: length // 2] + middle + [-tap for tap in half[: length // 2][::-1]]
    if shape == "half-band":
        count = max(1, length // 4)
        side = [tap for value in half[:count] for tap in (value, Decimal(0))][:-1]
        return [*side, Decimal("0.5"), *side[::-1]]
    if shape == "few":
        sizes = [_tap(rng) for _ in range(3)]
        return [rng.choice([1, -1]) * rng.choice(sizes) for _ in range(length)]
    return [_tap(rng) for _ in range(length)]


def _tap(rng: random.Random) -> Decimal:
    return Decimal(rng.randint(1, 10**6) * rng.choice([1, -1])).scaleb(-6 - rng.randint(0, 2))


def exact(codes: Sequence[int], drawn: FirDraw) -> list[Fraction]:
    """Compute the filter's results for the codes of one channel, limited to the range of the output.

    Before the first sample the input was 0, or with a steady start the same as the first.
    """
    spec = drawn.specification.checked
    (port,), output = spec.inputs, spec.output
    values = [port.zero + port.lsb * int(code) for code in codes]
    before = values[0] if spec.hardware.start == "steady" else Fraction(0)
    padded = [before] * (len(drawn.taps) - 1) + values
    low, high = (output.zero + output.lsb * code for code in (output.lowest, output.highest))
    results = []
    for n in range(len(values)):
        window = padded[n : n + len(drawn.taps)][::-1]
        total = sum((b * x for b, x in zip(drawn.taps, window, strict=True)), Fraction(0))
        results.append(min(max(total, low), high))
    return results


def stimulus(drawn: FirDraw, samples: int, seed: int) -> npt.NDArray[np.int64]:
    """Return input codes, shape (samples, channels): random ones, and the ends of the range by the taps' signs."""
    rng = np.random.default_rng(seed)
    spec = drawn.specification.checked
    (port,) = spec.inputs
    codes = rng.integers(port.lowest, port.highest + 1, (samples, spec.channels))
    ends = np.array([port.highest if tap > 0 else port.lowest for tap in reversed(drawn.taps)])
    other = port.highest + port.lowest - ends
    for k, worst in ((1, ends), (2, other)):
        start = k * samples // 3
        codes[start : start + len(worst), :] = worst[: samples - start, np.newaxis]
    return codes


def largest_error(results: npt.NDArray[np.int64], codes: npt.NDArray[np.int64], drawn: FirDraw) -> Fraction:
    """Largest distance of output codes, shape (samples, channels), from the exact results, in output LSBs."""
    output = drawn.specification.checked.output
    return max(
        abs(output.zero + output.lsb * int(code) - wanted) / output.lsb
        for k in range(codes.shape[1])
        for code, wanted in zip(results[:, k].tolist(), exact(codes[:, k].tolist(), drawn), strict=True)
    )
