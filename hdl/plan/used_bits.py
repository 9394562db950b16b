"""How many bits of each node of a dataflow graph are used, from the lowest one on.

The upper bits of a sum do not change its lower ones. Where its range is stated to be smaller than its operands say, or
only its lower bits are asked for, what lies above need not be computed, neither there nor in the sums before::

    a 20 --+                                        a 17 --+
           + [21] --+                                      + [17] --+
    b 20 --+        + [22] --> BOUND 17    becomes  b 17 --+        + [17] --> BOUND 17
    c 20 -----------+                               c 17 -----------+

>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> g = GraphBuilder()
>>> a, b = g.input("a", 0, -8, 7), g.input("b", 0, -8, 7)
>>> graph = g.build([g.bound(g.subtract(a, b), -4, 3)])
>>> [node.width for node in graph.nodes], used_bits(graph)
([4, 4, 5, 3], [3, 3, 3, 3])
"""

from __future__ import annotations

from sosmith.model.dataflow.graph import Graph, Node, Op


def used_bits(graph: Graph) -> list[int]:
    """Return the number of bits of each node that are used; all of one that nothing uses."""
    nodes = graph.nodes
    used = [0] * len(nodes)
    for index in [*graph.outputs, *(nodes[delay].operands[0] for delay in graph.delays)]:
        used[index] = nodes[index].width
    for index in reversed(range(len(nodes))):
        node = nodes[index]
        used[index] = min(used[index], node.width) or node.width
        for i in node.operands if node.op is not Op.DELAY else ():
            used[i] = max(used[i], min(_asked(node, nodes[i], used[index]), nodes[i].width))
    return used


def _asked(node: Node, operand: Node, used: int) -> int:
    """Return how many bits of an operand a node asks for, of which so many are used."""
    if node.op in {Op.ADD, Op.SUBTRACT}:
        return max(used - (node.frac - operand.frac), 0)
    if node.op in {Op.SHIFT, Op.BOUND}:
        return used
    if node.op is Op.FLOOR:
        return used + operand.frac - node.frac
    if node.op is Op.FRACTION:
        return operand.frac - node.parameter
    return operand.width
