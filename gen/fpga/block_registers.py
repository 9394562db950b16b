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
5.6 ns and a wire. A register moves only if nothing else reads it, or reads what it registers, and if it needs neither a
reset nor an enable: what the design does at any clock stays the same. Before the first clocks, a register in a block
holds 0, as one beside it would.

The netlist is that of Yosys's `write_json`, https://yosyshq.readthedocs.io/projects/yosys/en/latest/cmd/write_json.html;
the parameters are those of Lattice's FPGA Libraries Reference Guide for MULT18X18D and DP16KD.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import Any

Cell = dict[str, Any]
_FACTORS = tuple(f"{side}{bit}" for side in "AB" for bit in range(18))


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
        self._seen = {bit for port in module["ports"].values() for bit in port["bits"]}

    def all(self) -> None:
        """Move all registers that can be."""
        for name, cell in list(self._cells.items()):
            if cell["type"] == "MULT18X18D":
                self._factors(name, cell)
                self._product(cell)
            elif cell["type"] == "DP16KD":
                self._words(cell)

    def _is_plain(self, name: str | None) -> bool:
        """Whether a cell is a flip-flop that takes over its input at every rising edge, and holds 0 before."""
        cell = self._cells.get(name or "")
        if cell is None or cell["type"] != "TRELLIS_FF":
            return False
        parameters, connections = cell["parameters"], cell["connections"]
        always = parameters["CEMUX"].strip() == "1" and connections.get("LSR", ["0"]) == ["0"]
        return bool(always and parameters["CLKMUX"] == "CLK" and parameters["REGSET"] == "RESET")

    def _clock(self, registers: set[str]) -> int | None:
        """Return the clock that flip-flops share; None if they have several, or if there are none."""
        clocks = {self._cells[register]["connections"]["CLK"][0] for register in registers}
        return clocks.pop() if len(clocks) == 1 else None

    def _factors(self, name: str, cell: Cell) -> None:
        """Move the registers of both factors, or none of them."""
        connections = cell["connections"]
        bits = {port: connections[port][0] for port in _FACTORS}
        registers = {port: self._drivers.get(bit, "") for port, bit in bits.items() if bit != "0"}
        alone = all(
            reader == name and port in bits
            for port in registers
            for reader, port in self._readers[connections[port][0]]
        )
        clock = self._clock({*registers.values()}) if all(map(self._is_plain, registers.values())) else None
        if not alone or clock is None or self._seen.intersection(bits.values()):
            return
        for port, register in registers.items():
            connections[port] = self._cells[register]["connections"]["DI"]
        for register in {*registers.values()}:
            self._remove(register)
        for bit in {connections[port][0] for port in registers}:
            self._readers[bit] += [(name, port) for port in registers if connections[port][0] == bit]
        self._set(cell, clock, REG_INPUTA_CLK="CLK0", REG_INPUTB_CLK="CLK0")

    def _product(self, cell: Cell) -> None:
        """Move the registers of the product."""
        registers = self._behind(cell, "P")
        clock = self._clock({*registers.values()})
        if clock is None or cell["connections"].get("CLK0", [clock]) != [clock]:
            return
        self._take(cell, registers)
        self._set(cell, clock, REG_OUTPUT_CLK="CLK0")

    def _words(self, cell: Cell) -> None:
        """Move the registers of the words that the second port reads, and the first one too if it is a part of that."""
        wide = int(cell["parameters"]["DATA_WIDTH_B"], 2) == 36
        registers = self._behind(cell, "DO" if wide else "DOB")
        clock = self._clock({*registers.values()})
        connections = cell["connections"]
        if clock is None or connections["CLKB"] != [clock] or connections["CEB"] != ["1"]:
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
                if pin != "DI" or not self._is_plain(reader):
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

    @staticmethod
    def _set(cell: Cell, clock: int, **registers: str) -> None:
        """Turn registers of a multiplier on: always enabled, never reset."""
        cell["parameters"] |= {**registers, "RESETMODE": "SYNC", "GSR": "DISABLED"}
        cell["connections"] |= {"CLK0": [clock], "CE0": ["1"], "RST0": ["0"]}
        cell["port_directions"] |= {"CLK0": "input", "CE0": "input", "RST0": "input"}
