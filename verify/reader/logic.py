"""What a module does at a clock, bit by bit: the meaning that IEEE 1800 gives to what was read.

Registers, inputs, outputs of instances and words of memories are variables. What leaves is a word of gates: the next
content of each register, each output, each input of an instance, and what is written to a memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.reader.gates import HIGH, LOW, Gates, constant, extended
from sosmith.verify.reader.gates import Word as Literals
from sosmith.verify.reader.syntax import (
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
from sosmith.verify.reader.widths import is_signed, width_of

UNKNOWN = "x"
"""The variable of all bits that are x."""
_CONTEXT = frozenset({"+", "-", "*", "&", "|", "^"})


class Write(NamedTuple):
    """What is written to a memory at a clock, if it is enabled."""

    enable: int
    address: tuple[int, ...]
    data: tuple[int, ...]


class Stored(NamedTuple):
    """A memory: its first words, and what is written."""

    width: int
    first: tuple[int, ...]
    writes: tuple[Write, ...]


class RegisterLogic(NamedTuple):
    """A register: what it holds next, and before the first clock, which is None if that is not said."""

    next: tuple[int, ...]
    first: int | None


@dataclass
class Logic:
    """What a module does at a clock.

    Attributes
    ----------
    ports : dict of str to str
        Direction and width of each port.
    clocks : set of str
        Inputs that registers and memories are clocked by.
    outputs : dict of str to tuple of int
        Literals of each output.
    registers : dict of str to RegisterLogic
    memories : dict of str to Stored
    instances : dict of str to str
        The module of each instance.
    given : dict of str to tuple of int
        Literals of each input of an instance, as ``instance.port``.
    """

    ports: dict[str, str] = field(default_factory=dict)
    clocks: set[str] = field(default_factory=set)
    outputs: dict[str, tuple[int, ...]] = field(default_factory=dict)
    registers: dict[str, RegisterLogic] = field(default_factory=dict)
    memories: dict[str, Stored] = field(default_factory=dict)
    instances: dict[str, str] = field(default_factory=dict)
    given: dict[str, tuple[int, ...]] = field(default_factory=dict)


def port_of(direction: str, width: int) -> str:
    """Return what a port is, in words."""
    return f"an {direction} of {width} bits"


def word_at(gates: Gates, memory: str, address: Sequence[int], width: int) -> Literals:
    """Return the variables of the word of a memory at an address."""
    return [gates.variable(("word", memory, shortest(address), place)) for place in range(width)]


def shortest(address: Sequence[int]) -> tuple[int, ...]:
    """Return an address without zeros above it."""
    used = len(address)
    while used and address[used - 1] == LOW:
        used -= 1
    return tuple(address[:used])


def logic_of(module: Module, directions: dict[str, dict[str, str]], gates: Gates) -> Logic:
    """Return what a module does; `directions` are those of the ports of all modules.

    Raises
    ------
    RejectedError
        If a net depends on itself.
    """
    return _Reading(module, directions, gates).logic()


class _Reading:
    def __init__(self, module: Module, directions: dict[str, dict[str, str]], gates: Gates) -> None:
        self._module, self._directions, self._gates = module, directions, gates
        self._drivers: dict[tuple[str, int], tuple[int, int]] = {}
        self._assigned: dict[int, Literals] = {}
        self._open: set[int] = set()
        self._variables: dict[tuple[str, int], tuple[object, ...]] = {}
        for number, (target, _) in enumerate(module.assigns):
            for place, bit in enumerate(self._places(target)):
                self._drivers[bit] = (number, place)
        for kind, name, ports in module.instances:
            for port, value in ports.items():
                if directions[kind][port] == "output":
                    for place, bit in enumerate(self._places(value)):
                        self._variables[bit] = ("instance", name, port, place)

    def logic(self) -> Logic:
        module = self._module
        logic = Logic(ports={name: port_of(kind, module.widths[name]) for name, kind in module.ports.items()})
        logic.clocks = {clock for clock, _ in module.clocked}
        for name, kind in module.ports.items():
            if kind == "output":
                logic.outputs[name] = tuple(self._whole(Bits(name)))
        following = {name: self._whole(Bits(name)) for name in module.registers}
        writes: dict[str, list[Write]] = {name: [] for name in module.depths}
        for _, statements in module.clocked:
            own = {name: following[name] for name in self._loaded(statements)}
            following |= self._executed(statements, HIGH, own, writes)
        logic.registers = {
            name: RegisterLogic(tuple(following[name]), first) for name, first in module.registers.items()
        }
        for name, depth in module.depths.items():
            first = tuple(module.contents[name][place] for place in range(depth))
            logic.memories[name] = Stored(module.widths[name], first, tuple(writes[name]))
        for kind, name, ports in module.instances:
            logic.instances[name] = kind
            for port, value in ports.items():
                if self._directions[kind][port] == "input":
                    logic.given[f"{name}.{port}"] = tuple(self._whole(value))
        return logic

    def _loaded(self, statements: Sequence[Statement]) -> set[str]:
        """Return the registers that statements load."""
        registers: set[str] = set()
        for statement in statements:
            if isinstance(statement, Choice):
                registers |= self._loaded((*statement.yes, *statement.no))
            elif isinstance(statement.target, Bits):
                registers.add(statement.target.name)
        return registers

    def _executed(
        self, statements: Sequence[Statement], when: int, following: dict[str, Literals], writes: dict[str, list[Write]]
    ) -> dict[str, Literals]:
        """Return what registers hold after statements that are executed if `when` is 1, and note what is written."""
        gates = self._gates
        for statement in statements:
            if isinstance(statement, Load):
                following = self._load(statement, when, following, writes)
                continue
            condition = gates.any_of(self._whole(statement.condition))
            yes = self._executed(statement.yes, gates.both(when, condition), following, writes)
            no = self._executed(statement.no, gates.both(when, condition ^ 1), following, writes)
            following = {
                name: [gates.chosen(condition, a, b) for a, b in zip(yes[name], no[name], strict=True)]
                for name in following
            }
        return following

    def _load(
        self, load: Load, when: int, following: dict[str, Literals], writes: dict[str, list[Write]]
    ) -> dict[str, Literals]:
        target, value = load.target, self._in_context(load.value, width_of(load.target, self._module))
        if isinstance(target, Word):
            writes[target.name].append(Write(when, shortest(self._whole(target.address)), tuple(value)))
            return following
        word = list(following[target.name])
        for bit, (_, place) in zip(value, self._places(target), strict=True):
            word[place] = bit
        return {**following, target.name: word}

    # Nets.

    def _places(self, target: Expression) -> list[tuple[str, int]]:
        """Return the bits of nets, the lowest first."""
        if isinstance(target, Joined):
            return [bit for part in reversed(target.parts) for bit in self._places(part)]
        if not isinstance(target, Bits):
            raise RejectedError(f"what is driven must be nets, not {target}")
        return [(target.name, target.low + place) for place in range(width_of(target, self._module))]

    def _bit(self, name: str, place: int) -> int:
        module, bit = self._module, (name, place)
        if name.startswith("?"):
            return self._gates.variable(UNKNOWN)
        if module.ports.get(name) == "input":
            return self._gates.variable(("input", name, place))
        if name in module.registers:
            return self._gates.variable(("register", name, place))
        if bit in self._variables:
            return self._gates.variable(self._variables[bit])
        require(bit in self._drivers, f"bit {place} of {name} must be driven to be used")
        number, part = self._drivers[bit]
        if number not in self._assigned:
            require(number not in self._open, f"{name} must not depend on itself within a clock")
            self._open.add(number)
            target, value = module.assigns[number]
            self._assigned[number] = self._in_context(value, width_of(target, module))
            self._open.discard(number)
        return self._assigned[number][part]

    # Expressions.

    def _in_context(self, value: Expression, width: int) -> Literals:
        """Return what is assigned to a target of `width` bits."""
        size = max(width, width_of(value, self._module))
        return self._sized(value, size, signed=is_signed(value))[:width]

    def _whole(self, value: Expression) -> Literals:
        """Return an expression as an operand of its own."""
        return self._sized(value, width_of(value, self._module), signed=is_signed(value))

    def _sized(self, value: Expression, size: int, *, signed: bool) -> Literals:
        """Return an expression in a context of `size` bits, at least its own width."""
        gates = self._gates
        if isinstance(value, Operator):
            if value.symbol == "?":
                select, yes, no = value.operands
                condition = gates.any_of(self._whole(select))
                sides = (self._sized(of, size, signed=signed) for of in (yes, no))
                return [gates.chosen(condition, a, b) for a, b in zip(*sides, strict=True)]
            if value.symbol == "~":
                return [bit ^ 1 for bit in self._sized(value.operands[0], size, signed=signed)]
            if value.symbol in _CONTEXT and len(value.operands) == 2:
                a, b = (self._sized(of, size, signed=signed) for of in value.operands)
                return operated(gates, value.symbol, a, b)
        return extended(self._own(value), size, signed=signed)

    def _own(self, value: Expression) -> Literals:
        """Return what no context reaches into."""
        if isinstance(value, Number):
            return constant(value.value, value.width)
        if isinstance(value, Bits):
            return [self._bit(*place) for place in self._places(value)]
        if isinstance(value, Word):
            return word_at(self._gates, value.name, self._whole(value.address), self._module.widths[value.name])
        if isinstance(value, Joined):
            return [bit for part in reversed(value.parts) for bit in self._whole(part)]
        if value.symbol == "signed":
            return self._whole(value.operands[0])
        if len(value.operands) == 1:
            return [reduced(self._gates, value.symbol, self._whole(value.operands[0]))]
        signed = all(is_signed(of) for of in value.operands)
        size = max(width_of(of, self._module) for of in value.operands)
        a, b = (self._sized(of, size, signed=signed) for of in value.operands)
        return [compared(self._gates, value.symbol, a, b, signed=signed)]


def operated(gates: Gates, symbol: str, a: Literals, b: Literals) -> Literals:
    """Join two words of one width to one of that width."""
    if symbol in {"+", "-", "*"}:
        return {"+": gates.sum_of, "-": gates.difference_of, "*": gates.product_of}[symbol](a, b)
    join = {"&": gates.both, "|": gates.either, "^": gates.differ}[symbol]
    return [join(one, other) for one, other in zip(a, b, strict=True)]


def reduced(gates: Gates, symbol: str, word: Literals) -> int:
    """Return ``!``, ``&``, ``|`` or ``^`` of all bits of a word."""
    if symbol == "!":
        return gates.any_of(word) ^ 1
    return {"&": gates.all_of, "|": gates.any_of, "^": gates.parity_of}[symbol](word)


def compared(gates: Gates, symbol: str, a: Literals, b: Literals, *, signed: bool) -> int:
    """Compare two words of one width."""
    if symbol in {"==", "!="}:
        return gates.equal(a, b) ^ (symbol == "!=")
    first, second = (a, b) if symbol in {"<", ">="} else (b, a)
    return gates.less(first, second, signed=signed) ^ (symbol in {"<=", ">="})
