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
    nodes, widths = graph.nodes, [node.width for node in graph.nodes]
    used = [0] * len(nodes)
    for index in [*graph.outputs, *(nodes[delay].operands[0] for delay in graph.delays)]:
        used[index] = widths[index]
    for index in reversed(range(len(nodes))):
        node = nodes[index]
        used[index] = min(used[index], widths[index]) or widths[index]
        for i in node.operands if node.op is not Op.DELAY else ():
            used[i] = max(used[i], min(_asked(node, nodes[i].frac, widths[i], used[index]), widths[i]))
    return used


def _asked(node: Node, frac: int, width: int, used: int) -> int:
    """Return how many bits of an operand, of `frac` and `width`, a node asks for, of which so many are used."""
    op = node.op
    if op is Op.ADD or op is Op.SUBTRACT:
        return max(used - (node.frac - frac), 0)
    if op is Op.SHIFT or op is Op.BOUND:
        return used
    if op is Op.FLOOR:
        return used + frac - node.frac
    if op is Op.FRACTION:
        return frac - node.parameter
    return width
