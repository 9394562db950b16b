"""One stage of a datapath for several channels that take turns: its loop is pipelined through them.

The states of every channel lie in memories. A recursion need not be done within a clock then: while one channel's
sample is in the loop, those of others follow. The same channel may come again after as many samples as the loop has
ranks, `Schedule.distance`; the core keeps it waiting that long (`sosmith.hdl.core`).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.axi_stream import channel_bits
from sosmith.hdl.constant_banks import NO_CONSTANTS, Pair
from sosmith.hdl.ranked_logic import RankedLogic, banks_in_use, limits, shape_of
from sosmith.hdl.stage import PLAIN
from sosmith.model.dataflow.datapath import Stage
from sosmith.model.dataflow.graph import Graph, Node, Op

_ADDITION, _MULTIPLICATION, _PARTIAL_PRODUCT = 5, 12, 2
"""Time that an operation takes, some half nanoseconds of an ECP5; a product of several blocks has its parts added."""

_BLOCK_BITS = 18
"""Bits of each operand of a multiplier block, with the sign."""

_SHALLOW = 16
"""Channels up to which a memory of states may be made of LUTs: those of an ECP5 have 16 words. Beyond it is block RAM,
slow and far from the logic, so that registers stand before and behind it."""

_BLOCK_RAM = {"ram_style": "block", "no_rw_check": 1}
"""Of memories with those registers: a sample's states are read at least a clock before they are written, so that nobody
uses what is read at the clock at which that very word is written."""

_Moment = tuple[int, int]
"""Rank and time in it."""


@dataclass(frozen=True)
class Schedule:
    """When each node of a graph is computed.

    Attributes
    ----------
    ranks : tuple of int
        Rank of each node; that of a DELAY is the one that finds it read from memory.
    writes : dict of int to int
        Rank at which each DELAY gets its next value.
    reading : int
        Ranks from the one that tells a memory the channel to the one that has the state: 2 with registers around it.
    count : int
        Register ranks of the stage.
    """

    ranks: tuple[int, ...]
    writes: dict[int, int]
    reading: int
    count: int

    @property
    def distance(self) -> int:
        """Samples from one of a channel to the next of the same, at least, so that its states have been written."""
        told = {delay: self.ranks[delay] - self.reading for delay in self.writes}
        return max((written - told[delay] + 1 for delay, written in self.writes.items()), default=1)


def schedule(graph: Graph, channels: int) -> Schedule:
    """Spread `graph` over the least time a rank at which every channel can come as often as all others.

    Parameters
    ----------
    graph : Graph
        What the stage computes.
    channels : int
        At least 2.
    """
    least = max((_time(graph, node) for node in graph.nodes), default=0)
    reading = 1 if channels <= _SHALLOW else 2
    periods = itertools.count(max(least, 1))
    return next(found for period in periods if (found := _spread(graph, period, reading)).distance <= channels)


def _spread(graph: Graph, period: int, reading: int) -> Schedule:
    """Compute every node as late as the earliest moments of outputs and states' next values allow."""
    nodes = graph.nodes
    early: list[_Moment] = []  # when a value is there
    for node in nodes:
        if node.op in {Op.INPUT, Op.CONSTANT}:
            early.append((0, 0))
        elif node.op is Op.DELAY:
            early.append((reading, 0))  # the memory has been told the channel at rank 0
        else:
            rank, time = max(early[i] for i in node.operands)
            took = _time(graph, node)
            early.append((rank, time + took) if time + took <= period else (rank + 1, took))
    sources = [nodes[i].operands[0] for i in graph.delays]
    behind = reading - 1  # ranks from a next value to its memory
    count = max([rank for rank, _ in early] + [early[i][0] + behind for i in sources]) + 1
    late: list[_Moment] = [(count - 1, period)] * len(nodes)  # when it has to be there
    ranks = [0] * len(nodes)
    for index in reversed(range(len(nodes))):
        node = nodes[index]
        if index in sources and node.op is not Op.DELAY:
            late[index] = min(late[index], (early[index][0], period))
        rank, time = late[index]
        took = _time(graph, node)
        start = (rank, time - took) if time >= took else (rank - 1, period - took)
        ranks[index] = start[0]
        if node.op is not Op.DELAY:
            for i in node.operands:
                late[i] = min(late[i], start)
    for index, node in enumerate(nodes):
        if node.op in {Op.INPUT, Op.CONSTANT}:
            ranks[index] = 0
        elif node.op in PLAIN - {Op.DELAY}:  # what drops bits does so where there are any
            ranks[index] = ranks[node.operands[0]]
    writes = {i: max(ranks[nodes[i].operands[0]] + behind, ranks[i] - 1) for i in graph.delays}
    return Schedule(tuple(ranks), writes, reading, count)


def _time(graph: Graph, node: Node) -> int:
    if node.op in PLAIN:
        return 0
    if node.op in {Op.SCALE, Op.MULTIPLY}:
        operands = [(graph.nodes[i].width, graph.nodes[i].signed) for i in node.operands]
        if node.op is Op.SCALE:
            operands.append((abs(node.parameter).bit_length() + (node.parameter < 0), node.parameter < 0))
        signed = any(sign for _, sign in operands)  # a block takes both operands signed or neither
        several = any(bits + (signed and not sign) > _BLOCK_BITS for bits, sign in operands)
        return _MULTIPLICATION + several * _PARTIAL_PRODUCT
    return _ADDITION


class InterleavedStage(wiring.Component):
    """A stage that takes a sample of any channel at every clock at which the pipeline advances.

    Latency: `Schedule.count` in clocks of the pipeline. Throughput: one sample per clock, if those of the same channel
    are `Schedule.distance` apart.

    Parameters
    ----------
    stage : Stage
        What it computes.
    channels : int
        Number of channels, at least 2.
    constants : dict of int to Pair
        Constants that come from one of two banks, by their nodes.

    Members
    -------
    i0, i1, .. : In(shape)
        Input codes, in the order of the graph's inputs.
    i_valid : In(1)
        Whether the inputs hold a sample; without one, the states stay as they are.
    i_channel : In
        Number of its channel.
    i_bank, o_bank, uses : In(1), Out(1), Out(2)
        As of `sosmith.hdl.stage.PipelineStage`.
    advance : In(1)
        Whether the pipeline moves at this clock.
    clear, clear_channel : In
        While `clear` is high, the states of the channel `clear_channel` are set to 0; the pipeline must be empty.
    o0, o1, .. : Out(shape)
        Output codes; defined while `o_valid` is high.
    o_valid, o_channel : Out
        Whether the outputs hold a sample, and of which channel.
    o_saturated : Out(1)
        Whether the stage had to limit it.
    """

    def __init__(self, stage: Stage, channels: int, constants: Mapping[int, Pair] = NO_CONSTANTS) -> None:
        self.stage = stage
        self.constants = constants
        self.channels = channels
        self.schedule = schedule(stage.graph, channels)
        graph, bits = stage.graph, channel_bits(channels)
        members = {f"i{k}": In(shape_of(graph.nodes[i])) for k, i in enumerate(graph.inputs)}
        members |= {f"o{k}": Out(shape_of(graph.nodes[i])) for k, i in enumerate(graph.outputs)}
        members |= {"i_valid": In(1), "i_channel": In(bits), "advance": In(1)}
        members |= {"i_bank": In(1), "o_bank": Out(1), "uses": Out(2)}
        members |= {"clear": In(1), "clear_channel": In(bits)}
        super().__init__({**members, "o_valid": Out(1), "o_channel": Out(bits), "o_saturated": Out(1)})

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        graph, plan = self.stage.graph, self.schedule
        valid, channel, banks = self._travelling(m)
        ranked = RankedLogic(
            m,
            graph,
            plan.ranks,
            constants=self.constants,
            banks=banks,
            takes=[self.advance] * plan.count,
            valid=valid,
        )
        ranked.connect([getattr(self, f"i{k}") for k in range(len(graph.inputs))])
        at, wires, names = ranked.at, ranked.wires, ranked.names
        for index in graph.delays:
            node, written = graph.nodes[index], plan.writes[index]
            m.submodules[f"{names[index]}_memory"] = memory = Memory(
                shape=shape_of(node),
                depth=self.channels,
                init=[0] * self.channels,
                attrs=_BLOCK_RAM if plan.reading > 1 else {},
            )
            read, write = memory.read_port(), memory.write_port()
            found = read.data
            if plan.reading > 1:
                found = Signal(shape_of(node), name=f"{names[index]}_read", reset_less=True)
                with m.If(self.advance):
                    m.d.sync += found.eq(read.data)
            m.d.comb += [
                read.addr.eq(channel[plan.ranks[index] - plan.reading]),
                read.en.eq(self.advance),
                wires[index].eq(found),
                write.addr.eq(Mux(self.clear, self.clear_channel, channel[written])),
                write.data.eq(Mux(self.clear, 0, at(node.operands[0], written))),
                write.en.eq(self.clear | (self.advance & valid[written])),
            ]
        last = plan.count - 1
        for k, i in enumerate(graph.outputs):
            register = Signal(shape_of(graph.nodes[i]), name=f"{names[i]}_register", reset_less=True)
            m.d.comb += getattr(self, f"o{k}").eq(register)
            with m.If(self.advance):
                m.d.sync += register.eq(at(i, last))
                if graph.nodes[i].op is Op.CLAMP:
                    below, above = limits(graph.nodes[i], at(graph.nodes[i].operands[0], last))
                    m.d.sync += self.o_saturated.eq(below | above)
        return m

    def _travelling(self, m: Module) -> tuple[list[Value], list[Value], list[Value]]:
        """Return for each rank whether there is a sample, of which channel, and its bank; hand on those behind all."""
        valid: list[Value] = [self.i_valid]
        channel: list[Value] = [self.i_channel]
        banks: list[Value] = [self.i_bank]
        for rank in range(1, self.schedule.count + 1):
            valid.append(Signal(name=f"valid{rank}"))
            channel.append(Signal(len(self.i_channel), name=f"channel{rank}", reset_less=True))
            banks.append(Signal(name=f"bank{rank}", reset_less=True))
            with m.If(self.advance):
                m.d.sync += [valid[rank].eq(valid[rank - 1]), channel[rank].eq(channel[rank - 1])]
                m.d.sync += banks[rank].eq(banks[rank - 1])
        m.d.comb += [self.o_valid.eq(valid[-1]), self.o_channel.eq(channel[-1]), self.o_bank.eq(banks[-1])]
        m.d.comb += self.uses.eq(banks_in_use(valid[:-1], banks[:-1]))
        return valid, channel, banks
