"""Quantities of products, in multiplier blocks or in LUT4."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from sosmith.gen.estimate.quantities import Quantities
from sosmith.gen.fpga.boards import Device
from sosmith.gen.word_lengths.cost import Multiplication, Operand, multiplication_of
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.reload.constants import bits_of


class Product(NamedTuple):
    """A product as the hardware has it.

    Attributes
    ----------
    operands : Multiplication
        Its operands, data first.
    constant : int or None
        What is multiplied by, as many bits as the factor; None for two values.
    """

    operands: Multiplication
    constant: int | None = None

    @property
    def is_wires(self) -> bool:
        """Whether it takes no more than wires, or a change of sign."""
        return self.constant is not None and not abs(self.constant) & (abs(self.constant) - 1)


def product_in(graph: Graph, node: Node, *, loads: bool) -> Product | None:
    """Return the product that a node is, None if it is none; `loads` says that constants come from registers."""
    found = multiplication_of(graph, node)
    if found is None:
        return None
    if loads:
        factor = Operand(bits_of(node.parameter), signed=True) if node.op is Op.SCALE else found.factor
        return Product(Multiplication(found.data, factor))
    if node.op is Op.SCALE:
        return Product(found, node.parameter)
    return _of_constant_node(graph, node) or Product(found)


def _of_constant_node(graph: Graph, node: Node) -> Product | None:
    """Return the product of a value and a node that is a constant.

    A negative one has all bits of the result where the value has no sign, which multiplies without signs.
    """
    for own, other in (node.operands, node.operands[::-1]):
        constant, value = graph.nodes[own], graph.nodes[other]
        if constant.op is Op.CONSTANT:
            bits = node.width if constant.signed and not value.signed else constant.width
            signed = constant.signed and value.signed
            operands = Multiplication(Operand(value.width, value.signed), Operand(bits, signed))
            return Product(operands, constant.parameter)
    return None


def of_product(product: Product, device: Device) -> Quantities:
    """Count a product as synthesis makes it on a device."""
    operands, constant = product
    if product.is_wires:
        return Counter({"sums": operands.data.bits} if constant is not None and constant < 0 else {})
    if device.multiplier is None:
        return Counter(_soft(operands) if constant is None else {"soft_products": _added_bits(operands, constant)})
    return Counter({"blocks": operands.blocks_of(device.factor_bits), "joined": _joined(operands, device.factor_bits)})


def _joined(operands: Multiplication, block: int) -> int:
    """Return the bits of the sums that join the products of blocks, of which each begins where its operands do."""
    wide, narrow = sorted(operands.size, reverse=True)
    pieces = [(low, min(block, wide - low)) for low in range(0, wide, block)]
    of_factor = [low for low in range(0, narrow, block)]
    return sum(bits + narrow for low, bits in pieces if low) + sum(
        bits + narrow - low for low in of_factor if low for _, bits in pieces
    )


def _added_bits(operands: Multiplication, constant: int) -> int:
    """Return the bits to be added up in a product by a constant: a copy of the data for each of its ones."""
    data, factor = operands.size
    ones = (bit for bit in range(factor) if constant >> bit & 1)
    unsigned = not operands.data.signed and constant < 0  # what is above the result is left out
    return sum(min(data, factor - bit) if unsigned else data for bit in ones)


def _soft(operands: Multiplication) -> Quantities:
    """Count a product of two values in LUT4.

    Copies of one are added up three by three, the last two by carry; with a sign each of them is extended to the whole
    product, half of the other operand on average.
    """
    narrow, wide = sorted(operands.size)
    signed = operands.data.signed or operands.factor.signed
    return Counter({"soft_multipliers": max(0, 2 * narrow - 3) * (wide + (narrow // 2 if signed else 1))})
