"""The error of a calibration polynomial over its box of input codes, and the integer coefficients that keep it small.

The error is a polynomial in the variables too. About the middle of the box, ``u = c + r w`` with w in [-1, 1], the sum
of its coefficients' magnitudes is a bound on it: of a variable from 0 to 1 only half counts, and the rest moves into
the constant. That is what the coefficients are rounded for: from the highest powers down, each one takes up what those
above it have left about the middle of the box, as Babai's nearest plane does for a lattice.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations, product
from math import comb

from sosmith.model.sections.horner import HornerPolynomial, Variable

Rows = Sequence[Sequence[Fraction]]
"""Row i holds the coefficients of ``u**i``, by powers of the second variable."""

_MOST_IN_PAIRS = 12
"""Coefficients up to which neighbours are tried two at a time."""

_Index = tuple[int, int]


def _middle(variable: Variable) -> tuple[Fraction, Fraction]:
    """Middle and half width of a variable's range, which is a code's times ``2**-bits``."""
    unit = Fraction(1, 2 << variable.bits)
    return (variable.low + variable.high) * unit, (variable.high - variable.low) * unit


def _size(variable: Variable) -> Fraction:
    return Fraction(max(-variable.low, variable.high), 1 << variable.bits)


def horner_error(exact: Rows, horner: HornerPolynomial) -> Fraction:
    """Bound on the polynomial's error over all input codes, exact.

    A rounding keeps units of a sum in smaller ones: its error is half of a smaller unit in the mean, and off that at
    most half of their difference. What follows multiplies it by variables.

    Parameters
    ----------
    exact : sequence of sequence of Fraction
        Coefficients that are wanted, for the variables ``code * 2**-bits``.
    horner : HornerPolynomial
        The polynomial in integers, with rows of the same lengths.
    """
    lsb = Fraction(1, 1 << horner.frac)
    errors = [
        [m * lsb - w for w, m in zip(wanted, rounded, strict=True)]
        for wanted, rounded in zip(exact, horner.coefficients, strict=True)
    ]
    sizes = [_size(variable) for variable in horner.variables]
    radius = Fraction(0)
    for i, j, kept, given in _roundings(horner):
        unit, least = Fraction(1, 1 << kept), Fraction(1, 1 << given)
        if kept < given:
            errors[i][j] += least / 2
            radius += (unit - least) / 2 * sizes[0] ** i * sizes[-1] ** j
    middles = [_middle(variable) for variable in horner.variables]
    return radius + sum((abs(value) for row in _about(errors, middles) for value in row), Fraction(0))


def _roundings(horner: HornerPolynomial) -> Iterator[tuple[int, int, int, int]]:
    """Yield powers of the variables that a rounding is multiplied by, fraction bits that it keeps, and its sum's."""
    first, second = horner.frac + horner.variables[0].bits, horner.frac + horner.variables[-1].bits
    for i, row in enumerate(horner.coefficients):
        yield from ((i, j, horner.row_frac(i, j + 1), second) for j in range(len(row) - 1))
        if i:
            yield (
                i - 1,
                0,
                horner.frac,
                max(first, horner.row_frac(i - 1, 1) if len(horner.coefficients[i - 1]) > 1 else 0),
            )


def _about(rows: Rows, middles: Sequence[tuple[Fraction, Fraction]]) -> list[list[Fraction]]:
    """Coefficients of the same polynomial in w, with ``c + r w`` for each variable."""
    columns = max(map(len, rows))
    result = [[Fraction(0)] * columns for _ in rows]
    for (i, row), (j, _) in product(enumerate(rows), enumerate(range(columns))):
        if j < len(row) and row[j]:
            for (p, left), (q, right) in product(_power(i, *middles[0]), _power(j, *middles[-1])):
                result[p][q] += row[j] * left * right
    return result


def _power(exponent: int, centre: Fraction, radius: Fraction) -> list[tuple[int, Fraction]]:
    """Coefficients of ``(c + r w)**exponent`` by the power of w."""
    return [
        (power, comb(exponent, power) * centre ** (exponent - power) * radius**power) for power in range(exponent + 1)
    ]


def rounded(exact: Rows, frac: int, variables: Sequence[Variable]) -> tuple[tuple[int, ...], ...]:
    """Round coefficients to `frac` fraction bits so that the error of all together is small over the box.

    The choice is made in double precision; whatever it is, `horner_error` bounds it.

    Parameters
    ----------
    exact : sequence of sequence of Fraction
        Coefficients for the variables ``code * 2**-bits``.
    frac : int
        Fraction bits.
    variables : sequence of Variable
        The variables, one or two.
    """
    return _Lattice(exact, frac, variables).nearest()


class _Lattice:
    """Errors of integer coefficients about the middle of the box, as vectors of doubles, in units of ``2**-frac``."""

    def __init__(self, exact: Rows, frac: int, variables: Sequence[Variable]) -> None:
        self._exact = {(i, j): a * 2**frac for i, row in enumerate(exact) for j, a in enumerate(row)}
        middles = [_middle(variable) for variable in variables]
        self._steps: dict[_Index, dict[_Index, float]] = {
            (i, j): {
                (p, q): float(left * right)
                for (p, left), (q, right) in product(_power(i, *middles[0]), _power(j, *middles[-1]))
            }
            for i, j in self._exact
        }
        self._errors: dict[_Index, float] = {}
        self._integers: dict[_Index, int] = {}

    def nearest(self) -> tuple[tuple[int, ...], ...]:
        for index in sorted(self._exact, reverse=True):
            exact = self._exact[index]
            off = self._errors.get(index, 0.0) / self._steps[index][index]
            self._integers[index] = round(exact - Fraction(off))
            self._move(index, float(self._integers[index] - exact))
        self._descend()
        rows = [[self._integers[i, j] for k, j in sorted(self._integers) if k == i] for i in self._rows()]
        return tuple(map(tuple, rows))

    def _rows(self) -> list[int]:
        return sorted({i for i, _ in self._exact})

    def _move(self, index: _Index, by: float) -> None:
        for key, step in self._steps[index].items():
            self._errors[key] = self._errors.get(key, 0.0) + by * step

    def _descend(self) -> None:
        """Take the neighbours of one coefficient or of two that lower the bound most, until none does."""
        singles = [((index, by),) for index in sorted(self._exact) for by in (-1, 1)]
        moves: list[tuple[tuple[_Index, int], ...]] = [*singles]
        if len(self._exact) <= _MOST_IN_PAIRS:
            moves += [(*one, *other) for one, other in combinations(singles, 2) if one[0][0] != other[0][0]]
        least = self._bound(())
        while True:
            bound, move = min((self._bound(move), move) for move in moves)
            if bound >= least * (1 - 2.0**-20):
                return
            least = bound
            for index, by in move:
                self._integers[index] += by
                self._move(index, float(by))

    def _bound(self, move: Sequence[tuple[_Index, int]]) -> float:
        errors = dict(self._errors)
        for index, by in move:
            for key, step in self._steps[index].items():
                errors[key] += by * step
        return sum(map(abs, errors.values()))
