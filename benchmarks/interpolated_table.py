"""A curve as a table over the voltage: values at equal steps, interpolated, one table for each order of temperature.

::

    code of the voltage --+-- upper bits --> | table of r_0 | --> interpolation --> r_0(u) --------------+
                          |                  | table of r_1 | --> interpolation --> r_1(u) --(*)--------(+)--> output
                          +-- lower bits: x in [0, 1)                                         |
    code of the temperature ------------------------------------------------------------ t ---+

The curve is ``q(u, t) = r_0(u) + r_1(u) t`` in output LSBs, with codes read as fractions, u and t in [0, 1). What
linear interpolation over a segment of width h misses is at most ``h**2 / 8 max|q''|``, and a parabola through its ends
and its middle ``(h / 2)**3 / (9 sqrt(3)) max|q'''|``, primes by u (the remainder of interpolation, e.g. Davis,
Interpolation and Approximation, section 3.1). The largest derivative on each segment is bounded by its Bernstein
coefficients there: all in rational numbers, nothing is sampled. As q is linear in t, it is largest at an end of t.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from math import comb

from sosmith.gen.word_lengths.output_stage import output_stage
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Wire
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port

Row = tuple[Fraction, ...]
"""A polynomial of u: the coefficient of ``u**k`` at k."""

REMAINDERS = {1: Fraction(1, 8), 2: Fraction(641501, 10**7) / 8}
"""By the degree of interpolation n: what the remainder is at most, times ``h**(n + 1) max|q^(n+1)|``; the second is
``1 / (72 sqrt(3))``, rounded up."""

ROUNDED = {1: Fraction(2), 2: Fraction(13, 4)}
"""By the degree: half steps of the rows' last bit by which an interpolated row is off: its values are rounded, which a
parabola enlarges to 5/4 at most, and each product with x is."""

HALF = Fraction(1, 2)
"""Rounding to the output's LSB, in LSB."""

LARGEST, MOST_FRAC = 14, 16
"""Largest exponent of the number of segments, and largest number of fraction bits, that are tried."""


def rows_of(normalised: Sequence[Sequence[Fraction]]) -> tuple[Row, Row]:
    """Return r_0 and r_1 of a polynomial whose ``normalised[i][j]`` belongs to ``u**i t**j``.

    Raises
    ------
    ValueError
        If the order in t is above 1.
    """
    if max(map(len, normalised)) > 2:
        raise ValueError(f"the order in the temperature must be at most 1, not {max(map(len, normalised)) - 1}")
    padded = [(*row, Fraction(0), Fraction(0)) for row in normalised]
    return tuple(row[0] for row in padded), tuple(row[1] for row in padded)


def derivative(row: Row, times: int) -> Row:
    """Return a derivative of a polynomial."""
    for _ in range(times):
        row = tuple(k * value for k, value in enumerate(row))[1:] or (Fraction(0),)
    return row


def bernstein(row: Row) -> list[Fraction]:
    """Return the Bernstein coefficients of a polynomial on [0, 1], between whose extremes its values are."""
    n = len(row) - 1
    return [sum((comb(k, i) * row[i] / comb(n, i) for i in range(k + 1)), Fraction(0)) for k in range(n + 1)]


def halves(coefficients: list[Fraction]) -> tuple[list[Fraction], list[Fraction]]:
    """Return the Bernstein coefficients on both halves of the interval (de Casteljau)."""
    left, right, level = list[Fraction](), list[Fraction](), coefficients
    while level:
        left.append(level[0])
        right.append(level[-1])
        level = [(a + b) / 2 for a, b in pairwise(level)]
    return left, right[::-1]


def misses(rows: tuple[Row, Row], degree: int) -> Iterator[Fraction]:
    """Yield what interpolation misses at most, in output LSBs, with 1, 2, 4, ... segments."""
    at_ends = (rows[0], tuple(a + b for a, b in zip(*rows, strict=True)))
    parts = [bernstein(derivative(row, degree + 1)) for row in at_ends]
    width = Fraction(1)
    while True:
        yield REMAINDERS[degree] * width ** (degree + 1) * max(abs(value) for part in parts for value in part)
        parts = [half for part in parts for half in halves(part)]
        width /= 2


def value(row: Row, u: Fraction) -> Fraction:
    """Return a polynomial's value."""
    result = Fraction(0)
    for coefficient in reversed(row):
        result = result * u + coefficient
    return result


def rounded(degree: int, frac: int) -> Fraction:
    """Return what rounding to so many fraction bits adds at most to the error: in two rows, and in their sum."""
    return (2 * ROUNDED[degree] + 1) / 2 ** (frac + 1)


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of integers in units of ``2**-frac`` output LSBs.

    Attributes
    ----------
    rows : tuple of Row
        r_0 and r_1, exact.
    degree : int
        1: lines between the values; 2: a parabola through each segment's ends and middle.
    exponent : int
        There are ``2**exponent`` segments.
    frac : int
        Fraction bits.
    missed : Fraction
        What interpolation misses at most, in output LSBs; exact.
    """

    rows: tuple[Row, Row]
    degree: int
    exponent: int
    frac: int
    missed: Fraction

    @property
    def depth(self) -> int:
        """Values of each row."""
        return (self.degree << self.exponent) + 1

    @property
    def bound(self) -> Fraction:
        """Bound on the error of the output code, in output LSBs: interpolation, rounded values and products, output."""
        return self.missed + rounded(self.degree, self.frac) + HALF

    @cached_property
    def values(self) -> tuple[tuple[int, ...], ...]:
        """The values of each row, in units of ``2**-frac``."""
        at = [Fraction(k, self.depth - 1) for k in range(self.depth)]
        return tuple(tuple(round(value(row, u) * 2**self.frac) for u in at) for row in self.rows)

    @cached_property
    def widths(self) -> tuple[int, ...]:
        """Bits of a value of each row, in two's complement."""
        return tuple(_bits(own) for own in self.values)

    @property
    def bits(self) -> int:
        """Bits of memory."""
        return self.depth * sum(self.widths)

    @property
    def reload_words(self) -> int:
        """Words of 32 bits to be loaded for another curve, with as many values in a word as it holds."""
        return self.depth * -(-sum(self.widths) // 32)

    def datapath(self, inputs: tuple[Port, Port], output: Port) -> Datapath:
        """Return the arithmetic behind the memory; its inputs are x, t, and for each row the values of a segment."""
        x = Port.from_range("x", inputs[0].bits, Fraction(0), Fraction(1))
        ports = [x, inputs[1]]
        ports += [
            Port(name=f"r{j}{k}", bits=bits, signed=True, lsb=output.lsb / 2**self.frac, zero=Fraction(0))
            for j, bits in enumerate(self.widths)
            for k in range(self.degree + 1)
        ]
        stage = _Stage("interpolation", self._graph(ports))
        last, _ = output_stage(stage.graph.output_ranges[0], output)
        return Datapath(name="interpolated", inputs=tuple(ports), output=output, stages=(stage, last))

    def operands(self, code: int, temperature: int, bits: int) -> tuple[int, ...]:
        """Return the inputs of `datapath` for a sample whose voltage has so many `bits`."""
        segment, x = divmod(code << self.exponent, 1 << bits)
        first = segment * self.degree
        return (x, temperature, *(own[first + k] for own in self.values for k in range(self.degree + 1)))

    def _graph(self, ports: Sequence[Port]) -> Graph:
        g = GraphBuilder()
        x, t = (g.input(port.name, port.bits, port.lowest, port.highest) for port in ports[:2])
        given = [g.input(port.name, self.frac, port.lowest, port.highest) for port in ports[2:]]
        points = self.degree + 1
        rows = [
            self._interpolated(g, x, given[j * points : (j + 1) * points], own) for j, own in enumerate(self.values)
        ]
        curve = g.add(g.multiply(rows[1], t, "by_temperature"), rows[0])
        return g.build([g.round(curve, self.frac, "curve")])

    def _interpolated(self, g: GraphBuilder, x: Wire, points: list[Wire], own: tuple[int, ...]) -> Wire:
        """Interpolate one row; differences are as wide as those of its values."""
        if self.degree == 1:
            slope = _limited(g, g.subtract(points[1], points[0]), [b - a for a, b in pairwise(own)])
            return g.round(g.add(g.multiply(slope, x), points[0]), self.frac)
        triples = list(zip(own[::2], own[1::2], own[2::2], strict=False))
        start, middle, end = points
        # p(x) = start + x (first + x second), through the points at 0, 1/2 and 1
        rise = g.subtract(middle, start)
        bend = _limited(g, g.subtract(g.subtract(end, middle), rise), [a - 2 * b + c for a, b, c in triples])
        second = g.add(bend, bend)  # of as many fraction bits as the rest
        first = _limited(g, g.subtract(g.shift(rise, 1), bend), [4 * b - 3 * a - c for a, b, c in triples])
        inner = g.round(g.add(g.multiply(second, x), first), self.frac)
        return g.round(g.add(g.multiply(inner, x), start), self.frac)


@dataclass(frozen=True)
class _Stage:
    name: str
    graph: Graph


def _limited(g: GraphBuilder, wire: Wire, values: list[int]) -> Wire:
    """State the bits that a difference takes."""
    span = 1 << (_bits(values) - 1)
    return g.bound(wire, -span, span - 1)


def _bits(values: Sequence[int]) -> int:
    return max((each if each >= 0 else -each - 1).bit_length() for each in values) + 1


def smallest(rows: tuple[Row, Row], degree: int, allowed: Fraction) -> Table:
    """Return the table of fewest bits whose error is proven to be at most `allowed`, in output LSBs.

    Raises
    ------
    ShortfallError
        If none with up to ``2**LARGEST`` segments is.
    """
    best: Table | None = None
    room, since = allowed - HALF, 0
    for exponent, missed in zip(range(LARGEST + 1), misses(rows, degree), strict=False):
        fracs = [frac for frac in range(MOST_FRAC + 1) if missed + rounded(degree, frac) <= room]
        if not fracs:
            continue
        table = Table(rows=rows, degree=degree, exponent=exponent, frac=fracs[0], missed=missed)
        if best is None or table.bits < best.bits:
            best = table
        since += 1
        if since == 2:  # with twice the segments it is twice the depth: more cannot be saved by shorter values
            break
    if best is None:
        raise ShortfallError(
            f"the error allowed must be more than {float(HALF)} LSB and within reach of "
            f"{1 << LARGEST:,} segments, not {float(allowed):g} LSB"
        )
    return best
