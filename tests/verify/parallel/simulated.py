"""Runs the netlist of a core on numbers, by an evaluation of its own, to see what an edit changes."""

from __future__ import annotations

import operator
import random
from collections.abc import Iterator, Mapping, Sequence

from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.reader.source import read_modules
from sosmith.verify.reader.syntax import (
    Bits,
    Expression,
    Joined,
    Load,
    Number,
    Operator,
    Statement,
    Word,
)

_COMPARISONS = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
_SUMS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "&": operator.and_, "|": operator.or_}


class Simulation:
    """A netlist with the contents of its registers and memories."""

    def __init__(self, netlist: Netlist) -> None:
        self._netlist = netlist
        self._held = {name: register.first or 0 for name, register in netlist.registers.items()}
        self._words = {name: list(memory.first) for name, memory in netlist.memories.items()}
        self._inputs: Mapping[str, int] = {}
        self._found: dict[str, int] = {}

    def outputs(self, inputs: Mapping[str, int]) -> dict[str, int]:
        """Return the output ports for values of the input ports."""
        self._inputs, self._found = inputs, {}
        return {name: self._net(name) for name, direction in self._netlist.ports.items() if direction == "output"}

    def clock(self) -> None:
        """Execute everything that is clocked, with the inputs given last."""
        loads = [
            load
            for executed in (*self._netlist.registers.values(), *self._netlist.memories.values())
            for load in self._executed(executed.statements)
        ]
        values = [(load.target, self._context(load.value, self._width(load.target))) for load in loads]
        places = [self._value(target.address) if isinstance(target, Word) else 0 for target, _ in values]
        for (target, value), place in zip(values, places, strict=True):
            if isinstance(target, Bits):
                self._held[target.name] = value
            elif place < len(self._words[target.name]):
                self._words[target.name][place] = value

    def _executed(self, statements: Sequence[Statement]) -> Iterator[Load]:
        for statement in statements:
            if isinstance(statement, Load):
                yield statement
            else:
                yield from self._executed(statement.yes if self._value(statement.condition) else statement.no)

    def _net(self, name: str) -> int:
        if name not in self._found:
            self._found[name] = self._driven(name)
        return self._found[name]

    def _driven(self, name: str) -> int:
        if name in self._held:
            return self._held[name]
        if name in self._inputs:
            return self._inputs[name]
        self._found[name] = 0  # for loops of nets whose bits are none
        total = 0
        for driver in self._netlist.drivers.get(name, ()):
            value = self._context(driver.value, driver.start + driver.width)
            total |= (value >> driver.start & ((1 << driver.width) - 1)) << driver.low
        return total

    def _width(self, value: Expression) -> int:
        return self._netlist.width(value)

    def _value(self, value: Expression) -> int:
        return self._context(value, self._width(value))

    def _context(self, value: Expression, width: int) -> int:
        """Value in a context of `width` bits, cut to it."""
        size = max(width, self._width(value))
        return self._sized(value, size, signed=self._signed(value)) & ((1 << width) - 1)

    def _signed(self, value: Expression) -> bool:
        if not isinstance(value, Operator) or value.symbol in {*_COMPARISONS, "!"}:
            return False
        if len(value.operands) == 1 and value.symbol in {"&", "|", "signed"}:
            return value.symbol == "signed"
        return all(self._signed(operand) for operand in value.operands[value.symbol == "?" :])

    def _sized(self, value: Expression, size: int, *, signed: bool) -> int:
        """Bits of a value extended to `size` bits, by the sign if asked for."""
        if isinstance(value, Operator) and len(value.operands) + (value.symbol in {"~", "?"}) > 1:
            found = self._operated(value, size, signed=signed)
            if found is not None:
                return found & ((1 << size) - 1)
        width = self._width(value)
        bits = self._self_determined(value)
        return (bits | -(bits >> (width - 1) & 1) << width if signed else bits) & ((1 << size) - 1)

    def _operated(self, value: Operator, size: int, *, signed: bool) -> int | None:
        if value.symbol == "?":
            side = value.operands[1 if self._value(value.operands[0]) else 2]
            return self._sized(side, size, signed=signed)
        if value.symbol == "~":
            return ~self._sized(value.operands[0], size, signed=signed)
        if value.symbol in _SUMS:
            return int(_SUMS[value.symbol](*(self._sized(of, size, signed=signed) for of in value.operands)))
        return None

    def _self_determined(self, value: Expression) -> int:
        if isinstance(value, Number):
            return value.value
        if isinstance(value, Bits):
            return self._net(value.name) >> value.low & ((1 << self._width(value)) - 1)
        if isinstance(value, Word):
            place = self._value(value.address)
            return self._words[value.name][place] if place < len(self._words[value.name]) else 0
        if isinstance(value, Joined):
            total = 0
            for part in value.parts:
                total = total << self._width(part) | self._value(part)
            return total
        first = value.operands[0]
        bits, width = self._value(first), self._width(first)
        if value.symbol in _COMPARISONS:
            signed = all(self._signed(of) for of in value.operands)
            size = max(map(self._width, value.operands))
            a, b = (self._sized(of, size, signed=signed) for of in value.operands)
            if signed:
                a, b = (x - (x >> (size - 1) << size) for x in (a, b))
            return int(_COMPARISONS[value.symbol](a, b))
        return {"signed": bits, "!": int(not bits), "|": int(bits > 0), "&": int(bits == (1 << width) - 1)}[
            value.symbol
        ]


class Inputs:
    """Random inputs of a core at each clock.

    Source and sink stall for a while now and then, and there are a few resets. Many codes are the largest or smallest.
    """

    def __init__(self, text: str, clocks: int, seed: int, channels: int = 1) -> None:
        self.netlist = flattened(read_modules(text), "aclk")
        rng = random.Random(seed)
        width = self.netlist.widths["s_axis_tdata"]
        self.rows: list[dict[str, int]] = []
        busy = {"s_axis_tvalid": 1.0, "m_axis_tready": 1.0}
        for clock in range(clocks):
            if clock % 16 == 0:
                busy = {name: rng.choice((0.2, 0.5, 0.9, 1.0)) for name in busy}
                extreme = rng.random() < 0.6
            data = rng.getrandbits(width)
            if extreme:
                data = rng.choice((0, (1 << width) - 1, (1 << (width - 1)) - 1, 1 << (width - 1), data))
            row = {"aclk": 0, "aresetn": int(clock > 1 and rng.random() > 0.004), "s_axis_tdata": data}
            row |= {name: int(rng.random() < part) for name, part in busy.items()}
            if channels > 1:
                row["s_axis_tdest"] = rng.randrange(channels + 1)
            self.rows.append(row)


def run(inputs: Inputs) -> list[dict[str, int]]:
    """Return the outputs of a core at each clock."""
    simulation = Simulation(inputs.netlist)
    found = []
    for row in inputs.rows:
        found.append(simulation.outputs(row))
        simulation.clock()
    return found


def outputs(text: str, clocks: int, seed: int, channels: int = 1) -> list[dict[str, int]]:
    """Return the outputs of a core at each clock, as far as they mean something, for random inputs with the seed."""
    return [
        seen if seen["m_axis_tvalid"] else {name: seen[name] for name in ("m_axis_tvalid", "s_axis_tready")}
        for seen in run(Inputs(text, clocks, seed, channels))
    ]
