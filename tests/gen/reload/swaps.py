"""Other filters for the hardware of the examples, and what drives a swap to one of them hardest."""

from dataclasses import replace
from fractions import Fraction

import numpy as np

from sosmith.gen.core import CoreDesign
from sosmith.gen.filter.design import Filter, design
from sosmith.gen.reload.transient import transient
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.reload.constants import with_ranges


def moved(hardware: CoreDesign, ratio: str) -> Filter:
    """Design the hardware's filter with another cutoff."""
    wanted = hardware.spec.filter
    assert wanted.cutoff is not None
    cutoff = tuple(value * Fraction(ratio) for value in wanted.cutoff)
    return design(replace(wanted, cutoff=cutoff), float(hardware.spec.sample_rate))


def during(active: Quantized, other: Quantized) -> Datapath:
    """Return the other set with the ranges that are proven for the swap."""
    first = len(other.datapath.stages) - len(other.sections) - 1
    return with_ranges(other.datapath, [*[{}] * first, *transient(active, other).ranges, {}])


def worst_input(active: Quantized, other: Quantized, swap: int, samples: int) -> np.ndarray:
    """Return the input of one port that drives the last section's output highest after the swap.

    By the responses to an impulse at every sample, for sections in direct form in double precision.
    """
    values = np.eye(samples)
    for before, after in zip(active.quantized_sos, other.quantized_sos, strict=True):
        x, y = np.zeros((2, samples, samples + 2))
        x[:, 2:] = values
        for n in range(samples):
            b, a = np.split(before if n < swap else after, 2)
            y[:, n + 2] = x[:, n : n + 3] @ b[::-1] - y[:, n : n + 2] @ a[:0:-1]
        values = y[:, 2:]
    worst = swap + int(np.argmax(np.abs(values[:, swap:]).sum(axis=0)))
    (port,) = active.datapath.inputs
    return np.where(values[:, worst] > 0, port.highest, port.lowest)[:, np.newaxis]
