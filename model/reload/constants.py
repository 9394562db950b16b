"""The constants of a datapath that can be loaded at run time, and the words of a bank that hold them.

They are the factors of the parallel architecture and the coefficients of the polynomial; other constants belong to the
structure. Each is wider than its value takes, so that another value of about the same size fits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, Node, Op, range_of
from sosmith.model.dataflow.structure import Stage
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerStep

SPARE_BITS = 1
"""Bits of a constant beyond those of its value and sign."""

_WORD_BITS = 32


@dataclass(frozen=True)
class Constant:
    """A loadable constant: where it is, and its width.

    Attributes
    ----------
    stage, node : int
        Index of the stage in the datapath, and of the node in its graph.
    name : str
        ``<stage>.<node>``.
    bits : int
        Width in two's complement, in bits.
    """

    stage: int
    node: int
    name: str
    bits: int

    @property
    def words(self) -> int:
        """Number of words of 32 bits that it takes in a bank."""
        return -(-self.bits // _WORD_BITS)


def constants(datapath: Datapath) -> tuple[Constant, ...]:
    """Return the constants that can be loaded, in the order in which a bank holds them."""
    return tuple(
        Constant(number, index, f"{stage.name}.{node.name or f'node{index}'}", bits_of(node.parameter))
        for number, stage in enumerate(datapath.stages)
        for index, node in enumerate(stage.graph.nodes)
        if _is_loadable(stage, node)
    )


def _is_loadable(stage: Stage, node: Node) -> bool:
    return node.op is Op.SCALE or (node.op is Op.CONSTANT and isinstance(stage, HornerStep) and bool(node.name))


def bits_of(value: int) -> int:
    """Return the width in bits, in two's complement, of a constant that can be loaded in place of `value`.

    Examples
    --------
    >>> bits_of(3), bits_of(-4)
    (4, 4)
    """
    return _signed_bits(value) + SPARE_BITS


def _signed_bits(value: int) -> int:
    return (value if value >= 0 else -value - 1).bit_length() + 1


@dataclass(frozen=True)
class RoomyStage:
    """A stage whose ranges hold the results of all constants that can be loaded."""

    name: str
    graph: Graph


def with_room(datapath: Datapath) -> Datapath:
    """Return `datapath` with ranges for hardware whose constants can be loaded.

    Products and sums hold the results of any constant of the width. Ranges that are proven, not computed, get
    `SPARE_BITS` more bits: a set must not be loaded if its own proven ranges are wider, or if its output can leave the
    range of the port where nothing limits it.
    """
    widths = {(constant.stage, constant.node): constant.bits for constant in constants(datapath)}
    stages: list[Stage] = []
    ends = [(port.lowest, port.highest) for port in datapath.entry]
    for number, stage in enumerate(datapath.stages):
        bits = {node: width for (owner, node), width in widths.items() if owner == number}
        graph = _roomy(stage.graph, ends, bits)
        ends = [(graph.nodes[i].low, graph.nodes[i].high) for i in graph.outputs]
        stages.append(_with_graph(stage, graph))
    return replace(datapath, stages=_ending(stages, datapath.output))


def _ending(stages: Sequence[Stage], port: Port) -> tuple[Stage, ...]:
    """Return the stages with the range of the output cut to the port's, to which every set has to keep.

    Where the last stage only hands on what it gets, as one that counts does, that is cut as well.
    """
    *before, last = stages
    graph = last.graph
    output = graph.outputs[0]
    nodes = list(graph.nodes)
    node = nodes[output]
    nodes[output] = node._replace(low=max(node.low, port.lowest), high=min(node.high, port.highest))
    handed_on = before and node.op is Op.INPUT
    return (*(_ending(before, port) if handed_on else before), _with_graph(last, replace(graph, nodes=tuple(nodes))))


def with_ranges(datapath: Datapath, ranges: Sequence[Mapping[str, tuple[int, int]]]) -> Datapath:
    """Return `datapath` with other proven ranges, and all computed ranges derived from these.

    Parameters
    ----------
    datapath : Datapath
        The datapath.
    ranges : sequence of mapping of str to (int, int)
        For each stage, the smallest and largest code of each input and BOUND node that changes, by name. The range of
        an input is at least that of the output before it; it may be wider, since delays hold earlier values.

    Raises
    ------
    ValueError
        If the output's range leaves that of its port.
    """
    stages: list[Stage] = []
    ends = [(port.lowest, port.highest) for port in datapath.entry]
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
    """Return a stage with another graph; one of the polynomial keeps its type, since its constants can be loaded."""
    return replace(stage, graph=graph) if isinstance(stage, HornerStep) else RoomyStage(stage.name, graph)


def _roomy(
    graph: Graph,
    inputs: Sequence[tuple[int, int]],
    bits: Mapping[int, int],
    stated: Mapping[int, tuple[int, int]] | None = None,
) -> Graph:
    """Compute all ranges anew, except those in `stated`.

    As a delay comes before its operand, this takes one more pass for each delay in a row.
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
            nodes[index] = node._replace(low=low, high=high)
    return replace(graph, nodes=tuple(nodes))


def _with_spare_bits(node: Node) -> Node:
    """Return a BOUND with `SPARE_BITS` more, another node as it is."""
    if node.op is not Op.BOUND:
        return node
    return node._replace(low=min(node.low, node.low << SPARE_BITS), high=max(node.high, node.high << SPARE_BITS))


def values_of(datapath: Datapath, loadable: Sequence[Constant]) -> list[int]:
    """Return the value of each constant of `loadable` in a datapath of the same structure."""
    return [datapath.stages[constant.stage].graph.nodes[constant.node].parameter for constant in loadable]


def packed(values: Sequence[int], loadable: Sequence[Constant]) -> list[int]:
    """Return the words of a bank: each constant sign-extended to whole words, the lowest word first.

    Raises
    ------
    ValueError
        If a value does not fit its constant.
    """
    words = []
    for value, constant in zip(values, loadable, strict=True):
        if _signed_bits(value) > constant.bits:
            raise ValueError(f"{constant.name} must fit {constant.bits} bits, not {value}")
        words += [value >> _WORD_BITS * k & (1 << _WORD_BITS) - 1 for k in range(constant.words)]
    return words
