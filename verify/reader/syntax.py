"""Modules of a core as they are written: nets, assignments, registers, memories and instances."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Number:
    """A constant: a value, and its width in bits."""

    value: int
    width: int


@dataclass(frozen=True)
class Bits:
    """Bits of a net, from `low` on; without a width, all of it."""

    name: str
    low: int = 0
    width: int | None = None


@dataclass(frozen=True)
class Word:
    """A word of a memory."""

    name: str
    address: Expression


@dataclass(frozen=True)
class Joined:
    """A concatenation; the first part is the highest."""

    parts: tuple[Expression, ...]


@dataclass(frozen=True)
class Operator:
    """An operator with its operands.

    `symbol` is ``signed``, ``?``, a binary operator, or ``~``, ``!``, ``&``, ``|`` with one operand.
    """

    symbol: str
    operands: tuple[Expression, ...]


Expression = Number | Bits | Word | Joined | Operator


@dataclass(frozen=True)
class Load:
    """A non-blocking assignment."""

    target: Bits | Word
    value: Expression


@dataclass(frozen=True)
class Choice:
    """A statement ``if``."""

    condition: Expression
    yes: tuple[Statement, ...]
    no: tuple[Statement, ...]


Statement = Load | Choice


@dataclass
class Module:
    """A module as written.

    Attributes
    ----------
    ports : dict of str to str
        Direction of each port.
    widths : dict of str to int
        Width of each net, and of a word of each memory.
    registers : dict of str to int or None
        What each register holds before the first clock; None if that is not said.
    depths : dict of str to int
        Number of words of each memory.
    kept : set of str
        Nets that stay through synthesis.
    unchecked : set of str
        Memories that may read anything at the clock at which that word is written.
    contents : dict of str to dict of int to int
        What the words of each memory hold before the first clock.
    assigns : list
        Targets and expressions.
    clocked : list
        Clock, and the statements executed at its rising edge.
    instances : list
        Module, name, and the expression at each port.
    """

    ports: dict[str, str] = field(default_factory=dict)
    widths: dict[str, int] = field(default_factory=dict)
    registers: dict[str, int | None] = field(default_factory=dict)
    depths: dict[str, int] = field(default_factory=dict)
    kept: set[str] = field(default_factory=set)
    unchecked: set[str] = field(default_factory=set)
    contents: dict[str, dict[int, int]] = field(default_factory=dict)
    assigns: list[tuple[Expression, Expression]] = field(default_factory=list)
    clocked: list[tuple[str, tuple[Statement, ...]]] = field(default_factory=list)
    instances: list[tuple[str, str, dict[str, Expression]]] = field(default_factory=list)

    def copy(self) -> Module:
        """Return a module with the same expressions and statements, which do not change, in lists of its own."""
        return Module(
            ports=dict(self.ports),
            widths=dict(self.widths),
            registers=dict(self.registers),
            depths=dict(self.depths),
            kept=set(self.kept),
            unchecked=set(self.unchecked),
            contents={name: dict(words) for name, words in self.contents.items()},
            assigns=list(self.assigns),
            clocked=list(self.clocked),
            instances=[(inside, name, dict(ports)) for inside, name, ports in self.instances],
        )
