"""Integer dataflow graphs: the one description of a datapath, from which everything else is made.

A graph is a list of nodes in the order of computation. A node carries an integer `code` with
`frac` fraction bits, so its value is ``code * 2**-frac``, and the integer range ``low..high`` that
the code never leaves. The exact interpreter here, the C model (`sosmith.model.dataflow.c_model`) and the
hardware (`sosmith.hdl.pipelined_logic`) all walk the same nodes.

The usual quantizer is FLOOR, which drops lower bits and costs nothing; FRACTION is the bits that it drops.
Rounding to nearest, ties upward, adds a half before it. TRUNCATE drops bits of the magnitude, which never makes
a value larger: a recursion that cannot gain energy then comes to rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import NamedTuple, NewType


class Op(Enum):
    """Operation of a node."""

    INPUT = "input"
    CONSTANT = "constant"
    ADD = "add"
    SUBTRACT = "subtract"
    SHIFT = "shift"  # multiplies by 2**parameter: the same code, another binary point
    SCALE = "scale"  # multiplies by the constant parameter * 2**-parameter_frac
    MULTIPLY = "multiply"
    FLOOR = "floor"  # to `frac` fraction bits, by dropping the others
    FRACTION = "fraction"  # what FLOOR to `parameter` fraction bits drops: a - floor(a), never negative
    TRUNCATE = "truncate"  # to `frac` fraction bits, towards zero
    CLAMP = "clamp"  # limits to low..high
    BOUND = "bound"  # states that the value stays in low..high; no logic
    DELAY = "delay"  # the operand at the sample before; 0 at reset

    __hash__ = object.__hash__  # members are compared by identity, and looked up for every node


class Range(NamedTuple):
    """Integer codes that a signal takes: ``code * 2**-frac`` for codes from `low` to `high`."""

    frac: int
    low: int
    high: int

    @property
    def limits(self) -> tuple[Fraction, Fraction]:
        """Lowest and highest value, exact."""
        unit = Fraction(2) ** -self.frac
        return self.low * unit, self.high * unit


class Node(NamedTuple):
    """One operation.

    Attributes
    ----------
    op : Op
        The operation.
    operands : tuple of int
        Indices of the operands in the graph; that of a DELAY may come later.
    frac : int
        Fraction bits of the result; negative for multiples of a power of two.
    low, high : int
        Range of the result's code.
    parameter, parameter_frac : int
        Constant of CONSTANT, SCALE and SHIFT; for FRACTION, the fraction bits that FLOOR would keep.
    name : str
        Name in documents and in the hardware, ``""`` for an intermediate result.
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
    def range(self) -> Range:
        """Fraction bits and range of the result's code."""
        return Range(self.frac, self.low, self.high)

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


_Ranged = Range | Node


class RangeError(ArithmeticError):
    """A value left the range that its node states: an overflow in hardware."""


@dataclass(frozen=True)
class Graph:
    """A frozen dataflow graph; its delays are its state.

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

    @property
    def input_ranges(self) -> tuple[Range, ...]:
        """Ranges of the inputs, in port order."""
        return tuple(self.nodes[i].range for i in self.inputs)

    @property
    def output_ranges(self) -> tuple[Range, ...]:
        """Ranges of the outputs, in port order."""
        return tuple(self.nodes[i].range for i in self.outputs)

    def is_gate(self, node: Node) -> bool:
        """Whether a node is a product with a bit that is not a constant: all bits of the other operand, or none."""
        if node.op is not Op.MULTIPLY:
            return False
        factors = [self.nodes[i] for i in node.operands]
        return any(of.width == 1 and not of.signed and of.op is not Op.CONSTANT for of in factors)

    def concatenated(self, node: Node) -> tuple[int, int] | None:
        """Return the operands of a sum that takes no adder, the upper one first; None for any other node.

        The lower one is never negative, and all its bits lie below those of the upper one.
        """
        if node.op is not Op.ADD:
            return None
        for upper, lower in (node.operands, node.operands[::-1]):
            above, below = self.nodes[upper], self.nodes[lower]
            if not below.signed and below.width - below.frac <= -above.frac:
                return upper, lower
        return None

    def undelayed(self, index: int) -> tuple[int, int]:
        """Return the node that `index` is a delayed copy of, itself if it is none, and the delay in samples."""
        delay = 0
        while self.nodes[index].op is Op.DELAY:
            index, delay = self.nodes[index].operands[0], delay + 1
        return index, delay

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
            If a node's code leaves the range that the node states.
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
        """Compute samples in a row from `state`, or from reset if None; the slow, exact reference."""
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


def range_of(node: Node, operands: Sequence[Range], constant: tuple[int, int] | None = None) -> Range:
    """Derive the range of a node's result from those of its operands, by interval arithmetic.

    An INPUT and a CLAMP keep the range that they state; a BOUND keeps what its own and its operand's have in common.

    Parameters
    ----------
    node : Node
        The operation; its fraction bits count for INPUT, CONSTANT, FLOOR and TRUNCATE, its range as said above.
    operands : sequence of Range
        Ranges of its operands.
    constant : tuple of int or None
        Smallest and largest value that the constant of SCALE or CONSTANT may take; None for the one it has.
    """
    if node.op is Op.INPUT:
        return node.range
    if node.op is Op.CONSTANT:
        return Range(node.frac, *(constant or (node.parameter, node.parameter)))
    if node.op is Op.SCALE and constant is not None:
        return _product(operands[0], Range(node.parameter_frac, *constant))
    return _range_of(node.op, operands, node, node.parameter, node.parameter_frac)


def _range_of(op: Op, operands: Sequence[_Ranged], stated: _Ranged, parameter: int, parameter_frac: int) -> Range:
    """Do the same for an operation with operands, from what else its node states."""
    first = operands[0]
    if op is Op.ADD or op is Op.SUBTRACT:
        second = operands[1]
        frac = max(first.frac, second.frac)
        up, down = frac - first.frac, frac - second.frac
        ends = second.low << down, second.high << down
        low, high = ends if op is Op.ADD else (-ends[1], -ends[0])
        return Range(frac, (first.low << up) + low, (first.high << up) + high)
    if op is Op.SCALE:
        return _product(first, Range(parameter_frac, parameter, parameter))
    if op is Op.MULTIPLY:
        return _product(*operands)
    return _range_of_one(op, first, stated, parameter)


def _product(a: _Ranged, b: _Ranged) -> Range:
    products = (a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high)
    return Range(a.frac + b.frac, min(products), max(products))


def _range_of_one(op: Op, of: _Ranged, stated: _Ranged, parameter: int) -> Range:
    """Range of an operation with one operand and no factor."""
    if op is Op.SHIFT:
        return Range(of.frac - parameter, of.low, of.high)
    if op is Op.FLOOR:
        return Range(stated.frac, of.low >> (of.frac - stated.frac), of.high >> (of.frac - stated.frac))
    if op is Op.FRACTION:
        return Range(of.frac, 0, (1 << (of.frac - parameter)) - 1)
    if op is Op.TRUNCATE:
        low, high = (_truncated(end, of.frac - stated.frac) for end in (of.low, of.high))
        return Range(stated.frac, low, high)
    if op is Op.CLAMP:
        return Range(of.frac, stated.low, stated.high)
    if op is Op.BOUND:
        return Range(of.frac, max(stated.low, of.low), min(stated.high, of.high))
    return Range(of.frac, min(of.low, 0), max(of.high, 0))  # a DELAY begins at zero


_UNSTATED = Range(0, 0, 0)


Wire = NewType("Wire", int)
"""Handle to a node while its graph is being built: its index."""


class GraphBuilder:
    """Builds a `Graph` node by node, deriving fraction bits and ranges by interval arithmetic."""

    def __init__(self) -> None:
        self._nodes: list[Node] = []
        self._inputs: list[int] = []

    def __getitem__(self, wire: Wire) -> Node:
        return self._nodes[wire]

    def _append(self, node: Node) -> Wire:
        self._nodes.append(node)
        return Wire(len(self._nodes) - 1)

    def _derived(
        self,
        op: Op,
        *operands: Wire,
        stated: Range = _UNSTATED,
        parameter: int = 0,
        parameter_frac: int = 0,
        name: str = "",
    ) -> Wire:
        """Append a node whose fraction bits and range follow from its operands, and from those `stated`."""
        derived = _range_of(op, [self._nodes[wire] for wire in operands], stated, parameter, parameter_frac)
        return self._append(Node(op, operands, *derived, parameter, parameter_frac, name))

    def input(self, name: str, frac: int, low: int, high: int) -> Wire:
        """Add an input port whose code is in `low`..`high`."""
        wire = self._append(Node(Op.INPUT, (), frac, low, high, name=name))
        self._inputs.append(wire)
        return wire

    def constant(self, code: int, frac: int, name: str = "") -> Wire:
        """Add the constant ``code * 2**-frac``."""
        return self._append(Node(Op.CONSTANT, (), frac, code, code, parameter=code, name=name))

    def delay(self, name: str, frac: int, low: int, high: int) -> Wire:
        """Add a state that starts at zero; `connect` gives it its next value."""
        return self._append(Node(Op.DELAY, (-1,), frac, min(low, 0), max(high, 0), name=name))

    def copied(self, node: Node, operands: Sequence[Wire]) -> Wire:
        """Add a node of another graph with its range and name as they are; a DELAY is yet to be connected."""
        wire = self._append(node._replace(operands=(-1,) if node.op is Op.DELAY else tuple(operands)))
        if node.op is Op.INPUT:
            self._inputs.append(wire)
        return wire

    def connect(self, delay: Wire, source: Wire) -> None:
        """Make `source` at this sample the value of `delay` at the next.

        Raises
        ------
        ValueError
            If `delay` is connected already, or `source` has another format or a wider range.
        """
        state, node = self[delay], self[source]
        if state.op is not Op.DELAY or state.operands != (-1,):
            raise ValueError(f"wire must be an unconnected delay, not {state.op.value} {state.name!r}")
        if node.frac != state.frac or node.low < state.low or node.high > state.high:
            raise ValueError(f"source of {state.name!r} must fit its format and range, not {node!r}")
        self._nodes[delay] = state._replace(operands=(source,))

    def previous(self, source: Wire, name: str) -> Wire:
        """Return `source` delayed by one sample; `source` must already be computed."""
        node = self[source]
        delay = self.delay(name, node.frac, node.low, node.high)
        self.connect(delay, source)
        return delay

    def add(self, a: Wire, b: Wire, name: str = "") -> Wire:
        """Add exactly; the result has the longer fraction of the two."""
        return self._derived(Op.ADD, a, b, name=name)

    def subtract(self, a: Wire, b: Wire, name: str = "") -> Wire:
        """Subtract `b` from `a` exactly; the result has the longer fraction of the two."""
        return self._derived(Op.SUBTRACT, a, b, name=name)

    def shift(self, a: Wire, exponent: int) -> Wire:
        """Multiply by ``2**exponent`` exactly, by moving the binary point."""
        return a if exponent == 0 else self._derived(Op.SHIFT, a, parameter=exponent)

    def scale(self, a: Wire, coefficient: int, frac: int, name: str = "") -> Wire:
        """Multiply by the constant ``coefficient * 2**-frac`` exactly."""
        return self._derived(Op.SCALE, a, parameter=coefficient, parameter_frac=frac, name=name)

    def multiply(self, a: Wire, b: Wire, name: str = "") -> Wire:
        """Multiply two values exactly."""
        return self._derived(Op.MULTIPLY, a, b, name=name)

    def combine(self, terms: Iterable[tuple[int, Wire]], name: str = "") -> Wire:
        """Add multiples of wires exactly; each factor must be 0 or plus or minus a power of two.

        Raises
        ------
        ValueError
            If a factor is another number.
        """
        total: Wire | None = None
        ordered = [term for term in terms if term[0]]
        # A term that is added comes first: a negation is needed only if all terms are subtracted.
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
        """Name an intermediate result, unless it has a name."""
        if name and not self[wire].name:
            self._nodes[wire] = self[wire]._replace(name=name)
        return wire

    def floor(self, a: Wire, frac: int, name: str = "") -> Wire:
        """Drop bits down to `frac` fraction bits; exact if `a` has no more."""
        shift = self[a].frac - frac
        if shift < 0:
            return self.add(a, self.constant(0, frac), name)
        return self.named(a, name) if shift == 0 else self._derived(Op.FLOOR, a, stated=Range(frac, 0, 0), name=name)

    def fraction(self, a: Wire, frac: int, name: str = "") -> Wire:
        """Return what `floor` to `frac` fraction bits drops, exactly: at least 0 and below ``2**-frac``."""
        if self[a].frac <= frac:
            return self.constant(0, self[a].frac, name)
        return self._derived(Op.FRACTION, a, parameter=frac, name=name)

    def truncate(self, a: Wire, frac: int, name: str = "") -> Wire:
        """Round towards zero to `frac` fraction bits; exact if `a` has no more."""
        if self[a].frac <= frac:
            return self.floor(a, frac, name)
        return self._derived(Op.TRUNCATE, a, stated=Range(frac, 0, 0), name=name)

    def round(self, a: Wire, frac: int, name: str = "") -> Wire:
        """Round to nearest, ties upward; exact if `a` has no more than `frac` fraction bits."""
        if self[a].frac <= frac:
            return self.floor(a, frac, name)
        return self.floor(self.add(a, self.constant(1, frac + 1)), frac, name)

    def clamp(self, a: Wire, low: int, high: int, name: str = "") -> Wire:
        """Limit the code to `low`..`high`."""
        return self._derived(Op.CLAMP, a, stated=Range(0, low, high), name=name)

    def bound(self, a: Wire, low: int, high: int, name: str = "") -> Wire:
        """State that the code stays in `low`..`high`, known from a peak gain, and narrow its range to that."""
        return self._derived(Op.BOUND, a, stated=Range(0, low, high), name=name)

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
        return Graph(tuple(self._nodes), tuple(self._inputs), tuple(outputs))


def value(node: Node, code: int) -> Fraction:
    """Exact value of `code` in the format of `node`."""
    return Fraction(code) * Fraction(2) ** -node.frac
