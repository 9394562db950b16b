"""Clocks of a decimator before a core."""

from __future__ import annotations

from sosmith.model.dataflow.decimator import Decimator


def latency_cycles(decimator: Decimator, channels: int = 1) -> int:
    """Clocks from the edge that accepts the sample of a result to the edge that can hand it to the core."""
    return 2 * decimator.stages + (1 if channels == 1 else 3)


def reset_cycles(decimator: Decimator, channels: int = 1) -> int:
    """Clocks after a reset until the first sample is accepted, which is on offer: while it fills the decimator.

    With several channels, while these are cleared.
    """
    return decimator.warm_up if channels == 1 else channels


FIRST_SAMPLE = 1
"""Clocks from the edge that fills the decimator behind a calibration to the one that accepts the first sample."""


def cycles_per_result(decimator: Decimator, taken: int = 0, *, each: int = 1) -> int:
    """Clocks between results at the highest rate, for a core that takes a sample `taken` clocks after it finds it.

    `each` is the number of clocks for each sample in what stands before the decimator.
    """
    return max(decimator.factor * each, taken + latency_cycles(decimator) + 1)


def cycles_per_result_of_many(decimator: Decimator, *, each: int = 1) -> int:
    """Clocks for the samples of a result at the highest rate, at most, with several channels that share the adder.

    `each` is the number of clocks for each sample in what stands before the decimator.
    """
    with_result, without = 2 * decimator.stages + 3, decimator.stages + 2
    return max(each, with_result) + (decimator.factor - 1) * max(each, without)
