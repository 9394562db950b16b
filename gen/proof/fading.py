"""How the difference between two runs of a cascade of sections fades: the same input, other states at one sample.

Used for a swap of constants (`sosmith.gen.reload.transient`), where the second run has other constants too, and for
a start from zero (`sosmith.gen.proof.settling`), where it has the same.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from sosmith.gen.proof.cascade_proof import Drives, Key, Lane
from sosmith.gen.proof.linear_model import LinearModel, linear_models
from sosmith.gen.proof.peak_gain import ACCURACY, Drive, Extent, extent
from sosmith.gen.proof.response import IMPULSE, Response, common
from sosmith.gen.proof.sums import recursion
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.errors import ShortfallError

RESIDUE = Fraction(1, 256)
"""Remaining effect of the previous set on any state and on the output at which the transient counts as over, in output
LSBs."""

_GRID = 1 << 40
"""Limits of a source are rounded outward to multiples of the reciprocal of this."""

Codes = tuple[int, int]
"""Smallest and largest code."""


class Pair:
    """The same section in both sets.

    Attributes
    ----------
    together : Graph
        The active set's section, and the other set's equations applied to its states and input. Outputs: those of the
        active set, then the differences in next state and output, except those that are identically zero.
    place : list of int
        Node in `together` for each node of the other set's graph.
    differences : dict of int to int
        Node in `together` with the difference, by the index of the state or, counted after the states, of the output of
        the other set.
    after : Graph
        The other set's section with an additional input added to each state and each output. All its states are BOUND
        nodes. Constants are 0, since the equations in `together` already include them.
    """

    def __init__(self, active: Graph, other: Graph, name: str) -> None:
        self.active, self.other = active, other
        a, b = active, other
        before = {a.nodes[i].name: i for i in a.delays}
        forms = [
            [(graph.nodes[i].name, graph.nodes[i].frac) for i in (*graph.inputs, *graph.delays)] for graph in (a, b)
        ]
        if forms[0] != forms[1]:
            raise ShortfallError(f"the states of {name} must be {forms[0]}, not {forms[1]}")
        nodes = list(a.nodes)
        inputs = iter(a.inputs)
        self.place: list[int] = []
        for node in b.nodes:
            if node.op is Op.INPUT:
                self.place.append(next(inputs))
            elif node.op is Op.DELAY:
                self.place.append(before[node.name])
            else:
                self.place.append(len(nodes))
                nodes.append(node._replace(operands=tuple(self.place[i] for i in node.operands)))
        self.differences: dict[int, int] = {}
        ends = [(b.nodes[i].operands[0], a.nodes[before[b.nodes[i].name]].operands[0]) for i in b.delays]
        ends += list(zip(b.outputs, a.outputs, strict=True))
        for k, (new, old) in enumerate(ends):
            if self.place[new] != old:
                self.differences[k] = len(nodes)
                nodes.append(Node(Op.SUBTRACT, (self.place[new], old), b.nodes[new].frac, 0, 0))
        self.together = Graph(tuple(nodes), a.inputs, (*a.outputs, *self.differences.values()))
        self.after, self.watched = _with_additions(b)

    def bounds(self, lanes: Sequence[Lane]) -> dict[int, Lane]:
        """For every BOUND node of the other set, return an output that depends on it."""
        return {
            node: next(lane for lane in lanes if self.place[node] in lane.model.bounds)
            for node, it in enumerate(self.other.nodes)
            if it.op is Op.BOUND
        }

    def ranges(self, extents: Mapping[int, Extent]) -> dict[str, Codes]:
        """Ranges of codes of inputs and BOUND nodes that cover those of each set by itself and `extents`."""
        result: dict[str, Codes] = {}
        for graph, left in ((self.active, RESIDUE), (self.other, Fraction(0))):
            for node in graph.nodes:
                if node.op in {Op.INPUT, Op.BOUND}:
                    more = math.ceil(left * Fraction(2) ** node.frac) if node.op is Op.BOUND else 0
                    low, high = result.get(node.name, (node.low, node.high))
                    result[node.name] = min(low, node.low - more), max(high, node.high + more)
        for index, limits in extents.items():
            node = self.other.nodes[index]
            unit = Fraction(2) ** node.frac
            low, high = result[node.name]
            result[node.name] = min(low, math.floor(limits.low * unit)), max(high, math.ceil(limits.high * unit))
        return result

    def mismatch(self, state: int) -> Fraction:
        """Bound the distance of a state, by its index, from its value if the other set had been running alone.

        It is 0 for a state that holds a quantization error: any such error is possible with either set.
        """
        b = self.other
        node = b.nodes[b.delays[state]]
        if b.nodes[node.operands[0]].op is Op.FRACTION:
            return Fraction(0)
        (same,) = (n for n in self.active.nodes if n.op is Op.DELAY and n.name == node.name)
        return (max(node.high, same.high) - min(node.low, same.low)) * Fraction(2) ** -node.frac + RESIDUE


def _with_additions(graph: Graph) -> tuple[Graph, tuple[int, ...]]:
    """Add an input to every state and every output; return also the nodes of the states' next values."""
    nodes = [node._replace(parameter=0, low=0, high=0) if node.op is Op.CONSTANT else node for node in graph.nodes]
    added, sums = [], []
    for k, source in enumerate([*(graph.nodes[i].operands[0] for i in graph.delays), *graph.outputs]):
        frac = graph.nodes[source].frac
        added.append(len(nodes))
        nodes.append(Node(Op.INPUT, (), frac, 0, 0, name=f"difference{k}"))
        nodes.append(Node(Op.ADD, (source, added[-1]), frac, 0, 0))
        sums.append(len(nodes) - 1)
    states = len(graph.delays)
    watched = []
    for delay, total in zip(graph.delays, sums, strict=False):
        watched.append(len(nodes))
        nodes.append(Node(Op.BOUND, (total,), nodes[total].frac, 0, 0))
        nodes[delay] = nodes[delay]._replace(operands=(watched[-1],))
    return Graph(tuple(nodes), (*graph.inputs, *added), tuple(sums[states:])), tuple(watched)


class Fading:
    """Propagates the difference between the two runs through the other set's sections, in order."""

    def __init__(self, limit: Fraction = RESIDUE) -> None:
        self.samples = 0
        self._limit = limit
        self._wires: list[Drives] = [{}]
        self._mismatches: dict[Key, Fraction] = {}

    def section(
        self, number: int, pair: Pair, starts: Mapping[int, Extent], *, watched: bool = True
    ) -> dict[int, Extent]:
        """Bound the difference of a section's BOUND nodes from the result of its equations on the old run.

        Parameters
        ----------
        number : int
            Index of the section.
        pair : Pair
            The section in both sets.
        starts : mapping of int to Extent
            Limits of the differences, by their nodes in `pair.together`.
        watched : bool
            Whether `samples` is until the states at the swap matter to no state and no output any more.
        """
        states = len(pair.other.delays)
        additions: list[Drives] = []
        for k in range(states + len(pair.other.outputs)):
            key = number, k, "difference", 0
            start = starts[pair.differences[k]] if k in pair.differences else Extent(Fraction(0), Fraction(0))
            mismatch = pair.mismatch(k) if k < states else Fraction(0)
            left = RESIDUE if mismatch else Fraction(0)
            if mismatch:
                self._mismatches[key] = mismatch
            additions.append({key: _drive(start, left)})
        models = [_symmetric(model) for model in linear_models(pair.after)]
        lanes = [Lane(number, model, [*self._wires, *additions]) for model in models]
        moved: dict[int, Extent] = {}
        for lane in lanes:
            for node in lane.model.bounds:
                drives = lane.at(node)
                if node in pair.watched:
                    if watched:
                        self._watch(drives, states)
                else:
                    moved[node] = extent(list(drives.values()))
        outputs = [lane.at(lane.model.output) for lane in lanes]
        if watched:
            for drives in outputs:
                self._watch(drives, states)
        kept = {key for drives in outputs for key in drives if key[2] == "difference"}
        self._wires = [merged(drives, kept, (number, k, "rounding", 0)) for k, drives in enumerate(outputs)]
        return moved

    def watch_outputs(self) -> None:
        """Increase `samples` until the states at the swap no longer matter to the last section's output."""
        for drives in self._wires:
            self._watch(drives, 0)

    def _watch(self, drives: Drives, delays: int) -> None:
        """Increase `samples` until the states at the swap no longer matter here, nor after `delays` more samples."""
        weighted = [(d.response, self._mismatches[key]) for key, d in drives.items() if key in self._mismatches]
        self.samples = max(self.samples, _last_above(weighted, self._limit) + delays + 1)


def _last_above(weighted: Sequence[tuple[Response, Fraction]], limit: Fraction) -> int:
    """Last sample at which the weighted sum of absolute responses may exceed `limit`."""
    under = common([response for response, _ in weighted])
    last = recursion((under,), ACCURACY).last_above([((r.over(under),), weight) for r, weight in weighted], limit)
    if last is None:
        raise ShortfallError(
            "the states at a swap or a start must fade in the time in which a response decays, and are not proven to"
        )
    return last


def _symmetric(model: LinearModel) -> LinearModel:
    """Return the model with each quantizer's error replaced by the difference of two such errors."""
    count = len(model.entries)
    sources = [*model.sources[:count]]
    for source in model.own:
        most = max(abs(source.low), abs(source.high))
        sources.append(replace(source, low=-most, high=most))
    return replace(model, sources=tuple(sources))


def merged(drives: Drives, kept: set[Key], rest: Key) -> Drives:
    """Replace all sources except those in `kept` by one that takes any value within their limits at each sample."""
    limits = extent([drive for key, drive in drives.items() if key not in kept])
    return {key: drive for key, drive in drives.items() if key in kept} | {rest: _drive(limits)}


def added(a: Extent, b: Extent) -> Extent:
    return Extent(a.low + b.low, a.high + b.high)


def _drive(limits: Extent, more: Fraction = Fraction(0)) -> Drive:
    """Make a source with the given limits, widened by `more` and rounded outward."""
    low, high = limits.low - more, limits.high + more
    return Drive(IMPULSE, Fraction(math.floor(low * _GRID), _GRID), Fraction(math.ceil(high * _GRID), _GRID))
