"""A dataflow graph in the pipeline stages of an architecture, as synthesis sees it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

from sosmith.hdl.plan.interleaving import schedule
from sosmith.hdl.plan.look_ahead import TurnPlan
from sosmith.hdl.plan.pipeline import inner_sums, pipeline_stages
from sosmith.model.dataflow.graph import Graph, Op

SUMS = {Op.ADD, Op.SUBTRACT}
"""Operations that are sums."""

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
        return cls(graph, tuple(stages), adders, apart=inner_sums(graph, stages))

    @classmethod
    def of_channels(cls, graph: Graph, channels: int, adders: Collection[int], *, rewrites: bool) -> Pipelined:
        """Return the plan for several channels; `rewrites` as in `schedule`."""
        plan = schedule(graph, channels, rewrites=rewrites)
        return cls(graph, plan.pipeline_stages, adders, graph.delays, channels, plan.distance, plan.reading > 1)

    @classmethod
    def of_turns(cls, plan: TurnPlan) -> Pipelined:
        """Return the plan with look-ahead."""
        held = plan.loops if plan.turns > 1 else ()
        sums = [index for index, node in enumerate(plan.graph.nodes) if node.op in SUMS]
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
        """Say whether synthesis adds up at once what a sum or a product and the sum that uses it add up."""
        together = self.users[index] == [user] and self.stages[index] == self.stages[user]
        return together and index not in self.apart

    def width(self, index: int) -> int:
        """Return the bits of a node that are used: fewer if its range is stated to be smaller."""
        nodes = self.graph.nodes
        direct = [node for node in nodes if index in node.operands]
        if not direct or index in self.graph.outputs or any(node.op is not Op.BOUND for node in direct):
            return nodes[index].width
        return min(nodes[index].width, max(node.width for node in direct))
