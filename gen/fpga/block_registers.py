"""Registers beside the blocks of an ECP5 that move into them: around multipliers, and behind block RAMs.

::

    before                                        after
    FF --> A +-----------+                        A +----------------+
             | MULT18X18D| P --> FF          -->    | FF * FF --> FF | P
    FF --> B +-----------+                        B +----------------+

    address  +--------+ DO --> FF            -->  address +--------------+ DO
             | DP16KD |                                   | DP16KD .. FF |
             +--------+                                   +--------------+

Yosys leaves them outside (`synth_ecp5`, 0.70), where a product takes 3.9 ns and the wires to and from it, and a word
5.6 ns and a wire. A register needs no reset to move, and all that move to one side of a block one clock and one enable;
behind a block RAM, none. One behind a block moves only if nothing else reads what it registers. That of a factor which
something else reads stays for that, and the block has another. So what the design does at any clock stays the same.
Before the first clocks, a register in a block holds 0, as one beside it would.

The netlist is that of Yosys's `write_json`, https://yosyshq.readthedocs.io/projects/yosys/en/latest/cmd/write_json.html;
the parameters are those of Lattice's FPGA Libraries Reference Guide for MULT18X18D and DP16KD.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import Any, NamedTuple

Cell = dict[str, Any]
Net = int | str
"""A net, or a constant."""


class _Control(NamedTuple):
    """When registers take over their inputs: at the edges of a clock at which a net enables them, or its inverse."""

    clock: Net
    enable: Net
    inverse: bool


def with_block_registers(netlist: dict[str, Any]) -> dict[str, Any]:
    """Move registers into the blocks of an ECP5, in the top module of a netlist, in place; return the netlist.

    A netlist of another FPGA has no such blocks, and stays as it is.
    """
    for module in netlist["modules"].values():
        if "top" in module["attributes"]:
            _Packing(module).all()
    return netlist


def cells_of(netlist: dict[str, Any]) -> dict[str, int]:
    """Count the cells of the top module by type."""
    (module,) = (module for module in netlist["modules"].values() if "top" in module["attributes"])
    return dict(Counter(cell["type"] for cell in module["cells"].values()))


_FACTORS = tuple(f"{side}{bit}" for side in "AB" for bit in range(18))
_ENABLES = ("1", "CE", "INV")
"""What says that a flip-flop is always enabled, that a net enables it, and that its inverse does."""

_ENABLE_PORTS = {"INPUTA": "CE0", "INPUTB": "CE0", "OUTPUT": "CE1"}
"""Which port of a multiplier enables each of its registers."""


class _Packing:
    """The cells of a module, what drives each net, and what reads it."""

    def __init__(self, module: dict[str, Any]) -> None:
        self._cells: dict[str, Cell] = module["cells"]
        self._drivers: dict[int, str] = {}
        self._readers: defaultdict[int, list[tuple[str, str]]] = defaultdict(list)
        for name, cell in self._cells.items():
            for port, bits in cell["connections"].items():
                for bit in bits:
                    if cell["port_directions"][port] == "output":
                        self._drivers[bit] = name
                    elif isinstance(bit, int):
                        self._readers[bit].append((name, port))
        self._inverses: dict[Net, int] = {}
        self._seen = {bit for port in module["ports"].values() for bit in port["bits"]}

    def all(self) -> None:
        """Move all registers that can be."""
        for name, cell in list(self._cells.items()):
            if cell["type"] == "MULT18X18D":
                self._factors(name, cell)
                self._product(cell)
            elif cell["type"] == "DP16KD":
                self._words(cell)

    def _control(self, registers: set[str]) -> _Control | None:
        """Return when flip-flops that hold 0 at first take over their inputs, always in the same way.

        None if they are others, or do not share it, or if there are none.
        """
        controls = {self._control_of(name) for name in registers}
        return controls.pop() if len(controls) == 1 else None

    def _control_of(self, name: str) -> _Control | None:
        cell = self._cells.get(name)
        if cell is None or cell["type"] != "TRELLIS_FF":
            return None
        parameters, connections = cell["parameters"], cell["connections"]
        kind, without_reset = parameters["CEMUX"].strip(), connections.get("LSR", ["0"]) == ["0"]
        rising = parameters["CLKMUX"] == "CLK"
        if not (without_reset and rising and parameters["REGSET"] == "RESET" and kind in _ENABLES):
            return None
        return _Control(connections["CLK"][0], kind if kind == "1" else connections["CE"][0], kind == "INV")

    def _factors(self, name: str, cell: Cell) -> None:
        """Move the registers of both factors, or of the one that is not constant."""
        connections = cell["connections"]
        bits = {port: connections[port][0] for port in _FACTORS if isinstance(connections[port][0], int)}
        registers = {port: self._drivers.get(bit, "") for port, bit in bits.items()}
        control = self._control({*registers.values()})
        if control is None or not self._set(cell, control, "INPUTA", "INPUTB"):
            return
        for port, register in registers.items():
            (bit,) = self._cells[register]["connections"]["DI"]
            self._readers[bits[port]].remove((name, port))
            connections[port] = [bit]
            if isinstance(bit, int):
                self._readers[bit].append((name, port))
        for register, bit in {(registers[port], bits[port]) for port in bits}:
            if not self._readers[bit] and bit not in self._seen:
                self._remove(register)

    def _product(self, cell: Cell) -> None:
        """Move the registers of the product."""
        registers = self._behind(cell, "P")
        control = self._control({*registers.values()})
        if control is not None and self._set(cell, control, "OUTPUT"):
            self._take(cell, registers)

    def _words(self, cell: Cell) -> None:
        """Move the registers of the words that the second port reads, and the first one too if it is a part of that."""
        wide = int(cell["parameters"]["DATA_WIDTH_B"], 2) == 36
        registers = self._behind(cell, "DO" if wide else "DOB")
        control, connections = self._control({*registers.values()}), cell["connections"]
        if control is None or control.enable != "1":
            return
        clock = control.clock
        if connections["CLKB"] != [clock] or connections["CEB"] != ["1"]:
            return
        if wide and connections["CLKA"] not in ([clock], ["0"]):
            return
        self._take(cell, registers)
        for side in "AB" if wide else "B":  # whichever clock the registers of the first port have, it is the same
            cell["parameters"][f"REGMODE_{side}"] = "OUTREG"
            connections |= {f"OCE{side}": ["1"], f"CLK{side}": [clock]}

    def _behind(self, cell: Cell, outputs: str) -> dict[str, str]:
        """Return the flip-flop behind each output that is read; nothing if something else is behind one of them."""
        registers: dict[str, str] = {}
        for port, (bit, *_) in cell["connections"].items():
            if cell["port_directions"][port] != "output" or not port.startswith(outputs):
                continue
            readers = self._readers[bit]
            if bit in self._seen or len(readers) > 1:
                return {}
            for reader, pin in readers:
                if pin != "DI":
                    return {}
                registers[port] = reader
        return registers

    def _take(self, cell: Cell, registers: dict[str, str]) -> None:
        """Have outputs drive what the flip-flops behind them do."""
        for port, register in registers.items():
            cell["connections"][port] = self._cells[register]["connections"]["Q"]
            self._remove(register)

    def _remove(self, register: str) -> None:
        """Remove a flip-flop."""
        for bit in self._cells.pop(register)["connections"]["DI"]:
            if isinstance(bit, int):
                self._readers[bit].remove((register, "DI"))

    def _set(self, cell: Cell, control: _Control, *registers: str) -> bool:
        """Turn registers of a multiplier on, which are never reset; say whether it has no other clock yet."""
        clock = control.clock
        if cell["connections"].get("CLK0", [clock]) != [clock]:
            return False
        enable = self._inverse(control.enable) if control.inverse else control.enable
        own = {"CLK0": clock, "RST0": "0", **{_ENABLE_PORTS[register]: enable for register in registers}}
        cell["connections"] |= {port: [net] for port, net in own.items()}
        cell["port_directions"] |= dict.fromkeys(own, "input")
        cell["parameters"] |= {"RESETMODE": "SYNC", "GSR": "DISABLED"}
        for register in registers:
            place = {"CLK": "CLK0", "CE": _ENABLE_PORTS[register], "RST": "RST0"}
            cell["parameters"] |= {f"REG_{register}_{kind}": port for kind, port in place.items()}
        return True

    def _inverse(self, net: Net) -> Net:
        """Return the inverse of a net: blocks have no inverters at their inputs."""
        if net not in self._inverses:
            inverse = 1 + max(bit for bit in (*self._drivers, *self._readers, *self._seen) if isinstance(bit, int))
            name = f"enable_of_blocks_{len(self._inverses)}"
            self._cells[name] = {
                "type": "LUT4",
                "parameters": {"INIT": "0101010101010101"},
                "attributes": {},
                "port_directions": {**dict.fromkeys("ABCD", "input"), "Z": "output"},
                "connections": {"A": [net], **{port: ["0"] for port in "BCD"}, "Z": [inverse]},
            }
            self._drivers[inverse] = name
            self._inverses[net] = inverse
        return self._inverses[net]
