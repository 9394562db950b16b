"""Quantities of sums, with those that products by constants are made of.

Synthesis is kept from merging sums, so that each is a carry chain of its own: from where both operands have bits, or
one is subtracted, to the highest bit that is used.
"""

from __future__ import annotations

from collections import Counter

from sosmith.gen.estimate.pipelined import SUMS, Pipelined
from sosmith.gen.estimate.quantities import Quantities
from sosmith.model.dataflow.adder_graph import adder_bits, adder_graph, by_operand
from sosmith.model.dataflow.graph import Graph, Node, Op


def of_sums(plan: Pipelined) -> Quantities:
    """Count all sums of a stage."""
    nodes = plan.graph.nodes
    sums = sum(_chain(plan, index) for index, node in enumerate(nodes) if _takes_adder(plan.graph, node))
    for stage in set(plan.stages):
        products = [index for index in plan.adders if plan.stages[index] == stage]
        for operand, group in by_operand(plan.graph, products):
            adders = adder_graph(tuple(nodes[index].parameter for index in group))
            sums += adder_bits(adders, nodes[operand].low, nodes[operand].high)
    return Counter({"sums": sums})


def _chain(plan: Pipelined, index: int) -> int:
    """Return the bits of a sum that take a carry: all but the lowest, where one operand is alone and added."""
    nodes = plan.graph.nodes
    node = nodes[index]
    starts = [node.frac - nodes[i].frac + _low_zeros(nodes[plan.source(i)]) for i in node.operands]
    return max(0, plan.used[index] - (starts[1] if node.op is Op.SUBTRACT else max(starts)))


def _low_zeros(node: Node) -> int:
    """Return the bits below the lowest one of a constant; none of another value."""
    is_constant = node.op is Op.CONSTANT and node.parameter != 0
    return (node.parameter & -node.parameter).bit_length() - 1 if is_constant else 0


def _takes_adder(graph: Graph, node: Node) -> bool:
    """Say whether a node is a sum of which synthesis makes more than wires."""
    if node.op not in SUMS or graph.concatenated(node) is not None:
        return False
    absorbed = node.operands if node.op is Op.ADD else node.operands[1:]
    return not any(graph.nodes[i].op is Op.CONSTANT and graph.nodes[i].parameter == 0 for i in absorbed)
