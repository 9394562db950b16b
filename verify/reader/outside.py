"""Reads what an outside front end has made of a text: the modules of a netlist in the JSON format of Yosys.

The cells are those of Yosys' library of words, as they are after ``proc``; each has the meaning that its manual gives.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.reader.gates import HIGH, LOW, Gates, extended
from sosmith.verify.reader.gates import Word as Literals
from sosmith.verify.reader.logic import (
    UNKNOWN,
    Logic,
    RegisterLogic,
    Stored,
    Write,
    compared,
    operated,
    port_of,
    reduced,
    shortest,
    word_at,
)

SCRIPT = "read_verilog -sv core.sv; hierarchy -check -top {top}; proc -noopt; write_json core.json"
"""Commands of Yosys that read ``core.sv`` and write ``core.json``."""

_OPERATED = {"$add": "+", "$sub": "-", "$mul": "*", "$and": "&", "$or": "|", "$xor": "^"}
_COMPARED = {"$eq": "==", "$ne": "!=", "$lt": "<", "$le": "<=", "$gt": ">", "$ge": ">="}
_REDUCED = {"$logic_not": "!", "$reduce_and": "&", "$reduce_or": "|", "$reduce_bool": "|", "$reduce_xor": "^"}
_CONSTANTS: Mapping[object, int] = {"0": LOW, "1": HIGH}
_MALFORMED = (ValueError, KeyError, TypeError, IndexError, AttributeError)
"""What is raised where a file has anything else."""

Bit = int | str
Cell = Mapping[str, Any]


class _Driver(NamedTuple):
    cell: str
    port: str
    place: int


def modules_outside(text: str, registers: Mapping[str, Iterable[str]], gates: Gates) -> dict[str, Logic]:
    """Return what each module of a netlist does; `registers` are the names of those of each module.

    A netlist has names for nets, of which several may be one: which of them was written as a register, it does not say.

    Raises
    ------
    RejectedError
        If the netlist has a cell that is not known here, or is malformed.
    """
    try:
        modules = json.loads(text)["modules"]
        return {
            name: _Outside(module, set(modules), registers.get(name, ()), gates).logic()
            for name, module in modules.items()
        }
    except _MALFORMED as error:
        raise RejectedError(f"the netlist of the second reader must be one of Yosys, not with {error!r}") from None


class _Outside:
    def __init__(self, module: Mapping[str, Any], modules: set[str], registers: Iterable[str], gates: Gates) -> None:
        self._gates, self._registers, self._ports = gates, registers, module["ports"]
        self._cells: dict[str, Cell] = module["cells"]
        self._nets: dict[str, Any] = module["netnames"]
        self._memories: dict[str, Any] = module.get("memories", {})
        self._modules = modules
        self._drivers: dict[Bit, _Driver] = {}
        self._known: dict[Bit, int] = {}
        self._done: dict[str, Literals] = {}
        self._open: set[str] = set()
        for name, cell in self._cells.items():
            for port, direction in cell["port_directions"].items():
                if direction == "output":
                    for place, bit in enumerate(cell["connections"][port]):
                        require(bit not in self._drivers, f"{name} must not drive what another cell drives")
                        self._drivers[bit] = _Driver(name, port, place)
        for name, port in self._ports.items():
            if port["direction"] == "input":
                self._known |= {bit: gates.variable(("input", name, k)) for k, bit in enumerate(port["bits"])}

    def logic(self) -> Logic:
        logic = Logic(ports={name: port_of(port["direction"], len(port["bits"])) for name, port in self._ports.items()})
        logic.registers = self._held()
        logic.memories = {name.removeprefix("\\"): self._memory(name) for name in self._memories}
        for name, port in self._ports.items():
            if port["direction"] == "output":
                logic.outputs[name] = tuple(self._word(port["bits"]))
        for name, cell in self._cells.items():
            if cell["type"] in self._modules:
                logic.instances[name] = cell["type"]
                for port, direction in cell["port_directions"].items():
                    if direction == "input":
                        logic.given[f"{name}.{port}"] = tuple(self._word(cell["connections"][port]))
        logic.clocks = {self._clock(cell) for cell in self._cells.values() if cell["type"] in {"$dff", "$memwr_v2"}}
        return logic

    def _clock(self, cell: Cell) -> str:
        (bit,) = cell["connections"]["CLK"]
        require(_number(cell, "CLK_POLARITY") == 1, "registers of the second reader must take the rising edge")
        clocks = [name for name, port in self._ports.items() if port["bits"] == [bit] and port["direction"] == "input"]
        require(len(clocks) == 1, "the clock of the second reader must be an input")
        return str(clocks[0])

    def _held(self) -> dict[str, RegisterLogic]:
        """Return the registers, whose bits are flip-flops and no other's.

        Those of no register, which ``proc`` makes where a memory is written, are taken for undriven.
        """
        next_of: dict[Bit, Bit] = {}
        for cell in self._cells.values():
            if cell["type"] == "$dff":
                next_of |= zip(cell["connections"]["Q"], cell["connections"]["D"], strict=True)
        bits_of = {name: self._nets[name]["bits"] for name in self._registers if name in self._nets}
        for name, bits in bits_of.items():
            for place, bit in enumerate(bits):
                require(
                    bit in next_of and bit not in self._known,
                    f"bit {place} of {name} must be a flip-flop of its own to the second reader",
                )
                self._known[bit] = self._gates.variable(("register", name, place))
        for bit in next_of.keys() - self._known.keys():
            self._known[bit] = self._gates.variable(("undriven", bit))
        return {
            name: RegisterLogic(tuple(self._word([next_of[bit] for bit in bits])), self._first(name))
            for name, bits in bits_of.items()
        }

    def _first(self, name: str) -> int | None:
        bits = str(self._nets[name]["attributes"].get("init", "x"))
        return int(bits, 2) if set(bits) <= {"0", "1"} else None

    def _memory(self, name: str) -> Stored:
        memory, identity = self._memories[name], "\\" + name.removeprefix("\\")
        require(_plain(memory["start_offset"]) == 0, f"{name} of the second reader must begin at word 0")
        words: dict[int, int] = {}
        writes: list[Write] = []
        for cell in self._cells.values():
            if cell["parameters"].get("MEMID") != identity:
                continue
            connections = cell["connections"]
            if cell["type"] == "$meminit_v2":
                address, data = (_value(connections[port]) for port in ("ADDR", "DATA"))
                require(_value(connections["EN"]) == (1 << len(connections["EN"])) - 1, f"{name} must get whole words")
                width = _number(cell, "WIDTH")
                for place in range(_number(cell, "WORDS")):
                    require(address + place not in words, f"word {address + place} of {name} must be given once")
                    words[address + place] = data >> width * place & ((1 << width) - 1)
            elif cell["type"] == "$memwr_v2":
                writes.append(self._write(cell))
        size = _plain(memory["size"])
        require(sorted(words) == list(range(size)), f"all {size} words of {name} must be given to the second reader")
        return Stored(_plain(memory["width"]), tuple(words[k] for k in range(size)), tuple(writes))

    def _write(self, cell: Cell) -> Write:
        connections = cell["connections"]
        enables = set(self._word(connections["EN"]))
        require(len(enables) == 1, "the second reader must write whole words")
        (enable,) = enables
        address, data = (self._word([self._if(enable, bit) for bit in connections[port]]) for port in ("ADDR", "DATA"))
        return Write(enable, shortest(address), tuple(data))

    def _if(self, enable: int, bit: Bit) -> Bit:
        """Return what a bit is while `enable` is 1: ``proc`` writes x where nothing is written."""
        while bit in self._drivers:
            driver = self._drivers[bit]
            cell = self._cells[driver.cell]
            if cell["type"] != "$mux":
                break
            (select,) = self._word(cell["connections"]["S"])
            if self._gates.both(enable, select ^ 1) == LOW:
                bit = cell["connections"]["B"][driver.place]
            elif self._gates.both(enable, select) == LOW:
                bit = cell["connections"]["A"][driver.place]
            else:
                break
        return bit

    # Bits.

    def _word(self, bits: Sequence[Bit]) -> Literals:
        return [self._bit(bit) for bit in bits]

    def _bit(self, bit: Bit) -> int:
        if isinstance(bit, str):
            return _CONSTANTS[bit] if bit in _CONSTANTS else self._gates.variable(UNKNOWN)
        if bit not in self._known:
            driver = self._drivers.get(bit)
            if driver is None:
                self._known[bit] = self._gates.variable(("undriven", bit))
            elif self._cells[driver.cell]["type"] in self._modules:
                self._known[bit] = self._gates.variable(("instance", *driver))
            else:
                self._known[bit] = self._result(driver.cell)[driver.place]
        return self._known[bit]

    def _result(self, name: str) -> Literals:
        if name not in self._done:
            require(name not in self._open, f"{name} of the second reader must not depend on itself")
            self._open.add(name)
            self._done[name] = self._computed(self._cells[name])
            self._open.discard(name)
        return self._done[name]

    def _computed(self, cell: Cell) -> Literals:
        """Return the only output of a cell."""
        kind, connections, gates = cell["type"], cell["connections"], self._gates
        inputs = {port: self._word(bits) for port, bits in connections.items() if port in {"A", "B", "S", "ADDR"}}
        if kind == "$memrd":
            require(_number(cell, "CLK_ENABLE") == 0, "the second reader must read memories without a clock")
            return word_at(
                gates, cell["parameters"]["MEMID"].removeprefix("\\"), inputs["ADDR"], len(connections["DATA"])
            )
        width, first = len(connections["Y"]), inputs["A"]
        if kind == "$mux":
            (select,) = inputs["S"]
            return [gates.chosen(select, yes, no) for no, yes in zip(first, inputs["B"], strict=True)]
        if kind in {"$not", "$pos"}:
            word = extended(first, width, signed=_number(cell, "A_SIGNED") == 1)
            return [bit ^ (kind == "$not") for bit in word]
        if kind in _REDUCED:
            return extended([reduced(gates, _REDUCED[kind], first)], width, signed=False)
        require(kind in _OPERATED or kind in _COMPARED, f"the cell {kind} of the second reader must be known")
        signed = _number(cell, "A_SIGNED") == _number(cell, "B_SIGNED") == 1
        size = width if kind in _OPERATED else max(len(first), len(inputs["B"]))
        a, b = (extended(word, size, signed=signed) for word in (first, inputs["B"]))
        if kind in _OPERATED:
            return operated(gates, _OPERATED[kind], a, b)
        return extended([compared(gates, _COMPARED[kind], a, b, signed=signed)], width, signed=False)


def _number(cell: Cell, parameter: str) -> int:
    return _plain(cell["parameters"][parameter])


def _plain(value: int | str) -> int:
    return int(value, 2) if isinstance(value, str) else int(value)


def _value(bits: Sequence[Bit]) -> int:
    require(set(bits) <= {"0", "1"}, "first words of the second reader must be known")
    return sum(int(bit) << place for place, bit in enumerate(bits))
