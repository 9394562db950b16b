"""A dataflow graph in the pipeline stages of an architecture, as synthesis sees it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from sosmith.hdl.plan.interleaving import schedule
from sosmith.hdl.plan.look_ahead import TurnPlan
from sosmith.hdl.plan.pipeline import pipeline_stages
from sosmith.hdl.plan.sharing.sections import SharedSections
from sosmith.hdl.plan.used_bits import used_bits
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
    words_in_registers : bool
        Whether these memories are registers.
    distance : int
        Least number of samples from one of a channel to its next.
    block_ram : bool
        Whether the memories are asked to be block RAM.
    writes : mapping of int to int
        Pipeline stage in which each such memory is written, where that is not the one of the state.
    shares : bool
        Whether an output that is the upper part of a state's next value takes no register of its own.
    kept : collection of int
        Nodes that no register passes on, as they stay as they are.
    """

    graph: Graph
    stages: tuple[int, ...]
    adders: Collection[int] = ()
    held: Collection[int] = ()
    words: int = 1
    words_in_registers: bool = False
    distance: int = 1
    block_ram: bool = False
    writes: Mapping[int, int] = field(default_factory=dict)
    shares: bool = False
    kept: Collection[int] = ()

    @classmethod
    def of_one(cls, graph: Graph, adders: Collection[int]) -> Pipelined:
        """Return the plan for one channel."""
        return cls(graph, tuple(pipeline_stages(graph)), adders, shares=True)

    @classmethod
    def of_turn(cls, unit: SharedSections, clocks: int) -> Pipelined:
        """Return the plan of sections that share hardware, where inputs and states stay as they are in all clocks."""
        return cls(unit.graph, tuple(unit.turn(clocks)), kept=unit.kept, shares=True)

    @classmethod
    def of_channels(cls, graph: Graph, channels: int, adders: Collection[int], *, rewrites: bool) -> Pipelined:
        """Return the plan for several channels; `rewrites` as in `schedule`."""
        plan = schedule(graph, channels, rewrites=rewrites, adders=adders)
        return cls(
            graph,
            plan.pipeline_stages,
            adders,
            graph.delays,
            channels,
            plan.reading == 0,
            plan.distance,
            plan.reading > 1,
            plan.writes,
        )

    @classmethod
    def of_turns(cls, plan: TurnPlan) -> Pipelined:
        """Return the plan with look-ahead."""
        held = plan.loops if plan.turns > 1 else ()
        return cls(plan.graph, tuple(plan.pipeline_stages), (), held, plan.turns)

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
                use(operand, self.writes.get(user, self.stages[user]))
        for output in self.graph.outputs:
            use(output, self.depth - 1)
        return found

    def source(self, index: int) -> int:
        """Return the node that makes the signal of a node."""
        while self.graph.nodes[index].op in _WIRES:
            (index,) = self.graph.nodes[index].operands
        return index

    @cached_property
    def used(self) -> Sequence[int]:
        """Bits of each node that its signal has: of a sum those that are used, of another node all."""
        bits = used_bits(self.graph)
        return [bits[i] if node.op in SUMS else node.width for i, node in enumerate(self.graph.nodes)]

    def passes(self, index: int) -> int:
        """Return how many registers pass a node on; bits that are cut off a state are taken from where that is."""
        if index in self.kept:
            return 0
        node, own = self.graph.nodes[index], self.stages[index]
        if node.op in {Op.FLOOR, Op.FRACTION} and self.graph.nodes[node.operands[0]].op is Op.DELAY:
            own = max(own, self.stages[node.operands[0]])
        return max(self.uses.get(index, 0) - own, 0)

    def is_state(self, output: int) -> bool:
        """Say whether an output needs no register, as a state holds it."""
        if not self.shares or self.stages[output] != self.depth - 1:
            return False
        nodes, index = self.graph.nodes, output
        following = {nodes[delay].operands[0] for delay in self.graph.delays}
        while index not in following and nodes[index].op in {Op.FLOOR, *_WIRES}:
            (index,) = nodes[index].operands
        return index in following
