"""What a datapath costs, counted on its dataflow graphs: multipliers, adder bits, register bits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sosmith.model.datapath import Datapath
from sosmith.model.graph import Graph, Node, Op

MULTIPLIER_BITS = 18
"""Bits of each operand of a hardware multiplier; Yosys adds what one bit more contributes instead of taking a block."""

_LUTS_PER_ADDER_BIT, _LUTS_PER_SPLIT, _LUTS_AROUND = 0.87, 77.0, -51.0
"""Fitted by benchmarks/cost_model.py to synthesis of the examples for ECP5, to within a fifth."""

LUTS_OF_A_BLOCK = 864
"""What a multiplier block counts in LUT4: an ECP5-25 has 24,192 and 28 (Lattice FPGA-DS-02012, family table)."""


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Counts of a datapath in the parallel architecture, before synthesis.

    Attributes
    ----------
    multipliers : tuple of tuple of int
        Operand widths in bits of each multiplication, data first, in the order of the datapath.
    adder_bits : int
        Result bits of all additions and subtractions.
    register_bits : int
        State bits and pipeline registers.
    """

    multipliers: tuple[tuple[int, int], ...]
    adder_bits: int
    register_bits: int

    @property
    def multiplier_blocks(self) -> int:
        """Hardware multipliers of 18 x 18 bits, signed, that the multiplications take."""
        return sum(_pieces(a) * _pieces(b) for a, b in self.multipliers)

    @property
    def splits(self) -> int:
        """Blocks beyond the first of each multiplication: so many partial products have to be added."""
        return self.multiplier_blocks - len(self.multipliers)

    @property
    def extra_bits(self) -> int:
        """Adder bits for operands that have one bit more than whole blocks."""
        return sum(_extra(a) * b + _extra(b) * a for a, b in self.multipliers)

    @property
    def luts(self) -> int:
        """Estimate of the LUT4 on an ECP5, a carry cell counting as two."""
        adder_bits = self.adder_bits + self.extra_bits
        return round(_LUTS_PER_ADDER_BIT * adder_bits + _LUTS_PER_SPLIT * self.splits + _LUTS_AROUND)

    @property
    def area(self) -> int:
        """One number to compare designs by: LUT4, with a multiplier block as much as its share of an ECP5-25."""
        return self.luts + LUTS_OF_A_BLOCK * self.multiplier_blocks

    @property
    def multiplier_sizes(self) -> str:
        """The multiplications for people, such as ``2 of 23 x 18, 1 of 16 x 19``."""
        distinct = sorted(set(self.multipliers), reverse=True)
        return ", ".join(f"{self.multipliers.count(size)} of {size[0]} x {size[1]}" for size in distinct) or "none"


def cost_of(datapath: Datapath) -> Cost:
    """Count the operators of `datapath`."""
    return cost_of_graphs([stage.graph for stage in datapath.stages])


def cost_of_graphs(graphs: Sequence[Graph]) -> Cost:
    """Count the operators of a chain of graphs."""
    multipliers: list[tuple[int, int]] = []
    adders = registers = 0
    for graph in graphs:
        nodes = graph.nodes
        for node in nodes:
            if node.op is Op.SCALE:
                multipliers.append((nodes[node.operands[0]].width, constant_width(node)))
            elif node.op is Op.MULTIPLY:
                multipliers.append((nodes[node.operands[0]].width, nodes[node.operands[1]].width))
            elif node.op in {Op.ADD, Op.SUBTRACT}:
                adders += node.width
            elif node.op is Op.TRUNCATE:  # adds what makes negative values round upward
                adders += nodes[node.operands[0]].width
            elif node.op is Op.DELAY:
                registers += node.width
        registers += sum(nodes[i].width for i in graph.outputs)
    return Cost(multipliers=tuple(multipliers), adder_bits=adders, register_bits=registers)


def area_of(graph: Graph) -> int:
    """Return the part of a graph in the area of a datapath."""
    return cost_of_graphs([graph]).area - cost_of_graphs([]).area


def _extra(bits: int) -> int:
    return int(bits > MULTIPLIER_BITS and bits % MULTIPLIER_BITS == 1)


def _pieces(bits: int) -> int:
    return max(1, -(-(bits - 1) // MULTIPLIER_BITS))


def constant_width(node: Node) -> int:
    """Bits of a SCALE node's constant, with a sign bit if it is negative."""
    return abs(node.parameter).bit_length() + (node.parameter < 0)
