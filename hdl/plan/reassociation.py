"""The same sums in another order, so that a state meets what is added to it last.

``a - (b - state)`` takes two additions from the state on; ``(a - b) + state`` takes one, and what the bracket holds can
be computed pipeline stages before. Products with the constant 1, which unfolding makes of a state that is 1 from the
second sample on, go as well, and so does ``a - (a - b)``, which is b. All of it is exact.

>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> g = GraphBuilder()
>>> a, b, state = g.input("a", 0, 0, 7), g.input("b", 0, 0, 7), g.delay("state", 0, -7, 14)
>>> total = g.bound(g.subtract(a, g.subtract(b, state)), -7, 14)
>>> g.connect(state, total)
>>> graph = g.build([total])
>>> [node.op.value for node in reassociated(graph).nodes if node.operands]
['delay', 'subtract', 'subtract', 'add', 'bound', 'bound']
>>> reassociated(graph).run([[1, 5], [7, 0]]) == graph.run([[1, 5], [7, 0]])
True
"""

from __future__ import annotations

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Node, Op, Wire


def reassociated(graph: Graph) -> Graph:
    """Return the graph with states moved to the end of the sums that they are in."""
    return with_places(graph)[0]


def with_places(graph: Graph) -> tuple[Graph, list[int]]:
    """Return the graph that `reassociated` returns, and where each node of the first is in it."""
    g = GraphBuilder()
    wires: list[Wire] = []
    for node in graph.nodes:
        operands = [] if node.op is Op.DELAY else [wires[i] for i in node.operands]
        other = _shorter(g, node, operands)
        wires.append(g.copied(node, operands) if other is None else other)
    for i in graph.delays:
        g.connect(wires[i], wires[graph.nodes[i].operands[0]])
    return g.build([wires[i] for i in graph.outputs]), [int(wire) for wire in wires]


def _shorter(g: GraphBuilder, node: Node, operands: list[Wire]) -> Wire | None:
    """Return what a node may be instead; None if it stays."""
    if node.op is Op.MULTIPLY:
        for one, other in (operands, operands[::-1]):
            if (g[one].op, g[one].parameter, g[one].frac) == (Op.CONSTANT, 1, 0):
                return other
    if node.op is not Op.SUBTRACT:
        return None
    a, inner = operands[0], _unbound(g, operands[1])
    if g[inner].op is not Op.SUBTRACT:
        return None
    b, c = map(Wire, g[inner].operands)
    if a == b:
        return c if g[c].frac == node.frac else None
    if g[c].op is not Op.DELAY:
        return None
    return g.bound(g.add(g.subtract(a, b), c), node.low, node.high)


def _unbound(g: GraphBuilder, wire: Wire) -> Wire:
    """Return what a BOUND states the range of."""
    while g[wire].op is Op.BOUND:
        (wire,) = map(Wire, g[wire].operands)
    return wire
