"""Plateaus: levels that are held until the filter has settled."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.gen.stimuli.run import MAX_SAMPLES, MIN_SAMPLES, Bench, Run
from sosmith.model.arrays import Values

READING_PART = 0.1
"""Last fraction of each plateau, in which it is read. The paper reads once; more readings average the noise."""


@dataclass(frozen=True, eq=False)
class Plateaus:
    """Levels over time, shape (n,), and a mask, shape (n,), of the last `READING_PART` of each plateau."""

    values: Values
    reading: npt.NDArray[np.bool_]


def plateau_samples(bench: Bench, levels: tuple[float, ...]) -> int:
    """Return the length in samples of a plateau in whose last part the filter has settled."""
    step = float(np.max(np.abs(np.diff(levels, prepend=0.0))))
    return math.ceil((bench.settling(step) + 1) / (1 - READING_PART))


def plateaus(run: Run, levels: tuple[float, ...], heights: tuple[float, ...]) -> Plateaus:
    """Hold each of `levels` for the same time; `heights` are the levels in the output's unit.

    Raises
    ------
    SpecificationError
        If the trace is too short for the filter to settle on each level.
    """
    length = run.samples // len(levels)
    least = plateau_samples(run.bench, heights)
    if length < least:
        raise run.refuse_length(least * len(levels), f"the filter has to settle on {len(levels)} plateaus")
    index = np.minimum(np.arange(run.samples) // length, len(levels) - 1)
    position = np.arange(run.samples) % length
    full = np.arange(run.samples) < length * len(levels)
    return Plateaus(np.array(levels)[index], full & (position >= math.floor(length * (1 - READING_PART))))


def stepped_samples(levels: tuple[float, ...]) -> Callable[[Bench], int]:
    """Return a function for the default length of plateaus on `levels` in the output's unit."""

    def samples(bench: Bench) -> int:
        least = math.ceil(MIN_SAMPLES / len(levels))
        return min(max(plateau_samples(bench, levels), least) * len(levels), MAX_SAMPLES)

    return samples
