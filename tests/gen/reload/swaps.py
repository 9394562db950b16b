"""Other filters for the hardware of the examples, what drives a swap to them hardest, and what it leaves behind."""

from dataclasses import replace
from fractions import Fraction

import numpy as np

from sosmith.gen.core import CoreDesign
from sosmith.gen.filter.design import Filter, design
from sosmith.gen.reload.transient import transient
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, Op
from sosmith.model.reload.constants import with_ranges

RESIDUE = 1 / 256
"""What a swap may leave behind once it counts as over, in output LSBs, as `docs/registers.md` has it."""


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


def left_behind(active: Quantized, other: Quantized, samples: int) -> np.ndarray:
    """Bound what the states at a swap still do to any state and to the output, at each sample from the swap on.

    Every state may be off by the whole of its range in either set. In double precision, by one run without quantizers
    for each state; the absolute values are added.
    """
    starts = []
    for number, (old, new) in enumerate(zip(active.sections, other.sections, strict=True)):
        before = {old.graph.nodes[i].name: old.graph.nodes[i] for i in old.graph.delays}
        for k, index in enumerate(new.graph.delays):
            node = new.graph.nodes[index]
            if new.graph.nodes[node.operands[0]].op is not Op.FRACTION:  # an error may be any in either set
                ends = (node.low, node.high, before[node.name].low, before[node.name].high)
                starts.append((number, k, (max(ends) - min(ends)) * 2.0**-node.frac + RESIDUE))
    states = [[np.zeros(len(starts)) for _ in section.graph.delays] for section in other.sections]
    for run, (number, k, size) in enumerate(starts):
        states[number][k][run] = size
    result = []
    for _ in range(samples):
        seen = [value for section in states for value in section]
        wires = [np.zeros(len(starts)) for _ in other.sections[0].graph.inputs]
        for number, section in enumerate(other.sections):
            wires, states[number] = _linear_step(section.graph, wires, states[number])
        result.append(max(np.abs(value).sum() for value in (*seen, *wires)))
    return np.array(result)


def _linear_step(
    graph: Graph, inputs: list[np.ndarray], state: list[np.ndarray]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the outputs and the next states without quantizers and constants."""
    supply, memory = iter(inputs), iter(state)
    values: list[np.ndarray] = []
    for node in graph.nodes:
        if node.op in {Op.INPUT, Op.DELAY}:
            values.append(next(supply if node.op is Op.INPUT else memory))
            continue
        operands = [values[i] for i in node.operands]
        if node.op in {Op.CONSTANT, Op.FRACTION}:
            values.append(np.zeros_like(inputs[0]))
        elif node.op in {Op.ADD, Op.SUBTRACT}:
            values.append(operands[0] + operands[1] if node.op is Op.ADD else operands[0] - operands[1])
        elif node.op is Op.SHIFT:
            values.append(operands[0] * 2.0**node.parameter)
        elif node.op is Op.SCALE:
            values.append(operands[0] * node.parameter * 2.0**-node.parameter_frac)
        else:
            assert node.op in {Op.FLOOR, Op.TRUNCATE, Op.BOUND}
            values.append(operands[0])
    return [values[i] for i in graph.outputs], [values[graph.nodes[i].operands[0]] for i in graph.delays]
