"""Cost of a datapath, counted on its dataflow graphs: multipliers, adder bits, register bits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, Node, Op

MULTIPLIER_BITS = 18
"""Bits of each operand of a hardware multiplier; for one extra bit, Yosys uses adders instead of another block."""

_LUTS_PER_ADDER_BIT, _LUTS_PER_SPLIT = 1.04, 30.7
"""Fitted by benchmarks/cost_model.py to synthesis results of the examples on ECP5, within 40 %."""

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
        return _pieces(self.data.beside(self.factor)) * _pieces(self.factor.beside(self.data))

    @property
    def extra_bits(self) -> int:
        """Adder bits for operands one bit wider than whole blocks; a sign bit that is always 0 adds nothing."""
        return _extra(self.data, self.factor) * self.factor.bits + _extra(self.factor, self.data) * self.data.bits


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Operator counts of a datapath in the parallel architecture, before synthesis.

    Attributes
    ----------
    multiplications : tuple of Multiplication
        In the order of the datapath.
    adder_bits : int
        Result bits of all additions, subtractions and products with a single bit.
    register_bits : int
        State bits and pipeline registers.
    """

    multiplications: tuple[Multiplication, ...]
    adder_bits: int
    register_bits: int

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
        adder_bits = self.adder_bits + self.extra_bits
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


def cost_of(datapath: Datapath) -> Cost:
    """Count the operators of `datapath`."""
    return cost_of_graphs([stage.graph for stage in datapath.stages])


def cost_of_graphs(graphs: Sequence[Graph]) -> Cost:
    """Count the operators of a chain of graphs."""
    multiplications: list[Multiplication] = []
    adders = registers = 0
    for graph in graphs:
        nodes = graph.nodes
        for node in nodes:
            if node.op is Op.SCALE:
                factor = Operand(abs(node.parameter).bit_length() + (node.parameter < 0), node.parameter < 0)
                multiplications.append(Multiplication(_operand(nodes[node.operands[0]]), factor))
            elif graph.is_gate(node):
                adders += node.width
            elif node.op is Op.MULTIPLY:
                a, b = (_operand(nodes[i]) for i in node.operands)
                multiplications.append(Multiplication(a, b))
            elif node.op in {Op.ADD, Op.SUBTRACT}:
                adders += node.width
            elif node.op is Op.TRUNCATE:  # an adder makes negative values round up
                adders += nodes[node.operands[0]].width
            elif node.op is Op.DELAY:
                registers += node.width
        registers += sum(nodes[i].width for i in graph.outputs)
    return Cost(multiplications=tuple(multiplications), adder_bits=adders, register_bits=registers)


def area_of(graph: Graph) -> int:
    """Return the contribution of a graph to the area of a datapath."""
    return cost_of_graphs([graph]).area


def _operand(node: Node) -> Operand:
    return Operand(node.width, node.signed)


def _extra(operand: Operand, other: Operand) -> bool:
    seen = operand.beside(other)
    return seen == operand.bits and seen > MULTIPLIER_BITS and seen % MULTIPLIER_BITS == 1


def _pieces(bits: int) -> int:
    return max(1, -(-(bits - 1) // MULTIPLIER_BITS))
