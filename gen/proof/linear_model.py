"""Exact transfer functions of a linear stage, read off its dataflow graph.

A quantizer is an error source: ``floor(a) = a - e`` with e in [0, 2**-frac), ``truncate(a) = a - e`` with e in
(-2**-frac, 2**-frac). A FLOOR or FRACTION of a delayed node sees the delayed error of that node. An error that enters
in several places is therefore one source; error feedback depends on this. All transfer functions are polynomials in
``w = z**-1`` with rational coefficients.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple, TypeVar

from flint import fmpq, fmpq_mat, fmpq_poly

from sosmith.model.dataflow.graph import Graph, Node, Op

Polynomial = tuple[Fraction, ...]
"""Coefficients of w**0, w**1, ..; the last one is not zero unless it is the only one."""


@dataclass(frozen=True)
class Source:
    """An input, a constant or a quantization error that drives a stage.

    Attributes
    ----------
    name : str
        ``"input"``, ``"constant"``, or the name of the quantized node.
    low, high : Fraction
        Range of its value at every sample from reset on; for the input, the range its node states.
    kept : int or None
        Fraction bits that the quantizer keeps; None if the source is not a quantizer.
    numerators : mapping of int to Polynomial
        Numerators from this source to the output node and to every BOUND node, over the stage's denominator.
    """

    name: str
    low: Fraction
    high: Fraction
    kept: int | None
    numerators: Mapping[int, Polynomial]


@dataclass(frozen=True)
class LinearModel:
    """Linear model of one output of a stage: one denominator, and a numerator for every source and node.

    Attributes
    ----------
    denominator : Polynomial
        Denominator of the states that this output depends on; the constant term is 1.
    output : int
        Index of the output node.
    entries : tuple of int
        Positions, among the stage's inputs, of those that it depends on.
    bounds : tuple of int
        Indices of the BOUND nodes that it depends on, whose ranges are to be proven.
    sources : tuple of Source
        The inputs first, as in `entries`.
    """

    denominator: Polynomial
    output: int
    entries: tuple[int, ...]
    bounds: tuple[int, ...]
    sources: tuple[Source, ...]

    @property
    def transfers(self) -> tuple[Polynomial, ...]:
        """Numerators from the inputs to the output."""
        return tuple(source.numerators[self.output] for source in self.sources[: len(self.entries)])

    @property
    def transfer(self) -> Polynomial:
        """Numerator from the only input to the output."""
        (numerator,) = self.transfers
        return numerator

    @property
    def own(self) -> tuple[Source, ...]:
        """All sources but the inputs."""
        return self.sources[len(self.entries) :]

    @property
    def quantizers(self) -> tuple[Source, ...]:
        """The sources that are errors of a quantizer."""
        return tuple(source for source in self.own if source.kept is not None)


def linear_model(graph: Graph) -> LinearModel:
    """Extract the model of a graph with one input and one output.

    Raises
    ------
    ValueError
        If the graph multiplies two variables or clamps, or has not one input and one output.
    """
    if len(graph.inputs) != 1 or len(graph.outputs) != 1:
        raise ValueError(f"graph must have one input and one output, not {len(graph.inputs)}, {len(graph.outputs)}")
    (model,) = linear_models(graph)
    return model


@lru_cache(maxsize=256)
def linear_models(graph: Graph) -> tuple[LinearModel, ...]:
    """Extract the models of all outputs of `graph`, each from the part of the graph that leads to that output.

    Raises
    ------
    ValueError
        If the graph multiplies two variables or clamps, or states a range of a node that no output depends on.
    """
    for node in graph.nodes:
        if node.op in {Op.MULTIPLY, Op.CLAMP}:
            raise ValueError(f"graph must be linear, not {node.op.value}")
    bounds = [index for index, node in enumerate(graph.nodes) if node.op is Op.BOUND]
    # With a single output, the ranges of states that do not reach it are proven too.
    beside = bounds if len(graph.outputs) == 1 else []
    models = tuple(_model(*cone(graph, output, beside)) for output in graph.outputs)
    seen = {index for model in models for index in model.bounds}
    for index in bounds:
        if index not in seen:
            node = graph.nodes[index]
            raise ValueError(f"outputs must depend on every range that is stated, not leave out {node.name or index}")
    return models


def cone(graph: Graph, output: int, beside: Sequence[int] = ()) -> tuple[Graph, tuple[int, ...], tuple[int, ...]]:
    """Extract the part of `graph` that leads to one node and to the nodes `beside` it.

    Returns
    -------
    graph : Graph
        The extracted part, with one output.
    indices : tuple of int
        Index in the whole graph of each of its nodes.
    entries : tuple of int
        Position, among the inputs of the whole graph, of each of its inputs.
    """
    reached, pending = {output, *beside}, [output, *beside]
    while pending:
        new = set(graph.nodes[pending.pop()].operands) - reached
        reached |= new
        pending += new
    indices = tuple(sorted(reached))
    place = {index: k for k, index in enumerate(indices)}
    nodes = (graph.nodes[index] for index in indices)
    entries = tuple(k for k, index in enumerate(graph.inputs) if index in reached)
    part = Graph(
        tuple(node._replace(operands=tuple(place[i] for i in node.operands)) for node in nodes),
        tuple(place[graph.inputs[k]] for k in entries),
        (place[output],),
    )
    return part, indices, entries


def _model(graph: Graph, indices: Sequence[int], entries: tuple[int, ...]) -> LinearModel:
    """Model of `graph`, which has one output; `indices` and `entries` are as `cone` returns them."""
    (output,) = graph.outputs
    bounds = tuple(i for i, node in enumerate(graph.nodes) if node.op is Op.BOUND)
    forms = _forms(graph)
    denominator = _denominator(_state_matrix(graph, forms))
    watched = tuple(dict.fromkeys((output, *bounds)))
    sources = []
    for key in _source_keys(graph):
        numerators = {indices[i]: p for i, p in _numerators(graph, forms, key, watched, denominator).items()}
        low, high = _range(graph, key)
        kept = key[2] if key[0] in {"error", "truncation"} else None
        sources.append(Source(_name(graph, key), low, high, kept, numerators))
    return LinearModel(denominator, indices[output], entries, tuple(indices[i] for i in bounds), tuple(sources))


def transfer_function(graph: Graph) -> tuple[Polynomial, Polynomial]:
    """Numerator and denominator from the only input of a graph to its only output, as in `linear_model`."""
    (source,), (output,) = graph.inputs, graph.outputs
    forms = _forms(graph)
    denominator = _denominator(_state_matrix(graph, forms))
    return _numerators(graph, forms, ("input", source, 0), [output], denominator)[output], denominator


def quantizers(graph: Graph) -> list[str]:
    """Names of the quantized nodes, in the order of the sources of `linear_model`."""
    return [_name(graph, key) for key in _source_keys(graph) if key[0] in {"error", "truncation"}]


def quantized_nodes(graph: Graph) -> list[tuple[int, int]]:
    """Index of each quantized node, and the fraction bits that are kept of it, in the order of `quantizers`."""
    return [(index, kept) for kind, index, kept in _source_keys(graph) if kind in {"error", "truncation"}]


def _numerators(
    graph: Graph, forms: Sequence[_Form], key: _Key, watched: Sequence[int], denominator: Polynomial
) -> dict[int, Polynomial]:
    """Numerators from a source to the nodes `watched`."""
    # A numerator's degree is at most the number of states and the longest delay of an error together.
    length = 2 * len(graph.delays) + 1
    responses = _impulse_responses(graph, forms, key, watched, length)
    under = fmpq_poly([fmpq(c.numerator, c.denominator) for c in denominator])
    return {i: _trim(_fractions((fmpq_poly(response) * under).coeffs()[:length])) for i, response in responses.items()}


_Key = tuple[str, int, int]
"""Kind (``"input"``, ``"constant"``, ``"error"``, ``"truncation"``), node, and for the last two the fraction bits
kept."""


def _source_keys(graph: Graph) -> list[_Key]:
    keys: dict[_Key, None] = {("input", index, 0): None for index in graph.inputs}
    for index, node in enumerate(graph.nodes):
        if node.op is Op.CONSTANT and node.parameter:
            keys[("constant", index, 0)] = None
        elif node.op in {Op.FLOOR, Op.FRACTION, Op.TRUNCATE}:
            root, _ = graph.undelayed(node.operands[0])
            keys[(_kind(node), root, _kept(node))] = None
    return list(keys)


def _kind(node: Node) -> str:
    return "truncation" if node.op is Op.TRUNCATE else "error"


def _kept(node: Node) -> int:
    return node.parameter if node.op is Op.FRACTION else node.frac


def _range(graph: Graph, key: _Key) -> tuple[Fraction, Fraction]:
    kind, index, kept = key
    node = graph.nodes[index]
    unit = Fraction(2) ** -node.frac
    if kind in {"error", "truncation"}:
        most = ((1 << (node.frac - kept)) - 1) * unit
        return Fraction(0) if kind == "error" else -most, most
    return node.low * unit, node.high * unit


def _name(graph: Graph, key: _Key) -> str:
    kind, index, _ = key
    return kind if kind in {"input", "constant"} else graph.nodes[index].name or f"node{index}"


class _Form(NamedTuple):
    """What a node is the sum of: weights of the states, by position, and of the sources at samples before."""

    states: dict[int, fmpq]
    sources: dict[tuple[_Key, int], fmpq]

    def times(self, factor: fmpq) -> _Form:
        return _Form(_scaled(self.states, factor), _scaled(self.sources, factor))

    def plus(self, other: _Form, sign: int = 1) -> _Form:
        return _Form(_sum(self.states, other.states, sign), _sum(self.sources, other.sources, sign))


_Part = TypeVar("_Part")


def _scaled(of: Mapping[_Part, fmpq], factor: fmpq) -> dict[_Part, fmpq]:
    return {part: weight * factor for part, weight in of.items()}


def _sum(a: Mapping[_Part, fmpq], b: Mapping[_Part, fmpq], sign: int) -> dict[_Part, fmpq]:
    return {**a, **{part: a.get(part, 0) + sign * weight for part, weight in b.items()}}


def _forms(graph: Graph) -> list[_Form]:
    """Return all nodes as sums of states and sources."""
    forms: list[_Form] = []
    positions = iter(range(len(graph.nodes)))
    for index, node in enumerate(graph.nodes):
        of = [forms[i] for i in node.operands if node.op is not Op.DELAY]
        if node.op is Op.DELAY:
            form = _Form({next(positions): fmpq(1)}, {})
        elif node.op in {Op.INPUT, Op.CONSTANT}:
            form = _Form({}, {((node.op.value, index, 0), 0): fmpq(1)})
        elif node.op in {Op.ADD, Op.SUBTRACT}:
            form = of[0].plus(of[1], 1 if node.op is Op.ADD else -1)
        elif node.op is Op.SHIFT:
            form = of[0].times(fmpq(1 << max(node.parameter, 0), 1 << max(-node.parameter, 0)))
        elif node.op is Op.SCALE:
            # Coefficients that are multiples of a power of two have fewer than no fraction bits.
            frac = node.parameter_frac
            form = of[0].times(fmpq(node.parameter << max(-frac, 0), 1 << max(frac, 0)))
        elif node.op is Op.BOUND:
            form = of[0]
        else:
            root, delay = graph.undelayed(node.operands[0])
            error = _Form({}, {((_kind(node), root, _kept(node)), delay): fmpq(1)})
            form = error if node.op is Op.FRACTION else of[0].plus(error, -1)
        forms.append(form)
    return forms


def _impulse_responses(
    graph: Graph, forms: Sequence[_Form], key: _Key, watched: Sequence[int], length: int
) -> dict[int, list[fmpq]]:
    """Values of the nodes `watched` after a unit impulse of the source `key` at time 0, the others being 0.

    Most states of a delay line are 0 at a time: only those that are not are followed, to the sums that they are part
    of.
    """
    sums = {("state", k): forms[graph.nodes[i].operands[0]] for k, i in enumerate(graph.delays)}
    sums |= {("node", i): forms[i] for i in watched}
    parts: list[list[tuple[tuple[str, int], fmpq]]] = [[] for _ in graph.delays]
    driven: dict[int, list[tuple[tuple[str, int], fmpq]]] = {}
    for place, form in sums.items():
        for state, weight in form.states.items():
            parts[state].append((place, weight))
        for (source, time), weight in form.sources.items():
            if source == key:
                driven.setdefault(time, []).append((place, weight))
    zero = fmpq(0)
    result = {i: [zero] * length for i in watched}
    states: dict[int, fmpq] = {}
    for time in range(length):
        now: dict[tuple[str, int], fmpq] = dict(driven.get(time, ()))
        for state, value in states.items():
            for place, weight in parts[state]:
                now[place] = now.get(place, zero) + weight * value
        for (kind, number), value in now.items():
            if kind == "node":
                result[number][time] = value
        states = {number: value for (kind, number), value in now.items() if kind == "state" and value}
    return result


def state_matrix(graph: Graph) -> list[list[Fraction]]:
    """State transition matrix of `graph` without quantizers; the states are its delays, in their order."""
    matrix = _state_matrix(graph, _forms(graph))
    return [_fractions(row) for row in matrix.tolist()]


def _state_matrix(graph: Graph, forms: Sequence[_Form]) -> fmpq_mat:
    following = [forms[graph.nodes[i].operands[0]].states for i in graph.delays]
    size = len(following)
    return fmpq_mat(size, size, [states.get(j, 0) for states in following for j in range(size)])


def _denominator(matrix: fmpq_mat) -> Polynomial:
    """``det(I - w A)``: the characteristic polynomial, its coefficients in the opposite order."""
    return _trim(_fractions(matrix.charpoly().coeffs()[::-1]))


def _fractions(values: Sequence[fmpq]) -> list[Fraction]:
    return [Fraction(int(value.p), int(value.q)) if value else _ZERO for value in values]


_ZERO = Fraction(0)
"""Most values of a delay line: made once."""


def _trim(values: Sequence[Fraction]) -> Polynomial:
    end = max((k for k, value in enumerate(values) if value), default=0)
    return tuple(values[: end + 1]) or (Fraction(0),)
