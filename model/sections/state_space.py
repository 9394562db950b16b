"""State-space sections in integers, with a quantizer at each state and one at the output.

With the input u, the states x and the output y::

    x(n+1) = Q(A x(n) + B u(n))
    y(n)   = round(C x(n) + D u(n))

Every sum is exact before its quantizer. The diagonal of A is an integer part of 0, 1 or -1 plus a coefficient:
where poles lie near z = 1 or z = -1, the coefficient is small and a few significant bits place the poles to a
small fraction of their distance from there. Coefficients that are powers of two cost no multiplication.

Q rounds to nearest, or truncates magnitudes: then, if some diagonal D > 0 makes ``D - A' D A`` positive definite,
``x' D x`` falls at every sample without input until the state is zero, and no limit cycle is possible
(Mills, Mullis and Roberts 1978).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range, Wire


class Coefficient(NamedTuple):
    """The constant ``integer * 2**-frac``."""

    integer: int
    frac: int

    @property
    def value(self) -> Fraction:
        """Exact value."""
        return self.integer * Fraction(2) ** -self.frac


@dataclass(frozen=True, kw_only=True)
class StateSpace:
    """A section of one or two states; a stage of a datapath.

    Attributes
    ----------
    name : str
        Name of the section.
    a : tuple of tuple of Coefficient
        Rows of A, the diagonal without its integer part; one row for each state.
    integer_part : tuple of int
        Integer part of the diagonal of A; each 0, 1 or -1.
    b, c : tuple of Coefficient
        One for each state.
    d : Coefficient
        From input to output.
    truncating : bool
        Whether the states are truncated towards zero; else they are rounded to nearest, ties upward.
    u : Range
        Range of the input.
    x : tuple of Range
        Range of each state, from peak gains.
    y : Range
        Range of the output, from peak gains.
    """

    name: str
    a: tuple[tuple[Coefficient, ...], ...]
    integer_part: tuple[int, ...]
    b: tuple[Coefficient, ...]
    c: tuple[Coefficient, ...]
    d: Coefficient
    truncating: bool
    u: Range
    x: tuple[Range, ...]
    y: Range

    def __post_init__(self) -> None:
        order = len(self.a)
        if order not in {1, 2}:
            raise ValueError(f"states must be one or two, not {order}")
        lengths = [*map(len, self.a), *map(len, (self.integer_part, self.b, self.c, self.x))]
        if set(lengths) != {order}:
            raise ValueError(f"everything about {order} states must come {order} times, not {lengths}")
        if not self.is_stable:
            a1, a2 = self.denominator
            raise ValueError(f"poles must lie inside the unit circle, not at a1 = {float(a1)}, a2 = {float(a2)}")

    @cached_property
    def matrix(self) -> tuple[tuple[Fraction, ...], ...]:
        """A with its integer part, exactly."""
        return tuple(
            tuple(entry.value + (self.integer_part[i] if i == j else 0) for j, entry in enumerate(row))
            for i, row in enumerate(self.a)
        )

    @property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """Integer and fraction bits of every coefficient that is not zero, by name."""
        order = range(1, len(self.a) + 1)
        named = {f"a{i}{j}": self.a[i - 1][j - 1] for i in order for j in order}
        named |= {f"b{i}": self.b[i - 1] for i in order} | {f"c{i}": self.c[i - 1] for i in order} | {"d": self.d}
        return {name: (c.integer, c.frac) for name, c in named.items() if c.integer}

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """Names of the nodes that may be quantized but need not be: none."""
        return ()

    @property
    def stated_fracs(self) -> dict[str, int]:
        """Fraction bits of the nodes with a stated range, by name, which follow without the graph."""
        return {f"x{i}_next": x.frac for i, x in enumerate(self.x, start=1)} | {"y": self.y.frac}

    @property
    def denominator(self) -> tuple[Fraction, Fraction]:
        """Exact (a1, a2) of the integer coefficients, in scipy's sign convention."""
        if len(self.a) == 1:
            return -self.matrix[0][0], Fraction(0)
        (a11, a12), (a21, a22) = self.matrix
        return -a11 - a22, a11 * a22 - a12 * a21

    @property
    def is_stable(self) -> bool:
        """Whether all poles lie inside the unit circle, decided in rationals."""
        a1, a2 = self.denominator
        return abs(a2) < 1 and abs(a1) < 1 + a2

    @cached_property
    def graph(self) -> Graph:
        """The section as a dataflow graph with the input ``u`` and the output ``y``.

        The sums before their quantizers are named ``x1_sum``, ``x2_sum`` and ``y_sum``, and behind them ``x1_next``,
        ``x2_next`` and ``y``.
        """
        g = GraphBuilder()
        u = g.input("u", *self.u)
        states = [g.delay(f"x{i}", *x) for i, x in enumerate(self.x, start=1)]
        for i, state in enumerate(states):
            name = f"x{i + 1}"
            terms = [(f"a{i + 1}{j}", entry, x) for j, (entry, x) in enumerate(zip(self.a[i], states, strict=True), 1)]
            total = [(self.integer_part[i], state), *_products(g, [*terms, (f"b{i + 1}", self.b[i], u)])]
            frac, low, high = self.x[i]
            quantize = _truncated if self.truncating else _rounded
            g.connect(state, g.bound(quantize(g, total, frac, f"{name}_sum"), low, high, f"{name}_next"))
        terms = [(f"c{j}", entry, x) for j, (entry, x) in enumerate(zip(self.c, states, strict=True), 1)]
        output = _rounded(g, _products(g, [*terms, ("d", self.d, u)]), self.y.frac, "y_sum")
        return g.build([g.bound(output, self.y.low, self.y.high, "y")])


_Term = tuple[int, Wire]
"""Sign of a summand, and its wire."""


def _products(g: GraphBuilder, factors: Sequence[tuple[str, Coefficient, Wire]]) -> list[_Term]:
    terms = []
    for name, (integer, frac), wire in factors:
        size = abs(integer)
        if size & (size - 1):
            product = g.scale(wire, size, frac, f"product_{name}")
        else:
            product = g.shift(wire, size.bit_length() - 1 - frac)
        if size:
            terms.append((1 if integer > 0 else -1, product))
    return terms


def _rounded(g: GraphBuilder, terms: Sequence[_Term], frac: int, name: str) -> Wire:
    total = g.combine(terms)
    if g[total].frac > frac:
        total = g.add(total, g.constant(1, frac + 1))
    return g.floor(g.named(total, name), frac)


def _truncated(g: GraphBuilder, terms: Sequence[_Term], frac: int, name: str) -> Wire:
    return g.truncate(g.named(g.combine(terms), name), frac)
