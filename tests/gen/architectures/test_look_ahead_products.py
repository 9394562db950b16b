"""Which products of a core with look-ahead take multiplier blocks."""

import pytest

from sosmith.gen.architectures.blocks import Blocks
from sosmith.gen.architectures.look_ahead_products import products_for
from sosmith.hdl.plan.block_products import blocks_of
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op

CONSTANTS = (3, 4, 43691, -109227)
"""One that takes a sum, one that takes wires, and two that take several sums."""


def graph(bits: int) -> Graph:
    """Make products of an input of so many bits by `CONSTANTS`, and one of two values."""
    g = GraphBuilder()
    x = g.input("x", 0, -(1 << (bits - 1)), (1 << (bits - 1)) - 1)
    y = g.input("y", 0, -128, 127)
    return g.build([*(g.scale(x, constant, 17) for constant in CONSTANTS), g.multiply(y, y)])


@pytest.mark.parametrize(
    ("bits", "available", "in_blocks"),
    [
        (16, None, {43691, -109227}),
        (16, 3, {43691, -109227}),
        (16, 2, {43691}),
        (16, 1, set()),  # the product of two values has it
        (16, 0, set()),
        (20, None, {43691, -109227}),
        (20, 4, {43691}),
        (20, 2, set()),
    ],
)
def test_blocks_go_where_they_save_most_as_long_as_there_are_any(
    bits: int, available: int | None, in_blocks: set[int]
) -> None:
    made = graph(bits)
    products = products_for([made], Blocks(available))
    (adders,) = products.adders
    scaled = {index: node for index, node in enumerate(made.nodes) if node.op is Op.SCALE}
    assert {node.parameter for index, node in scaled.items() if index not in adders} == in_blocks
    taken = sum(blocks_of(made, node, 18) for index, node in scaled.items() if index not in adders)
    assert available is None or taken <= max(0, available - 1)
