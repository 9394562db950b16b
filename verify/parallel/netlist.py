"""Puts the modules of a core together: nets with what drives them, registers and memories, in one flat list.

The name of a net inside an instance is ``instance.net``; the nets of the top have no prefix.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from sosmith.verify.graph import require
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


@dataclass(frozen=True)
class Driver:
    """Bits of a net from `low` on, and what they are: bits of an expression from `start` on."""

    low: int
    width: int
    value: Expression
    start: int


@dataclass(frozen=True)
class Register:
    """A register: what it holds before the first clock, None if that is not said, and what is executed at each."""

    name: str
    width: int
    first: int | None
    statements: tuple[Statement, ...]


@dataclass(frozen=True)
class Memory:
    """A memory: its words before the first clock, and what is executed at each.

    `unchecked` says that it may read anything at the clock at which that word is written.
    """

    name: str
    width: int
    first: tuple[int, ...]
    statements: tuple[Statement, ...]
    unchecked: bool = False


@dataclass
class Netlist:
    """A core in one piece.

    Attributes
    ----------
    ports : dict of str to str
        Direction of each port.
    widths : dict of str to int
        Width of each net.
    drivers : dict of str to list of Driver
        What drives each net that is neither a register nor an input.
    registers : dict of str to Register
    memories : dict of str to Memory
    inlets : set of str
        Nets that are input ports of instances.
    fields : dict of str to str
        Of a register that holds some bits of one in the text, which is loaded in parts or taken apart in
        `sosmith.verify.parallel.split`, the name of that.
    """

    ports: dict[str, str]
    widths: dict[str, int] = field(default_factory=dict)
    drivers: dict[str, list[Driver]] = field(default_factory=dict)
    registers: dict[str, Register] = field(default_factory=dict)
    memories: dict[str, Memory] = field(default_factory=dict)
    inlets: set[str] = field(default_factory=set)
    fields: dict[str, str] = field(default_factory=dict)

    def add_field(self, name: str, field: Register, low: int) -> None:
        """Add the register that holds the bits of the net `name` from `low` on."""
        require(field.name not in self.widths, f"{field.name} must be the name of one net, not of two")
        self.registers[field.name] = field
        self.widths[field.name] = field.width
        self.fields[field.name] = self.fields.get(name, name)
        self.drivers.setdefault(name, []).append(Driver(low, field.width, Bits(field.name), 0))

    def with_input(self, name: str) -> Netlist:
        """Return the netlist with a net that is an input, in place of what drives it."""
        drivers = {other: own for other, own in self.drivers.items() if other != name}
        return replace(self, ports={**self.ports, name: "input"}, drivers=drivers)

    def holder(self, name: str) -> str | None:
        """Return the register that a net is, or whose bits it has below constant ones; None for others."""
        if name in self.registers:
            return name
        drivers = [driver for driver in self.drivers.get(name, ()) if not isinstance(driver.value, Number)]
        if len(drivers) == 1 and drivers[0].low == 0:
            value = drivers[0].value
            if isinstance(value, Bits) and value == Bits(value.name) and drivers[0].width == self.widths[value.name]:
                return value.name if value.name in self.registers else None
        return None

    def width(self, value: Expression) -> int:
        """Return the width that an expression has by itself, in bits."""
        if isinstance(value, Number):
            return value.width
        if isinstance(value, Bits):
            return self.widths[value.name] if value.width is None else value.width
        if isinstance(value, Word):
            return self.memories[value.name].width
        if isinstance(value, Joined):
            return sum(self.width(part) for part in value.parts)
        if value.symbol == "?":
            return max(self.width(side) for side in value.operands[1:])
        if value.symbol in {"==", "!=", "<", ">", "<=", ">=", "!"}:
            return 1
        if value.symbol in {"&", "|", "^"} and len(value.operands) == 1:
            return 1
        return max(self.width(operand) for operand in value.operands)


def flattened(modules: Mapping[str, Module], clock: str) -> Netlist:
    """Put modules together; everything must be clocked by the port `clock` of the first, which is the top.

    Raises
    ------
    RejectedError
        If something is connected to what does not exist, driven twice, or clocked otherwise.
    """
    top = next(iter(modules.values()))
    netlist = Netlist(dict(top.ports))
    flattening = _Flattening(modules, netlist, clock)
    flattening.add(top, "", {clock: clock})
    for register in netlist.registers.values():
        flattening.check_statements(register.statements)
    for memory in netlist.memories.values():
        flattening.check_statements(memory.statements)
    for name, drivers in netlist.drivers.items():
        drivers.sort(key=lambda driver: driver.low)
        ends = [0, *(driver.low + driver.width for driver in drivers)]
        apart = all(driver.low >= end for driver, end in zip(drivers, ends, strict=False))
        only = name not in netlist.registers and netlist.ports.get(name) != "input"
        require(apart and only, f"every bit of {name} must be driven once, not twice")
    return netlist


def _apart(executed: tuple[Statement, ...]) -> list[tuple[Statement, ...]]:
    """Split a process that does nothing but load registers, each as a whole and once: several processes do the same."""
    loaded = {
        statement.target.name
        for statement in executed
        if isinstance(statement, Load) and isinstance(statement.target, Bits) and statement.target.width is None
    }
    return [(statement,) for statement in executed] if len(loaded) == len(executed) else [executed]


class _Flattening:
    """Adds modules to a netlist, one inside the other."""

    def __init__(self, modules: Mapping[str, Module], netlist: Netlist, clock: str) -> None:
        self._modules, self._netlist, self._clock = modules, netlist, clock

    def add(self, module: Module, prefix: str, clocks: Mapping[str, str], depth: int = 0) -> None:
        """Add a module; `clocks` are those of its nets that are the clock."""
        require(depth < 10, "modules must not be nested deeper than ten")
        netlist = self._netlist
        statements: dict[str, tuple[Statement, ...]] = {}
        fields: dict[str, list[Bits]] = {}
        for clock, executed in ((clock, part) for clock, whole in module.clocked for part in _apart(whole)):
            require(clock in clocks, f"registers must be clocked by {self._clock}, not {prefix}{clock}")
            targets = {_shown(target): target for target in _targets(executed)}
            require(len(targets) == 1, f"a process must load one register, not {', '.join(sorted(targets))}")
            ((name, loaded),) = targets.items()
            require(name not in statements, f"{prefix}{name} must be loaded in one process, not several")
            statements[name] = executed
            if isinstance(loaded, Bits) and loaded.width is not None:
                fields.setdefault(loaded.name, []).append(loaded)
        for name in module.contents:
            require(name in module.depths, f"{prefix}{name} must be a memory to be given words")
        for name, width in module.widths.items():
            known = prefix + name in netlist.widths or prefix + name in netlist.memories
            require(not known, f"{prefix}{name} must be the name of one net, not of two")
            if name in module.depths:
                continue
            netlist.widths[prefix + name] = width
            if name in fields:
                self._add_fields(module, name, prefix, fields[name], statements)
            elif name in module.registers:
                require(name in statements, f"the register {prefix}{name} must be loaded somewhere")
                netlist.registers[prefix + name] = Register(
                    prefix + name, width, module.registers[name], _prefixed_all(statements.pop(name), prefix)
                )
        for name, depth_ in module.depths.items():
            content = module.contents.get(name, {})
            given = len(content) == depth_ and sorted(content) == list(range(depth_))
            require(given, f"all {depth_} words of {prefix}{name} must be given")
            netlist.memories[prefix + name] = Memory(
                prefix + name,
                module.widths[name],
                tuple(content[k] for k in range(depth_)),
                _prefixed_all(statements.pop(name, ()), prefix),
                name in module.unchecked,
            )
        require(not statements, f"a process must load a register, not {', '.join(sorted(statements))}")
        for target, value in module.assigns:
            self._drive(_prefixed(target, prefix), _prefixed(value, prefix))
        for kind, name, ports in module.instances:
            self._instance(kind, f"{prefix}{name}.", prefix, ports, clocks, depth)

    def _add_fields(
        self,
        module: Module,
        name: str,
        prefix: str,
        fields: Sequence[Bits],
        statements: dict[str, tuple[Statement, ...]],
    ) -> None:
        """Add the registers that one is made of, which is loaded in parts."""
        require(name in module.registers, f"what is loaded must be a register, not {prefix}{name}")
        netlist, first, end = self._netlist, module.registers[name], 0
        for field_ in sorted(fields, key=lambda field_: field_.low):
            width, own = field_.width or 1, prefix + _shown(field_)
            require(field_.low == end, f"every bit of {prefix}{name} must be loaded in one process")
            end += width
            value = None if first is None else first >> field_.low & ((1 << width) - 1)
            executed = retargeted(_prefixed_all(statements.pop(_shown(field_)), prefix), own)
            netlist.add_field(prefix + name, Register(own, width, value, executed), field_.low)
        require(end == module.widths[name], f"every bit of {prefix}{name} must be loaded in one process")

    def _instance(
        self,
        kind: str,
        inside: str,
        outside: str,
        ports: Mapping[str, Expression],
        clocks: Mapping[str, str],
        depth: int,
    ) -> None:
        require(kind in self._modules, f"the module {kind} of {inside[:-1]} must be in the text")
        module = self._modules[kind]
        require(
            set(ports) == set(module.ports),
            f"the ports {', '.join(module.ports)} of {inside[:-1]} must all be connected, not {', '.join(ports)}",
        )
        passed = {
            port: port for port, value in ports.items() if isinstance(value, Bits) and value == Bits(value.name)
            and value.name in clocks and module.ports[port] == "input"
        }  # fmt: skip
        self.add(module, inside, passed, depth + 1)
        for port, direction in module.ports.items():
            value = _prefixed(ports[port], outside)
            own = Bits(inside + port)
            self._check_names(value)
            if direction == "input":
                self._netlist.inlets.add(own.name)
                self._drive(own, value)
            else:
                self._drive(value, own)

    def check_statements(self, statements: Sequence[Statement]) -> None:
        """Check that all names in statements are declared, with the bits that are used."""
        for statement in statements:
            if isinstance(statement, Load):
                self._check_names(statement.target)
                self._check_names(statement.value)
            else:
                self._check_names(statement.condition)
                self.check_statements((*statement.yes, *statement.no))

    def _drive(self, target: Expression, value: Expression) -> None:
        """Let `value` drive the bits of `target`: it is cut, or extended, to their number."""
        self._check_names(target)
        self._check_names(value)
        start = 0
        parts = target.parts if isinstance(target, Joined) else (target,)
        for part in reversed(parts):
            require(isinstance(part, Bits), "what is assigned must be bits of nets")
            assert isinstance(part, Bits)
            width = self._netlist.width(part)
            self._netlist.drivers.setdefault(part.name, []).append(Driver(part.low, width, value, start))
            start += width

    def _check_names(self, value: Expression) -> None:
        if isinstance(value, Bits):
            widths = self._netlist.widths
            require(value.name in widths, f"{value.name} must be declared to be used")
            end = value.low + (value.width or 1)
            require(end <= widths[value.name], f"{value.name} must have {end} bits, not {widths[value.name]}")
        elif isinstance(value, Word):
            require(value.name in self._netlist.memories, f"{value.name} must be declared to be used")
            self._check_names(value.address)
        elif isinstance(value, Joined):
            for part in value.parts:
                self._check_names(part)
        elif isinstance(value, Operator):
            for operand in value.operands:
                self._check_names(operand)


def _targets(statements: Sequence[Statement]) -> list[Bits | Word]:
    targets: list[Bits | Word] = []
    for statement in statements:
        if isinstance(statement, Load):
            targets.append(statement.target)
        else:
            targets += [*_targets(statement.yes), *_targets(statement.no)]
    return targets


def _shown(target: Bits | Word) -> str:
    """Return the name of what is loaded; of a memory, without the address."""
    if isinstance(target, Word) or target.width is None:
        return target.name
    return bits_name(target.name, target.low, target.width)


def bits_name(name: str, low: int, width: int) -> str:
    """Return the name of a register for bits of another one."""
    return f"{name}[{low + width - 1}:{low}]" if width > 1 else f"{name}[{low}]"


def retargeted(statements: Sequence[Statement], name: str) -> tuple[Statement, ...]:
    """Return statements that load the register `name` with what they load now."""
    return tuple(
        Load(Bits(name), statement.value)
        if isinstance(statement, Load)
        else Choice(statement.condition, retargeted(statement.yes, name), retargeted(statement.no, name))
        for statement in statements
    )


def _prefixed(value: Expression, prefix: str) -> Expression:
    """Return an expression of nets of the instance with this prefix."""
    if isinstance(value, Bits):
        return replace(value, name=prefix + value.name)
    if isinstance(value, Word):
        return Word(prefix + value.name, _prefixed(value.address, prefix))
    if isinstance(value, Joined):
        return Joined(tuple(_prefixed(part, prefix) for part in value.parts))
    if isinstance(value, Operator):
        return Operator(value.symbol, tuple(_prefixed(operand, prefix) for operand in value.operands))
    return value


def _prefixed_all(statements: Sequence[Statement], prefix: str) -> tuple[Statement, ...]:
    prefixed: list[Statement] = []
    for statement in statements:
        if isinstance(statement, Load):
            target = _prefixed(statement.target, prefix)
            assert isinstance(target, Bits | Word)
            prefixed.append(Load(target, _prefixed(statement.value, prefix)))
        else:
            prefixed.append(
                Choice(
                    _prefixed(statement.condition, prefix),
                    _prefixed_all(statement.yes, prefix),
                    _prefixed_all(statement.no, prefix),
                )
            )
    return tuple(prefixed)
