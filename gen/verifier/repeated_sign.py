"""Proves that the bits above a result repeat its sign, or are 0, at every clock: bit by bit, through all modules.

Two bits are the same if they are the same logic of the same bits. If they are bits of registers, they must be the same
before the first clock, and what each of them takes over at a clock must be the same, provided that they are now: this
is induction over the clocks. If both are choices by the same bit, what is chosen from must be the same on either side::

    m_axis_tdata[11] == m_axis_tdata[10]
      register o_data[11] == o_data[10]                 both 0 before the first clock
        at a clock: full ? o_next[11] : code[10]  ==  full ? o_next[10] : code[10]
          register o_next[11] == o_next[10]             ..

Whatever else there is in the core may hold anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from sosmith.gen.verifier.certificate_file import PortEntry
from sosmith.gen.verifier.graph import require
from sosmith.gen.verifier.parallel.netlist import Driver, Netlist, flattened
from sosmith.gen.verifier.parallel.text import (
    Bits,
    Choice,
    Expression,
    Joined,
    Load,
    Module,
    Number,
    Operator,
    Statement,
    Word,
)

_OUTPUT = "m_axis_tdata"
_WIDENED = frozenset({"+", "-", "*", "&", "|", "^", "~", "?"})
_COMPARED = frozenset({"==", "!=", "<", ">", "<=", ">="})

_Bit = int
"""Number of what a bit is; 0 and 1 are the constants."""


class _Made(NamedTuple):
    """What a bit is: bit `place` of what `kind`, the name of a net or an operator, makes of the operands' bits."""

    kind: str
    place: int = 0
    operands: tuple[tuple[_Bit, ...], ...] = ()


def check_signs(modules: dict[str, Module], port: PortEntry, clock: str) -> None:
    """Prove that what `m_axis_tdata` has above the bits of a result is its sign again, or 0.

    Parameters
    ----------
    modules : dict of str to Module
        All modules of the core, the top first.
    port : PortEntry
        The output.
    clock : str
        The clock of all registers.

    Raises
    ------
    RejectedError
        If a bit is another one, or this is not found.
    """
    netlist = flattened({name: _without_parts(module) for name, module in modules.items()}, clock)
    logic = _BitLogic(netlist)
    width = netlist.widths[_OUTPUT]
    wanted = -(-port.bits // 8) * 8
    require(width == wanted, f"{_OUTPUT} must have {wanted} bits, not {width}")
    bits, sign = logic.net(_OUTPUT), port.bits - 1
    for place in range(port.bits, width):
        what = f"the sign, bit {sign}," if port.signed else "0"
        same = _same(logic, bits[place], bits[sign] if port.signed else 0)
        require(same, f"bit {place} of {_OUTPUT} must be {what} at every clock, not another value")


def _without_parts(module: Module) -> Module:
    """Let registers that are loaded in parts hold anything at any time."""

    def parts(statements: Sequence[Statement]) -> set[str]:
        found = set()
        for statement in statements:
            if isinstance(statement, Choice):
                found |= parts((*statement.yes, *statement.no))
            elif isinstance(statement.target, Bits) and statement.target.width is not None:
                found.add(statement.target.name)
        return found

    names = set().union(*(parts(statements) for _, statements in module.clocked))
    return replace(
        module,
        registers={name: first for name, first in module.registers.items() if name not in names},
        clocked=[(clock, statements) for clock, statements in module.clocked if not parts(statements)],
    )


def _same(logic: _BitLogic, a: _Bit, b: _Bit) -> bool:
    """Whether two bits are proven to be the same at every clock; the second may be a constant."""
    taken: set[tuple[_Bit, _Bit]] = set()
    goals = [(a, b)]
    while goals:
        a, b = pair = goals.pop()
        if a == b or pair in taken:
            continue
        made, other = logic.made[a], logic.made[b]
        if made.kind == "?" and (b < 2 or (other.kind == "?" and made.operands[0] == other.operands[0])):
            sides = [(b,), (b,)] if b < 2 else other.operands[1:]
            goals += [(x, y) for (x,), (y,) in zip(made.operands[1:], sides, strict=True)]
            continue
        first = b if b < 2 else logic.first(b)
        if first is None or logic.first(a) != first:
            return False
        taken.add(pair)
        goals.append((logic.after(a), b if b < 2 else logic.after(b)))
    return True


class _BitLogic:
    """The bits of all nets of a core within one clock: the same logic of the same bits has the same number."""

    def __init__(self, netlist: Netlist) -> None:
        self._netlist = netlist
        self.made: list[_Made] = []
        self._numbers: dict[_Made, _Bit] = {}
        for value in (0, 1):
            self._bit(_Made("", value))
        self._driven: dict[tuple[str, int], tuple[_Bit, ...]] = {}
        self._open: set[tuple[str, int]] = set()

    def first(self, bit: _Bit) -> int | None:
        """Return what a bit of a register is before the first clock; None if that is not said, or it is no such bit."""
        kind, place, operands = self.made[bit]
        register = None if operands else self._netlist.registers.get(kind)
        return None if register is None or register.first is None else register.first >> place & 1

    def after(self, bit: _Bit) -> _Bit:
        """Return what a bit of a register takes over at a clock."""
        register = self._netlist.registers[self.made[bit].kind]
        return self._loaded(register.statements, self.net(register.name))[self.made[bit].place]

    def net(self, name: str, low: int = 0, width: int | None = None) -> tuple[_Bit, ...]:
        """Return bits of a net, the lowest first; what nothing drives is a bit of its own.

        Raises
        ------
        RejectedError
            If it depends on itself.
        """
        end = self._netlist.widths[name] if width is None else low + width
        bits = {place: self._bit(_Made(name, place)) for place in range(low, end)}
        for index, driver in enumerate(self._netlist.drivers.get(name, [])):
            first, last = max(low, driver.low), min(end, driver.low + driver.width)
            if first < last:
                value = self._driver(name, index, driver)
                bits |= {place: value[place - driver.low] for place in range(first, last)}
        return tuple(bits.values())

    def _driver(self, name: str, index: int, driver: Driver) -> tuple[_Bit, ...]:
        key = name, index
        if key not in self._driven:
            require(key not in self._open, f"{name} must not depend on itself within a clock")
            self._open.add(key)
            end, value = driver.start + driver.width, driver.value
            bits = self._value(value, max(end, self._netlist.width(value)))
            self._driven[key] = bits[driver.start : end]
        return self._driven[key]

    def _bit(self, made: _Made) -> _Bit:
        if made not in self._numbers:
            self._numbers[made] = len(self.made)
            self.made.append(made)
        return self._numbers[made]

    def _loaded(self, statements: Sequence[Statement], held: tuple[_Bit, ...]) -> tuple[_Bit, ...]:
        """Return what a register holds after statements."""
        for statement in statements:
            if isinstance(statement, Load):
                held = self._value(statement.value, max(len(held), self._netlist.width(statement.value)))[: len(held)]
            else:
                yes, no = (self._loaded(part, held) for part in (statement.yes, statement.no))
                held = self._chosen(self._any(self._own(statement.condition)), yes, no)
        return held

    # Expressions.

    def _own(self, value: Expression) -> tuple[_Bit, ...]:
        return self._value(value, self._netlist.width(value))

    def _value(self, value: Expression, width: int) -> tuple[_Bit, ...]:
        """Return an expression in so many bits, not less than its own."""
        if isinstance(value, Operator) and value.symbol in _WIDENED and len(value.operands) > (value.symbol != "~"):
            return self._widened(value, width)
        bits = self._plain(value)
        return (*bits, *[bits[-1] if _is_signed(value) else 0] * (width - len(bits)))

    def _plain(self, value: Expression) -> tuple[_Bit, ...]:
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

    def _widened(self, value: Operator, width: int) -> tuple[_Bit, ...]:
        """Return an operation whose operands are extended to so many bits, all by their sign or none."""
        choice = value.symbol == "?"
        operands = [self._extended(of, width, signed=_is_signed(value)) for of in value.operands[choice:]]
        if choice:
            return self._chosen(self._any(self._own(value.operands[0])), *operands)
        if value.symbol in {"+", "-", "*"}:
            return self._opaque(value.symbol, operands, width)
        return tuple(self._opaque(value.symbol, [(bit,) for bit in bits], 1)[0] for bits in zip(*operands, strict=True))

    def _extended(self, value: Expression, width: int, *, signed: bool) -> tuple[_Bit, ...]:
        bits = self._own(value)
        return (*bits, *[bits[-1] if signed else 0] * (width - len(bits)))

    def _opaque(self, kind: str, operands: Sequence[tuple[_Bit, ...]], width: int) -> tuple[_Bit, ...]:
        return tuple(self._bit(_Made(kind, place, tuple(operands))) for place in range(width))

    def _any(self, bits: tuple[_Bit, ...]) -> _Bit:
        return bits[0] if len(bits) == 1 else self._opaque("|", [bits], 1)[0]

    def _chosen(self, select: _Bit, yes: tuple[_Bit, ...], no: tuple[_Bit, ...]) -> tuple[_Bit, ...]:
        def one(a: _Bit, b: _Bit) -> _Bit:
            return a if a == b else self._bit(_Made("?", 0, ((select,), (a,), (b,))))

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
