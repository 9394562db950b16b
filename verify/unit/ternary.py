"""What the logic of a netlist is where only some of its bits are known.

Every bit is 0, 1 or unknown. What comes out as known is so whatever the unknown bits are, as 0 & x. Words are pairs of
integers, the value and the mask of known bits; in the value, unknown bits are 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.evaluation import is_signed
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.reader.syntax import Bits, Expression, Joined, Load, Number, Operator, Statement, Word

Trits = tuple[int, int]
"""Value and mask of the known bits of a word."""

Values = dict[str, Trits]
"""What nets hold."""

_Function = Callable[[Values], Trits]

UNKNOWN: Trits = (0, 0)


def known(value: int, width: int) -> Trits:
    """Return a word of which all bits are known."""
    mask = (1 << width) - 1
    return value & mask, mask


class Ternary:
    """The nets of a netlist and what its registers take over, with unknown bits.

    Parameters
    ----------
    netlist : Netlist
    words : mapping of str to sequence of int
        Memories whose words never change.

    The values that are handed to its methods hold what registers, inputs and cut nets do. Nets are added to them.
    """

    def __init__(self, netlist: Netlist, words: Mapping[str, Sequence[int]]) -> None:
        self._netlist, self._words = netlist, words
        self._nets: dict[str, _Function] = {}
        self._open: set[str] = set()
        self._next: dict[str, _Function] = {}

    def net(self, name: str, values: Values) -> Trits:
        """Return a net.

        Raises
        ------
        RejectedError
            If it depends on itself.
        """
        trits = values.get(name)
        if trits is None:
            if name not in self._nets:
                self._nets[name] = self._of_net(name)
            require(name not in self._open, f"{name} must not depend on itself within a clock")
            self._open.add(name)
            try:
                trits = values[name] = self._nets[name](values)
            finally:
                self._open.discard(name)
        return trits

    def bits(self, name: str, low: int, width: int, values: Values) -> Trits:
        """Return bits of a net."""
        value, mask = self.net(name, values)
        cut = (1 << width) - 1
        return value >> low & cut, mask >> low & cut

    def after(self, name: str, values: Values) -> Trits:
        """Return what a register holds after a clock."""
        if name not in self._next:
            register = self._netlist.registers[name]
            self._next[name] = self._executed(register.statements, register.width, lambda values: values[name])
        return self._next[name](values)

    def value(self, expression: Expression, width: int, values: Values) -> Trits:
        """Return an expression, extended to a width."""
        return self._extended(expression, width)(values)

    def _executed(self, statements: Sequence[Statement], width: int, before: _Function) -> _Function:
        now = before
        for statement in statements:
            if isinstance(statement, Load):
                require(isinstance(statement.target, Bits), "a register must be loaded as a whole")
                now = _cut(self._extended(statement.value, width), 0, width)
            else:
                condition = self._any(statement.condition)
                yes, no = (self._executed(side, width, now) for side in (statement.yes, statement.no))
                now = _chosen(condition, yes, no)
        return now

    def _of_net(self, name: str) -> _Function:
        drivers = self._netlist.drivers.get(name)
        if drivers is None:
            return lambda values: UNKNOWN
        parts: list[tuple[int, int, _Function]] = []
        for driver in drivers:
            width = max(driver.start + driver.width, self._netlist.width(driver.value))
            parts.append(
                (driver.low, driver.width, _cut(self._extended(driver.value, width), driver.start, driver.width))
            )
        if len(parts) == 1 and parts[0][0] == 0:
            return parts[0][2]

        def joined(values: Values) -> Trits:
            value = mask = 0
            for low, _, part in parts:
                own, known_ = part(values)
                value |= own << low
                mask |= known_ << low
            return value, mask

        return joined

    # Expressions: each is a function that gives exactly `width` bits, which are not less than its own.

    def _extended(self, value: Expression, width: int) -> _Function:
        own = self._netlist.width(value)
        width = max(width, own)
        if isinstance(value, Operator) and value.symbol in {"+", "-", "*", "~", "?"}:
            return self._widened(value, width)
        return _extension(self._plain(value), own, width, signed=is_signed(value))

    def _widened(self, value: Operator, width: int) -> _Function:
        signed = is_signed(value)

        def operand(of: Expression) -> _Function:
            own = self._netlist.width(of)
            return _extension(self._extended(of, own), own, width, signed=signed)

        if value.symbol == "?":
            return _chosen(self._any(value.operands[0]), operand(value.operands[1]), operand(value.operands[2]))
        full = (1 << width) - 1
        a = operand(value.operands[0])
        if value.symbol == "~":

            def inverted(values: Values) -> Trits:
                own, mask = a(values)
                return ~own & mask, mask

            return inverted
        b = operand(value.operands[1])
        symbol = value.symbol

        def computed(values: Values) -> Trits:
            (x, p), (y, q) = a(values), b(values)
            if p == full and q == full:
                result = x + y if symbol == "+" else x - y if symbol == "-" else x * y
                return result & full, full
            if symbol == "*" and ((p == full and not x) or (q == full and not y)):
                return 0, full
            return UNKNOWN

        return computed

    def _plain(self, value: Expression) -> _Function:
        if isinstance(value, Number):
            number = known(value.value, value.width)
            return lambda values: number
        if isinstance(value, Bits):
            return self._of_bits(value)
        if isinstance(value, Word):
            return self._of_word(value)
        if isinstance(value, Joined):
            return self._joined(value)
        if value.symbol == "signed":
            return self._extended(value.operands[0], self._netlist.width(value))
        if value.symbol in {"&", "|", "^"} and len(value.operands) == 2:
            return self._bitwise(value)
        if value.symbol == "&":
            return self._all(value.operands[0])
        if value.symbol == "|":
            return self._any(value.operands[0])
        if value.symbol == "^" and len(value.operands) == 1:
            return self._odd(value.operands[0])
        if value.symbol == "!":
            any_ = self._any(value.operands[0])

            def none(values: Values) -> Trits:
                own, mask = any_(values)
                return ~own & mask, mask

            return none
        return self._compared(value)

    def _of_bits(self, value: Bits) -> _Function:
        name, low, width = value.name, value.low, value.width
        net = self.net
        if width is None:
            return lambda values: net(name, values)
        cut = (1 << width) - 1

        def sliced(values: Values) -> Trits:
            own, mask = net(name, values)
            return own >> low & cut, mask >> low & cut

        return sliced

    def _of_word(self, value: Word) -> _Function:
        words = self._words.get(value.name)
        if words is None:
            return lambda values: UNKNOWN
        width, contents = self._netlist.memories[value.name].width, words
        full = (1 << self._netlist.width(value.address)) - 1
        address = self._extended(value.address, 0)

        def read(values: Values) -> Trits:
            at, mask = address(values)
            return known(contents[at], width) if mask == full and at < len(contents) else UNKNOWN

        return read

    def _joined(self, value: Joined) -> _Function:
        parts: list[tuple[int, _Function]] = []
        at = 0
        for part in reversed(value.parts):
            own = self._netlist.width(part)
            parts.append((at, self._extended(part, own)))
            at += own

        def joined(values: Values) -> Trits:
            total = mask = 0
            for low, part in parts:
                own, known_ = part(values)
                total |= own << low
                mask |= known_ << low
            return total, mask

        return joined

    def _bitwise(self, value: Operator) -> _Function:
        first, second = value.operands
        width = self._netlist.width(first)
        require(width == self._netlist.width(second), f"{value.symbol} must join words of one width, not of two")
        a, b = self._extended(first, width), self._extended(second, width)
        if value.symbol == "&":

            def both(values: Values) -> Trits:
                (x, p), (y, q) = a(values), b(values)
                return x & y, (p & q) | (p & ~x) | (q & ~y)

            return both
        if value.symbol == "|":

            def either(values: Values) -> Trits:
                (x, p), (y, q) = a(values), b(values)
                return x | y, (p & q) | x | y

            return either

        def one(values: Values) -> Trits:
            (x, p), (y, q) = a(values), b(values)
            return (x ^ y) & p & q, p & q

        return one

    def _any(self, value: Expression) -> _Function:
        """Whether a bit is set."""
        width = self._netlist.width(value)
        word, full = self._extended(value, width), (1 << width) - 1

        def any_bit(values: Values) -> Trits:
            own, mask = word(values)
            return (1, 1) if own else (0, int(mask == full))

        return any_bit

    def _all(self, value: Expression) -> _Function:
        """Whether all bits are set."""
        width = self._netlist.width(value)
        word, full = self._extended(value, width), (1 << width) - 1

        def all_bits(values: Values) -> Trits:
            own, mask = word(values)
            return (0, 1) if ~own & mask else (1, 1) if mask == full else (0, 0)

        return all_bits

    def _odd(self, value: Expression) -> _Function:
        """Whether an odd number of bits is set."""
        width = self._netlist.width(value)
        word, full = self._extended(value, width), (1 << width) - 1

        def parity(values: Values) -> Trits:
            own, mask = word(values)
            return (own.bit_count() & 1, 1) if mask == full else (0, 0)

        return parity

    def _compared(self, value: Operator) -> _Function:
        signed = all(is_signed(operand) for operand in value.operands)
        width = max(self._netlist.width(operand) for operand in value.operands)
        a, b = (
            _extension(
                self._extended(operand, self._netlist.width(operand)),
                self._netlist.width(operand),
                width,
                signed=signed,
            )
            for operand in value.operands
        )
        full, top, symbol = (1 << width) - 1, 1 << (width - 1), value.symbol
        if symbol not in {"==", "!=", "<", ">", "<=", ">="}:
            raise RejectedError(f"the operator {symbol} must be known")

        def compared(values: Values) -> Trits:
            (x, p), (y, q) = a(values), b(values)
            if symbol in {"==", "!="} and (x ^ y) & p & q:
                return int(symbol == "!="), 1
            if p != full or q != full:
                return UNKNOWN
            if signed:
                x, y = x - ((x & top) << 1), y - ((y & top) << 1)
            right = {"==": x == y, "!=": x != y, "<": x < y, ">": x > y, "<=": x <= y, ">=": x >= y}[symbol]
            return int(right), 1

        return compared


def _cut(word: _Function, low: int, width: int) -> _Function:
    cut = (1 << width) - 1

    def cut_bits(values: Values) -> Trits:
        own, mask = word(values)
        return own >> low & cut, mask >> low & cut

    return cut_bits


def _extension(word: _Function, own: int, width: int, *, signed: bool) -> _Function:
    """Return a word of `own` bits with `width` bits."""
    if width <= own:
        return word
    above, top = ((1 << width) - 1) & ~((1 << own) - 1), 1 << (own - 1)

    def extended(values: Values) -> Trits:
        value, mask = word(values)
        if not signed:
            return value, mask | above
        return (value | above if value & top else value), (mask | above if mask & top else mask)

    return extended


def _chosen(condition: _Function, yes: _Function, no: _Function) -> _Function:
    def chosen(values: Values) -> Trits:
        select, certain = condition(values)
        if certain:
            return yes(values) if select else no(values)
        (x, p), (y, q) = yes(values), no(values)
        mask = p & q & ~(x ^ y)
        return x & mask, mask

    return chosen
