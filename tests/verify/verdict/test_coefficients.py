"""Coefficients of products that are one node, and of those that are made of sums, whatever the nodes are called."""

from sosmith.model.dataflow.graph import Graph, GraphBuilder
from sosmith.model.sections.truncated_products import truncated
from sosmith.verify.certificate_file import NodeEntry, Operation
from sosmith.verify.verdict.coefficients import coefficients


def nodes_of(graph: Graph) -> list[NodeEntry]:
    """Return the nodes of a graph as a certificate has them."""
    return [
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


def section() -> list[NodeEntry]:
    """Return the sum of a whole product and of one whose sums drop bits, and which drops bits itself."""
    g = GraphBuilder()
    x, other = g.input("x", 2, -200, 199), g.input("other", 2, -200, 199)
    whole = g.scale(x, 45, 8, "product_A1")
    sums = truncated(g, g.add(x, other, "taps_A2"), 137967, 20, 9, "product_A2")
    return nodes_of(g.build([g.add(whole, g.floor(sums, 7), "v")]))


def test_a_product_of_sums_has_the_constant_that_they_come_to() -> None:
    assert coefficients(section()) == [("A1", 45, 8), ("A2", 137967, 20)]


def test_a_name_makes_no_product_and_hides_none() -> None:
    renamed = [node.model_copy(update={"name": f"other{k}"}) for k, node in enumerate(section())]
    assert [made for _, *made in coefficients(renamed)] == [[45, 8], [137967, 20]]
    named = [node.model_copy(update={"name": f"product_{k}"}) for k, node in enumerate(section())]
    assert [made for _, *made in coefficients(named)] == [[45, 8], [137967, 20]]


def test_powers_of_two_are_no_coefficients() -> None:
    g = GraphBuilder()
    x = g.input("x", 0, -8, 7)
    assert coefficients(nodes_of(g.build([g.add(g.shift(x, 1), g.shift(x, 1), "product_A1")]))) == []


def test_long_sums_are_read_at_once() -> None:
    g = GraphBuilder()
    wire = g.add(g.input("x", 0, -8, 7), g.shift(0, 1))
    for _ in range(3000):
        wire = g.shift(wire, 1)
    doubled = g.add(wire, wire)
    for _ in range(40):
        doubled = g.add(doubled, doubled)
    assert coefficients(nodes_of(g.build([doubled]))) == [("", 3 << 3041, 0)]
