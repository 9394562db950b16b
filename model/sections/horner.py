"""The bivariate calibration polynomial in integers, by nested Horner.

The variables are ADC codes read as fractions, ``u = code * 2**-bits``, so that |u| <= 1 whatever the
physical range, and every coefficient has the same weight in the error. All rows are evaluated in the second
variable at once, then their results in the first::

    r_i = (.. (c_in t + c_i(n-1)) t + ..) t + c_i0        one stage for each power of t
    d   = (.. (r_m u + r_(m-1)) u + ..) u + r_0           one stage for each power of u

Each stage rounds once per row to `frac` fraction bits, to which the coefficients are rounded too. A row that is only
added from then on may keep some more: these bits make no multiplier wider.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Node, Wire


@dataclass(frozen=True, kw_only=True)
class Variable:
    """An input of the polynomial: name, width in bits, and whether its code is signed."""

    name: str
    bits: int
    signed: bool = False

    @property
    def low(self) -> int:
        """Smallest code."""
        return -(1 << (self.bits - 1)) if self.signed else 0

    @property
    def high(self) -> int:
        """Largest code."""
        return (1 << (self.bits - 1)) - 1 if self.signed else (1 << self.bits) - 1


@dataclass(frozen=True)
class HornerStep:
    """One stage of the polynomial; a stage of a datapath."""

    name: str
    graph: Graph


@dataclass(frozen=True, kw_only=True)
class HornerPolynomial:
    """``sum c[i][j] u**i t**j * 2**-frac`` with integer coefficients.

    Attributes
    ----------
    coefficients : tuple of tuple of int
        Row i holds the coefficients of ``u**i``; rows may be short.
    frac : int
        Fraction bits of the coefficients and of every intermediate result but those that `finer` is for.
    variables : tuple of Variable
        The first variable, and the second if there is one; without it every row has one coefficient.
    finer : int
        Additional fraction bits of the rows r_0 to r_(m-1), which are added to products and multiplied by nothing.
    """

    coefficients: tuple[tuple[int, ...], ...]
    frac: int
    variables: tuple[Variable, ...]
    finer: int = 0

    def __post_init__(self) -> None:
        if not self.coefficients or not all(self.coefficients):
            raise ValueError("coefficients must have at least one row and no empty row")
        if len(self.variables) not in {1, 2}:
            raise ValueError(f"variables must be one or two, not {len(self.variables)}")
        if len(self.variables) == 1 and max(map(len, self.coefficients)) > 1:
            raise ValueError("coefficients must have one column where there is one variable")

    @cached_property
    def stages(self) -> tuple[HornerStep, ...]:
        """The stages, in order; the output of the last one is the value of the polynomial."""
        steps: list[HornerStep] = []
        rows: dict[int, Node] = {}  # rows that hold a computed value, not just their constant yet
        for power in range(max(map(len, self.coefficients)) - 1, 0, -1):
            steps.append(self._row_step(rows, power))
        for power in range(len(self.coefficients) - 1, 0, -1):
            steps.append(self._column_step(rows, power, first=not steps))
        if not steps:
            steps.append(self._constant_step())
        return tuple(steps)

    def row_frac(self, i: int, power: int) -> int:
        """Fraction bits of row i behind the stage for ``t**power``."""
        only_added = power == 1 and i < len(self.coefficients) - 1
        return min(self.frac + self.finer * only_added, self.frac + self.variables[-1].bits)

    def _variable(self, g: GraphBuilder, index: int) -> Wire:
        variable = self.variables[index]
        return g.input(variable.name, variable.bits, variable.low, variable.high)

    def _constant(self, g: GraphBuilder, i: int, j: int) -> Wire:
        return g.constant(self.coefficients[i][j], self.frac, f"c{i}{j}")

    def _row_step(self, rows: dict[int, Node], power: int) -> HornerStep:
        """Multiply every row of degree `power` or more by t, and add the coefficient of ``t**(power - 1)``."""
        g = GraphBuilder()
        u, t = self._variable(g, 0), self._variable(g, 1)
        so_far = _row_inputs(g, rows)
        for i, row in enumerate(self.coefficients):
            if len(row) > power:
                start = so_far.get(i) or self._constant(g, i, power)
                total = g.add(g.multiply(start, t, f"product{i}"), self._constant(g, i, power - 1))
                so_far[i] = g.round(total, self.row_frac(i, power), f"row{i}")
        keep = [u, t] if power > 1 else [u] if len(self.coefficients) > 1 else []
        return _step(g, f"row_power{power}", keep, so_far, rows)

    def _column_step(self, rows: dict[int, Node], power: int, *, first: bool) -> HornerStep:
        """Multiply the top row by u and add the row below; pass the other rows on."""
        g = GraphBuilder()
        u = self._variable(g, 0)
        if first and len(self.variables) > 1:
            self._variable(g, 1)
        so_far = _row_inputs(g, rows)
        top, below = (so_far.pop(i) if i in so_far else self._constant(g, i, 0) for i in (power, power - 1))
        so_far[power - 1] = g.round(g.add(g.multiply(top, u, "product"), below), self.frac, f"row{power - 1}")
        return _step(g, f"column_power{power}", [u] if power > 1 else [], so_far, rows)

    def _constant_step(self) -> HornerStep:
        g = GraphBuilder()
        for index in range(len(self.variables)):
            self._variable(g, index)
        return HornerStep("constant", g.build([self._constant(g, 0, 0)]))


def _row_inputs(g: GraphBuilder, rows: dict[int, Node]) -> dict[int, Wire]:
    return {i: g.input(f"row{i}", node.frac, node.low, node.high) for i, node in sorted(rows.items())}


def _step(g: GraphBuilder, name: str, keep: list[Wire], so_far: dict[int, Wire], rows: dict[int, Node]) -> HornerStep:
    """Finish a stage, and set `rows` to those that it passes on."""
    rows.clear()
    rows.update({i: g[wire] for i, wire in sorted(so_far.items())})
    return HornerStep(name, g.build([*keep, *(wire for _, wire in sorted(so_far.items()))]))
