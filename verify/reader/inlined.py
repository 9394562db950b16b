"""Puts modules into the one that they are part of, and prints it: the same hardware without their borders.

::

    module top(..);                                 module top(..);
      wire [3:0] sum;                                 reg [3:0] sum = 4'h0;
      top_adder adder (.o(sum), .a(4'h1), ..);        wire [3:0] a;       assign a = 4'h1;
                                                      ..                  what the adder has
    module top_adder(o, a, ..);
      output [3:0] o;  reg [3:0] o = 4'h0;  ..

A net outside that is a port as a whole is one net with it. It has the name that it has in the top, if it is a port of
that; else that of the register which it is, or the one inside. A name that another net has already gets that of the
instance before it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from sosmith.verify.reader.source import Source, read_source
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

FUNCTIONS = ("sequencer", "program_memory", "word_memory", "multiply_accumulate", "result")
"""What a folded or serial core is made of."""


def inlined(source: Source, top: str) -> Source:
    """Return a text whose module `top` has in it what its instances of the modules ``top_function`` have.

    Other modules are left out, but for those that are still instances in it.
    """
    modules = source.modules
    merged = modules[top].copy()
    names = {f"{top}_{part}" for part in FUNCTIONS} & modules.keys()
    while (place := next((k for k, each in enumerate(merged.instances) if each[0] in names), None)) is not None:
        # Those that wait stay in it: what they are connected to is renamed with the rest.
        inside, name, ports = merged.instances.pop(place)
        merged = _joined(merged, modules[inside], name, ports)
    rest = _below(modules, {inside for inside, _, _ in merged.instances})
    if {top, *rest} == modules.keys():
        return source
    return read_source("".join([_printed(top, merged), *(_printed(name, modules[name]) for name in rest)]), top)


def _below(modules: Mapping[str, Module], names: set[str]) -> list[str]:
    """Return modules, and all that are in them."""
    reached: dict[str, None] = dict.fromkeys(sorted(names))
    for name in (waiting := list(reached)):
        for inside, _, _ in modules[name].instances:
            if inside not in reached:
                reached[inside] = None
                waiting.append(inside)
    return list(reached)


def _joined(whole: Module, part: Module, instance: str, ports: Mapping[str, Expression]) -> Module:
    """Add a module to the whole, and rename the nets of the whole that have better names inside."""
    taken = {*whole.widths, *(name for _, name, _ in whole.instances)}
    outside: dict[str, str] = {}
    nets = {
        port: value.name
        for port, value in ports.items()
        if isinstance(value, Bits) and value.width is None and not value.name.startswith("?")
    }
    for port, name in nets.items():
        if port in part.registers and part.ports[port] == "output" and name not in whole.ports and port not in taken:
            outside[name] = port
            taken.add(port)
    inside = {port: outside.get(name, name) for port, name in nets.items()}
    for net in part.widths:
        if net not in inside and not net.startswith("?"):
            name = net if net not in taken else f"{instance}_{net}"
            while name in taken:
                name += "_"
            taken.add(name)
            inside[net] = name
        elif net not in inside:
            inside[net] = f"?{instance}{net}"
    joined = _renamed(whole, outside)
    added = _renamed(part, inside)
    for port, value in ports.items():
        own, other = Bits(inside[port]), _named(value, outside)
        if own != other:
            joined.assigns.append((own, other) if part.ports[port] == "input" else (other, own))
    for name in ("widths", "registers", "depths", "contents"):
        getattr(joined, name).update(getattr(added, name))
    joined.unchecked |= added.unchecked
    for name in ("assigns", "clocked", "instances"):
        getattr(joined, name).extend(getattr(added, name))
    return joined


def _renamed(module: Module, names: Mapping[str, str]) -> Module:
    """Return a module whose nets and memories have other names."""

    def name(old: str) -> str:
        return names.get(old, old)

    return Module(
        ports={name(port): direction for port, direction in module.ports.items()},
        widths={name(net): width for net, width in module.widths.items()},
        registers={name(net): first for net, first in module.registers.items()},
        depths={name(net): depth for net, depth in module.depths.items()},
        unchecked={name(net) for net in module.unchecked},
        contents={name(net): dict(words) for net, words in module.contents.items()},
        assigns=[(_named(target, names), _named(value, names)) for target, value in module.assigns],
        clocked=[(name(clock), _statements(statements, names)) for clock, statements in module.clocked],
        instances=[
            (inside, instance, {port: _named(value, names) for port, value in ports.items()})
            for inside, instance, ports in module.instances
        ],
    )


def _named(value: Expression, names: Mapping[str, str]) -> Expression:
    match value:
        case Bits():
            return replace(value, name=names.get(value.name, value.name))
        case Word():
            return Word(names.get(value.name, value.name), _named(value.address, names))
        case Joined():
            return Joined(tuple(_named(part, names) for part in value.parts))
        case Operator():
            return Operator(value.symbol, tuple(_named(part, names) for part in value.operands))
    return value


def _statements(statements: Sequence[Statement], names: Mapping[str, str]) -> tuple[Statement, ...]:
    renamed: list[Statement] = []
    for one in statements:
        if isinstance(one, Load):
            target = _named(one.target, names)
            assert isinstance(target, Bits | Word)
            renamed.append(Load(target, _named(one.value, names)))
        else:
            yes, no = _statements(one.yes, names), _statements(one.no, names)
            renamed.append(Choice(_named(one.condition, names), yes, no))
    return tuple(renamed)


# The text.


def _printed(name: str, module: Module) -> str:
    """Print a module as the reader takes it."""
    return "\n".join((f"module {name}({', '.join(module.ports)});", *_items(module), "endmodule", ""))


def _items(module: Module) -> Iterator[str]:
    for net, width in module.widths.items():
        if net.startswith("?"):
            continue
        ranged = f"[{width - 1}:0] " if width > 1 else ""
        if net in module.ports:
            yield f"  {module.ports[net]} {ranged}{net};"
        if net in module.depths:
            if net in module.unchecked:
                yield "  (* no_rw_check = 32'd1 *)"
            yield f"  reg {ranged}{net} [{module.depths[net] - 1}:0];"
            yield "  initial begin"
            yield from (f"    {net}[{k}] = {_number(Number(word, width))};" for k, word in module.contents[net].items())
            yield "  end"
        elif net in module.registers:
            first = module.registers[net]
            yield f"  reg {ranged}{net}{'' if first is None else ' = ' + _number(Number(first, width))};"
        else:
            yield f"  wire {ranged}{net};"
    for target, value in module.assigns:
        yield f"  assign {_shown(target, module)} = {_shown(value, module)};"
    for clock, statements in module.clocked:
        (one, *more) = statements
        yield f"  always_ff @(posedge {clock}) {_block(statements, module) if more else _statement(one, module)}"
    for inside, instance, ports in module.instances:
        connected = ", ".join(f".{port}({_shown(value, module)})" for port, value in ports.items())
        yield f"  {inside} {instance} ({connected});"


def _block(statements: Sequence[Statement], module: Module) -> str:
    """Print statements: one that loads a register by itself, others between ``begin`` and ``end``."""
    if len(statements) == 1 and isinstance(statements[0], Load) and isinstance(statements[0].target, Bits):
        return _statement(statements[0], module)
    return f"begin {' '.join(_statement(one, module) for one in statements)} end"


def _statement(one: Statement, module: Module) -> str:
    if isinstance(one, Load):
        return f"{_shown(one.target, module)} <= {_shown(one.value, module)};"
    choice = f"if ({_shown(one.condition, module)}) {_block(one.yes, module)}"
    return f"{choice} else {_block(one.no, module)}" if one.no else choice


def _number(number: Number) -> str:
    return f"{number.width}'h{number.value:x}"


def _shown(value: Expression, module: Module) -> str:
    match value:
        case Number():
            return _number(value)
        case Bits():
            if value.name.startswith("?"):
                return f"{module.widths[value.name]}'hx"
            if value.width is None or module.widths[value.name] == 1:
                return value.name
            high = value.low + value.width - 1
            return f"{value.name}[{high}]" if value.width == 1 else f"{value.name}[{high}:{value.low}]"
        case Word():
            return f"{value.name}[{_shown(value.address, module)}]"
        case Joined():
            return f"{{ {', '.join(_shown(part, module) for part in value.parts)} }}"
        case Operator():
            operands = [_shown(part, module) for part in value.operands]
            if value.symbol == "signed":
                return f"$signed({operands[0]})"
            if value.symbol == "?":
                return f"{operands[0]} ? {operands[1]} : {operands[2]}"
            return f"{value.symbol} {operands[0]}" if len(operands) == 1 else f" {value.symbol} ".join(operands)
