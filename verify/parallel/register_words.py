"""Pairs of registers that are a memory of two words, put into its form.

::

    assign x_clear0 = clear & ~which;           assign x_write0 = x_write & ~x_write_address;
    assign x_clear1 = clear & which;            assign x_write1 = x_write & x_write_address;
    assign x_write = writes & ~clear;           .. address ? x_word1 : x_word0 ..
    if (x_clear0) x_word0 <= 0; else if (x_write0) x_word0 <= data;         and so for x_word1

At a clock, one word at most is loaded: that of `which` with 0 while `clear` is 1, that of `x_write_address` with the
data while `x_write` is. That is a memory, written at the address ``clear ? which : x_write_address``. Both registers
must be read nowhere else. A pair of which any of this is not so stays what it is: two registers, which hold no state
of two channels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from sosmith.verify.parallel.netlist import Driver, Memory, Netlist, Register
from sosmith.verify.reader.syntax import (
    Bits,
    Choice,
    Expression,
    Joined,
    Load,
    Number,
    Operator,
    Statement,
    Word,
)


def with_memories(netlist: Netlist) -> Netlist:
    """Return a netlist in which each pair of registers that are words of one memory is that memory."""
    for name in [name.removesuffix("_word0") for name in netlist.registers if name.endswith("_word0")]:
        memory = _memory(netlist, name)
        if memory is not None:
            netlist = _in_its_place(netlist, name, memory)
    return netlist


def _memory(netlist: Netlist, name: str) -> Memory | None:
    """Return the memory that two registers are, without its reading; None if they are none."""
    pair = [netlist.registers.get(f"{name}_word{k}") for k in range(2)]
    loads = [None if register is None else _loads(register) for register in pair]
    (one, other), (first, second) = pair, loads
    if one is None or other is None or first is None or second is None or f"{name}_memory" in netlist.memories:
        return None
    clear, write = _selected(netlist, first[0], second[0]), _selected(netlist, first[1], second[1])
    if clear is None or write is None or first[2] != second[2]:
        return None
    if not one.width == other.width == netlist.width(first[2]):
        return None
    if one.first is None or other.first is None or not _excludes(netlist, write[0], clear[0]):
        return None
    written = Load(
        Word(f"{name}_memory", Operator("?", (clear[0], clear[1], write[1]))),
        Operator("?", (clear[0], Number(0, one.width), first[2])),
    )
    executed = Choice(Operator("|", (clear[0], write[0])), (written,), ())
    return Memory(f"{name}_memory", one.width, (one.first, other.first), (executed,))


def _loads(register: Register) -> tuple[Bits, Bits, Expression] | None:
    """Return when a register is cleared, when it is loaded otherwise, and with what."""
    match register.statements:
        case (
            Choice(
                Bits(width=None) as clears,
                (Load(Bits() as cleared, Number(0, _)),),
                (Choice(Bits(width=None) as writes, (Load(Bits() as loaded, value),), ()),),
            ),
        ) if cleared == loaded == Bits(register.name):
            return clears, writes, value
    return None


def _selected(netlist: Netlist, first: Bits, second: Bits) -> tuple[Bits, Bits] | None:
    """Return the bit that two bits are while another one is 0, and while it is 1; and that other one."""
    match _driver(netlist, first), _driver(netlist, second):
        case Operator("&", (Bits() as both, inverse)), Operator("&", (Bits() as same, Bits() as where)):
            if (
                both == same
                and _inverse(netlist, inverse) == where
                and netlist.width(both) == netlist.width(where) == 1
            ):
                return both, where
    return None


def _excludes(netlist: Netlist, write: Bits, clear: Bits) -> bool:
    """Whether a bit is 0 while another one is 1."""
    match _driver(netlist, write):
        case Operator("&", (first, second)):
            return clear in (_inverse(netlist, first), _inverse(netlist, second))
    return False


def _inverse(netlist: Netlist, value: Expression) -> Bits | None:
    """Return the bit of which an expression is the inverse."""
    if isinstance(value, Bits):
        driver = _driver(netlist, value)
        return None if driver is None or isinstance(driver, Bits) else _inverse(netlist, driver)
    match value:
        case Operator("~" | "!", (Bits() as bit,)) if netlist.width(bit) == 1:
            return bit
    return None


def _driver(netlist: Netlist, bit: Bits) -> Expression | None:
    """Return the expression of one bit that drives a net of one bit."""
    drivers = netlist.drivers.get(bit.name, [])
    if bit != Bits(bit.name) or netlist.widths[bit.name] != 1 or len(drivers) != 1 or drivers[0].start:
        return None
    return drivers[0].value if netlist.width(drivers[0].value) == 1 else None


def _in_its_place(netlist: Netlist, name: str, memory: Memory) -> Netlist:
    """Return a netlist with a memory for two registers; the same one if these are read in any other way."""
    words = tuple(Bits(f"{name}_word{k}") for k in range(2))

    def read(value: Expression) -> Expression:
        match value:
            case Operator("?", (Bits() as address, high, low)) if (low, high) == words and netlist.width(address) == 1:
                return Word(memory.name, address)
            case Operator(symbol, operands):
                return Operator(symbol, tuple(map(read, operands)))
            case Joined(parts):
                return Joined(tuple(map(read, parts)))
            case Word(other, address):
                return Word(other, read(address))
        return value

    names = {word.name for word in words}
    changed = replace(
        netlist,
        widths={net: width for net, width in netlist.widths.items() if net not in names},
        drivers={
            net: [Driver(driver.low, driver.width, read(driver.value), driver.start) for driver in drivers]
            for net, drivers in netlist.drivers.items()
        },
        registers={
            net: replace(register, statements=_each(register.statements, read))
            for net, register in netlist.registers.items()
            if net not in names
        },
        memories={
            net: replace(other, statements=_each(other.statements, read)) for net, other in netlist.memories.items()
        }
        | {memory.name: memory},
    )
    return netlist if names & set(_names(changed)) else changed


def _each(statements: tuple[Statement, ...], change: Callable[[Expression], Expression]) -> tuple[Statement, ...]:
    """Return statements with each expression changed."""
    return tuple(
        Load(statement.target, change(statement.value))
        if isinstance(statement, Load)
        else Choice(change(statement.condition), _each(statement.yes, change), _each(statement.no, change))
        for statement in statements
    )


def _names(netlist: Netlist) -> Iterator[str]:
    """Yield the name of each net whose bits are used, or loaded, or driven."""
    yield from netlist.drivers
    for drivers in netlist.drivers.values():
        for driver in drivers:
            yield from _used(driver.value)
    for register in netlist.registers.values():
        for statement in register.statements:
            yield from _used_by(statement)
    for memory in netlist.memories.values():
        for statement in memory.statements:
            yield from _used_by(statement)


def _used_by(statement: Statement) -> Iterator[str]:
    if isinstance(statement, Load):
        yield from _used(statement.target)
        yield from _used(statement.value)
        return
    yield from _used(statement.condition)
    for inner in (*statement.yes, *statement.no):
        yield from _used_by(inner)


def _used(value: Expression) -> Iterator[str]:
    if isinstance(value, Bits):
        yield value.name
    elif isinstance(value, Word):
        yield from _used(value.address)
    elif isinstance(value, Joined | Operator):
        for part in value.parts if isinstance(value, Joined) else value.operands:
            yield from _used(part)
