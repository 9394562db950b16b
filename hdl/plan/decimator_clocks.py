"""Clocks of a decimator before a core."""

from __future__ import annotations

from sosmith.model.dataflow.decimator import Decimator


def latency_cycles(decimator: Decimator) -> int:
    """Clocks from the edge that accepts the sample of a result to the edge that can hand it to the core."""
    return 2 * decimator.stages + 1


def reset_cycles(decimator: Decimator) -> int:
    """Clocks for which the first sample after a reset is offered before it is accepted."""
    return decimator.warm_up


FIRST_SAMPLE = 1
"""Clocks from the edge that fills the decimator behind a calibration to the one that accepts the first sample."""


def cycles_per_result(decimator: Decimator, taken: int = 0, *, each: int = 1) -> int:
    """Clocks between results at the highest rate, for a core that takes a sample `taken` clocks after it finds it.

    `each` is the number of clocks for each sample in what stands before the decimator.
    """
    return max(decimator.factor * each, taken + latency_cycles(decimator) + 1)
