"""Quantities of hardware that has every operation of a dataflow graph, in pipeline stages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

from sosmith.gen.estimate.memories import of_memory
from sosmith.gen.estimate.products import of_product, product_in
from sosmith.gen.estimate.quantities import (
    Quantities,
    check_bits,
    of_check_bits,
    tree,
)
from sosmith.gen.fpga.boards import Device
from sosmith.hdl.plan.interleaving import schedule
from sosmith.hdl.plan.look_ahead import TurnPlan
from sosmith.hdl.plan.pipeline import known_early, pipeline_stages
from sosmith.model.dataflow.adder_graph import adder_bits, adder_graph, by_operand
from sosmith.model.dataflow.graph import Graph, Node, Op

_SUMS = {Op.ADD, Op.SUBTRACT}
_WIRES = {Op.BOUND, Op.SHIFT}


@dataclass(frozen=True)
class Pipelined:
    """A graph in the pipeline stages of an architecture.

    Attributes
    ----------
    graph : Graph
        What is computed.
    stages : tuple of int
        Pipeline stage of each node.
    adders : collection of int
        Products by constants that are made of adders.
    held : collection of int
        States that lie in memories.
    words : int
        Words of each such memory.
    distance : int
        Least number of samples from one of a channel to its next.
    block_ram : bool
        Whether the memories are asked to be block RAM.
    apart : collection of int
        Nodes that synthesis must not merge with others.
    """

    graph: Graph
    stages: tuple[int, ...]
    adders: Collection[int] = ()
    held: Collection[int] = ()
    words: int = 1
    distance: int = 1
    block_ram: bool = False
    apart: Collection[int] = ()

    @classmethod
    def of_one(cls, graph: Graph, adders: Collection[int]) -> Pipelined:
        """Return the plan for one channel."""
        stages = pipeline_stages(graph)
        return cls(graph, tuple(stages), adders, apart=known_early(graph, stages))

    @classmethod
    def of_channels(cls, graph: Graph, channels: int, adders: Collection[int], *, rewrites: bool) -> Pipelined:
        """Return the plan for several channels; `rewrites` as in `schedule`."""
        plan = schedule(graph, channels, rewrites=rewrites)
        return cls(graph, plan.pipeline_stages, adders, graph.delays, channels, plan.distance, plan.reading > 1)

    @classmethod
    def of_turns(cls, plan: TurnPlan) -> Pipelined:
        """Return the plan with look-ahead."""
        held = plan.loops if plan.turns > 1 else ()
        sums = [index for index, node in enumerate(plan.graph.nodes) if node.op in _SUMS]
        return cls(plan.graph, tuple(plan.pipeline_stages), (), held, plan.turns, apart=sums)

    @property
    def depth(self) -> int:
        """Number of pipeline stages."""
        return max(self.stages) + 1

    @cached_property
    def uses(self) -> Mapping[int, int]:
        """Last pipeline stage in which each node is used."""
        nodes = self.graph.nodes
        found: dict[int, int] = {}

        def use(index: int, stage: int) -> None:
            while nodes[index].op is Op.SHIFT:  # the same signal
                (index,) = nodes[index].operands
            found[index] = max(found.get(index, 0), stage)

        for user, node in enumerate(nodes):
            for operand in node.operands if node.op is not Op.SHIFT else ():
                use(operand, self.stages[user])
        for output in self.graph.outputs:
            use(output, self.depth - 1)
        return found

    @cached_property
    def users(self) -> Mapping[int, list[int]]:
        """Nodes that use each node, be it through nodes that are the same signal."""
        nodes = self.graph.nodes
        found: dict[int, list[int]] = {index: [] for index in range(len(nodes))}
        for user, node in enumerate(nodes):
            if node.op not in _WIRES:
                for operand in node.operands:
                    found[self.source(operand)].append(user)
        for output in self.graph.outputs:
            found[self.source(output)].append(len(nodes))
        return found

    def source(self, index: int) -> int:
        """Return the node that makes the signal of a node."""
        while self.graph.nodes[index].op in _WIRES:
            (index,) = self.graph.nodes[index].operands
        return index

    def is_merged(self, index: int, user: int) -> bool:
        """Say whether synthesis makes one sum of a sum and the one that uses it."""
        node = self.graph.nodes[index]
        return (
            node.op in _SUMS
            and index not in self.apart
            and self.users[index] == [user]
            and self.stages[index] == self.stages[user]
        )

    def width(self, index: int) -> int:
        """Return the bits of a node that are used: fewer if its range is stated to be smaller."""
        nodes = self.graph.nodes
        direct = [node for node in nodes if index in node.operands]
        if not direct or index in self.graph.outputs or any(node.op is not Op.BOUND for node in direct):
            return nodes[index].width
        return min(nodes[index].width, max(node.width for node in direct))

    def dropped(self, index: int) -> int:
        """Return the number of lowest bits of a node that nothing uses."""
        nodes, users = self.graph.nodes, self.users[index]
        if not users or any(user >= len(nodes) or nodes[user].op is not Op.FLOOR for user in users):
            return 0
        return min(nodes[nodes[user].operands[0]].frac - nodes[user].frac for user in users)


def of_pipelined(plan: Pipelined, device: Device, *, protect: str = "none", loads: bool = False) -> Quantities:
    """Count a stage on a device; `loads` says that its constants come from registers."""
    made: Quantities = Counter()
    graph = plan.graph
    for operand, group in by_operand(graph, plan.adders):
        sums = adder_graph(tuple(graph.nodes[index].parameter for index in group))
        made["sums"] += adder_bits(sums, *graph.nodes[operand].range[1:])
    for index, node in enumerate(graph.nodes):
        if node.op is Op.DELAY:
            made += _state(plan, index, device, protect)
        elif index not in plan.adders:
            made += _sum(plan, index) if node.op in _SUMS else _operation(graph, node, device, loads=loads)
        if node.op not in {Op.CONSTANT, Op.SHIFT}:
            passes = plan.uses.get(index, 0) - plan.stages[index]
            made["registers"] += node.width * max(passes, 0)
    made["registers"] += sum(graph.nodes[i].width for i in graph.outputs) + 2 * plan.depth
    made["guarded_stages"] += plan.depth * (protect != "none")
    return made


def _operation(graph: Graph, node: Node, device: Device, *, loads: bool) -> Quantities:
    nodes = graph.nodes
    if graph.is_gate(node):
        return Counter({"gated": node.width})
    if node.op is Op.TRUNCATE:
        return Counter({"sums": nodes[node.operands[0]].width})
    if node.op is Op.CLAMP:
        return clamp(node, nodes[node.operands[0]])
    product = product_in(graph, node, loads=loads)
    return Counter() if product is None else of_product(product, device)


def _sum(plan: Pipelined, index: int) -> Quantities:
    """Count a sum; two that synthesis merges add up three numbers without a carry first, in two LUT4 a bit."""
    node = plan.graph.nodes[index]
    if _is_concatenation(plan.graph, node):
        return Counter()
    free = _free_bits(plan.graph, node)
    carries = max(0, plan.dropped(index) - free)
    merged = sum(plan.is_merged(plan.source(operand), index) for operand in node.operands)
    width = plan.width(index)
    return Counter({"sums": max(0, width - free - carries), "carries": carries, "merged": merged * width})


def _is_concatenation(graph: Graph, node: Node) -> bool:
    """Say whether a sum takes no adder, as one operand is a constant with bits below those of the other alone."""
    for own, other in (node.operands, node.operands[::-1]):
        constant = graph.nodes[own]
        if constant.op is Op.CONSTANT and (node.op is Op.ADD or own == node.operands[1]):
            end = constant.parameter.bit_length() - constant.frac
            if constant.parameter == 0 or (
                node.op is Op.ADD and constant.parameter > 0 and end <= -graph.nodes[other].frac
            ):
                return True
    return False


def _free_bits(graph: Graph, node: Node) -> int:
    """Return the lowest bits of a sum without an adder: only one operand has any there, and is not subtracted."""
    first, second = (node.frac - graph.nodes[i].frac for i in node.operands)
    return max(0, second - first) if node.op is Op.SUBTRACT else abs(second - first)


def clamp(node: Node, operand: Node) -> Quantities:
    """Count what limits a value to a range: a choice for each bit, and a comparison with its ends."""
    bits = node.high.bit_length()
    simple = node.high == (1 << bits) - 1 and node.low in {0, -node.high - 1}
    ends = 2 * tree(max(0, operand.width - bits)) if simple else 0
    return Counter({"chosen": node.width, "logic": ends, "compared": 0 if simple else 2 * operand.width})


def _state(plan: Pipelined, index: int, device: Device, protect: str) -> Quantities:
    graph = plan.graph
    width = graph.nodes[index].width
    if index in plan.held:
        return _held_state(plan, width, device, protect)
    early = any(
        plan.stages[user] < plan.stages[index]
        for user, node in enumerate(graph.nodes)
        if index in node.operands and node.op is not Op.DELAY
    )
    made: Quantities = Counter({"registers": width, "chosen": width * early})
    if protect != "none":  # registers have parity
        made += of_check_bits(width, "detect") + Counter({"registers": 1})
    return made


def _held_state(plan: Pipelined, width: int, device: Device, protect: str) -> Quantities:
    made = of_memory(device, plan.words, width + check_bits(width, protect), block=plan.block_ram)
    made += Counter({"registers": width * plan.block_ram, "states": width})
    if protect == "none":
        return made
    return made + of_check_bits(width, protect) + Counter({"chosen": width})  # a scrub writes what it has read
