"""Quantities of products, in multiplier blocks or in LUT4."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from sosmith.gen.estimate.quantities import Quantities
from sosmith.gen.fpga.boards import Device
from sosmith.gen.word_lengths.cost import Multiplication, Operand, multiplication_of
from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.reload.constants import bits_of

_LEAST_BITS = 3
"""Bits of a part of a product from which on it takes a multiplier block, as synthesis has them."""


class Product(NamedTuple):
    """A product as the hardware has it.

    Attributes
    ----------
    operands : Multiplication
        Its operands, data first.
    constant : int or None
        What is multiplied by, as many bits as the factor; None for two values.
    width : int or None
        Bits of the result, if its range takes fewer than the operands have together.
    """

    operands: Multiplication
    constant: int | None = None
    width: int | None = None

    @property
    def bits(self) -> int:
        """Bits that are computed: all of them, or as many as a negative constant has without a sign."""
        data, factor = self.operands.size
        cut = self.constant is not None and self.constant < 0 and not self.operands.data.signed
        bits = factor if cut else data + factor
        return bits if self.width is None else min(bits, self.width)

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
        return Product(Multiplication(found.data, factor), width=node.width)
    if node.op is Op.SCALE:
        return Product(found, node.parameter, node.width)
    return _of_constant_node(graph, node) or Product(found, width=node.width)


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
            return Product(operands, constant.parameter, node.width)
    return None


def of_product(product: Product, device: Device) -> Quantities:
    """Count a product as synthesis makes it on a device."""
    operands, constant = product.operands, product.constant
    if product.is_wires:
        return Counter({"sums": operands.data.bits} if constant is not None and constant < 0 else {})
    if device.multiplier is None:
        return _soft(operands) if constant is None else Counter({"soft_products": _added_bits(product, constant)})
    block = device.factor_bits
    blocks = operands.blocks_of(block) - _narrow_parts(product, device)
    return Counter({"blocks": blocks, "joined": _joined(product, block)})


def _narrow_parts(product: Product, device: Device) -> int:
    """Return the parts of a product of several blocks of which so few bits are left that they are made of LUT4."""
    block = device.factor_bits
    starts = [range(0, size, block) for size in product.operands.size]
    left = [product.bits - low - high for low in starts[0] for high in starts[1] if low + high]
    return sum(0 < bits < _LEAST_BITS for bits in left)


def _joined(product: Product, block: int) -> int:
    """Return the bits of the sums that join the products of blocks, from where they begin to where they end."""
    narrow, wide = sorted(product.operands.size)
    bits = 0
    for low in range(0, wide, block):
        width = min(min(block, wide - low) + narrow, product.bits - low)
        bits += width * (low > 0) + sum(width - start for start in range(block, narrow, block))
    return bits


def _added_bits(product: Product, constant: int) -> int:
    """Return the bits to be added up in a product by a constant: a copy of the data for each of its ones."""
    data, factor = product.operands.size
    return sum(min(data, product.bits - bit) for bit in range(factor) if constant >> bit & 1)


def _soft(operands: Multiplication) -> Quantities:
    """Count a product of two values in LUT4.

    Copies of one are added up three by three, the last two by carry; with a sign each of them is extended to the whole
    product, half of the other operand on average.
    """
    narrow, wide = sorted(operands.size)
    signed = operands.data.signed or operands.factor.signed
    return Counter({"soft_multipliers": max(0, 2 * narrow - 3) * (wide + (narrow // 2 if signed else 1))})
