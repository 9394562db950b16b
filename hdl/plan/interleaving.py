"""Pipeline stages of a datapath stage for several channels, which take turns in it without waiting for each other."""

from __future__ import annotations

import itertools
from collections.abc import Collection
from dataclasses import dataclass

from sosmith.hdl.plan.pipeline import NO_LOGIC, REGISTERED_MULTIPLICATION, is_block_product, operation_time
from sosmith.model.dataflow.graph import Graph, Op

_READ, _WRITE = 3, 3
"""Delays of memories in the unit of `operation_time`: of one that is read without a clock, and of the choice between
what is written and what clears."""

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
        Pipeline stage in which each DELAY is written; that behind the last one has the number `depth`.
    reading : int
        Pipeline stages from the one that addresses a memory to the one that has the state: 0 for two channels, whose
        loop has no clock for it; 1; or 2 with registers around the memory.
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


def schedule(graph: Graph, channels: int, *, rewrites: bool = False, adders: Collection[int] = ()) -> Schedule:
    """Schedule `graph` with the shortest pipeline stages that let all channels take turns without waiting.

    A product from a multiplier block has registers before and behind it, where that makes them shorter.

    Parameters
    ----------
    graph : Graph
        What the stage computes.
    channels : int
        Number of channels, at least 2.
    rewrites : bool
        Whether a state may have to be written as it was read, which takes until it has been read.
    adders : collection of int
        Products by constants that are made of adders.
    """
    blocks = {i for i, node in enumerate(graph.nodes) if is_block_product(graph, node)} - {*adders}
    times = [operation_time(graph, node) for node in graph.nodes]
    least = max((time for i, time in enumerate(times) if i not in blocks), default=0)
    reading = 0 if channels == 2 else 1 if channels <= _MAX_LUT_RAM_CHANNELS else 2
    tried = (_Spreading(graph, times, blocks, period, reading) for period in itertools.count(max(least, 1)))
    plans = (spreading.schedule(rewrites=rewrites) for spreading in tried)
    return next(plan for plan in plans if plan.distance <= channels)


@dataclass(frozen=True)
class _Spreading:
    """Pipeline stages of the time `period`.

    A first pass finds the earliest moment at which each value can be there. A second one computes each as late as the
    earliest moments of the outputs and of the states' next values allow, so that fewer registers pass values on.

    Attributes
    ----------
    graph : Graph
    times : list of int
        Time of each node.
    blocks : set of int
        Products that a register may follow at once: then they take as long as what is left of their pipeline stage, if
        that is all of it, as there are registers before them as well, or `REGISTERED_MULTIPLICATION`.
    period, reading : int
    """

    graph: Graph
    times: list[int]
    blocks: set[int]
    period: int
    reading: int

    def schedule(self, *, rewrites: bool) -> Schedule:
        """Return the schedule."""
        nodes, delays = self.graph.nodes, self.graph.delays
        early = self._earliest()
        due = {i: self._written(early[nodes[i].operands[0]]) for i in delays}
        depth = max(stage for stage, _ in early) + 1
        stages = self._latest(early, depth)
        for index, node in enumerate(nodes):
            if node.op in {Op.INPUT, Op.CONSTANT}:
                stages[index] = 0
            elif node.op in NO_LOGIC - {Op.DELAY}:  # bits are dropped as early as possible, before they take registers
                stages[index] = stages[node.operands[0]]
        before = self.reading > 0 and not rewrites
        writes: dict[int, int] = {}
        for i in delays:
            (source,) = nodes[i].operands
            writes[i] = max(stages[source] + due[i] - early[source][0], stages[i] - before)
        return Schedule(tuple(stages), writes, self.reading, depth)

    def _written(self, there: _Moment) -> int:
        """Return the pipeline stage in which a value is written that is there at a moment."""
        stage, time = there
        return stage + (self.reading > 1 or time + _WRITE > self.period)

    def _earliest(self) -> list[_Moment]:
        """Return the earliest moment at which each value can be there."""
        early: list[_Moment] = []
        for index, node in enumerate(self.graph.nodes):
            if node.op in {Op.INPUT, Op.CONSTANT}:
                early.append((0, 0))
            elif node.op is Op.DELAY:
                early.append((self.reading, 0) if self.reading else (0, _READ))  # addressed in pipeline stage 0
            else:
                early.append(self._end(index, max(early[i] for i in node.operands)))
        return early

    def _end(self, index: int, begin: _Moment) -> _Moment:
        """Return the earliest moment at which an operation ends whose operands are there at `begin`."""
        (stage, time), took = begin, self.times[index]
        if time + took <= self.period:
            return stage, time + took
        if index not in self.blocks:
            return stage + 1, took
        at_once = time <= self._latest_factor
        return stage + (not at_once), took if not at_once and took <= self.period else self.period

    def _begin(self, index: int, end: _Moment) -> _Moment:
        """Return the latest moment at which an operation can begin that ends at `end`."""
        (stage, time), took = end, self.times[index]
        if self.graph.nodes[index].op is Op.DELAY and not self.reading:
            took = _READ
        if index in self.blocks and (time == self.period or time < took):
            return stage - (time < self.period), self._latest_factor
        return (stage, time - took) if time >= took else (stage - 1, self.period - took)

    @property
    def _latest_factor(self) -> int:
        """Latest time in a pipeline stage at which a factor may be there of a product that is registered at once."""
        return max(self.period - REGISTERED_MULTIPLICATION, 0)

    def _latest(self, early: list[_Moment], depth: int) -> list[int]:
        """Return the latest pipeline stage in which each value can be computed."""
        nodes = self.graph.nodes
        sources = {nodes[i].operands[0] for i in self.graph.delays}
        late: list[_Moment] = [(depth - 1, self.period)] * len(nodes)  # when a value has to be there
        stages = [0] * len(nodes)
        for index in reversed(range(len(nodes))):
            node = nodes[index]
            if index in sources and node.op is not Op.DELAY:
                stage, time = early[index]
                registered = self._written((stage, time)) > stage
                late[index] = min(late[index], (stage, self.period - (0 if registered else _WRITE)))
            start = self._begin(index, late[index])
            stages[index] = start[0]
            if node.op is not Op.DELAY:
                for i in node.operands:
                    late[i] = min(late[i], start)
        return stages
