"""What the sum of an FIR filter's products begins with, so that it is rounded by what is left out of it, and its width.

Several filters may share the sum: their results have the same output, but each its own fraction bits.
"""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Node, Op


def rounding(filters: Sequence[Datapath]) -> tuple[int, int]:
    """Return the fraction bits of the sum, and what it begins with: offset of the output, and half a step."""
    constants = [
        [node for node in each.stages[-1].graph.nodes if node.op is Op.CONSTANT and node.name != "samples"]
        for each in filters
    ]
    grid = max([finest(filters), *(node.frac for own in constants for node in own)])
    # All results have the same output: half a step more changes none of those that need no rounding.
    return grid, max(sum(node.parameter << grid - node.frac for node in own) for own in constants)


def finest(filters: Sequence[Datapath]) -> int:
    """Return the most fraction bits of products: those of what the last stage takes."""
    graphs = [each.stages[-1].graph for each in filters]
    return max(graph.nodes[graph.inputs[0]].frac for graph in graphs)


def sum_bits(filters: Sequence[Datapath], grid: int) -> int:
    """Return the bits of the sum with its sign, of which so many are fraction bits."""
    ends = [end for node in map(_unlimited, filters) for end in (node.low, node.high)]
    return 1 + max(map(_bits, ends)) + max(grid, 0)


def last_node(datapath: Datapath) -> Node:
    """Return the node that leaves a datapath."""
    graph = datapath.stages[-1].graph
    return graph.nodes[graph.outputs[0]]


def _unlimited(datapath: Datapath) -> Node:
    """Return what leaves a datapath before it is limited."""
    last = last_node(datapath)
    return datapath.stages[-1].graph.nodes[last.operands[0]] if last.op is Op.CLAMP else last


def _bits(value: int) -> int:
    """Count the bits of a number without its sign."""
    return (-value - 1 if value < 0 else value).bit_length()
