"""The stages of a datapath as one list of nodes, in which nothing is kept twice."""

from __future__ import annotations

from typing import NamedTuple

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Node, Op


class Flat(NamedTuple):
    """All stages' nodes in one list, which the rest indexes; `settling` is None without that flag."""

    nodes: list[Node]
    inputs: list[int]
    output: int
    settling: int | None = None


def flattened(datapath: Datapath) -> Flat:
    """Join the stages' graphs: the inputs of each become the outputs of the one before."""
    nodes: list[Node] = []
    inputs: list[int] = []
    passed: list[int] = []
    for stage in datapath.stages:
        graph = stage.graph
        supply = iter(passed)
        at: list[int] = []
        start = len(nodes)
        for node in graph.nodes:
            if node.op is Op.INPUT and passed:
                at.append(next(supply))
                continue
            at.append(len(nodes))
            name = f"{stage.name}.{node.name}" if node.name else ""
            nodes.append(node._replace(name=name))
            if node.op is Op.INPUT:
                inputs.append(len(nodes) - 1)
        for index in range(start, len(nodes)):
            node = nodes[index]
            nodes[index] = node._replace(operands=tuple(at[i] for i in node.operands))
        passed = [at[i] for i in graph.outputs]
    return Flat(nodes, inputs, *passed)


def share_delays(nodes: list[Node]) -> None:
    """Let a delay of what another delay holds anyway read that one, instead of keeping it once more.

    A section keeps y(n-1) with all its fraction bits, and the next one x(n-1), which is the floor of that.
    """
    changed = True
    while changed:
        changed = False
        kept: dict[int, int] = {}
        for index, node in enumerate(nodes):
            if node.op is Op.DELAY:
                kept.setdefault(node.operands[0], index)
        for index, node in enumerate(nodes):
            if node.op is not Op.DELAY:
                continue
            source = node.operands[0]
            of = nodes[source]
            if kept[source] != index:
                nodes[index] = node._replace(op=Op.BOUND, operands=(kept[source],))
                for other, user in enumerate(nodes):
                    moved = tuple(kept[source] if i == index else i for i in user.operands)
                    nodes[other] = user._replace(operands=moved)
            elif of.op is Op.FLOOR and of.operands[0] in kept:
                nodes[index] = node._replace(op=Op.FLOOR, operands=(kept[of.operands[0]],))
            else:
                continue
            changed = True
            break
