"""Integer dataflow graphs: the one description of a datapath that everything else is made from.

A graph is a list of nodes in the order of computation. A node carries an integer `code` with
`frac` fraction bits, so its value is ``code * 2**-frac``, and the integer range ``low..high`` that
the code never leaves. The exact interpreter here, the C model (`sosmith.model.dataflow.c_model`) and the
hardware (`sosmith.hdl.pipelined_logic`) all walk the same nodes.

The usual quantizer is FLOOR, which drops lower bits and costs nothing; the bits it drops are FRACTION.
Rounding to nearest, ties upward, is the addition of a half before it. TRUNCATE drops bits of the magnitude,
which never makes a value larger: a recursion that cannot gain energy then comes to rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from fractions import Fraction


class Op(Enum):
    """What a node does with its operands."""

    INPUT = "input"
    CONSTANT = "constant"
    ADD = "add"
    SUBTRACT = "subtract"
    SHIFT = "shift"  # multiplies by 2**parameter: the same code, another binary point
    SCALE = "scale"  # multiplies by the constant parameter * 2**-parameter_frac
    MULTIPLY = "multiply"
    FLOOR = "floor"  # to `frac` fraction bits, by dropping the others
    FRACTION = "fraction"  # what FLOOR to parameter fraction bits drops: a - floor(a), never negative
    TRUNCATE = "truncate"  # to `frac` fraction bits, towards zero
    CLAMP = "clamp"  # limits to low..high
    BOUND = "bound"  # states that the value stays in low..high; no logic
    DELAY = "delay"  # the operand of the sample before; 0 at reset


@dataclass(frozen=True)
class Node:
    """One operation.

    Attributes
    ----------
    op : Op
        What it does.
    operands : tuple of int
        Indices of its operands in the graph; the operand of a DELAY may come later.
    frac : int
        Fraction bits of the result; negative for multiples of a power of two.
    low, high : int
        Range of the result's code.
    parameter, parameter_frac : int
        Constant of CONSTANT, SCALE and SHIFT; fraction bits that FLOOR would keep, for FRACTION.
    name : str
        Name for people and for the hardware, ``""`` for a passing result.
    """

    op: Op
    operands: tuple[int, ...]
    frac: int
    low: int
    high: int
    parameter: int = 0
    parameter_frac: int = 0
    name: str = ""

    @property
    def signed(self) -> bool:
        """Whether the code can be negative."""
        return self.low < 0

    @property
    def width(self) -> int:
        """Bits that hold the whole range, with a sign bit if `signed`; at least 1."""
        if self.signed:
            return max((-self.low - 1).bit_length(), self.high.bit_length()) + 1
        return max(self.high.bit_length(), 1)

    @property
    def format(self) -> str:
        """Q format, ``Qi.f`` for two's complement (i without the sign bit) or ``UQi.f``."""
        if self.signed:
            return f"Q{self.width - 1 - self.frac}.{self.frac}"
        return f"UQ{self.width - self.frac}.{self.frac}"


class RangeError(ArithmeticError):
    """A value left the range its node states: an overflow in hardware."""


@dataclass(frozen=True)
class Graph:
    """A frozen dataflow graph with named inputs and outputs and its delays as state.

    Attributes
    ----------
    nodes : tuple of Node
        In the order of computation.
    inputs : tuple of int
        Indices of the INPUT nodes, in port order.
    outputs : tuple of int
        Indices of the nodes that leave the graph, in port order.
    """

    nodes: tuple[Node, ...]
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]

    @property
    def delays(self) -> tuple[int, ...]:
        """Indices of the DELAY nodes: the state, in the order of the nodes."""
        return tuple(i for i, node in enumerate(self.nodes) if node.op is Op.DELAY)

    def reset(self) -> list[int]:
        """State after reset: one zero per delay."""
        return [0] * len(self.delays)

    def step(self, inputs: Sequence[int], state: list[int]) -> list[int]:
        """Compute one sample in exact integers and advance `state` in place.

        Parameters
        ----------
        inputs : sequence of int
            One code per input.
        state : list of int
            One code per delay, as from `reset`.

        Returns
        -------
        list of int
            One code per output.

        Raises
        ------
        RangeError
            If any node's code leaves the range it states.
        """
        codes: list[int] = []
        supply = iter(inputs)
        memory = iter(state)
        for node in self.nodes:
            if node.op is Op.INPUT:
                code = next(supply)
            elif node.op is Op.DELAY:
                code = next(memory)
            else:
                code = self._evaluate(node, codes)
            if not node.low <= code <= node.high:
                raise RangeError(f"{node.name or node.op.value} must be in {node.low}..{node.high}, not {code}")
            codes.append(code)
        state[:] = [codes[self.nodes[i].operands[0]] for i in self.delays]
        return [codes[i] for i in self.outputs]

    def run(self, samples: Iterable[Sequence[int]], state: list[int] | None = None) -> list[list[int]]:
        """Compute a run of samples from `state` (reset if None); the slow, exact reference."""
        memory = self.reset() if state is None else state
        return [self.step(sample, memory) for sample in samples]

    def _evaluate(self, node: Node, codes: Sequence[int]) -> int:
        operands = [codes[i] for i in node.operands]
        fracs = [self.nodes[i].frac for i in node.operands]
        return _EVALUATE[node.op](node, operands, fracs)


def _aligned(node: Node, operands: Sequence[int], fracs: Sequence[int]) -> tuple[int, int]:
    return operands[0] << (node.frac - fracs[0]), operands[1] << (node.frac - fracs[1])


def _add(node: Node, operands: Sequence[int], fracs: Sequence[int]) -> int:
    a, b = _aligned(node, operands, fracs)
    return a + b


def _subtract(node: Node, operands: Sequence[int], fracs: Sequence[int]) -> int:
    a, b = _aligned(node, operands, fracs)
    return a - b


def _fraction(node: Node, operands: Sequence[int], fracs: Sequence[int]) -> int:
    return operands[0] & ((1 << (fracs[0] - node.parameter)) - 1)


def _truncated(code: int, shift: int) -> int:
    return code >> shift if code >= 0 else -(-code >> shift)


_EVALUATE: dict[Op, Callable[[Node, Sequence[int], Sequence[int]], int]] = {
    Op.CONSTANT: lambda node, _operands, _fracs: node.parameter,
    Op.ADD: _add,
    Op.SUBTRACT: _subtract,
    Op.SHIFT: lambda _node, operands, _fracs: operands[0],
    Op.SCALE: lambda node, operands, _fracs: operands[0] * node.parameter,
    Op.MULTIPLY: lambda _node, operands, _fracs: operands[0] * operands[1],
    Op.FLOOR: lambda node, operands, fracs: operands[0] >> (fracs[0] - node.frac),
    Op.FRACTION: _fraction,
    Op.TRUNCATE: lambda node, operands, fracs: _truncated(operands[0], fracs[0] - node.frac),
    Op.CLAMP: lambda node, operands, _fracs: min(max(operands[0], node.low), node.high),
    Op.BOUND: lambda _node, operands, _fracs: operands[0],
}


@dataclass(frozen=True)
class Wire:
    """Handle to a node while its graph is being built."""

    index: int


class GraphBuilder:
    """Builds a `Graph` node by node, deriving fraction bits and ranges by interval arithmetic."""

    def __init__(self) -> None:
        self._nodes: list[Node] = []
        self._inputs: list[int] = []

    def __getitem__(self, wire: Wire) -> Node:
        return self._nodes[wire.index]

    def _append(self, node: Node) -> Wire:
        self._nodes.append(node)
        return Wire(len(self._nodes) - 1)

    def input(self, name: str, frac: int, low: int, high: int) -> Wire:
        """Add an input port whose code is in `low`..`high`."""
        wire = self._append(Node(Op.INPUT, (), frac, low, high, name=name))
        self._inputs.append(wire.index)
        return wire

    def constant(self, code: int, frac: int, name: str = "") -> Wire:
        """Add the constant ``code * 2**-frac``."""
        return self._append(Node(Op.CONSTANT, (), frac, code, code, parameter=code, name=name))

    def delay(self, name: str, frac: int, low: int, high: int) -> Wire:
        """Add a state that starts at zero; `connect` gives it its next value."""
        return self._append(Node(Op.DELAY, (-1,), frac, min(low, 0), max(high, 0), name=name))

    def connect(self, delay: Wire, source: Wire) -> None:
        """Make `source` of this sample the value of `delay` at the next."""
        state, node = self[delay], self[source]
        if state.op is not Op.DELAY or state.operands != (-1,):
            raise ValueError(f"wire must be an unconnected delay, not {state.op.value} {state.name!r}")
        if node.frac != state.frac or node.low < state.low or node.high > state.high:
            raise ValueError(f"source of {state.name!r} must fit its format and range, not {node!r}")
        self._nodes[delay.index] = replace(state, operands=(source.index,))

    def previous(self, source: Wire, name: str) -> Wire:
        """Return `source` delayed by one sample; `source` must already be computed."""
        node = self[source]
        delay = self.delay(name, node.frac, node.low, node.high)
        self.connect(delay, source)
        return delay

    def add(self, a: Wire, b: Wire, name: str = "") -> Wire:
        """Add exactly; the result has the longer fraction of the two."""
        frac, (al, ah), (bl, bh) = self._align(a, b)
        return self._append(Node(Op.ADD, (a.index, b.index), frac, al + bl, ah + bh, name=name))

    def subtract(self, a: Wire, b: Wire, name: str = "") -> Wire:
        """Subtract `b` from `a` exactly; the result has the longer fraction of the two."""
        frac, (al, ah), (bl, bh) = self._align(a, b)
        return self._append(Node(Op.SUBTRACT, (a.index, b.index), frac, al - bh, ah - bl, name=name))

    def _align(self, a: Wire, b: Wire) -> tuple[int, tuple[int, int], tuple[int, int]]:
        first, second = self[a], self[b]
        frac = max(first.frac, second.frac)
        up, down = frac - first.frac, frac - second.frac
        return frac, (first.low << up, first.high << up), (second.low << down, second.high << down)

    def shift(self, a: Wire, exponent: int) -> Wire:
        """Multiply by ``2**exponent`` exactly, by moving the binary point."""
        node = self[a]
        if exponent == 0:
            return a
        return self._append(Node(Op.SHIFT, (a.index,), node.frac - exponent, node.low, node.high, parameter=exponent))

    def scale(self, a: Wire, coefficient: int, frac: int, name: str = "") -> Wire:
        """Multiply by the constant ``coefficient * 2**-frac`` exactly."""
        node = self[a]
        ends = sorted((node.low * coefficient, node.high * coefficient))
        return self._append(Node(Op.SCALE, (a.index,), node.frac + frac, ends[0], ends[1], coefficient, frac, name))

    def multiply(self, a: Wire, b: Wire, name: str = "") -> Wire:
        """Multiply two values exactly."""
        first, second = self[a], self[b]
        ends = [x * y for x in (first.low, first.high) for y in (second.low, second.high)]
        return self._append(
            Node(Op.MULTIPLY, (a.index, b.index), first.frac + second.frac, min(ends), max(ends), name=name)
        )

    def combine(self, terms: Iterable[tuple[int, Wire]], name: str = "") -> Wire:
        """Sum small integer multiples of wires exactly; each factor must be 0 or plus or minus a power of two."""
        total: Wire | None = None
        ordered = [term for term in terms if term[0]]
        # The first of those that are added comes first: a negation is needed only where everything is subtracted.
        first = next((k for k, (factor, _) in enumerate(ordered) if factor > 0), 0)
        for factor, wire in [*ordered[first : first + 1], *ordered[:first], *ordered[first + 1 :]]:
            size = abs(factor)
            if size & (size - 1):
                raise ValueError(f"factor must be 0 or plus or minus a power of two, not {factor!r}")
            term = self.shift(wire, size.bit_length() - 1)
            if total is None:
                total = term if factor > 0 else self.subtract(self.constant(0, self[term].frac), term)
            else:
                total = self.add(total, term) if factor > 0 else self.subtract(total, term)
        if total is None:
            return self.constant(0, 0, name)
        return self.named(total, name)

    def named(self, wire: Wire, name: str) -> Wire:
        """Give a passing result a name for people and for the hardware."""
        if name and not self[wire].name:
            self._nodes[wire.index] = replace(self[wire], name=name)
        return wire

    def floor(self, a: Wire, frac: int, name: str = "") -> Wire:
        """Drop bits down to `frac` fraction bits; exact if `a` has no more."""
        node = self[a]
        shift = node.frac - frac
        if shift < 0:
            return self.add(a, self.constant(0, frac), name)
        if shift == 0:
            return self.named(a, name)
        return self._append(Node(Op.FLOOR, (a.index,), frac, node.low >> shift, node.high >> shift, name=name))

    def fraction(self, a: Wire, frac: int, name: str = "") -> Wire:
        """Return what `floor` to `frac` fraction bits drops, exactly; at least 0 and below ``2**-frac``."""
        node = self[a]
        shift = node.frac - frac
        if shift <= 0:
            return self.constant(0, node.frac, name)
        return self._append(Node(Op.FRACTION, (a.index,), node.frac, 0, (1 << shift) - 1, parameter=frac, name=name))

    def truncate(self, a: Wire, frac: int, name: str = "") -> Wire:
        """Round towards zero to `frac` fraction bits; exact if `a` has no more."""
        node = self[a]
        shift = node.frac - frac
        if shift <= 0:
            return self.floor(a, frac, name)
        low, high = _truncated(node.low, shift), _truncated(node.high, shift)
        return self._append(Node(Op.TRUNCATE, (a.index,), frac, low, high, name=name))

    def round(self, a: Wire, frac: int, name: str = "") -> Wire:
        """Round to nearest with ties upward; exact if `a` has no more than `frac` fraction bits."""
        if self[a].frac <= frac:
            return self.floor(a, frac, name)
        return self.floor(self.add(a, self.constant(1, frac + 1)), frac, name)

    def clamp(self, a: Wire, low: int, high: int, name: str = "") -> Wire:
        """Limit the code to `low`..`high`."""
        return self._append(Node(Op.CLAMP, (a.index,), self[a].frac, low, high, name=name))

    def bound(self, a: Wire, low: int, high: int, name: str = "") -> Wire:
        """State that the code stays in `low`..`high`, known from outside (a peak gain), and so narrow it."""
        node = self[a]
        return self._append(Node(Op.BOUND, (a.index,), node.frac, max(low, node.low), min(high, node.high), name=name))

    def build(self, outputs: Sequence[Wire]) -> Graph:
        """Freeze the graph.

        Raises
        ------
        ValueError
            If a delay was never connected.
        """
        for node in self._nodes:
            if node.op is Op.DELAY and node.operands == (-1,):
                raise ValueError(f"delay {node.name!r} must be connected")
        return Graph(tuple(self._nodes), tuple(self._inputs), tuple(wire.index for wire in outputs))


def value(node: Node, code: int) -> Fraction:
    """Exact value of `code` in the format of `node`."""
    return Fraction(code) * Fraction(2) ** -node.frac
