"""Which products by constants of a core with look-ahead take multiplier blocks, and which are made of adders."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.gen.architectures.blocks import Blocks
from sosmith.gen.word_lengths.cost import bits_by_digits, cost_of_graphs, multiplication_of
from sosmith.hdl.plan.block_products import blocks_of, with_blocks
from sosmith.hdl.plan.look_ahead import Products
from sosmith.model.dataflow.adder_graph import scalings
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op

_WORTH_A_BLOCK = 18
"""Adder bits that a block has to save."""


def products_for(graphs: Sequence[Graph], blocks: Blocks) -> Products:
    """Choose blocks for the products that would take most adder bits for each block, as long as there are any.

    A product stays with adders if a block would save few: pieces are added up, too. Products of two values, which
    nothing else can make, come first.
    """
    bits = blocks.bits
    adders = [set(scalings(graph)) for graph in graphs]
    others = (multiplication_of(graph, node) for graph in graphs for node in graph.nodes if node.op is Op.MULTIPLY)
    taken = sum(product.blocks_of(bits) for product in others if product is not None)
    ranked = sorted(
        (-saved / count, k, index, count)
        for k, graph in enumerate(graphs)
        for index in adders[k]
        for saved, count in [(_saved(graph, index, bits), blocks_of(graph, graph.nodes[index], bits))]
        if saved >= _WORTH_A_BLOCK * count
    )
    for _, k, index, count in ranked:
        if blocks.available is None or taken + count <= blocks.available:
            adders[k].remove(index)
            taken += count
    return Products(tuple(map(frozenset, adders)), bits)


def _saved(graph: Graph, index: int, bits: int) -> int:
    """Estimate the adder bits that blocks save of a product by a constant, by the digits of the constant."""
    node = graph.nodes[index]
    g = GraphBuilder()
    alone = g.build([g.scale(g.input("", *graph.nodes[node.operands[0]].range), node.parameter, node.parameter_frac)])
    split, pieces = with_blocks(alone, scalings(alone), bits)
    of_pieces = cost_of_graphs([split], [scalings(split) - pieces], bits_by_digits).adder_bits
    return cost_of_graphs([alone], [scalings(alone)], bits_by_digits).adder_bits - of_pieces
