"""The bits of all nets of a netlist within one clock: the same logic of the same bits has the same number.

Bits of registers, of what nothing drives, and of words of memories stand for themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sosmith.verify.graph import require
from sosmith.verify.parallel.netlist import Driver, Netlist
from sosmith.verify.reader.syntax import Bits, Expression, Joined, Load, Number, Operator, Statement, Word

_WIDENED = frozenset({"+", "-", "*", "&", "|", "^", "~", "?"})
_COMPARED = frozenset({"==", "!=", "<", ">", "<=", ">="})

Bit = int
"""Number of what a bit is; 0 and 1 are the constants."""


class BitSource(NamedTuple):
    """What a bit is: bit `place` of what `kind`, the name of a net or an operator, makes of the operands' bits."""

    kind: str
    place: int = 0
    operands: tuple[tuple[Bit, ...], ...] = ()


class BitLogic:
    """The bits of all nets of a core within one clock: the same logic of the same bits has the same number."""

    def __init__(self, netlist: Netlist) -> None:
        self._netlist = netlist
        self.sources: list[BitSource] = []
        self._numbers: dict[BitSource, Bit] = {}
        for value in (0, 1):
            self._bit(BitSource("", value))
        self._driven: dict[tuple[str, int], tuple[Bit, ...]] = {}
        self._open: set[tuple[str, int]] = set()

    def first(self, bit: Bit) -> int | None:
        """Return what a bit of a register is before the first clock; None if that is not said, or it is no such bit."""
        kind, place, operands = self.sources[bit]
        register = None if operands else self._netlist.registers.get(kind)
        return None if register is None or register.first is None else register.first >> place & 1

    def after(self, bit: Bit) -> Bit:
        """Return what a bit of a register takes over at a clock."""
        register = self._netlist.registers[self.sources[bit].kind]
        return self._loaded(register.statements, self.net(register.name))[self.sources[bit].place]

    def net(self, name: str, low: int = 0, width: int | None = None) -> tuple[Bit, ...]:
        """Return bits of a net, the lowest first; what nothing drives is a bit of its own.

        Raises
        ------
        RejectedError
            If it depends on itself.
        """
        end = self._netlist.widths[name] if width is None else low + width
        bits = {place: self._bit(BitSource(name, place)) for place in range(low, end)}
        for index, driver in enumerate(self._netlist.drivers.get(name, [])):
            first, last = max(low, driver.low), min(end, driver.low + driver.width)
            if first < last:
                value = self._driver(name, index, driver)
                bits |= {place: value[place - driver.low] for place in range(first, last)}
        return tuple(bits.values())

    def _driver(self, name: str, index: int, driver: Driver) -> tuple[Bit, ...]:
        key = name, index
        if key not in self._driven:
            require(key not in self._open, f"{name} must not depend on itself within a clock")
            self._open.add(key)
            end, value = driver.start + driver.width, driver.value
            bits = self._value(value, max(end, self._netlist.width(value)))
            self._driven[key] = bits[driver.start : end]
        return self._driven[key]

    def _bit(self, source: BitSource) -> Bit:
        if source not in self._numbers:
            self._numbers[source] = len(self.sources)
            self.sources.append(source)
        return self._numbers[source]

    def _loaded(self, statements: Sequence[Statement], word: tuple[Bit, ...]) -> tuple[Bit, ...]:
        """Return what a register holds after statements."""
        for statement in statements:
            if isinstance(statement, Load):
                word = self._value(statement.value, max(len(word), self._netlist.width(statement.value)))[: len(word)]
            else:
                yes, no = (self._loaded(part, word) for part in (statement.yes, statement.no))
                word = self._chosen(self._any(self._own(statement.condition)), yes, no)
        return word

    # Expressions.

    def _own(self, value: Expression) -> tuple[Bit, ...]:
        return self._value(value, self._netlist.width(value))

    def _value(self, value: Expression, width: int) -> tuple[Bit, ...]:
        """Return an expression in so many bits, not less than its own."""
        if isinstance(value, Operator) and value.symbol in _WIDENED and len(value.operands) > (value.symbol != "~"):
            return self._widened(value, width)
        bits = self._plain(value)
        return (*bits, *[bits[-1] if _is_signed(value) else 0] * (width - len(bits)))

    def _plain(self, value: Expression) -> tuple[Bit, ...]:
        """Return anything whose operands are not extended with it."""
        if isinstance(value, Number):
            return tuple(value.value >> place & 1 for place in range(value.width))
        if isinstance(value, Bits):
            return self.net(value.name, value.low, value.width)
        if isinstance(value, Joined):
            return tuple(bit for part in reversed(value.parts) for bit in self._own(part))
        if isinstance(value, Word):
            return self._opaque(f"word {value.name}", [self._own(value.address)], self._netlist.width(value))
        if value.symbol == "signed":
            return self._own(value.operands[0])
        if value.symbol == "!":
            return self._opaque("!", [(self._any(self._own(value.operands[0])),)], 1)
        operands = list(value.operands)
        width = max(map(self._netlist.width, operands))
        signed = all(map(_is_signed, operands))
        kind = f"signed {value.symbol}" if signed else value.symbol
        return self._opaque(kind, [self._extended(of, width, signed=signed) for of in operands], 1)

    def _widened(self, value: Operator, width: int) -> tuple[Bit, ...]:
        """Return an operation whose operands are extended to so many bits, all by their sign or none."""
        choice = value.symbol == "?"
        operands = [self._extended(of, width, signed=_is_signed(value)) for of in value.operands[choice:]]
        if choice:
            return self._chosen(self._any(self._own(value.operands[0])), *operands)
        if value.symbol in {"+", "-", "*"}:
            return self._opaque(value.symbol, operands, width)
        return tuple(self._opaque(value.symbol, [(bit,) for bit in bits], 1)[0] for bits in zip(*operands, strict=True))

    def _extended(self, value: Expression, width: int, *, signed: bool) -> tuple[Bit, ...]:
        bits = self._own(value)
        return (*bits, *[bits[-1] if signed else 0] * (width - len(bits)))

    def _opaque(self, kind: str, operands: Sequence[tuple[Bit, ...]], width: int) -> tuple[Bit, ...]:
        return tuple(self._bit(BitSource(kind, place, tuple(operands))) for place in range(width))

    def _any(self, bits: tuple[Bit, ...]) -> Bit:
        return bits[0] if len(bits) == 1 else self._opaque("|", [bits], 1)[0]

    def _chosen(self, select: Bit, yes: tuple[Bit, ...], no: tuple[Bit, ...]) -> tuple[Bit, ...]:
        def one(a: Bit, b: Bit) -> Bit:
            return a if a == b else self._bit(BitSource("?", 0, ((select,), (a,), (b,))))

        if select < 2:
            return yes if select else no
        return tuple(map(one, yes, no))


def _is_signed(value: Expression) -> bool:
    """Whether an expression is extended by its sign."""
    if not isinstance(value, Operator) or value.symbol == "!" or value.symbol in _COMPARED:
        return False
    if value.symbol == "signed":
        return True
    operands = value.operands[value.symbol == "?" :]
    return (value.symbol == "~" or len(operands) > 1) and all(map(_is_signed, operands))
