"""Mean and interval over seeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypedDict

import numpy as np
from scipy import stats


class Spread(TypedDict):
    """A quantity over seeds: its mean, the confidence interval of the mean, and the central range of single runs."""

    mean: float
    low: float
    high: float
    run_low: float
    run_high: float


def spread(values: Sequence[float], confidence: float) -> Spread:
    """Summarize the values of at least two independent seeds.

    The interval of the mean is Student's; the range of single runs lies between the quantiles that exclude
    (1 - `confidence`) / 2 on each side.
    """
    array = np.asarray(values, dtype=np.float64)
    half = float(stats.t.ppf((1 + confidence) / 2, len(array) - 1) * array.std(ddof=1) / np.sqrt(len(array)))
    mean = float(array.mean())
    tail = (1 - confidence) / 2
    low, high = np.quantile(array, [tail, 1 - tail])
    return Spread(mean=mean, low=mean - half, high=mean + half, run_low=float(low), run_high=float(high))
