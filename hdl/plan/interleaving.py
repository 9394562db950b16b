"""Pipeline stages of a datapath stage for several channels, which take turns in it without waiting for each other."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from sosmith.hdl.plan.pipeline import NO_LOGIC, operation_time
from sosmith.model.dataflow.graph import Graph, Op

_MAX_LUT_RAM_CHANNELS = 16
"""Most channels whose states lie in LUT RAM, which has 16 words in an ECP5. More take block RAM, which is slow and far
from the logic, so that it gets registers before and behind it."""

_Moment = tuple[int, int]
"""Pipeline stage, and time within it."""


@dataclass(frozen=True)
class Schedule:
    """Pipeline stages in which the nodes of a graph are computed.

    Attributes
    ----------
    pipeline_stages : tuple of int
        Pipeline stage of each node; that of a DELAY is the one in which its value has been read from memory.
    writes : dict of int to int
        Pipeline stage in which each DELAY is written.
    reading : int
        Pipeline stages from the one that addresses a memory to the one that has the state: 1, or 2 with registers
        around the memory.
    depth : int
        Number of pipeline stages.
    """

    pipeline_stages: tuple[int, ...]
    writes: dict[int, int]
    reading: int
    depth: int

    @property
    def distance(self) -> int:
        """Least number of samples from one of a channel to its next, so that the states have been written by then."""
        addressed = {delay: self.pipeline_stages[delay] - self.reading for delay in self.writes}
        return max((written - addressed[delay] + 1 for delay, written in self.writes.items()), default=1)


def schedule(graph: Graph, channels: int, *, rewrites: bool = False) -> Schedule:
    """Schedule `graph` with the shortest pipeline stages that let all channels take turns without waiting.

    Parameters
    ----------
    graph : Graph
        What the stage computes.
    channels : int
        Number of channels, at least 2.
    rewrites : bool
        Whether a state may have to be written as it was read, which takes until it has been read.
    """
    least = max((operation_time(graph, node) for node in graph.nodes), default=0)
    reading = 1 if channels <= _MAX_LUT_RAM_CHANNELS else 2
    tried = (_spread(graph, period, reading, rewrites) for period in itertools.count(max(least, 1)))
    return next(plan for plan in tried if plan.distance <= channels)


def _spread(graph: Graph, period: int, reading: int, rewrites: bool) -> Schedule:
    """Schedule `graph` with pipeline stages of the time `period`.

    A first pass finds the earliest moment at which each value can be there. A second one computes each as late as the
    earliest moments of the outputs and of the states' next values allow, so that fewer registers pass values on.
    """
    nodes = graph.nodes
    early: list[_Moment] = []  # when a value is there
    for node in nodes:
        if node.op in {Op.INPUT, Op.CONSTANT}:
            early.append((0, 0))
        elif node.op is Op.DELAY:
            early.append((reading, 0))  # the memory is addressed in pipeline stage 0
        else:
            stage, time = max(early[i] for i in node.operands)
            took = operation_time(graph, node)
            early.append((stage, time + took) if time + took <= period else (stage + 1, took))
    sources = [nodes[i].operands[0] for i in graph.delays]
    behind = reading - 1  # pipeline stages from a state's next value to the port of its memory
    depth = max([stage for stage, _ in early] + [early[i][0] + behind for i in sources]) + 1
    late: list[_Moment] = [(depth - 1, period)] * len(nodes)  # when a value has to be there
    stages = [0] * len(nodes)
    for index in reversed(range(len(nodes))):
        node = nodes[index]
        if index in sources and node.op is not Op.DELAY:
            late[index] = min(late[index], (early[index][0], period))
        stage, time = late[index]
        took = operation_time(graph, node)
        start = (stage, time - took) if time >= took else (stage - 1, period - took)
        stages[index] = start[0]
        if node.op is not Op.DELAY:
            for i in node.operands:
                late[i] = min(late[i], start)
    for index, node in enumerate(nodes):
        if node.op in {Op.INPUT, Op.CONSTANT}:
            stages[index] = 0
        elif node.op in NO_LOGIC - {Op.DELAY}:  # bits are dropped as early as possible, before they take registers
            stages[index] = stages[node.operands[0]]
    writes = {i: max(stages[nodes[i].operands[0]] + behind, stages[i] - (not rewrites)) for i in graph.delays}
    return Schedule(tuple(stages), writes, reading, depth)
