"""Reads a whole text: its modules, each of them part of the top one, and how they are put together.

What tools could disagree on is refused here: which module is the top, what an instance is of, what drives a net.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import NamedTuple

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.reader.grammar import MAX_WORDS, Reader
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
from sosmith.verify.reader.tokens import Tokens
from sosmith.verify.reader.widths import width_of

_MAX_CHARACTERS = 1 << 28
_MAX_MODULES = 400
_MAX_INSTANCES = 1 << 12


class Source(NamedTuple):
    """A text that has been read.

    Attributes
    ----------
    text : str
        The text in one layout, without comments and attributes.
    modules : dict of str to Module
        Its modules, the top first.
    """

    text: str
    modules: dict[str, Module]


def read_source(text: str, top: str | None = None, *, unknowns: bool = True) -> Source:
    """Read a text whose top module is `top`, or else the only one that is in no other.

    A number of x bits is taken for a net that nothing drives, unless `unknowns` says no.

    Raises
    ------
    RejectedError
        If the text has anything that is not in the subset, or its modules are not put together in one way.
    """
    source = _parsed(text, top, unknowns)
    return Source(source.text, {name: module.copy() for name, module in source.modules.items()})


@lru_cache(maxsize=2)
def _parsed(text: str, top: str | None, unknowns: bool) -> Source:
    """Read a text, which every proof asks for again; what is kept is handed out as copies alone."""
    require(len(text) <= _MAX_CHARACTERS, f"the SystemVerilog must have at most {_MAX_CHARACTERS} characters")
    tokens = Tokens(text)
    modules: dict[str, Module] = {}
    printed: list[str] = []
    while tokens.peek():
        tokens.expect("module")
        name = tokens.name()
        require(name not in modules, f"module {name} must be written once, not twice")
        require(len(modules) < _MAX_MODULES, f"the SystemVerilog must have at most {_MAX_MODULES} modules")
        reader = Reader(tokens, name, unknowns=unknowns)
        try:
            modules[name] = reader.module()
        except RecursionError:
            raise RejectedError(f"expressions and statements of {name} must not be nested as deep as that") from None
        printed += reader.lines
    require(bool(modules), "the SystemVerilog must have a module")
    if top is None:
        placed = {inside for module in modules.values() for inside, _, _ in module.instances}
        top, *others = [name for name in modules if name not in placed] or [next(iter(modules))]
        require(not others, f"one module must be in no other, not {', '.join((top, *others))}")
    require(top in modules, f"the SystemVerilog must have a module {top}, not {', '.join(modules)}")
    _check_tree(modules, top)
    _check_size(modules, top)
    for name, module in modules.items():
        try:
            _check_nets(name, module, modules)
        except RecursionError:
            raise RejectedError(f"expressions and statements of {name} must not be nested as deep as that") from None
    _check_clocks(modules, top)
    rest = {name: module.copy() for name, module in modules.items() if name != top}
    return Source("".join(f"{line}\n" for line in printed), {top: modules[top], **rest})


def read_modules(text: str, top: str | None = None) -> dict[str, Module]:
    """Read all modules of a text without x, as `read_source`; the first is the top.

    Raises
    ------
    RejectedError
        As `read_source`.
    """
    return read_source(text, top, unknowns=False).modules


def _check_size(modules: Mapping[str, Module], top: str) -> None:
    """Check that all instances and memories together are not too many to be taken apart."""
    instances: dict[str, int] = {}
    words: dict[str, int] = {}

    def count(name: str) -> None:
        inside = [module for module, _, _ in modules[name].instances]
        for module in inside:
            if module not in instances:
                count(module)
        instances[name] = 1 + sum(instances[module] for module in inside)
        words[name] = sum(modules[name].depths.values()) + sum(words[module] for module in inside)

    count(top)
    for total, most, what in (
        (instances[top], _MAX_INSTANCES, "instances"),
        (words[top], MAX_WORDS, "words of memories"),
    ):
        require(total <= most, f"{top} must have at most {most} {what}, not {total}")


def _check_tree(modules: Mapping[str, Module], top: str) -> None:
    """Check that every instance is of a module that is there, and that all modules are in the top one."""
    placed: set[str] = set()
    waiting: list[tuple[str, tuple[str, ...]]] = [(top, (top,))]
    while waiting:
        name, above = waiting.pop()
        if name in placed:
            continue
        placed.add(name)
        for inside, instance, _ in modules[name].instances:
            require(inside in modules, f"{instance} must be of a module in the text, not of {inside}")
            require(inside not in above, f"{instance} must not be of {inside}, in which it is")
            waiting.append((inside, (*above, inside)))
    unused = sorted(modules.keys() - placed)
    require(not unused, f"every module must be part of {top}, not {', '.join(unused)}")


def _check_clocks(modules: Mapping[str, Module], top: str) -> None:
    """Check that the clock of every module is one input of the top module, handed down as it is."""
    clocks = {name: {clock for clock, _ in module.clocked} for name, module in modules.items()}
    for name in _from_below(modules, top):
        module = modules[name]
        for inside, instance, ports in module.instances:
            for clock in clocks[inside]:
                given = ports[clock]
                whole = isinstance(given, Bits) and given.width is None
                require(whole, f"the clock {clock} of {instance} must be a net, not computed or cut from one")
                assert isinstance(given, Bits)
                clocks[name].add(given.name)
        for clock in clocks[name]:
            require(module.ports.get(clock) == "input", f"the clock {clock} of {name} must be an input of it")
    require(len(clocks[top]) <= 1, f"{top} must have one clock, not {', '.join(sorted(clocks[top]))}")
    for name, module in modules.items():
        seen = sorted(clocks[name] & _looked_at(module, clocks))
        require(
            not seen,
            f"the clock {', '.join(seen)} of {name} must be nothing but a clock, not a value: what it is at its edge "
            "differs from tool to tool",
        )


def _looked_at(module: Module, clocks: Mapping[str, set[str]]) -> set[str]:
    """Return the nets that are in assignments and statements, or go to ports that are no clocks."""
    nets = set[str]()

    def look(one: Expression | Statement) -> None:
        match one:
            case Bits():
                nets.add(one.name)
            case Word():
                look(one.address)
            case Joined():
                for part in one.parts:
                    look(part)
            case Operator():
                for part in one.operands:
                    look(part)
            case Load():
                look(one.value)
                if isinstance(one.target, Word):
                    look(one.target.address)
            case Choice():
                look(one.condition)
                for statement in (*one.yes, *one.no):
                    look(statement)

    for _, value in module.assigns:
        look(value)
    for _, statements in module.clocked:
        for statement in statements:
            look(statement)
    for inside, _, ports in module.instances:
        for port, given in ports.items():
            if port not in clocks[inside]:
                look(given)
    return nets


def _from_below(modules: Mapping[str, Module], top: str) -> list[str]:
    """Return all modules, each behind all that are in it."""
    order: list[str] = []

    def place(name: str) -> None:
        if name not in order:
            for inside, _, _ in modules[name].instances:
                place(inside)
            order.append(name)

    place(top)
    return order


def _check_nets(name: str, module: Module, modules: Mapping[str, Module]) -> None:
    """Check what drives the nets of a module: each bit one thing, an input and a register nothing else."""
    driven: dict[str, int] = {}

    def drive(target: Expression) -> None:
        for part in target.parts if isinstance(target, Joined) else (target,):
            if not isinstance(part, Bits):
                raise RejectedError(f"what is driven in {name} must be nets, not {part}")
            require(
                part.name not in module.registers and module.ports.get(part.name) != "input",
                f"{part.name} of {name} must be a net to be driven, not a register or an input",
            )
            mask = _mask(part, module)
            require(not driven.get(part.name, 0) & mask, f"each bit of {part.name} in {name} must be driven once")
            driven[part.name] = driven.get(part.name, 0) | mask

    for target, value in module.assigns:
        drive(target)
        width_of(value, module)
    for inside, instance, ports in module.instances:
        other = modules[inside]
        require(
            sorted(ports) == sorted(other.ports),
            f"the ports of {instance} must be {', '.join(sorted(other.ports))}, not {', '.join(sorted(ports))}",
        )
        for port, value in ports.items():
            own, wanted = width_of(value, module), other.widths[port]
            require(own == wanted, f"the port {port} of {instance} must have {wanted} bits, not {own}")
            if other.ports[port] == "output":
                drive(value)
    loaded: dict[str, int] = {}
    for clock, statements in module.clocked:
        require(module.widths.get(clock) == 1, f"{clock} must be a net of one bit to be a clock in {name}")
        own_bits: dict[str, int] = {}
        for load in _loads(statements):
            width_of(load.value, module)
            if isinstance(load.target, Word):
                continue
            target = load.target
            require(target.name in module.registers, f"{target.name} of {name} must be a register to be loaded")
            own_bits[target.name] = own_bits.get(target.name, 0) | _mask(target, module)
        for register, mask in own_bits.items():
            require(not loaded.get(register, 0) & mask, f"each bit of {register} in {name} must be loaded at one place")
            loaded[register] = loaded.get(register, 0) | mask
    for register in module.registers:
        whole = (1 << module.widths[register]) - 1
        require(loaded.get(register, 0) == whole, f"each bit of {register} in {name} must be loaded at one place")
    read = _read(module, modules)
    for net in module.widths:
        if net in module.depths or net in module.registers or net.startswith("?") or module.ports.get(net) == "input":
            continue
        missing = read.get(net, 0) & ~driven.get(net, 0)
        require(not missing, f"each bit of {net} in {name} that is read must be driven")
    for memory, depth in module.depths.items():
        content = module.contents.get(memory, {})
        require(len(content) == depth, f"all {depth} words of {memory} must be given, not {len(content)}")


def _read(module: Module, modules: Mapping[str, Module]) -> dict[str, int]:
    """Bits of each net of a module that are read, or leave it."""
    read = {port: (1 << module.widths[port]) - 1 for port, kind in module.ports.items() if kind == "output"}

    def note(value: Expression) -> None:
        if isinstance(value, Bits):
            read[value.name] = read.get(value.name, 0) | _mask(value, module)
        elif isinstance(value, Word):
            note(value.address)
        elif not isinstance(value, Number):
            for part in value.parts if isinstance(value, Joined) else value.operands:
                note(part)

    def follow(statements: tuple[Statement, ...]) -> None:
        for statement in statements:
            if isinstance(statement, Choice):
                note(statement.condition)
                follow(statement.yes)
                follow(statement.no)
            else:
                note(statement.value)
                if isinstance(statement.target, Word):
                    note(statement.target.address)

    for _, value in module.assigns:
        note(value)
    for clock, statements in module.clocked:
        note(Bits(clock))
        follow(statements)
    for inside, _, ports in module.instances:
        for port, value in ports.items():
            if modules[inside].ports[port] == "input":
                note(value)
    return read


def _mask(bits: Bits, module: Module) -> int:
    width = module.widths[bits.name] if bits.width is None else bits.width
    return ((1 << width) - 1) << bits.low


def _loads(statements: tuple[Statement, ...]) -> Iterator[Load]:
    for statement in statements:
        if isinstance(statement, Choice):
            yield from _loads((*statement.yes, *statement.no))
        else:
            yield statement
