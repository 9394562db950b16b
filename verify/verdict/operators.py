"""Counts the operators of a certificate's graphs, each by itself: multipliers, bits of adders, bits of registers.

A product with a single bit is made of gates, and counts like a sum. The bits of a sum that count are those that are
asked for: where a range says that the upper ones repeat the sign, or only the lower ones are taken, the others are not
computed, there and in the sums before. What is added where the other operand has no bits takes no adder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sosmith.verify.certificate_file import NodeEntry, Operation, StageEntry

_SUMS = frozenset({Operation.ADD, Operation.SUBTRACT})


@dataclass(frozen=True)
class Operators:
    """The operators of stages: bits of both operands of each product, of what else takes adders, and of registers."""

    products: list[list[int]]
    adder_bits: int
    register_bits: int


def operators(stages: Sequence[StageEntry]) -> Operators:
    """Return the operators of stages."""
    products: list[list[int]] = []
    adders = registers = 0
    for stage in stages:
        asked = _asked(stage)
        for index, node in enumerate(stage.nodes):
            operands = [stage.nodes[i] for i in node.operands]
            if node.op in _SUMS or (node.op is Operation.MULTIPLY and any(map(_is_bit, operands))):
                adders += 0 if node.op is Operation.ADD and _are_joined(operands) else asked[index]
            elif node.op is Operation.TRUNCATE:
                adders += bits(operands[0])
            elif node.op is Operation.DELAY:
                registers += bits(node)
            elif is_product(node, operands):
                scale, factor = node.op is Operation.SCALE, node.parameter
                others = [abs(factor).bit_length() + (factor < 0)] if scale else [bits(operands[1])]
                products.append([bits(operands[0]), *others])
        registers += sum(bits(stage.nodes[index]) for index in stage.outputs)
    return Operators(products, adders, registers)


def is_product(node: NodeEntry, operands: Sequence[NodeEntry]) -> bool:
    """Whether a node is a product that may take a multiplier; with a single bit, it takes gates."""
    return node.op is Operation.SCALE or (node.op is Operation.MULTIPLY and not any(map(_is_bit, operands)))


def bits(node: NodeEntry) -> int:
    """Count the bits of a node, with its sign if it has one."""
    if node.low < 0:
        return max((-node.low - 1).bit_length(), node.high.bit_length()) + 1
    return max(node.high.bit_length(), 1)


def _is_bit(node: NodeEntry) -> bool:
    return bits(node) == 1 and node.low == 0 and node.op is not Operation.CONSTANT


def _are_joined(operands: Sequence[NodeEntry]) -> bool:
    """Whether one of two operands is not negative and lies below the lowest bit of the other: adding takes nothing."""
    return any(
        lower.low >= 0 and bits(lower) - lower.frac <= -upper.frac for lower, upper in (operands, operands[::-1])
    )


def _asked(stage: StageEntry) -> list[int]:
    """Return how many bits of each node others ask for, counted from its lowest; all of one that nobody asks for."""
    nodes = stage.nodes
    wholly = {*stage.outputs, *(node.operands[0] for node in nodes if node.op is Operation.DELAY)}
    asked = [bits(node) if index in wholly else 0 for index, node in enumerate(nodes)]
    for index, node in sorted(enumerate(nodes), reverse=True):
        own = asked[index] = min(asked[index], bits(node)) or bits(node)
        if node.op is Operation.DELAY:
            continue
        for i in node.operands:
            of = nodes[i]
            if node.op in _SUMS | {Operation.FLOOR}:
                wanted = own + of.frac - node.frac
            elif node.op is Operation.FRACTION:
                wanted = of.frac - node.parameter
            else:
                wanted = own if node.op in {Operation.SHIFT, Operation.BOUND} else bits(of)
            asked[i] = max(asked[i], min(wanted, bits(of)))
    return asked
