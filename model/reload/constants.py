"""The constants of a datapath that can be loaded at run time, in the words of a bank.

They are what the parallel architecture multiplies by, and the coefficients of the polynomial; other constants belong
to the structure. Each has the bits of its value and some more, so that another value of about the same size fits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from sosmith.model.dataflow.datapath import Datapath, Stage
from sosmith.model.dataflow.graph import Graph, Node, Op, range_of
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerStep

SPARE_BITS = 1
"""Bits that a constant has more than its value takes with its sign."""

_WORD = 32


@dataclass(frozen=True)
class Constant:
    """A constant: where it is, and its width in bits, the sign's included.

    Attributes
    ----------
    stage, node : int
        Place of the stage in the datapath, and of the node in its graph.
    name : str
        ``<stage>.<node>``.
    bits : int
        Width in two's complement.
    """

    stage: int
    node: int
    name: str
    bits: int

    @property
    def words(self) -> int:
        """Words of 32 bits that it takes in a bank."""
        return -(-self.bits // _WORD)


def constants(datapath: Datapath) -> tuple[Constant, ...]:
    """Return the constants that can be loaded, in the order in which a bank holds them."""
    return tuple(
        Constant(place, index, f"{stage.name}.{node.name or f'node{index}'}", _signed_bits(node.parameter) + SPARE_BITS)
        for place, stage in enumerate(datapath.stages)
        for index, node in enumerate(stage.graph.nodes)
        if _is_loadable(stage, node)
    )


def _is_loadable(stage: Stage, node: Node) -> bool:
    return node.op is Op.SCALE or (node.op is Op.CONSTANT and isinstance(stage, HornerStep) and bool(node.name))


def _signed_bits(value: int) -> int:
    return (value if value >= 0 else -value - 1).bit_length() + 1


@dataclass(frozen=True)
class RoomyStage:
    """A stage whose ranges hold what any constants that fit may make."""

    name: str
    graph: Graph


def with_room(datapath: Datapath) -> Datapath:
    """Return `datapath` with ranges for hardware whose constants can be loaded.

    Products and sums hold whatever a constant of its width may make. Ranges that are proven, not computed, have
    `SPARE_BITS` more bits: a set whose own proven ranges are wider is not to be loaded, nor one whose output leaves
    its port's range where nothing limits it.
    """
    widths = {(constant.stage, constant.node): constant.bits for constant in constants(datapath)}
    stages: list[Stage] = []
    ends = [(port.lowest, port.highest) for port in datapath.inputs]
    for place, stage in enumerate(datapath.stages):
        bits = {node: width for (number, node), width in widths.items() if number == place}
        graph = _roomy(stage.graph, ends, bits)
        ends = [(graph.nodes[i].low, graph.nodes[i].high) for i in graph.outputs]
        stages.append(_with_graph(stage, graph))
    stages[-1] = _with_graph(stages[-1], _ending(stages[-1].graph, datapath.output))
    return replace(datapath, stages=tuple(stages))


def _ending(graph: Graph, port: Port) -> Graph:
    """Return the last stage with a result no wider than its port: where nothing limits it, sets must keep to that."""
    (output,) = graph.outputs
    nodes = list(graph.nodes)
    node = nodes[output]
    nodes[output] = replace(node, low=max(node.low, port.lowest), high=min(node.high, port.highest))
    return replace(graph, nodes=tuple(nodes))


def with_ranges(datapath: Datapath, ranges: Sequence[Mapping[str, tuple[int, int]]]) -> Datapath:
    """Return `datapath` with other ranges for what is proven, not computed, and all others made anew from these.

    Parameters
    ----------
    datapath : Datapath
        What is computed.
    ranges : sequence of mapping of str to (int, int)
        For each stage the smallest and largest codes of its inputs and BOUND nodes, by name, as far as they change.
        An input's range is at least that of the output before it, and may be wider: delays hold what came earlier.

    Raises
    ------
    ValueError
        If the output's range leaves that of its port.
    """
    stages: list[Stage] = []
    ends = [(port.lowest, port.highest) for port in datapath.inputs]
    for stage, given in zip(datapath.stages, ranges, strict=True):
        nodes = stage.graph.nodes
        wide = [
            (min(low, given.get(nodes[i].name, (low, high))[0]), max(high, given.get(nodes[i].name, (low, high))[1]))
            for i, (low, high) in zip(stage.graph.inputs, ends, strict=True)
        ]
        stated = {i: given.get(node.name, (node.low, node.high)) for i, node in enumerate(nodes) if node.op is Op.BOUND}
        graph = _roomy(stage.graph, wide, {}, stated)
        ends = [(graph.nodes[i].low, graph.nodes[i].high) for i in graph.outputs]
        stages.append(_with_graph(stage, graph))
    return replace(datapath, stages=tuple(stages))


def _with_graph(stage: Stage, graph: Graph) -> Stage:
    """Return a stage with other ranges; one of the polynomial stays one, for its constants can be loaded."""
    return replace(stage, graph=graph) if isinstance(stage, HornerStep) else RoomyStage(stage.name, graph)


def _roomy(
    graph: Graph,
    inputs: Sequence[tuple[int, int]],
    bits: Mapping[int, int],
    stated: Mapping[int, tuple[int, int]] | None = None,
) -> Graph:
    """Compute all ranges but those that are `stated` anew; once more for each delay in a row.

    A delay comes before what it remembers.
    """
    nodes = list(graph.nodes)
    for _ in range(len(graph.delays) + 1):
        supply = iter(inputs)
        for index, node in enumerate(graph.nodes):
            if node.op is Op.INPUT:
                low, high = next(supply)
            elif stated is not None and index in stated:
                low, high = stated[index]
            else:
                width = bits.get(index)
                constant = None if width is None else (-1 << (width - 1), (1 << (width - 1)) - 1)
                operands = [nodes[i].range for i in node.operands]
                _, low, high = range_of(_with_spare_bits(node), operands, constant)
            nodes[index] = replace(node, low=low, high=high)
    return replace(graph, nodes=tuple(nodes))


def _with_spare_bits(node: Node) -> Node:
    """Return a BOUND with `SPARE_BITS` more, another node as it is."""
    if node.op is not Op.BOUND:
        return node
    return replace(node, low=node.low << SPARE_BITS, high=node.high << SPARE_BITS)


def values_of(datapath: Datapath, loadable: Sequence[Constant]) -> list[int]:
    """Return the value of each constant of `loadable` in a datapath of the same structure."""
    return [datapath.stages[constant.stage].graph.nodes[constant.node].parameter for constant in loadable]


def packed(values: Sequence[int], loadable: Sequence[Constant]) -> list[int]:
    """Return the words of a bank: each constant extended by its sign to whole words, the lowest first.

    Raises
    ------
    ValueError
        If a value does not fit its constant.
    """
    words = []
    for value, constant in zip(values, loadable, strict=True):
        if _signed_bits(value) > constant.bits:
            raise ValueError(f"{constant.name} must fit {constant.bits} bits, not {value}")
        words += [value >> _WORD * k & (1 << _WORD) - 1 for k in range(constant.words)]
    return words


def unpacked(words: Sequence[int], loadable: Sequence[Constant]) -> list[int]:
    """Return the constants' values from the words of a bank, as hardware takes them: bits beyond a width do not count.

    Raises
    ------
    ValueError
        If the number of words is not that of the bank.
    """
    count = sum(constant.words for constant in loadable)
    if len(words) != count:
        raise ValueError(f"a bank must have {count} words, not {len(words)}")
    values, place = [], 0
    for constant in loadable:
        whole = sum(word << _WORD * k for k, word in enumerate(words[place : place + constant.words]))
        code = whole & ((1 << constant.bits) - 1)
        values.append(code - (code >> (constant.bits - 1) << constant.bits))
        place += constant.words
    return values
