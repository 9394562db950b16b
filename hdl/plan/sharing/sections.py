"""Sections with one graph in hardware, and in which clock of a section's turn each of its nodes is computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import count

from sosmith.hdl.plan.pipeline import ADDITION, NO_LOGIC, operation_time, takes_several
from sosmith.hdl.plan.regrouped_sums import with_places
from sosmith.hdl.plan.sharing.fit import Fit, fit
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.dataflow.structure import Stage
from sosmith.model.sections.start import StartStage

_CHOICE = 0.5
"""Time in additions of the choice of a section's input."""

_BETWEEN_BLOCKS = 8
"""Time of the wires between the multiplier blocks of a product, in units of `operation_time`: from placed cores, as
`sosmith.hdl.plan.sharing.sharing` has them."""

_STATES = frozenset({Op.INPUT, Op.CONSTANT, Op.DELAY})
"""What stays as it is while a section has its turn."""


@dataclass(frozen=True)
class SharedSections:
    """Sections that share hardware, and the graph that it computes.

    Attributes
    ----------
    stages : tuple of Stage
        The sections, in their order; at least two.
    graph : Graph
        Nodes with room for those of all sections, each with as many fraction bits as any of them has. Its products are
        by the largest constants.
    constants : dict of int to tuple of int
        Constants, and those of products, by node: one for each section.
    states : dict of int to tuple of int or None
        The DELAY nodes of the sections, by that of the graph; None of a section that has 0 there.
    """

    stages: tuple[Stage, ...]
    graph: Graph
    constants: dict[int, tuple[int, ...]]
    states: dict[int, tuple[int | None, ...]]

    def turn(self, clocks: int) -> list[int]:
        """Return the clock of a turn in which each node is computed, so that the slowest one is as fast as it can be.

        Each is as early as its operands are there.
        """
        return next(stages for _, stages in self._spread() if max(stages) < clocks)

    def period(self, clocks: int) -> int:
        """Return the time of the slowest clock of a turn, in units of `sosmith.hdl.plan.pipeline.operation_time`."""
        return next(period for period, stages in self._spread() if max(stages) < clocks)

    def _spread(self) -> Sequence[tuple[int, list[int]]]:
        """Return the clock of each node by the time that a clock takes, up to the one in which all are computed."""
        return self._spreads

    @cached_property
    def _spreads(self) -> list[tuple[int, list[int]]]:
        times = [_time(self.graph, node) for node in self.graph.nodes]
        spread: list[tuple[int, list[int]]] = []
        for period in count(max(1, *times)):
            spread.append((period, _as_early(self.graph, times, period)))
            if not any(spread[-1][1]):
                break
        return spread

    @property
    def state_bits(self) -> int:
        """Bits of the states of one section."""
        return sum(self.graph.nodes[index].width for index in self.graph.delays)

    @cached_property
    def kept(self) -> frozenset[int]:
        """Nodes that stay as they are during a turn: inputs and states, and bits of them."""
        kept = set[int]()
        for index, node in enumerate(self.graph.nodes):
            if node.op in _STATES or (node.op in NO_LOGIC and kept.issuperset(node.operands)):
                kept.add(index)
        return frozenset(kept)


def merged(stages: Sequence[Stage]) -> SharedSections | None:
    """Return several stages with hardware in common; None if there is none."""
    graphs = [stage.graph for stage in stages]
    if len(stages) < 2 or any(isinstance(stage, StartStage) for stage in stages) or not all(map(_is_section, graphs)):
        return None
    longest = max(graphs, key=lambda graph: len(graph.nodes))
    members = [_Member(graph, own) for graph in graphs if (own := fit(longest, graph)) is not None]
    return _shared(tuple(stages), longest, members) if len(members) == len(graphs) else None


def _is_section(graph: Graph) -> bool:
    """Whether a graph has states, and one input and output, none of which is limited."""
    ops = {node.op for node in graph.nodes}
    return len(graph.inputs) == len(graph.outputs) == 1 and Op.DELAY in ops and Op.CLAMP not in ops


@dataclass(frozen=True)
class _Member:
    """A section's graph, and where it is in that of the hardware."""

    graph: Graph
    fit: Fit

    def node(self, index: int) -> Node | None:
        """Return the section's node whose value a node of the hardware has; None where it has none."""
        own = self.fit.values.get(index)
        return None if own is None else self.graph.nodes[own]

    def constant(self, index: int, op: Op) -> Node | None:
        """Return the section's node with the constant of a node of the hardware; None if that is 0."""
        own = self.node(index)
        return own if own is not None and own.op is op else None


def _shared(stages: tuple[Stage, ...], longest: Graph, members: Sequence[_Member]) -> SharedSections | None:
    """Return sections whose graphs are in the longest one; None if words of some have no place in it."""
    nodes: list[Node] = []
    constants: dict[int, tuple[int, ...]] = {}
    for index, node in enumerate(longest.nodes):
        made = _with_room(nodes, node, [own for member in members if (own := member.node(index)) is not None])
        if node.op in {Op.CONSTANT, Op.SCALE}:
            constants[index] = tuple(_longer(member.constant(index, made.op), made) for member in members)
            made = made._replace(parameter=max(constants[index], key=abs))
        nodes.append(made)
    if any(node.op is Op.DELAY and nodes[node.operands[0]].frac != node.frac for node in nodes):
        return None
    if any(node.op is Op.TRUNCATE and not _as_long(node, nodes, members) for node in nodes):
        return None
    graph, places = _with_input_late(Graph(tuple(nodes), longest.inputs, longest.outputs))
    states = {places[index]: tuple(member.fit.values.get(index) for member in members) for index in longest.delays}
    return SharedSections(stages, graph, {places[index]: each for index, each in constants.items()}, states)


def _with_input_late(graph: Graph) -> tuple[Graph, list[int]]:
    """Return the graph with sums in an order that adds last what is there last, and where each node is in it.

    States and constants are there from the beginning of a turn; the input is chosen first.
    """
    times: list[float] = []
    for node in graph.nodes:
        before = 0.0 if node.op in _STATES else max(times[index] for index in node.operands)
        took = _CHOICE if node.op is Op.INPUT else operation_time(graph, node) / ADDITION
        times.append(before + took)
    inside = {index for index, node in enumerate(graph.nodes) if graph.concatenated(node) is None}
    return with_places(graph, inside, times)


def _as_long(node: Node, nodes: Sequence[Node], members: Sequence[_Member]) -> bool:
    """Whether all sections drop the same bits: what rounds towards zero adds all of them, and not zeros below."""
    (of,) = node.operands
    return all(own is None or own.frac == nodes[of].frac for own in (member.node(of) for member in members))


def _longer(own: Node | None, made: Node) -> int:
    """Return a section's constant with the fraction bits that it has in hardware; 0 if it has none."""
    if own is None:
        return 0
    longer = made.frac - own.frac if made.op is Op.CONSTANT else made.parameter_frac - own.parameter_frac
    return own.parameter << longer


def _with_room(before: Sequence[Node], node: Node, several: Sequence[Node]) -> Node:
    """Return a node with room for several, the operands of which are among those `before`, but for a DELAY's."""
    fracs = [before[index].frac for index in node.operands] if node.op is not Op.DELAY else []
    alike = [own for own in several if own.op is node.op] or [node]
    parameter_frac = max(own.parameter_frac for own in alike)
    match node.op:
        case Op.ADD | Op.SUBTRACT:
            frac = max(fracs)
        case Op.SHIFT:
            frac = fracs[0] - node.parameter
        case Op.SCALE:
            frac = fracs[0] + parameter_frac
        case Op.MULTIPLY:
            frac = sum(fracs)
        case Op.BOUND | Op.FRACTION:
            frac = fracs[0]
        case Op.FLOOR | Op.TRUNCATE:
            frac = node.frac
        case _:
            frac = max(own.frac for own in alike)
    low = min([0, *(own.low << frac - own.frac for own in several)])
    high = max([0, *(own.high << frac - own.frac for own in several)])
    return node._replace(frac=frac, low=low, high=high, parameter_frac=parameter_frac)


def _time(graph: Graph, node: Node) -> int:
    """Return how long an operation takes, in units of `operation_time`."""
    took = operation_time(graph, node)
    of_blocks = took and node.op in {Op.SCALE, Op.MULTIPLY} and not graph.is_gate(node)
    return took + _BETWEEN_BLOCKS if of_blocks and takes_several(graph, node) else took


def _as_early(graph: Graph, times: Sequence[int], period: int) -> list[int]:
    """Return the clock of each node, as early as its operands are there, where each clock takes a time `period`."""
    moments: list[tuple[int, int]] = []
    for node, took in zip(graph.nodes, times, strict=True):
        clock, time = (0, 0) if node.op in _STATES else max(moments[index] for index in node.operands)
        moments.append((clock, time + took) if time + took <= period else (clock + 1, took))
    return [clock for clock, _ in moments]
