"""Inputs that bring a core's error near its bound: each sample is chosen so that all roundings go the same way.

A bound adds up the worst of every part. Patterns that are the worst of one part alone leave the roundings to chance,
and reach little more than half of it. Here the samples follow the pattern that is the worst of the coefficients' error,
from rail to rail, but near each rail many codes are tried in the integer model, and the one is taken whose roundings,
each times the response from there to the last sample, add up to the most.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.gen.core import CoreDesign
from sosmith.gen.filter.design import decay_length
from sosmith.gen.proof.linear_model import quantized_nodes
from sosmith.gen.stimuli.error_paths import error_paths
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.arithmetic.recursive_filters import sosfilt
from sosmith.model.arrays import Codes
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.reference.golden import exact_chain

_WIDEST = 62
"""Bits of a word up to which numpy's integers are used; beyond it Python's, which are slower."""

TRIED = 512
"""Codes that are tried for each sample."""
NEAR = 1 / 32
"""Share of an input's range, at each end, that they are taken from."""
REST = 64
"""Samples that follow the steered ones."""
MOST = 3000
"""Samples of a response that are steered; the rest of it is a long tail."""

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Steered:
    """Codes, shape (samples, inputs), and the largest error of the core at them in output LSBs."""

    codes: Codes
    error: float


@dataclass(frozen=True)
class _Quantizer:
    """Where an error comes from, and what a unit of it does to the output so many samples later."""

    stage: int
    node: int
    kept: int
    response: Floats


def steered(design: CoreDesign, *, seed: int) -> Steered:
    """Search for inputs with a large error, of each sign.

    Raises
    ------
    ValueError
        If the core decimates, or a stage of its filter has several outputs.
    """
    walk = _Walk(design, np.random.default_rng(seed))
    return max((walk.towards(sign) for sign in (1, -1)), key=lambda one: one.error)


class _Walk:
    def __init__(self, design: CoreDesign, rng: np.random.Generator) -> None:
        self._quantized = quantized = design.quantized
        if design.datapath.decimator is not None or quantized.filter is None:
            raise ValueError("the core must filter every sample")
        self._stages = design.datapath.stages
        wide = max(node.width for stage in self._stages for node in stage.graph.nodes) > _WIDEST
        self._kind = object if wide else np.int64
        first = len(self._stages) - len(quantized.sections) - 1
        self._entry = first
        length = min(decay_length(quantized.quantized_sos), MOST)
        impulse = np.zeros(length)
        impulse[0] = 1.0
        self._ideal = sosfilt(quantized.filter.sos, impulse)
        self._off = sosfilt(quantized.quantized_sos, impulse) - self._ideal
        self._sources = [*_sources(quantized, first)]
        self._near = [self._codes_near(rng, high=high) for high in (False, True)]

    def _codes_near(self, rng: np.random.Generator, *, high: bool) -> Ints:
        """Codes whose exact values are near one end of what enters the filter, shape (tried, inputs)."""
        ports = self._quantized.datapath.inputs
        low, top = (np.array([getattr(port, end) for port in ports]) for end in ("lowest", "highest"))
        wide = rng.integers(low, top + 1, (1 << 16, len(ports)))
        corners = np.stack(np.meshgrid(*zip(low, top, strict=True), indexing="ij"), axis=-1).reshape(-1, len(ports))
        values = self._exact_input(np.concatenate([wide, corners]))
        best = np.concatenate([wide, corners])[int(np.argmax(values) if high else np.argmin(values))]
        reach = np.maximum((top - low) * NEAR, 4).astype(np.int64)
        near = rng.integers(np.maximum(best - reach, low), np.minimum(best + reach, top) + 1, (TRIED, len(ports)))
        return np.concatenate([best[np.newaxis], near])

    def _exact_input(self, codes: Ints) -> Floats:
        """Return what exactly enters the filter, in output LSBs."""
        values = self._quantized.unfiltered(codes[:, np.newaxis, :])[:, 0]
        return values / float(self._quantized.datapath.output.lsb)

    def towards(self, sign: int) -> Steered:
        last = len(self._ideal) - 1
        near = [(codes, self._exact_input(codes)) for codes in self._near]
        states = [np.zeros(len(stage.graph.delays), dtype=object) for stage in self._stages]
        taken: list[Ints] = []
        for at in range(last + 1):
            back = last - at
            codes, exact = near[int(sign * self._off[back] >= 0)]
            values = self._step(codes, states)
            entering = self._entering(values)
            merit = self._off[back] * entering + self._ideal[back] * (entering - exact)
            for source in self._sources:
                if back < len(source.response):
                    merit += source.response[back] * _error(
                        self._stages[source.stage].graph, source, values[source.stage]
                    )
            best = int(np.argmax(sign * merit)) if back else self._last(taken, codes, values, sign)
            taken.append(codes[best])
            for stage, state, results in zip(self._stages, states, values, strict=True):
                state[:] = [results[stage.graph.nodes[i].operands[0]][best] for i in stage.graph.delays]
        # A slow output may round well at the last sample: it stays where it is for some more.
        chosen = np.array([*taken, *taken[-REST:]])
        return Steered(chosen, float(np.abs(self._errors(chosen)).max()))

    def _entering(self, values: Sequence[Sequence[Ints]]) -> Floats:
        """Return what enters the filter, in output LSBs, before a first sample is taken off."""
        stage = self._entry - self._quantized.steady
        graph = self._stages[stage].graph
        (at, *_) = graph.inputs
        return np.asarray(values[stage][at], dtype=np.float64) * 2.0 ** -graph.nodes[at].frac

    def _last(self, taken: list[Ints], codes: Ints, values: Sequence[Sequence[Ints]], sign: int) -> int:
        """Return the last code: the one with the largest error indeed, the last rounding included."""
        output = self._quantized.datapath.output
        base = np.array([*taken, codes[0]])
        exact = self._golden(base)[-1]
        inputs = self._exact_input(codes)
        exact = exact + self._ideal[0] * (inputs - inputs[0])
        zero = float(output.zero / output.lsb)
        low, high = output.lowest + zero, output.highest + zero
        made = np.asarray(values[-1][self._stages[-1].graph.outputs[0]], dtype=np.float64) + zero
        return int(np.argmax(sign * (made - np.clip(exact, low, high))))

    def _golden(self, codes: Ints) -> Floats:
        quantized = self._quantized
        assert quantized.filter is not None
        exact = exact_chain(
            codes[:, np.newaxis, :],
            quantized.datapath,
            quantized.polynomial,
            quantized.filter.sos,
            steady=quantized.steady,
        )
        return exact[:, 0] / float(quantized.datapath.output.lsb)

    def _errors(self, codes: Ints) -> Floats:
        output = self._quantized.datapath.output
        made = output.decode(self._quantized.datapath.compute(codes[:, np.newaxis, :]))[:, 0] / float(output.lsb)
        return made - self._golden(codes)

    def _step(self, codes: Ints, states: Sequence[npt.NDArray[np.object_]]) -> list[list[Ints]]:
        """Values of all nodes of all stages for each code, at the same states."""
        wires = [codes[:, k].astype(self._kind) for k in range(codes.shape[1])]
        values = []
        for stage, state in zip(self._stages, states, strict=True):
            values.append(_evaluated(stage.graph, wires, state))
            wires = [values[-1][i] for i in stage.graph.outputs]
        return values


def _sources(quantized: Quantized, first: int) -> Iterator[_Quantizer]:
    """Yield the sources of error of all sections, which have one output each."""
    if any(len(section.graph.outputs) > 1 for section in quantized.sections):
        raise ValueError("each stage of the filter must have one output")
    places = [(k, *place) for k, section in enumerate(quantized.sections) for place in quantized_nodes(section.graph)]
    paths = [(k, response) for k, _, source, response in error_paths(quantized) if source.kept is not None]
    for (number, node, kept), (same, response) in zip(places, paths, strict=True):
        assert number == same
        yield _Quantizer(first + number, node, kept, response[:MOST])


def _error(graph: Graph, source: _Quantizer, values: Sequence[Ints]) -> Floats:
    frac = graph.nodes[source.node].frac
    dropped = frac - source.kept
    return np.asarray(values[source.node] & ((1 << dropped) - 1), dtype=np.float64) * 2.0**-frac


def _evaluated(graph: Graph, wires: Sequence[Ints], state: npt.NDArray[np.object_]) -> list[Ints]:
    values: list[Ints] = []
    supply, memory = iter(wires), iter(state)
    count = len(wires[0])
    for node in graph.nodes:
        if node.op is Op.INPUT:
            values.append(next(supply))
        elif node.op is Op.DELAY:
            values.append(np.full(count, next(memory), dtype=wires[0].dtype))
        else:
            values.append(_value(graph, node, [values[i] for i in node.operands], wires[0]))
    return values


def _value(graph: Graph, node: Node, operands: Sequence[Ints], like: Ints) -> Ints:
    fracs = [graph.nodes[i].frac for i in node.operands]
    if node.op is Op.CONSTANT:
        return np.full_like(like, node.parameter)
    if node.op in {Op.ADD, Op.SUBTRACT}:
        a, b = (value << (node.frac - frac) for value, frac in zip(operands, fracs, strict=True))
        return a + b if node.op is Op.ADD else a - b
    if node.op is Op.MULTIPLY:
        return operands[0] * operands[1]
    if node.op is Op.SCALE:
        return operands[0] * node.parameter
    if node.op is Op.FLOOR:
        return operands[0] >> (fracs[0] - node.frac)
    if node.op is Op.FRACTION:
        return operands[0] & ((1 << (fracs[0] - node.parameter)) - 1)
    if node.op is Op.CLAMP:
        return np.clip(operands[0], node.low, node.high)
    if node.op in {Op.SHIFT, Op.BOUND}:
        return operands[0]
    raise ValueError(f"the filter must not have nodes of the kind {node.op.value}")
