"""Cost of a datapath, counted on its dataflow graphs: multipliers, adder bits, register bits."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from sosmith.hdl.plan.used_bits import used_bits
from sosmith.model.dataflow.adder_graph import adder_bits, adder_graph, by_operand, scalings, signed_digits
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, Node, Op

MULTIPLIER_BITS = 18
"""Bits of each operand of a hardware multiplier; for one extra bit, Yosys uses adders instead of another block."""

_LUTS_PER_ADDER_BIT, _LUTS_PER_SPLIT = 1.04, 30.7
"""Fitted by benchmarks/cost_model.py to synthesis results of the examples on ECP5, within 40 %."""

_ADDERS_PER_EXTRA_BIT = 3
"""Adder bits for each bit of `Cost.extra_bits`: Yosys gates the other operand and adds it up with its sign, which takes
some 60 LUT4 for a signed operand of 19 bits on an ECP5."""

LUTS_OF_A_BLOCK = 864
"""LUT4 that a multiplier block counts as: an ECP5-25 has 24,192 LUT4 and 28 blocks (Lattice FPGA-DS-02012, family
table)."""


class Operand(NamedTuple):
    """One operand of a multiplication: its bits, with a sign bit if it is signed."""

    bits: int
    signed: bool

    def beside(self, other: Operand) -> int:
        """Bits at the multiplier, which takes either both operands as signed or neither."""
        return self.bits + (other.signed and not self.signed)


@dataclass(frozen=True)
class Multiplication:
    """Two operands, data first."""

    data: Operand
    factor: Operand

    @property
    def size(self) -> tuple[int, int]:
        """Bits of both operands."""
        return self.data.bits, self.factor.bits

    @property
    def blocks(self) -> int:
        """Hardware multipliers of 18 x 18 bits, signed."""
        return self.blocks_of(MULTIPLIER_BITS)

    def blocks_of(self, bits: int) -> int:
        """Hardware multipliers whose operands have `bits` bits, signed."""
        return _pieces(self.data.beside(self.factor), bits) * _pieces(self.factor.beside(self.data), bits)

    @property
    def extra_bits(self) -> int:
        """Adder bits for operands one bit wider than whole blocks; a sign bit that is always 0 adds nothing."""
        return self.extra_bits_of(MULTIPLIER_BITS)

    def extra_bits_of(self, bits: int) -> int:
        """Adder bits for operands one bit wider than whole blocks of operands with `bits` bits."""
        ends = (_extra(self.data, self.factor, bits), _extra(self.factor, self.data, bits))
        return ends[0] * self.factor.bits + ends[1] * self.data.bits


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Operator counts of a datapath in the parallel architecture, before synthesis.

    Attributes
    ----------
    multiplications : tuple of Multiplication
        In the order of the datapath, without those that are made of adders.
    adder_bits : int
        Result bits of all additions, subtractions and products with a single bit, and of the sums that products by
        constants are made of.
    register_bits : int
        State bits and pipeline registers.
    """

    multiplications: tuple[Multiplication, ...]
    adder_bits: int
    register_bits: int

    def beside(self, other: Cost) -> Cost:
        """Return the operators of both."""
        return Cost(
            multiplications=self.multiplications + other.multiplications,
            adder_bits=self.adder_bits + other.adder_bits,
            register_bits=self.register_bits + other.register_bits,
        )

    @property
    def multipliers(self) -> tuple[tuple[int, int], ...]:
        """Operand widths in bits of each multiplication, data first."""
        return tuple(m.size for m in self.multiplications)

    @property
    def multiplier_blocks(self) -> int:
        """Number of hardware multipliers (signed, 18 x 18 bits) that the multiplications use."""
        return sum(m.blocks for m in self.multiplications)

    @property
    def splits(self) -> int:
        """Blocks beyond the first of each multiplication: the number of partial products to be added."""
        return self.multiplier_blocks - len(self.multiplications)

    @property
    def extra_bits(self) -> int:
        """Adder bits for operands one bit wider than whole blocks."""
        return sum(m.extra_bits for m in self.multiplications)

    @property
    def luts(self) -> int:
        """Estimated number of LUT4 on an ECP5; a carry cell counts as two."""
        adder_bits = self.adder_bits + _ADDERS_PER_EXTRA_BIT * self.extra_bits
        return round(_LUTS_PER_ADDER_BIT * adder_bits + _LUTS_PER_SPLIT * self.splits)

    @property
    def area(self) -> int:
        """Figure of merit for comparing designs: LUT4, with a multiplier block weighted by its share of an ECP5-25."""
        return self.luts + LUTS_OF_A_BLOCK * self.multiplier_blocks

    @property
    def multiplier_sizes(self) -> str:
        """Readable list of the multiplications, such as ``2 of 23 x 18, 1 of 16 x 19``."""
        distinct = sorted(set(self.multipliers), reverse=True)
        return ", ".join(f"{self.multipliers.count(size)} of {size[0]} x {size[1]}" for size in distinct) or "none"


def cost_of(datapath: Datapath, adders: Sequence[Collection[int]] = ()) -> Cost:
    """Count the operators of `datapath`; the products in `adders`, by stage, are made of adders."""
    return cost_of_graphs([stage.graph for stage in datapath.stages], adders)


def cost_of_graphs(
    graphs: Sequence[Graph],
    from_adders: Sequence[Collection[int]] = (),
    bits: Callable[[Graph, Collection[int]], int] | None = None,
    pipeline_stages: Sequence[Sequence[int]] = (),
) -> Cost:
    """Count the operators of a chain of graphs; the products in `from_adders`, by graph, are made of adders.

    `bits` says how many adder bits products of a graph take; None for those of the sums that are really made. These are
    shared by products in the same pipeline stage; `pipeline_stages` has that of each node, by graph.
    """
    multiplications: list[Multiplication] = []
    adders = registers = 0
    for k, (graph, products) in enumerate(zip(graphs, from_adders or [()] * len(graphs), strict=True)):
        nodes, used = graph.nodes, used_bits(graph)
        for together in _by_stage(products, pipeline_stages[k]) if pipeline_stages else [products]:
            adders += (bits or _bits_of_products)(graph, together)
        for index, node in enumerate(nodes):
            if index in products:
                continue
            if graph.concatenated(node) is not None:
                continue
            if node.op is Op.ADD or node.op is Op.SUBTRACT or graph.is_gate(node):
                adders += used[index]
            elif node.op is Op.TRUNCATE:  # an adder makes negative values round up
                adders += nodes[node.operands[0]].width
            elif node.op is Op.DELAY:
                registers += node.width
            elif (multiplication := multiplication_of(graph, node)) is not None:
                multiplications.append(multiplication)
        registers += sum(nodes[i].width for i in graph.outputs)
    return Cost(multiplications=tuple(multiplications), adder_bits=adders, register_bits=registers)


def passed_bits(graph: Graph) -> int:
    """Return the bits of all sums that are those of one operand, as the other has none so low: they take no adder."""
    passed = 0
    for node in graph.nodes:
        if (node.op is Op.ADD or node.op is Op.SUBTRACT) and graph.concatenated(node) is None:
            left, right = (graph.nodes[i].frac for i in node.operands)
            passed += max(left - right, 0 if node.op is Op.SUBTRACT else right - left)
    return passed


def area_of(graph: Graph) -> int:
    """Return the contribution of a graph to the area of a datapath."""
    return cost_of_graphs([graph]).area


def area_by_digits(graph: Graph) -> int:
    """Estimate the contribution of a graph without multiplier blocks, by the signed digits of its constants.

    Each digit but the first of a constant takes a sum of about the width of the operand. `adder_graph` finds sums that
    take less, but not in the time that a search among thousands of constants has.
    """
    return cost_of_graphs([graph], [scalings(graph)], bits_by_digits).area


def products_from_adders(
    graphs: Sequence[Graph], blocks: int | None, block_bits: int = MULTIPLIER_BITS
) -> tuple[frozenset[int], ...]:
    """Return the products by constants that are made of adders, so that the others take no more blocks than there are.

    Products of two values, which nothing else can make, take blocks first; then products by constants, those first
    that would take most adder bits for each block.

    Parameters
    ----------
    graphs : sequence of Graph
        The stages.
    blocks : int or None
        Number of multiplier blocks; None for as many as it takes.
    block_bits : int
        Bits of each operand of a block, signed.
    """
    if blocks is None:
        return tuple(frozenset() for _ in graphs)
    from_adders: list[set[int]] = [set() for _ in graphs]
    scaled: list[tuple[float, int, int, int]] = []
    needed = 0
    for k, graph in enumerate(graphs):
        constant = scalings(graph)
        for index, node in enumerate(graph.nodes):
            multiplication = multiplication_of(graph, node)
            if multiplication is None:
                continue
            taken = multiplication.blocks_of(block_bits)
            needed += taken
            if index in constant:
                scaled.append((_bits_of_products(graph, [index]) / taken, k, index, taken))
    for _, k, index, taken in sorted(scaled):
        if needed <= blocks:
            break
        from_adders[k].add(index)
        needed -= taken
    return tuple(map(frozenset, from_adders))


def _by_stage(products: Collection[int], pipeline_stages: Sequence[int]) -> list[list[int]]:
    """Return products by their pipeline stages."""
    groups: dict[int, list[int]] = {}
    for index in sorted(products):
        groups.setdefault(pipeline_stages[index], []).append(index)
    return list(groups.values())


def _bits_of_products(graph: Graph, products: Iterable[int]) -> int:
    """Return the adder bits of products by constants."""
    total = 0
    for operand, group in by_operand(graph, products):
        sums = adder_graph(tuple(graph.nodes[index].parameter for index in group))
        total += adder_bits(sums, *graph.nodes[operand].range[1:])
    return total


def bits_by_digits(graph: Graph, products: Iterable[int]) -> int:
    """Estimate the adder bits of products by constants."""
    nodes = graph.nodes
    return sum(
        (len(signed_digits(nodes[index].parameter)) - 1) * (nodes[nodes[index].operands[0]].width + 1)
        for index in products
    )


def multiplication_of(graph: Graph, node: Node) -> Multiplication | None:
    """Return the multiplication that a node is, None if it is none."""
    if node.op is Op.SCALE:
        factor = Operand(abs(node.parameter).bit_length() + (node.parameter < 0), node.parameter < 0)
        return Multiplication(_operand(graph.nodes[node.operands[0]]), factor)
    if node.op is Op.MULTIPLY and not graph.is_gate(node):
        a, b = (_operand(graph.nodes[i]) for i in node.operands)
        return Multiplication(a, b)
    return None


def _operand(node: Node) -> Operand:
    return Operand(node.width, node.signed)


def _extra(operand: Operand, other: Operand, block_bits: int) -> bool:
    seen = operand.beside(other)
    return seen == operand.bits and seen > block_bits and seen % block_bits == 1


def _pieces(bits: int, block_bits: int) -> int:
    return max(1, -(-(bits - 1) // block_bits))
