"""Follows a certificate's polynomial and output stages symbolically.

These stages have no memory: every value is an exact polynomial in the inputs plus a bounded error. Each input is
written about the middle of its range, as ``c + r w`` with |w| at most one, so that the sum of the coefficients'
absolute values bounds a polynomial. In the calibration, what a rounding down drops is a whole number of units of its
operand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from operator import add

from sosmith.verify.certificate_file import Certificate, NodeEntry, Operation, PortEntry, StageEntry
from sosmith.verify.graph import check_product, inputs_of, label, require

_Polynomial = dict[tuple[int, ...], Fraction]
"""Coefficients by the powers of the variables."""


@dataclass(frozen=True)
class _Value:
    """An exact polynomial in variables of magnitude at most one, within `radius` of a node's value."""

    exact: _Polynomial
    radius: Fraction

    @property
    def size(self) -> Fraction:
        """Bound on the polynomial's absolute value."""
        return sum(map(abs, self.exact.values()), Fraction(0))

    def plus(self, other: _Value, factor: int = 1) -> _Value:
        """Sum, or with `factor` -1 difference."""
        keys = self.exact.keys() | other.exact.keys()
        total = {key: self.exact.get(key, Fraction(0)) + factor * other.exact.get(key, Fraction(0)) for key in keys}
        return _Value(total, self.radius + other.radius)

    def times(self, other: _Value) -> _Value:
        """Product."""
        degrees = [max(map(sum, value.exact), default=0) for value in (self, other)]
        check_product(len(self.exact) * len(other.exact), sum(degrees))
        total: _Polynomial = {}
        for (p, a), (q, b) in product(self.exact.items(), other.exact.items()):
            key = tuple(map(add, p, q))
            total[key] = total.get(key, Fraction(0)) + a * b
        radius = self.radius * other.size + other.radius * self.size + self.radius * other.radius
        return _Value(total, radius)


def _constant(value: Fraction, variables: int) -> _Value:
    return _Value({(0,) * variables: value}, Fraction(0))


def _variable(index: int, variables: int) -> _Value:
    return _Value({tuple(int(i == index) for i in range(variables)): Fraction(1)}, Fraction(0))


def _centred(entry: NodeEntry, index: int, variables: int) -> _Value:
    """Return an input as the middle of its range, and half its width times a variable."""
    unit = Fraction(2) ** -entry.frac / 2
    middle, radius = (entry.low + entry.high) * unit, (entry.high - entry.low) * unit
    return _variable(index, variables).times(_constant(radius, variables)).plus(_constant(middle, variables))


def _through(stage: StageEntry, arriving: Sequence[_Value], variables: int) -> list[_Value]:
    """Values of all nodes of a stage without memory."""
    supply = iter(arriving)
    values: list[_Value] = []
    for index, node in enumerate(stage.nodes):
        operands = [values[i] for i in node.operands if node.op is not Operation.DELAY]
        values.append(next(supply) if node.op is Operation.INPUT else _value(stage, index, operands, variables))
    return values


def _value(stage: StageEntry, index: int, operands: Sequence[_Value], variables: int) -> _Value:
    node = stage.nodes[index]
    if node.op is Operation.CONSTANT:
        return _constant(node.parameter * Fraction(2) ** -node.frac, variables)
    if node.op in {Operation.ADD, Operation.SUBTRACT}:
        return operands[0].plus(operands[1], 1 if node.op is Operation.ADD else -1)
    if node.op is Operation.MULTIPLY and stage.role == "polynomial":
        return operands[0].times(operands[1])
    if node.op is Operation.SHIFT:
        return operands[0].times(_constant(Fraction(2) ** node.parameter, variables))
    if node.op is Operation.SCALE:
        return operands[0].times(_constant(node.parameter * Fraction(2) ** -node.parameter_frac, variables))
    if node.op is Operation.FLOOR:  # the middle of the dropped range, plus or minus half its width
        half = Fraction(2) ** -node.frac / 2
        if stage.role == "polynomial":
            half -= Fraction(2) ** -stage.nodes[node.operands[0]].frac / 2
        return _Value(operands[0].plus(_constant(-half, variables)).exact, operands[0].radius + half)
    require(
        node.op is Operation.CLAMP and stage.role == "output" and stage.outputs == (index,),
        f"{label(stage, index)} must not be in a {stage.role} stage",
    )
    return operands[0]


def polynomial_error(certificate: Certificate, stages: Sequence[StageEntry]) -> Fraction:
    """Bound the error of the polynomial stages over all input codes, in output LSBs.

    Raises
    ------
    RejectedError
        If the stages do not compute a polynomial in variables of magnitude at most one.
    """
    entries = [stages[0].nodes[index] for index in inputs_of(stages[0])]
    count = len(entries)
    for entry in entries:
        require(
            max(-entry.low, entry.high) <= Fraction(2) ** entry.frac,
            f"input {entry.name} must be at most one in size, not with {entry.frac} fraction bits",
        )
    wires = [_centred(entry, index, count) for index, entry in enumerate(entries)]
    for stage in stages:
        values = _through(stage, wires, count)
        wires = [values[i] for i in stage.outputs]
    require(len(wires) == 1, f"the polynomial must have one result, not {len(wires)}")
    difference = wires[0].plus(_ideal_polynomial(certificate, entries), -1)
    return difference.size + difference.radius


def _ideal_polynomial(certificate: Certificate, entries: Sequence[NodeEntry]) -> _Value:
    """Return the ideal polynomial in the same variables, in output LSBs."""
    count = len(entries)
    physical = [
        _affine(port, entry, index, count)
        for index, (port, entry) in enumerate(zip(certificate.inputs, entries, strict=True))
    ]
    rows = certificate.ideal.polynomial or ((Fraction(0),), (Fraction(1),))
    require(count > 1 or max(map(len, rows)) == 1, "the calibration of one input must have one column")
    total = _constant(Fraction(0), count)
    for i, row in enumerate(rows):
        for j, coefficient in enumerate(row):
            term = _constant(coefficient / certificate.output.lsb, count)
            for value in [physical[0]] * i + [physical[-1]] * j:
                term = term.times(value)
            total = total.plus(term)
    return total


def _affine(port: PortEntry, entry: NodeEntry, index: int, count: int) -> _Value:
    """``zero + lsb * code`` with the variable ``code * 2**-frac``."""
    scale = _constant(port.lsb * Fraction(2) ** entry.frac, count)
    return _centred(entry, index, count).times(scale).plus(_constant(port.zero, count))


def output_error(certificate: Certificate, stage: StageEntry) -> tuple[Fraction, Fraction]:
    """Bound the error of the last stage, in output LSBs, and find the gain of its second input, 0 without one.

    The stage adds the second input with that gain, subtracts the output's zero, rounds and limits.

    Raises
    ------
    RejectedError
        If it does anything else.
    """
    port, node = certificate.output, stage.nodes[stage.outputs[0]]
    require(
        node.op is not Operation.CLAMP or (node.low, node.high) == (port.lowest, port.highest),
        f"the output must be limited to {port.lowest}..{port.highest}, not {node.low}..{node.high}",
    )
    count = len(inputs_of(stage))
    require(count in {1, 2}, f"{stage.name} must have one or two inputs, not {count}")
    variables = [_variable(index, count) for index in range(count)]
    polynomial = _through(stage, variables, count)[stage.outputs[0]]
    difference = polynomial.plus(variables[0], -1).plus(_constant(port.zero / port.lsb, count))
    factor = difference.exact.pop((1, 0)[:count], Fraction(0)) + 1
    require(factor == 1, f"{stage.name} must add to its input and no more, not multiply it by {factor}")
    gain = difference.exact.pop((0, 1), Fraction(0))
    return difference.size + difference.radius, gain
