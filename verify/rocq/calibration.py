"""The calibration for Rocq: its polynomial in the codes of the inputs, and how far from it the graph may be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

from sosmith.verify.certificate_file import Certificate, NodeEntry, Operation, PortEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.flat import FlatGraph
from sosmith.verify.rocq.polynomials import number, rows

Polynomial = Mapping[tuple[int, int], Fraction]
"""Coefficients by the powers of the first and the second code."""


@dataclass(frozen=True)
class Calibration:
    """The exact input of the filter as a polynomial in codes, in units of the output's last place.

    Attributes
    ----------
    physical : str
        The formula in physical units, as a term of Rocq in `x`, the codes.
    whole : str
        The polynomial in codes, in integers, as a term of Rocq.
    denominator : int
        By which it is divided.
    error : Fraction
        Bound on the difference of the node that enters the filter.
    most : int
        Bound on its magnitude.
    """

    physical: str
    whole: str
    denominator: int
    error: Fraction
    most: int


def calibration_of(certificate: Certificate, graph: FlatGraph, node: int) -> Calibration:
    """Follow the graph up to a node, as Rocq's `calibration_holds` does.

    Raises
    ------
    RejectedError
        If a node before it is of a kind that no polynomial is known for.
    """
    sizes = [max(abs(low), abs(high)) for low, high in graph.ports] + [0]
    exact = _exact(certificate)
    denominator = 1
    for value in exact.values():
        denominator = denominator * value.denominator // _gcd(denominator, value.denominator)
    made, radius = _followed(graph, node, sizes)
    unit = Fraction(2) ** -graph.node(node).frac
    apart = {key: made.get(key, Fraction(0)) * unit - exact.get(key, Fraction(0)) for key in made.keys() | exact.keys()}
    width = max(i for i, _ in exact) + 1 if exact else 1
    whole = [
        [int(exact.get((i, j), Fraction(0)) * denominator) for j in range(max(k for _, k in exact) + 1)]
        for i in range(width)
    ]
    middles = [*graph.ports, (0, 0)]
    error = radius * unit + _size(_about(apart, middles), [abs(high - low) for low, high in middles])
    return Calibration(formula(certificate), rows(whole), denominator, error, -int(-_size(exact, sizes) // 1))


def _gcd(a: int, b: int) -> int:
    while b:
        a, b = b, a % b
    return a


def _size(polynomial: Polynomial, sizes: Sequence[int]) -> Fraction:
    return sum((abs(value) * sizes[0] ** i * sizes[1] ** j for (i, j), value in polynomial.items()), Fraction(0))


def _about(polynomial: Polynomial, ports: Sequence[tuple[int, int]]) -> Polynomial:
    """Return a polynomial in twice the distances from the middles of the codes' ranges."""
    codes = [
        {(0, 0): Fraction(low + high, 2), (1 - at, at): Fraction(1, 2)} for at, (low, high) in enumerate(ports[:2])
    ]
    total: Polynomial = {}
    for (i, j), value in polynomial.items():
        term: Polynomial = {(0, 0): value}
        for code in [codes[0]] * i + [codes[1]] * j:
            term = _times(term, code)
        total = _plus(total, term)
    return total


def _times(a: Polynomial, b: Polynomial) -> dict[tuple[int, int], Fraction]:
    made: dict[tuple[int, int], Fraction] = {}
    for ((i, j), x), ((k, m), y) in product(a.items(), b.items()):
        made[i + k, j + m] = made.get((i + k, j + m), Fraction(0)) + x * y
    return made


def _plus(a: Polynomial, b: Polynomial, factor: Fraction | int = 1) -> dict[tuple[int, int], Fraction]:
    return {key: a.get(key, Fraction(0)) + factor * b.get(key, Fraction(0)) for key in a.keys() | b.keys()}


def _exact(certificate: Certificate) -> Polynomial:
    """Return the ideal polynomial in codes, in units of the output's last place."""
    ports = certificate.inputs
    physical = [{(0, 0): port.zero, (1 - at, at): port.lsb} for at, port in enumerate(ports)]
    total: Polynomial = {}
    for i, row in enumerate(_table(certificate)):
        for j, coefficient in enumerate(row):
            term: Polynomial = {(0, 0): coefficient / certificate.output.lsb}
            for value in [physical[0]] * i + [physical[-1]] * j:
                term = _times(term, value)
            total = _plus(total, term)
    return {key: value for key, value in total.items() if value}


def _table(certificate: Certificate) -> Sequence[Sequence[Fraction]]:
    return certificate.ideal.polynomial or ((Fraction(0),), (Fraction(1),))


def _rational(value: Fraction) -> str:
    return f"{number(value.numerator)} / {value.denominator}" if value.denominator > 1 else number(value.numerator)


def formula(certificate: Certificate) -> str:
    """Write the ideal polynomial in physical units, in Horner's form, as a term of Rocq in `x`, the codes."""

    def horner(parts: Sequence[str], variable: str) -> str:
        text = parts[-1]
        for part in reversed(parts[:-1]):
            text = f"{part} + {variable} * ({text})"
        return text

    inner = [horner([f"({_rational(value)})" for value in row], "v") for row in _table(certificate)]
    lines = [
        f"  let {name} := {_port(port, at)} in\n"
        for at, (name, port) in enumerate(zip("uv", certificate.inputs, strict=False))
    ]
    return f"{''.join(lines)}  ({horner([f'({part})' for part in inner], 'u')}) / ({_rational(certificate.output.lsb)})"


def _port(port: PortEntry, at: int) -> str:
    return f"{_rational(port.zero)} + {_rational(port.lsb)} * IZR (x {at}%nat)"


def _followed(graph: FlatGraph, last: int, sizes: Sequence[int]) -> tuple[Polynomial, Fraction]:
    """Return the polynomial in codes that a node's code follows, and a bound on the difference."""
    made: list[tuple[Polynomial, Fraction]] = []
    for stage, (entries, offset) in enumerate(zip(graph.stages, graph.offsets, strict=False)):
        inputs = 0
        for at, node in enumerate(entries.nodes):
            if offset + at > last:
                return made[last]
            if node.op is Operation.INPUT:
                made.append(
                    ({(1 - inputs, inputs): Fraction(1)}, Fraction(0))
                    if not stage
                    else made[graph.feeds[stage][inputs]]
                )
                inputs += 1
            else:
                operands = [(graph.stages[stage].nodes[i], *made[offset + i]) for i in node.operands]
                made.append(_value(node, operands, sizes))
    return made[last]


def _value(
    node: NodeEntry, operands: Sequence[tuple[NodeEntry, Polynomial, Fraction]], sizes: Sequence[int]
) -> tuple[Polynomial, Fraction]:
    if node.op is Operation.CONSTANT:
        return {(0, 0): Fraction(node.parameter)}, Fraction(0)
    (first, exact, radius), *others = operands
    if node.op in {Operation.ADD, Operation.SUBTRACT}:
        ((second, more, wider),) = others
        up = [Fraction(2) ** (node.frac - of.frac) for of in (first, second)]
        sign = 1 if node.op is Operation.ADD else -1
        return _plus({key: up[0] * value for key, value in exact.items()}, more, sign * up[1]), up[0] * radius + up[
            1
        ] * wider
    if node.op is Operation.MULTIPLY:
        ((_, more, wider),) = others
        return _times(exact, more), _size(exact, sizes) * wider + _size(more, sizes) * radius + radius * wider
    if node.op is Operation.SCALE:
        return {key: node.parameter * value for key, value in exact.items()}, abs(node.parameter) * radius
    if node.op in {Operation.SHIFT, Operation.BOUND}:
        return exact, radius
    if node.op is Operation.FLOOR:
        drop = Fraction(1, 1 << first.frac - node.frac)
        half = (1 - drop) / 2
        shifted = _plus({key: drop * value for key, value in exact.items()}, {(0, 0): Fraction(1)}, -half)
        return shifted, drop * radius + half
    raise RejectedError(f"a polynomial must be known of a node before the filter, not a {node.op.value}")
