"""Width and sign of an expression as an operand of its own, as IEEE 1800 has them."""

from __future__ import annotations

from sosmith.verify.reader.syntax import Bits, Expression, Joined, Module, Number, Operator, Word

_COMPARISONS = frozenset({"==", "!=", "<", ">", "<=", ">="})
_REDUCTIONS = frozenset({"!", "&", "|", "^"})


def is_one_bit(value: Expression) -> bool:
    """Whether an expression is a comparison or a reduction: one bit without sign."""
    if not isinstance(value, Operator):
        return False
    return value.symbol in _COMPARISONS or (len(value.operands) == 1 and value.symbol in _REDUCTIONS)


def is_signed(value: Expression) -> bool:
    """Whether an expression has a sign: only ``$signed`` gives one, and all operands must have it."""
    if not isinstance(value, Operator) or is_one_bit(value):
        return False
    return value.symbol == "signed" or all(is_signed(of) for of in value.operands[value.symbol == "?" :])


def width_of(value: Expression, module: Module) -> int:
    """Width of an expression in bits, as an operand of its own."""
    if isinstance(value, Number):
        return value.width
    if isinstance(value, Bits):
        return module.widths[value.name] if value.width is None else value.width
    if isinstance(value, Word):
        return module.widths[value.name]
    if isinstance(value, Joined):
        return sum(width_of(part, module) for part in value.parts)
    if is_one_bit(value):
        return 1
    return max(width_of(part, module) for part in value.operands[value.symbol == "?" :])
