"""Coefficients of products that are one node, and of those that are made of sums."""

from sosmith.model.dataflow.graph import GraphBuilder
from sosmith.model.sections.truncated_products import truncated
from sosmith.verify.certificate_file import NodeEntry, Operation
from sosmith.verify.verdict.coefficients import coefficients


def test_a_product_of_sums_has_the_constant_that_they_come_to() -> None:
    g = GraphBuilder()
    x, other = g.input("x", 2, -200, 199), g.input("other", 2, -200, 199)
    whole = g.scale(x, 45, 8, "product_A1")
    sums = truncated(g, g.add(x, other, "taps_A2"), 137967, 20, 9, "product_A2")
    graph = g.build([g.add(whole, sums, "v")])
    nodes = [
        NodeEntry(
            op=Operation(node.op.value),
            operands=node.operands,
            frac=node.frac,
            low=node.low,
            high=node.high,
            parameter=node.parameter,
            parameter_frac=node.parameter_frac,
            name=node.name,
        )
        for node in graph.nodes
    ]
    assert coefficients(nodes) == [("A1", 45, 8), ("A2", 137967, 20)]
