"""Clocks of a decimator before a core."""

from __future__ import annotations

from sosmith.model.dataflow.decimator import Decimator


def latency_cycles(decimator: Decimator) -> int:
    """Clocks from the edge that accepts the sample of a result to the edge that can hand it to the core."""
    return 2 * decimator.stages + 1


def reset_cycles(decimator: Decimator) -> int:
    """Clocks for which the first sample after a reset is offered before it is accepted."""
    return decimator.warm_up


def cycles_per_result(decimator: Decimator, taken: int = 0) -> int:
    """Clocks between results at the highest rate, for a core that takes a sample `taken` clocks after it finds it."""
    return max(decimator.factor, taken + latency_cycles(decimator) + 1)
