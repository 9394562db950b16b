"""What a module of an RTLIL text does at a clock, bit by bit: its cells mean what the manual of Yosys says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.reader.gates import HIGH, LOW, Gates, extended
from sosmith.verify.reader.gates import Word as Literals
from sosmith.verify.reader.logic import compared, operated, reduced, shortest, word_at
from sosmith.verify.reader.rtlil.syntax import Bit, Case, Cell, RtlilModule

Place = tuple[str, int]
"""A bit of a net."""

_OPERATED = {"$add": "+", "$sub": "-", "$mul": "*", "$and": "&", "$or": "|", "$xor": "^"}
_COMPARED = {"$eq": "==", "$ne": "!=", "$lt": "<", "$le": "<=", "$gt": ">", "$ge": ">="}
_REDUCED = {"$reduce_and": "&", "$reduce_or": "|", "$reduce_bool": "|", "$reduce_xor": "^"}
_SHIFTS = ("$shl", "$shr", "$sshr")
_STORES = ("$dff", "$memrd_v2", "$memwr_v2", "$meminit_v2")


class Write(NamedTuple):
    """What is written to a memory at a clock, bit by bit where it is enabled."""

    enables: tuple[int, ...]
    address: tuple[int, ...]
    data: tuple[int, ...]


class RtlilLogic:
    """Nets of a module as literals.

    Parameters
    ----------
    name : str
        Name of the module.
    module : RtlilModule
    directions : mapping
        Directions of the ports of each module, by their names in the RTLIL.
    gates : Gates
    names : mapping
        The names that nets, memories and instances of each module have in the SystemVerilog, by those in the RTLIL.
    """

    def __init__(
        self,
        name: str,
        module: RtlilModule,
        directions: Mapping[str, Mapping[str, str]],
        gates: Gates,
        names: Mapping[str, Mapping[str, str]],
    ) -> None:
        self.module, self.gates, self._names, self._plain = module, gates, names, names[name]
        self._driven: set[Place] = set()
        self._connected: dict[Place, Bit] = {}
        self._set: dict[Place, Case] = {}
        self._from_instance: dict[Place, tuple[str, str, int]] = {}
        self._from_cell: dict[Place, tuple[str, int]] = {}
        self._held: dict[Place, tuple[str, int]] = {}
        self._done: dict[str, Literals] = {}
        self._known: dict[Place, int] = {}
        self._open: set[object] = set()
        self.instances: dict[str, str] = {}
        self.inputs: dict[str, list[Bit]] = {}
        self.given: dict[str, list[Bit]] = {}
        for target, value in module.connects:
            for one, other in zip(target, value, strict=True):
                self._connected[self._drive(one)] = other
        for case in module.processes:
            for bit in case.targets():
                self._set[self._drive(bit)] = case
        for label, cell in module.cells.items():
            self._add_cell(label, cell, directions)

    def _drive(self, bit: Bit) -> Place:
        """Note that a bit is driven, which must be that of a net, and return it."""
        require(isinstance(bit, tuple), "what is driven in the RTLIL must be a net")
        assert isinstance(bit, tuple)
        require(bit not in self._driven, f"bit {bit[1]} of {bit[0]} of the RTLIL must be driven once")
        require(self.module.wires[bit[0]].direction != "input", f"the input {bit[0]} of the RTLIL must not be driven")
        self._driven.add(bit)
        return bit

    def _add_cell(self, name: str, cell: Cell, directions: Mapping[str, Mapping[str, str]]) -> None:
        if cell.kind.startswith("\\"):
            kind, plain = cell.kind[1:], self._plain[name]
            require(kind in directions, f"the module {kind} of the RTLIL must be in the text")
            require(set(cell.ports) == set(directions[kind]), f"all ports of {name} of the RTLIL must be connected")
            self.instances[plain] = kind
            for port, bits in cell.ports.items():
                if directions[kind][port] == "output":
                    for place, bit in enumerate(bits):
                        self._from_instance[self._drive(bit)] = plain, self._names[kind][port], place
                else:
                    self.given[f"{plain}.{self._names[kind][port]}"] = bits
            return
        _check_shape(cell)
        output = {"$dff": "Q", "$memrd_v2": "DATA", "$memwr_v2": "", "$meminit_v2": ""}.get(cell.kind, "Y")
        drivers = self._held if cell.kind in _STORES else self._from_cell
        for place, bit in enumerate(cell.ports[output] if output else []):
            drivers[self._drive(bit)] = name, place

    # What is held.

    def registers(self) -> dict[Place, tuple[str, int]]:
        """Return the bits that are held, by what holds them: a cell and the place in it."""
        return self._held

    def hold(self, bit: Place, literal: int) -> None:
        """Let a bit that is held stand for a literal."""
        self._known[bit] = literal

    def variable(self, key: tuple[object, ...]) -> int:
        """Return the variable of this key."""
        return self.gates.variable(key)

    def is_driven(self, bit: Place) -> bool:
        """Whether anything drives a bit."""
        return bit in self._driven

    def restart(self) -> None:
        """Forget what was computed from what is held."""
        self._known.clear()
        self._done.clear()

    def next_of(self, bit: Place) -> int:
        """Return what a bit that is held takes over at a clock."""
        name, place = self._held[bit]
        cell = self.module.cells[name]
        if cell.kind == "$dff":
            require(cell.number("CLK_POLARITY") == 1, "registers of the RTLIL must take the rising edge")
            return self.bit(cell.ports["D"][place])
        (enable,) = self.word(cell.ports["EN"])
        return self.gates.chosen(enable, self._read(cell)[place], self.bit(bit))

    def first_of(self, bit: Place) -> int | None:
        """Return what a bit is before the first clock; None if that is not said."""
        first = self.module.wires[bit[0]].first
        digit = "x" if first is None else first.partition("'")[2][::-1][bit[1]]
        return int(digit) if digit in "01" else None

    def root(self, bit: Bit) -> Bit:
        """Follow connections to the bit that one is."""
        seen = set()
        while isinstance(bit, tuple) and bit in self._connected:
            require(bit not in seen, f"bit {bit[1]} of {bit[0]} of the RTLIL must not be itself")
            seen.add(bit)
            bit = self._connected[bit]
        return bit

    def clocks(self) -> set[str]:
        """Return the inputs that clock anything."""
        clocks = set()
        for cell in self.module.cells.values():
            if cell.kind in {"$dff", "$memwr_v2"} or (cell.kind == "$memrd_v2" and cell.number("CLK_ENABLE")):
                require(cell.number("CLK_POLARITY") == 1, "the RTLIL must take the rising edge")
                root = self.root(cell.ports["CLK"][0])
                name = root[0] if isinstance(root, tuple) else ""
                require(
                    name in self.module.wires and self.module.wires[name].direction == "input",
                    "a clock must be an input",
                )
                clocks.add(self._plain[name])
        return clocks

    # Memories.

    def memory(self, name: str) -> tuple[tuple[int, ...], tuple[Write, ...]]:
        """Return the first words of a memory, and what is written."""
        width, size, _ = self.module.memories[name]
        words: dict[int, int] = {}
        writes = []
        for cell in self.module.cells.values():
            if cell.parameters.get("MEMID") != f"\\{name}":
                continue
            if cell.kind == "$meminit_v2":
                address, data, enable = (_value(cell.ports[port]) for port in ("ADDR", "DATA", "EN"))
                require(enable == (1 << width) - 1, f"{name} of the RTLIL must get whole words")
                for place in range(cell.number("WORDS")):
                    require(address + place not in words, f"word {address + place} of {name} must be given once")
                    words[address + place] = data >> width * place & ((1 << width) - 1)
            elif cell.kind == "$memwr_v2":
                self._check_sizes(cell, width)
                require(cell.number("CLK_ENABLE") == 1, f"{name} of the RTLIL must be written at a clock")
                parts = (self.word(cell.ports[port]) for port in ("EN", "ADDR", "DATA"))
                enables, address_, data_ = map(tuple, parts)
                writes.append(Write(enables, shortest(address_), data_))
        require(sorted(words) == list(range(size)), f"all {size} words of {name} of the RTLIL must be given")
        return tuple(words[place] for place in range(size)), tuple(writes)

    def _read(self, cell: Cell) -> Literals:
        memory = str(cell.parameters.get("MEMID", ""))[1:]
        require(memory in self.module.memories, "what is read in the RTLIL must be a memory")
        require(cell.parameters.get("TRANSPARENCY_MASK") in {0, ""}, f"{memory} of the RTLIL must be read as it was")
        width = self.module.memories[memory][0]
        require(
            _is_constant(cell, "ARST", "0") and _is_constant(cell, "SRST", "0"), f"{memory} must be read without reset"
        )
        clocked = cell.number("CLK_ENABLE") == 1
        require(clocked or _is_constant(cell, "EN", "1"), f"{memory} of the RTLIL must always be read")
        require(set(str(cell.parameters.get("INIT_VALUE"))) == {"x"}, f"what is read of {memory} must begin with x")
        self._check_sizes(cell, width)
        return word_at(self.gates, self._plain[memory], self.word(cell.ports["ADDR"]), width)

    @staticmethod
    def _check_sizes(cell: Cell, width: int) -> None:
        same = cell.number("WIDTH") == len(cell.ports["DATA"]) == width
        require(same, f"words of a memory of the RTLIL must have {width} bits")
        require(cell.number("ABITS") == len(cell.ports["ADDR"]), "ABITS of a memory of the RTLIL must be that of ADDR")

    # Nets.

    def word(self, bits: Sequence[Bit]) -> Literals:
        """Return the literals of a word."""
        return [self.bit(bit) for bit in bits]

    def bit(self, bit: Bit) -> int:
        """Return the literal of a bit.

        Raises
        ------
        RejectedError
            If it depends on itself within a clock, or is not driven.
        """
        if isinstance(bit, str):
            require(bit in {"0", "1"}, f"a bit of the RTLIL must be 0 or 1, not {bit}")
            return HIGH if bit == "1" else LOW
        if bit not in self._known:
            require(bit not in self._open, f"bit {bit[1]} of {bit[0]} of the RTLIL must not depend on itself")
            self._open.add(bit)
            self._known[bit] = self._found(bit)
            self._open.discard(bit)
        return self._known[bit]

    def _found(self, bit: Place) -> int:
        if self.module.wires[bit[0]].direction == "input":
            return self.gates.variable(("input", self._plain[bit[0]], bit[1]))
        require(bit in self._driven, f"bit {bit[1]} of {bit[0]} of the RTLIL must be driven to be used")
        if bit in self._connected:
            return self.bit(self._connected[bit])
        if bit in self._from_instance:
            return self.gates.variable(("instance", *self._from_instance[bit]))
        if bit in self._set:
            return self._case(self._set[bit], bit, None)
        name, place = (self._held if bit in self._held else self._from_cell)[bit]
        cell = self.module.cells[name]
        if cell.kind == "$memrd_v2" and cell.number("CLK_ENABLE") == 0:
            return self._read(cell)[place]
        if bit in self._held:
            return self.gates.variable(("unnamed", bit))
        if name not in self._done:
            self._done[name] = self._computed(cell)
        return self._done[name][place]

    def _case(self, case: Case, bit: Place, before: int | None) -> int:
        """Return what a bit is after a case; `before` is what it was, None if it was not set."""
        value = self.bit(case.sets[bit]) if bit in case.sets else before
        for word, cases in case.choices:
            if not any(each.touches(bit) for _, each in cases):
                continue
            require(value is not None, f"bit {bit[1]} of {bit[0]} of the RTLIL must be set in any case")
            assert value is not None
            literals, result = self.word(word), value
            for patterns, each in reversed(cases):
                inside = self._case(each, bit, value)
                result = self.gates.chosen(self._matches(literals, patterns), inside, result)
            value = result
        require(value is not None, f"bit {bit[1]} of {bit[0]} of the RTLIL must be set in any case")
        assert value is not None
        return value

    def _matches(self, word: Literals, patterns: Sequence[str]) -> int:
        """Return whether a word is of one of some patterns; of any word if there is none."""
        if not patterns:
            return HIGH
        return self.gates.any_of(
            [
                self.gates.all_of(
                    [
                        bit if digit == "1" else bit ^ 1
                        for bit, digit in zip(word, pattern[::-1], strict=True)
                        if digit != "-"
                    ]
                )
                for pattern in patterns
            ]
        )

    def _computed(self, cell: Cell) -> Literals:
        """Return what a cell without memory computes."""
        gates, kind = self.gates, cell.kind
        a = self.word(cell.ports["A"])
        if kind == "$mux":
            (select,) = self.word(cell.ports["S"])
            return [gates.chosen(select, yes, no) for no, yes in zip(a, self.word(cell.ports["B"]), strict=True)]
        size, signed = len(cell.ports["Y"]), bool(cell.number("A_SIGNED"))
        widths = [("A", "A_WIDTH"), ("Y", "Y_WIDTH"), *([("B", "B_WIDTH")] if "B" in cell.ports else [])]
        for port, key in widths:
            require(len(cell.ports[port]) == cell.number(key), f"{key} of a cell {kind} must be that of {port}")
        if kind == "$not":
            return [bit ^ 1 for bit in extended(a, size, signed=signed)]
        if kind in _REDUCED:
            return extended([reduced(gates, _REDUCED[kind], a)], size, signed=False)
        b = self.word(cell.ports["B"])
        if kind in _SHIFTS:
            require(not cell.number("B_SIGNED"), f"a cell {kind} of the RTLIL must shift by a number without sign")
            return _shifted(gates, kind, extended(a, max(size, len(a)), signed=signed), b, signed=signed)[:size]
        signed = signed and bool(cell.number("B_SIGNED"))
        if kind in _OPERATED:
            return operated(gates, _OPERATED[kind], extended(a, size, signed=signed), extended(b, size, signed=signed))
        if kind in _COMPARED:
            most = max(len(a), len(b))
            sides = (extended(each, most, signed=signed) for each in (a, b))
            return extended([compared(gates, _COMPARED[kind], *sides, signed=signed)], size, signed=False)
        raise RejectedError(f"the RTLIL must not have a cell {kind}")


_UNARY = {"A", "Y"}, {"A_SIGNED", "A_WIDTH", "Y_WIDTH"}
_BINARY = {"A", "B", "Y"}, {"A_SIGNED", "A_WIDTH", "B_SIGNED", "B_WIDTH", "Y_WIDTH"}
_MEMORY = {"MEMID", "ABITS", "WIDTH"}
_SHAPES: dict[str, tuple[set[str], set[str]]] = {
    "$dff": ({"CLK", "D", "Q"}, {"CLK_POLARITY", "WIDTH"}),
    "$mux": ({"A", "B", "S", "Y"}, {"WIDTH"}),
    "$memrd_v2": (
        {"ADDR", "ARST", "CLK", "DATA", "EN", "SRST"},
        _MEMORY
        | {"ARST_VALUE", "CE_OVER_SRST", "CLK_ENABLE", "CLK_POLARITY", "COLLISION_X_MASK", "INIT_VALUE", "SRST_VALUE"}
        | {"TRANSPARENCY_MASK"},
    ),
    "$memwr_v2": ({"ADDR", "CLK", "DATA", "EN"}, _MEMORY | {"CLK_ENABLE", "CLK_POLARITY", "PORTID", "PRIORITY_MASK"}),
    "$meminit_v2": ({"ADDR", "DATA", "EN"}, _MEMORY | {"PRIORITY", "WORDS"}),
    "$not": _UNARY,
    **dict.fromkeys(_REDUCED, _UNARY),
}
"""Ports and parameters that Yosys' manual gives each kind of cell; those that are not named are binary."""

_SAME = {"$dff": ("D", "Q"), "$mux": ("A", "B", "Y")}
"""Ports that are as wide as WIDTH says."""


def _check_shape(cell: Cell) -> None:
    """Check that a cell has the ports and parameters of its kind, and no others: tools do not take it otherwise."""
    ports, parameters = _SHAPES.get(cell.kind, _BINARY)
    for what, names, wanted in (("ports", cell.ports, ports), ("parameters", cell.parameters, parameters)):
        require(
            set(names) == wanted,
            f"a cell {cell.kind} of the RTLIL must have the {what} {', '.join(sorted(wanted))}, "
            f"not {', '.join(sorted(names))}",
        )
    for port in _SAME.get(cell.kind, ()):
        require(len(cell.ports[port]) == cell.number("WIDTH"), f"WIDTH of a cell {cell.kind} must be that of {port}")


def _shifted(gates: Gates, kind: str, word: Literals, places: Literals, *, signed: bool) -> Literals:
    fill = word[-1] if kind == "$sshr" and signed else LOW
    for power, bit in enumerate(places):
        step = min(1 << min(power, 20), len(word))
        moved = [LOW] * step + word[: len(word) - step] if kind == "$shl" else word[step:] + [fill] * step
        word = [gates.chosen(bit, a, b) for a, b in zip(moved, word, strict=True)]
    return word


def _is_constant(cell: Cell, port: str, digit: str) -> bool:
    return set(cell.ports[port]) == {digit}


def _value(bits: Sequence[Bit]) -> int:
    require(all(bit in {"0", "1"} for bit in bits), "a constant of the RTLIL must be of 0 and 1")
    return sum((bit == "1") << place for place, bit in enumerate(bits))
