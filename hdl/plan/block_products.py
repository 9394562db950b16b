"""Products by constants in pieces that multiplier blocks take whole, so that a register can follow each block.

As an example, ``y = 75001 x`` for `x` of 22 bits and blocks of 16 bits, which take 16 signed bits or 15 others::

    x --+-- floor ----> [upper 7 bits] ---- SCALE 18750 --> * 2**15 -->+--> * 4 -->+--> y
        |                                                              ^           ^
        +-- fraction -> [lower 15 bits] --- SCALE 18750 ---------------+           |
        +--------------------------------------------------------------------------+

What a constant has beyond a block is a product by a small number, which is left to adders
(`sosmith.hdl.plan.constant_products`).

>>> from sosmith.model.dataflow.graph import GraphBuilder
>>> g = GraphBuilder()
>>> graph = g.build([g.scale(g.input("x", 0, -(1 << 21), (1 << 21) - 1), 75001, 4)])
>>> split, blocks = with_blocks(graph, [1], 16)
>>> [(node.width, node.parameter) for node in (split.nodes[i] for i in sorted(blocks))]
[(22, 18750), (30, 18750)]
>>> split.run([[-1234567], [7]]) == graph.run([[-1234567], [7]])
True
"""

from __future__ import annotations

from collections.abc import Collection

from sosmith.model.dataflow.adder_graph import multiple_range
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Node, Op, Wire
from sosmith.model.sections.floored_products import factors


def blocks_of(graph: Graph, node: Node, bits: int) -> int:
    """Return the multiplier blocks, with signed operands of `bits` bits, that a product by a constant takes."""
    operand = graph.nodes[node.operands[0]]
    return -(-max(1, operand.width - operand.signed) // (bits - 1))


def is_product(node: Node) -> bool:
    """Whether a node is a product by a constant that takes more than wires: by no power of two, whatever its sign."""
    size = abs(node.parameter)
    return node.op is Op.SCALE and size & (size - 1) != 0


def with_blocks(graph: Graph, products: Collection[int], bits: int) -> tuple[Graph, frozenset[int]]:
    """Return the graph with some products by constants in pieces for blocks of `bits` bits, and the pieces' nodes.

    A product by a negative number that is only added or taken off becomes one by a positive number that is taken off
    or added: the lower pieces are never negative, and their sums with the upper one then begin above them.
    """
    g = GraphBuilder()
    wires: list[Wire] = []
    pieces: set[int] = set()
    negated = _to_negate(graph, products)
    for index, node in enumerate(graph.nodes):
        operands = [] if node.op is Op.DELAY else [wires[i] for i in node.operands]
        if index in products and is_product(node):
            wanted = node._replace(parameter=-node.parameter, name=f"minus_{node.name}") if index in negated else node
            wires.append(_product(g, operands[0], wanted, bits, pieces))
        elif index in negated:
            wires.append(g.scale(operands[0], -node.parameter, node.parameter_frac, f"minus_{node.name}"))
        elif negated & {*node.operands} and node.op is not Op.DELAY:
            wires.append(_turned_sum(g, node, operands, first=node.operands[0] in negated))
        else:
            wires.append(g.copied(node, operands))
    for i in graph.delays:
        g.connect(wires[i], wires[graph.nodes[i].operands[0]])
    return g.build([wires[i] for i in graph.outputs]), frozenset(pieces)


def _to_negate(graph: Graph, products: Collection[int]) -> set[int]:
    """Return the products by negative numbers that every user adds to something else, or takes off something else.

    Those by other numbers than powers of two must be in `products`.
    """
    negated: set[int] = set()
    for index, node in enumerate(graph.nodes):
        users = [other for other in graph.nodes if index in other.operands]
        if (
            node.op is Op.SCALE
            and node.parameter < 0
            and (index in products or not is_product(node))
            and index not in graph.outputs
            and all(
                (user.op is Op.ADD or (user.op is Op.SUBTRACT and user.operands[0] != index))
                and not negated & {*user.operands}
                and len({*user.operands}) > 1
                for user in users
            )
        ):
            negated.add(index)
    return negated


def _turned_sum(g: GraphBuilder, node: Node, operands: list[Wire], *, first: bool) -> Wire:
    """Return a sum one of whose operands, the first or the second, has the other sign."""
    one, other = reversed(operands) if first else operands
    return g.copied(node._replace(op=Op.ADD if node.op is Op.SUBTRACT else Op.SUBTRACT), [one, other])


def _product(g: GraphBuilder, operand: Wire, node: Node, bits: int, pieces: set[int]) -> Wire:
    """Make a product by a constant, and note its pieces."""
    if g[operand].width - g[operand].signed < bits and abs(node.parameter) < 1 << (bits - 1):
        whole = g.scale(operand, node.parameter, node.parameter_frac, node.name)
        pieces.add(int(whole))
        return whole
    upper, dropped, rest = factors(node.parameter, bits)
    frac = node.parameter_frac
    parts = _parts(g, operand, bits)
    # What is never negative, times a number that is not either, takes a block less.
    constants = [upper if g[part].signed else abs(upper) for part in parts]
    scaled = [g.scale(part, constant, frac - dropped) for part, constant in zip(parts, constants, strict=True)]
    pieces |= {int(piece) for piece in scaled}
    if rest:  # next to the lowest piece: a sum with the upper ones then has few bits
        more = g.scale(operand, rest, frac)
        scaled[-1] = g.add(scaled[-1], more) if constants[-1] == upper else g.subtract(scaled[-1], more)
    total = scaled[0] if constants[0] == upper else g.subtract(g.constant(0, 0), scaled[0])
    for piece in scaled[1:]:
        total = g.add(total, piece) if upper > 0 else g.subtract(total, piece)
    if dropped and not rest:
        total = g.scale(total, 1 << dropped, dropped)
    return g.bound(total, *multiple_range(node.parameter, g[operand].low, g[operand].high), node.name)


def _parts(g: GraphBuilder, operand: Wire, bits: int) -> list[Wire]:
    """Take a value apart, the uppermost part first; only that can be negative."""
    lower: list[Wire] = []
    while g[operand].width - g[operand].signed > bits - 1:
        frac = g[operand].frac - (bits - 1)
        lower.append(g.fraction(operand, frac))
        operand = g.floor(operand, frac)
    return [operand, *reversed(lower)]
