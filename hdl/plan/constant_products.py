"""Products by constants as sums in a dataflow graph, so that pipeline stages can end between them.

::

    x --- SCALE 75 ---> y        becomes        x ---> x + 4x = [5x] ---> 16 * 5x - 5x = [75x] ---> y

Each sum is stated to have the range of its multiple, exactly. Which sums there are is the work of
`sosmith.model.dataflow.adder_graph`.

>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> g = GraphBuilder()
>>> graph = g.build([g.scale(g.input("x", 0, -8, 7), 75, 4)])
>>> [node.op.value for node in with_sums(graph).nodes]
['input', 'shift', 'add', 'bound', 'shift', 'subtract', 'bound', 'shift']
>>> with_sums(graph).run([[-8], [3]]) == graph.run([[-8], [3]])
True
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from sosmith.model.dataflow.adder_graph import (
    adder_graph,
    by_operand,
    multiple_name,
    multiple_range,
    odd_part,
    scalings,
)
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Op, Wire


def with_sums(graph: Graph, apart: Collection[int] = ()) -> Graph:
    """Return the graph with each product by a constant but 0 made of sums, and of a product by a power of two.

    Those in `apart` stay as they are.
    """
    g = GraphBuilder()
    scaled = sorted(scalings(graph) - {*apart})
    groups = {index: group for group in by_operand(graph, scaled) for index in group[1]}
    multiples: dict[int, dict[int, Wire]] = {}
    wires: list[Wire] = []
    for index, node in enumerate(graph.nodes):
        if index not in groups:
            wires.append(g.copied(node, [] if node.op is Op.DELAY else [wires[i] for i in node.operands]))
            continue
        operand, products = groups[index]
        if operand not in multiples:
            multiples[operand] = _multiples(g, wires[operand], [graph.nodes[i].parameter for i in products])
        odd, power = odd_part(node.parameter)
        wire = multiples[operand][odd]
        wire = g.shift(wire, g[wire].frac - node.frac)
        wires.append(wire if power == 0 else g.scale(wire, 1 << power, 0))
    for i in graph.delays:
        g.connect(wires[i], wires[graph.nodes[i].operands[0]])
    return g.build([wires[i] for i in graph.outputs])


def _multiples(g: GraphBuilder, operand: Wire, constants: Sequence[int]) -> dict[int, Wire]:
    """Add the sums that give the odd parts of all constants; return them, and the operand, by their multiples."""
    values = [operand]
    by_multiple = {1: operand}
    node = g[operand]
    name = node.name or node.op.value
    for adder in adder_graph(tuple(constants)):
        left, right = (g.shift(values[k], shift) for k, shift in (adder.left, adder.right))
        total = g.subtract(left, right) if adder.subtract else g.add(left, right)
        limits = multiple_range(adder.multiple, node.low, node.high)
        values.append(g.bound(total, *limits, multiple_name(name, adder.multiple)))
        by_multiple[adder.multiple] = values[-1]
    return by_multiple
