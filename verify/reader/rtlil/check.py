"""Proves that the modules of an RTLIL text do what those of the SystemVerilog do, by induction over the clocks.

Both are taken apart into the same gates. A register of one text is found in the other by its name, or by that of a net
that is the same; what nobody reads may be missing in the SystemVerilog, and bits that never change are constants. For
equal content of all registers and memories, equal inputs and equal results of instances, both must give equal outputs,
hand equal inputs to the instances, and hold equal content next; and they must begin with the same.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.reader.gates import Gates
from sosmith.verify.reader.logic import Logic, logic_of, port_of
from sosmith.verify.reader.recursion import deep_recursion
from sosmith.verify.reader.rtlil.equality import Equality
from sosmith.verify.reader.rtlil.logic import Place, RtlilLogic
from sosmith.verify.reader.rtlil.syntax import RtlilModule, read_rtlil
from sosmith.verify.reader.syntax import Bits, Expression, Joined, Module, Number
from sosmith.verify.reader.widths import width_of


@dataclass(frozen=True)
class RtlilVerdict:
    """What was compared.

    Attributes
    ----------
    modules, register_bits : int
        Number of modules, and of bits that are held in registers.
    open : tuple of str
        What could not be shown to be the same, and was not found to differ either.
    """

    modules: int
    register_bits: int
    open: tuple[str, ...] = ()


def check_rtlil(text: str, modules: Mapping[str, Module]) -> RtlilVerdict:
    """Prove that an RTLIL text does what the modules of a SystemVerilog text do.

    Parameters
    ----------
    text : str
        RTLIL.
    modules : mapping of str to Module
        Modules of the SystemVerilog, the top first.

    Raises
    ------
    RejectedError
        If one does anything else, or the RTLIL is malformed.
    """
    try:
        return _checked(read_rtlil(text), modules)
    except (KeyError, IndexError, ValueError, TypeError) as error:
        raise RejectedError(f"the RTLIL must be well formed, not with {error!r}") from None


def _checked(read: Mapping[str, RtlilModule], modules: Mapping[str, Module]) -> RtlilVerdict:
    odd = sorted(set(read) ^ set(modules))
    require(not odd, f"the modules of the RTLIL must be those of the SystemVerilog, not {', '.join(odd[:3])} besides")
    gates = Gates()
    equality = Equality(gates)
    bits, left = 0, list[str]()
    with deep_recursion():
        own = {name: module.ports for name, module in modules.items()}
        others = {name: _directions(module) for name, module in read.items()}
        names = {name: plain_names(module, modules[name]) for name, module in read.items()}
        for name, module in modules.items():
            other = RtlilLogic(name, read[name], others, gates, names)
            pair = _Pair(name, module, logic_of(module, own, gates), other, equality, names[name])
            bits += pair.check()
            left += pair.open
    return RtlilVerdict(len(modules), bits, tuple(left))


def plain_names(module: RtlilModule, there: Module) -> dict[str, str]:
    """Return the names that nets, memories and cells have in the SystemVerilog, where none has a ``$``.

    They are guessed; whatever is found by one has to do the same.
    """
    every = [*module.wires, *module.memories, *module.cells]
    names = {name: name for name in every if "$" not in name}
    known = {*there.widths, *(instance for _, instance, _ in there.instances)} - set(names)
    for name in every:
        if name not in names:
            short = re.sub(r"\W+", "_", name).strip("_")
            made_up = re.sub(r"\W+", "", name)
            likely = [each for each in (short, made_up, f"{short}_", f"{short}__") if each in known]
            names[name] = likely[0] if likely else short
            known.discard(names[name])
    return names


def _directions(module: RtlilModule) -> dict[str, str]:
    return {name: wire.direction for name, wire in module.wires.items() if wire.direction}


class _Pair:
    """A module of both texts."""

    def __init__(
        self, name: str, module: Module, own: Logic, other: RtlilLogic, equality: Equality, names: Mapping[str, str]
    ) -> None:
        self._name, self._module, self._own, self._other = name, module, own, other
        self._same, self._plain = equality.same, names
        self.open: list[str] = []
        self._alias = _aliases(module)

    def check(self) -> int:
        """Compare both, and return the number of bits in registers."""
        own, other = self._own, self._other
        wires = other.module.wires
        ports = {
            self._plain[name]: port_of(wire.direction, wire.width) for name, wire in wires.items() if wire.direction
        }
        ports = {name: port for name, port in ports.items() if not port.endswith(" 0 bits")}
        self._require(ports == own.ports, "ports")
        self._require(other.clocks() == own.clocks and len(own.clocks) <= 1, "clocks")
        self._require(other.instances == own.instances, "instances")
        places = self._found()
        self._settle(places)
        matched = {place for place in places.values() if isinstance(place, tuple)}
        for name, register in own.registers.items():
            for place in range(len(register.next)):
                if (name, place) not in matched:
                    self.open.append(f"bit {place} of the register {name} of {self._name}")
        for bit, there in places.items():
            self._check_next(bit, there)
        self._check_memories()
        for name, wire in wires.items():
            if wire.direction == "output" and wire.width:
                self._compare(
                    own.outputs[self._plain[name]], other.word([(name, k) for k in range(wire.width)]), f"output {name}"
                )
        given = {name: bits for name, bits in other.given.items() if bits}
        self._require(given.keys() == own.given.keys(), "inputs of instances")
        for name, bits in given.items():
            self._compare(own.given[name], other.word(bits), f"input {name}")
        return len(matched)

    def _require(self, holds: bool, what: str) -> None:
        require(holds, f"the {what} of {self._name} must be the same in the RTLIL as in the SystemVerilog")

    def _compare(self, own: tuple[int, ...], other: list[int] | tuple[int, ...], what: str) -> None:
        self._require(len(own) == len(other), what)
        for one, value in zip(own, other, strict=True):
            self._decide(one, value, what)

    def _decide(self, own: int, other: int, what: str) -> None:
        same = self._same(own, other)
        self._require(same is not False, what)
        if same is None:
            self.open.append(f"{what} of {self._name}")

    def _found(self) -> dict[Place, Place | int]:
        """Return where each bit that the RTLIL holds is in the SystemVerilog: a register's bit, or a constant."""
        places: dict[Place, Place | int] = {}
        registers = {bit for bit, (cell, _) in self._other.registers().items() if self._is_clocked(cell)}
        for name, wire in self._other.module.wires.items():
            for place in range(wire.width):
                root = self._other.root((name, place))
                if root in registers and root not in places:
                    assert isinstance(root, tuple)
                    there = self._there((self._plain[name], place))
                    if there is not None:
                        places[root] = there
        self._find_renamed(places, registers)
        for bit in registers - places.keys():
            first = self._other.first_of(bit)
            if first is not None:
                places[bit] = first
        return places

    def _find_renamed(self, places: dict[Place, Place | int], registers: set[Place]) -> None:
        """Find registers by nets that turn out to be the same only when gates are taken for what they are."""
        known = {place for place in places.values() if isinstance(place, tuple)}
        self._other.restart()
        variables = {self._other.bit(bit): bit for bit in registers}
        for name, wire in self._other.module.wires.items():
            for place in range(wire.width):
                there = self._there((self._plain[name], place))
                if isinstance(there, tuple) and there not in known and self._other.is_driven((name, place)):
                    bit = variables.get(self._other.bit((name, place)))
                    if bit is not None and bit not in places:
                        places[bit] = there
                        known.add(there)

    def _is_clocked(self, cell: str) -> bool:
        instance = self._other.module.cells[cell]
        return instance.kind == "$dff" or (instance.kind == "$memrd_v2" and instance.number("CLK_ENABLE") == 1)

    def _there(self, place: Place) -> Place | int | None:
        """Follow assignments of the SystemVerilog to a register or a constant."""
        seen = set()
        at: Place | int | None = place
        while isinstance(at, tuple) and at[0] not in self._module.registers:
            if at in seen or at not in self._alias:
                return None
            seen.add(at)
            at = self._alias[at]
        return at

    def _settle(self, places: dict[Place, Place | int]) -> None:
        """Let what is held stand for what it is; take back constants that do not stay."""
        while True:
            self._other.restart()
            for bit, place in places.items():
                self._other.hold(bit, self._literal(place))
            wrong = [
                bit
                for bit, place in places.items()
                if isinstance(place, int)
                and not (self._other.first_of(bit) == place and self._same(self._other.next_of(bit), place))
            ]
            if not wrong:
                return
            for bit in wrong:
                del places[bit]

    def _literal(self, place: Place | int) -> int:
        if isinstance(place, int):
            return place
        return self._own_variable(place)

    def _own_variable(self, place: Place) -> int:
        return self._other.variable(("register", *place))

    def _check_next(self, bit: Place, place: Place | int) -> None:
        if isinstance(place, int):
            return  # checked where the constants settle
        name, at = place
        register = self._own.registers[name]
        first = None if register.first is None else register.first >> at & 1
        what = f"bit {at} of the register {name}"
        self._require(first == self._other.first_of(bit), what)
        self._decide(register.next[at], self._other.next_of(bit), what)

    def _check_memories(self) -> None:
        memories = {self._plain[name]: name for name in self._other.module.memories}
        self._require(memories.keys() >= self._own.memories.keys(), "memories")
        for name in self._own.memories:  # a word of any other one is no bit of the SystemVerilog
            there = memories[name]
            own, (first, writes) = self._own.memories[name], self._other.memory(there)
            width, _, unchecked = self._other.module.memories[there]
            same = (width, first) == (own.width, own.first) and unchecked == (name in self._module.unchecked)
            self._require(same and len(writes) == len(own.writes) <= 1, f"memory {name}")
            for one, other in zip(own.writes, writes, strict=True):
                enables = set(other.enables)
                self._require(len(enables) == 1, f"memory {name}")
                enable = enables.pop()
                self._decide(one.enable, enable, f"memory {name}")
                pairs = [*_padded(one.address, other.address), *zip(one.data, other.data, strict=True)]
                both = self._other.gates.both
                for a, b in pairs:
                    self._decide(both(enable, a), both(enable, b), f"memory {name}")


def _padded(a: tuple[int, ...], b: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    width = max(len(a), len(b))
    return zip((*a, *[0] * (width - len(a))), (*b, *[0] * (width - len(b))), strict=True)


def _aliases(module: Module) -> dict[Place, Place | int]:
    """Return what the bits of nets are that are assigned bits of other nets, or constants."""
    aliases: dict[Place, Place | int] = {}
    for target, value in module.assigns:
        one, other = _places(target, module), _places(value, module)
        if one is not None and other is not None and len(one) == len(other):
            aliases |= {bit: to for bit, to in zip(one, other, strict=True) if isinstance(bit, tuple)}
    return aliases


def _places(value: Expression, module: Module) -> list[Place | int] | None:
    """Return the bits of an expression, the lowest first; None if it computes anything."""
    if isinstance(value, Number):
        return [value.value >> place & 1 for place in range(value.width)]
    if isinstance(value, Bits):
        return [(value.name, value.low + place) for place in range(width_of(value, module))]
    if isinstance(value, Joined):
        parts = [_places(part, module) for part in reversed(value.parts)]
        return None if None in parts else [bit for part in parts for bit in part or ()]
    return None
