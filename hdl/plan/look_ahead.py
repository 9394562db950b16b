"""Pipeline stages of a pipeline with look-ahead: loops that go back several samples take turns with themselves.

A loop that uses only values of T, 2T, .. samples ago is T loops that never meet: samples 0, T, 2T, .. are one, samples
1, T + 1, .. another. Their states lie in a memory of T words, and a sample finds those of its turn there, as the
samples of T channels do (`sosmith.hdl.plan.interleaving`). The loop then has T clocks. What no loop reaches has as many
pipeline stages as it likes; its delays are registers that move with every sample.

Products by constants are sums (`sosmith.hdl.plan.constant_products`), between which pipeline stages may end, or pieces
for multiplier blocks (`sosmith.hdl.plan.block_products`), each alone in a pipeline stage: registers of its block are on
both sides. All stages of a core get pipeline stages of the time that its slowest loop needs: shorter ones would take
registers for nothing. Where a core has so many blocks that they lie all over the FPGA, a wire from one of them takes a
pipeline stage of its own, up to a register near what adds up the pieces, if the loops have the clock for it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from sosmith.hdl.plan.block_products import is_product, with_blocks
from sosmith.hdl.plan.constant_products import with_sums
from sosmith.hdl.plan.pipeline import ADDITION, NO_LOGIC, loop_delays, operation_time, recursive
from sosmith.hdl.plan.reassociation import with_places
from sosmith.hdl.plan.regrouped_sums import regrouped
from sosmith.model.dataflow.adder_graph import scalings
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op, Wire
from sosmith.model.dataflow.structure import Stage


@dataclass(frozen=True)
class TurnPlan:
    """Pipeline stages of one stage.

    Attributes
    ----------
    graph : Graph
        What is computed: the stage's graph with sums for products, and one DELAY for each T samples of a loop's past.
    turns : int
        Number T of samples that take turns; 1 if a loop goes back one sample.
    loops : frozenset of int
        The DELAYs of loops.
    pipeline_stages : tuple of int
        Pipeline stage of each node. That of a loop's DELAY is the one in which its value is there; in a memory, it is
        addressed one before.
    writes : dict of int to int
        Pipeline stage in which each loop's DELAY is written.
    depth : int
        Number of pipeline stages.
    """

    graph: Graph
    turns: int
    loops: frozenset[int]
    pipeline_stages: tuple[int, ...]
    writes: dict[int, int]
    depth: int

    @property
    def distance(self) -> int:
        """Least number of samples from one to the next that uses its states."""
        reading = _reading(self.turns)
        return max((end - self.pipeline_stages[i] + reading + 1 for i, end in self.writes.items()), default=1)


@dataclass(frozen=True)
class Products:
    """How the products by constants of a core with look-ahead are made.

    Attributes
    ----------
    adders : tuple of frozenset of int
        Those that are made of adders, by stage and node.
    block_bits : int
        Bits of each operand, signed, of the multiplier blocks that the others take.
    """

    adders: tuple[frozenset[int], ...]
    block_bits: int

    @classmethod
    def of_adders(cls, stages: Sequence[Stage]) -> Products:
        """Make all of adders."""
        return cls(tuple(scalings(stage.graph) for stage in stages), 2)


def plans(stages: Sequence[Stage], products: Products) -> tuple[TurnPlan, ...]:
    """Plan the pipeline stages of all stages of a core."""
    return _plans(tuple(stage.graph for stage in stages), products)


def in_pieces(graphs: Sequence[Graph], products: Products) -> list[tuple[Graph, frozenset[int]]]:
    """Return the graphs with products in pieces as multiplier blocks take them, and which nodes these are."""
    return [
        with_blocks(graph, _others(graph, adders), products.block_bits)
        for graph, adders in zip(graphs, products.adders, strict=True)
    ]


def period(stages: Sequence[Stage], products: Products) -> int:
    """Return the time of the pipeline stages in `plans`, with wires that are long, in units of `operation_time`."""
    turned = _all_turned(tuple(stage.graph for stage in stages), products)
    time, wired = _period(turned)
    return time + _LONG_WIRE * (_is_far(turned) and not wired)


_NEAR, _LONG_WIRE = 64, 7
"""Multiplier blocks of a core up to which none is far from what takes its product; what the wire takes where they are
more, in units of `operation_time`.

With 156 of them on an ECP5-85F, the slowest path was a wire of 6.9 ns from a block, and two sums behind it: 82 MHz.
"""

_Turned = tuple[Graph, int, frozenset[int]]
"""A graph with sums, whose loops have one DELAY for all samples that take turns; their number; the DELAYs."""


@lru_cache(maxsize=16)
def _plans(graphs: tuple[Graph, ...], products: Products) -> tuple[TurnPlan, ...]:
    turned = _all_turned(graphs, products)
    longest, wired = _period(turned)
    return tuple(_spread(*each, longest, wired=wired) for each in turned)


def _all_turned(graphs: tuple[Graph, ...], products: Products) -> tuple[_Turned, ...]:
    bits = products.block_bits
    return tuple(_turned(graph, adders, bits) for graph, adders in zip(graphs, products.adders, strict=True))


@lru_cache(maxsize=16)
def _period(all_turned: tuple[_Turned, ...]) -> tuple[int, bool]:
    """Return the shortest time, and whether wires from blocks have pipeline stages: not if that takes longer."""
    longest = ADDITION
    for graph, turns, loops in all_turned:
        if loops:
            tried = itertools.count(longest)
            longest = next(time for time in tried if _fits(graph, turns, loops, time, wired=False))
    if _is_far(all_turned):
        for time in range(longest, longest + _LONG_WIRE):
            if all(_fits(*each, time, wired=True) for each in all_turned):
                return time, True
    return longest, False


def _fits(graph: Graph, turns: int, loops: frozenset[int], time: int, *, wired: bool) -> bool:
    """Whether loops have the time they need with pipeline stages of so much."""
    return not loops or _spread(graph, turns, loops, time, wired=wired).distance <= turns


def _is_far(all_turned: tuple[_Turned, ...]) -> bool:
    """Whether blocks lie all over the FPGA."""
    return sum(is_product(node) for graph, _, _ in all_turned for node in graph.nodes) > _NEAR


def _reading(turns: int) -> int:
    """Pipeline stages from the one that addresses a memory to the one that has the state; a register has none."""
    return 1 if turns > 1 else 0


def _others(graph: Graph, nodes: Collection[int]) -> list[int]:
    return [index for index in range(len(graph.nodes)) if index not in nodes]


@lru_cache(maxsize=64)
def _turned(graph: Graph, adders: frozenset[int], bits: int) -> _Turned:
    """Return a graph whose loops take turns, with sums for products in `adders` and pieces for blocks otherwise.

    Its nodes are in the order of computation also where they depend on a DELAY of no loop.
    """
    graph, places = with_places(graph)
    graph = regrouped(with_sums(*with_blocks(graph, _others(graph, {places[index] for index in adders}), bits)))
    nodes, loops = graph.nodes, loop_delays(graph)
    roots = {i: graph.undelayed(i) for i in loops}
    used = {i for index, node in enumerate(nodes) if index not in loops for i in node.operands} | {*graph.outputs}
    turns = math.gcd(*(roots[i][1] for i in loops & used))
    kept = {i for i in loops if roots[i][1] % max(turns, 1) == 0}
    last = max((roots[i][1] for i in loops & used), default=0)
    g = GraphBuilder()
    wires: dict[int, Wire] = {}
    for index in _in_order(graph, loops):
        node = nodes[index]
        if index in kept and roots[index][1] <= last:
            wires[index] = g.copied(node, [])
        elif index not in loops and node.op is not Op.DELAY:
            wires[index] = g.copied(node, [wires[i] for i in node.operands])
        elif index not in loops:
            wires[index] = g.copied(node, [])
            g.connect(wires[index], wires[node.operands[0]])
    states = [i for i in sorted(kept) if i in wires]
    for i in states:
        root, delay = roots[i]
        before = next((k for k in states if roots[k] == (root, delay - turns)), root)
        g.connect(wires[i], wires[before])
    return g.build([wires[i] for i in graph.outputs]), max(turns, 1), frozenset(int(wires[i]) for i in states)


def _in_order(graph: Graph, loops: frozenset[int]) -> list[int]:
    """Return the nodes in an order in which each follows its operands; loops begin at their DELAYs."""
    order = [*graph.inputs]  # the ports stay in their order
    placed = set(order)
    for start in range(len(graph.nodes)):
        pending = [start]
        while pending:
            index = pending[-1]
            operands = () if index in loops else graph.nodes[index].operands
            missing = [i for i in operands if i not in placed]
            if missing and index not in placed:
                pending += missing
                continue
            pending.pop()
            if index not in placed:
                placed.add(index)
                order.append(index)
    return order


_Moment = tuple[int, int]
"""Pipeline stage, and time within it."""


def _spread(graph: Graph, turns: int, loops: frozenset[int], longest: int, *, wired: bool) -> TurnPlan:
    """Plan with pipeline stages of the time `longest`; an operation that takes longer has one of its own.

    Blocks have their registers, but in loops that have no clock for them; `wired` says whether the wires from them have
    a pipeline stage besides.
    """
    products = frozenset(index for index, node in enumerate(graph.nodes) if is_product(node))
    plans = (
        _spread_with(graph, turns, loops, longest, registered, lead, wired=wired)
        for registered in ((products,) if wired else (products, products - recursive(graph)))
        for lead in range(max(turns - 1, 1))
    )
    return _first_in_time(plans, turns)


def _first_in_time(plans: Iterable[TurnPlan], turns: int) -> TurnPlan:
    """Return the first plan whose loops have the time they need, or the last one."""
    for plan in plans:
        if plan.distance <= turns:
            break
    return plan


def _spread_with(
    graph: Graph,
    turns: int,
    loops: frozenset[int],
    longest: int,
    registered: frozenset[int],
    lead: int,
    *,
    wired: bool,
) -> TurnPlan:
    """Plan with each product in `registered` alone in its pipeline stage: registers of its block are on both sides.

    Such a product is faster than any other pipeline stage: 186 MHz on an ECP5 of speed grade 6 with the one behind it,
    which if `wired` has nothing but a wire.

    As `sosmith.hdl.plan.interleaving.schedule`, it finds the earliest moment of each value first, and then computes
    each as late as the outputs and the states' next values allow. The pipeline stage of a delay in no loop is that of
    what it delays.
    """
    nodes = graph.nodes
    times = [
        longest if index in registered else min(operation_time(graph, node, powers=True), longest)
        for index, node in enumerate(nodes)
    ]
    distant = registered if wired else frozenset[int]()
    early = _earliest(graph, loops, times, longest, _reading(turns), lead, registered, distant)
    depth = max(stage for stage, _ in early) + 1
    planned = _latest(graph, loops, times, longest, early, depth, distant)
    for index, node in enumerate(nodes):
        if node.op in {Op.INPUT, Op.CONSTANT}:
            planned[index] = 0
        elif index not in loops and node.op in NO_LOGIC:  # as early as possible: dropped bits take no registers
            planned[index] = planned[node.operands[0]]
    writes = {i: max(planned[nodes[i].operands[0]], planned[i]) for i in loops}
    return TurnPlan(graph, turns, loops, tuple(planned), writes, depth)


def _earliest(
    graph: Graph,
    loops: frozenset[int],
    times: list[int],
    longest: int,
    reading: int,
    lead: int,
    registered: frozenset[int],
    distant: frozenset[int],
) -> list[_Moment]:
    """Return the earliest moment at which each value can be there; that of older states, `lead` stages before.

    Products in `distant` are there a pipeline stage later than they are computed. What enters is registered once more
    before it goes to blocks: they are many, and far from each other.
    """
    early: list[_Moment] = []
    for index, node in enumerate(graph.nodes):
        if index in loops:
            early.append((reading + (lead if node.operands[0] not in loops else 0), 0))
        elif not node.operands:
            early.append((0, 0))
        elif node.op is Op.DELAY:  # a register, which has its value from the beginning of the pipeline stage on
            early.append((early[node.operands[0]][0], 0))
        else:
            stage, time = max(early[i] for i in node.operands)
            if index in registered:
                stage, time = max((stage, time), (1, 0))
            took = times[index]
            stage, time = (stage, time + took) if time + took <= longest else (stage + 1, took)
            early.append((stage + (index in distant), time))
    return early


def _latest(
    graph: Graph,
    loops: frozenset[int],
    times: list[int],
    longest: int,
    early: list[_Moment],
    depth: int,
    distant: frozenset[int],
) -> list[int]:
    """Return the latest pipeline stage in which each value can begin to be computed."""
    nodes = graph.nodes
    sources = {nodes[i].operands[0] for i in loops} - loops
    late: list[_Moment] = [(depth - 1, longest)] * len(nodes)
    planned = [0] * len(nodes)
    for index in reversed(range(len(nodes))):
        if index in sources:
            late[index] = min(late[index], (early[index][0], longest))
        (stage, time), took = late[index], times[index]
        stage -= index in distant
        start = (stage, time - took) if time >= took else (stage - 1, longest - took)
        planned[index] = start[0]
        if nodes[index].op is Op.DELAY:
            start = start[0], longest
        for i in () if index in loops else nodes[index].operands:
            late[i] = min(late[i], start)
    return planned
