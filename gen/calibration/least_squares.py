"""Least squares for a polynomial of two variables, the same to the last bit on every machine.

The sums of the normal equations (equation 3 of the paper) are exact: doubles are integers times a power of two,
and integers add without rounding, so the result depends neither on the order of the measurements nor on the machine.
The equations are then solved in decimal arithmetic with `DIGITS` digits. These are enough for the squared condition
number of the normal equations. Only the final coefficients are rounded to doubles, once each.
"""

from __future__ import annotations

import copy
import decimal
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from operator import mul, sub

import numpy as np

from sosmith.model.arrays import Values
from sosmith.model.polynomial import Polynomial

DIGITS = 150
"""Digits of the decimal arithmetic. A matrix that `MIN_SINE` admits loses about 40 of them."""

MIN_SINE = 1e-10
"""Sine of the angle between a term and the span of the terms before it, below which the term counts as dependent.

Five digits above double rounding, so that terms that differ only by rounding count as dependent, and well below the
angle that any measurable variation of both variables gives.
"""

Term = tuple[int, int]
"""Powers (i, j) of the first and of the second variable."""

_CONTEXT = decimal.Context(prec=DIGITS, Emax=decimal.MAX_EMAX, Emin=decimal.MIN_EMIN)


@dataclass(frozen=True)
class Solution:
    """The least-squares coefficients and their sums of squares.

    Attributes
    ----------
    terms : tuple of Term
        Powers of V and T, one pair for each coefficient.
    polynomial : Polynomial
        The polynomial; every coefficient is the exact one rounded to double.
    residual_squares : Decimal
        Weighted sum of squared residuals at the minimum, before the coefficients are rounded.
    total_squares : Decimal
        Weighted sum of squared deviations of d from its weighted mean.
    factor : tuple of tuple of float
        Lower triangle L of ``N = L diag(pivots) L'`` for the matrix N of the normal equations, in the centred
        variables of `Sums.centred`.
    pivots : tuple of float
        Pivots of that factorization, all positive.
    """

    terms: tuple[Term, ...]
    polynomial: Polynomial
    residual_squares: Decimal
    total_squares: Decimal
    factor: tuple[tuple[float, ...], ...]
    pivots: tuple[float, ...]


class Sums:
    """Exact sums ``w V**i T**j`` and ``w d V**i T**j`` over all measurements, computed on first use.

    Both variables are centred, so that powers stay distinct over a narrow range far from zero, and scaled into [-1, 1]
    by a power of two, which is exact.

    Parameters
    ----------
    d, V, T : ndarray, shape (n,)
        Finite doubles, n at least 1.
    weights : ndarray, shape (n,), optional
        Weights of the squared residuals, 0 or more; 1 by default.
    """

    def __init__(self, d: Values, V: Values, T: Values, weights: Values | None = None) -> None:
        self._x, self._y = _Centred.of(V), _Centred.of(T)
        self._d, self._bits_d = _integers(d)
        self._weights = np.ones(len(d)) if weights is None else weights
        integers, self._bits_w = _integers(self._weights)
        self._part = _Part(integers, self._d, self._x.integers, self._y.integers)
        self._before: Sums | None = None
        self._moments: dict[tuple[int, Term], tuple[int, int]] = {}

    def reweighted(self, weights: Values) -> Sums:
        """Return the sums with other weights, shape (n,); only rows whose weight changes are summed again."""
        rows = np.flatnonzero(weights != self._weights)
        if not len(rows):
            return self
        other = copy.copy(self)
        integers, other._bits_w = _integers(np.concatenate((weights[rows], self._weights[rows])))
        change = list(map(sub, integers[: len(rows)], integers[len(rows) :]))
        some = ([values[row] for row in rows.tolist()] for values in (self._d, self._x.integers, self._y.integers))
        other._weights = weights
        other._part = _Part(change, *some)
        other._before = self
        other._moments = {}
        return other

    def _moment(self, power: int, term: Term) -> tuple[int, int]:
        """Return the sum of ``w d**power V**i T**j``, V and T centred, as an integer and its fraction bits."""
        if (power, term) not in self._moments:
            i, j = term
            total = self._part.sum(power, i, j)
            bits = self._bits_w + power * self._bits_d + i * self._x.bits + j * self._y.bits
            if self._before is not None:
                before, bits_before = self._before._moment(power, term)
                finest = max(bits, bits_before)
                total, bits = (total << (finest - bits)) + (before << (finest - bits_before)), finest
            self._moments[power, term] = total, bits
        return self._moments[power, term]

    def _decimal(self, power: int, term: Term) -> Decimal:
        """Return the sum, rounded once."""
        total, bits = self._moment(power, term)
        return Decimal(total) / Decimal(1 << bits)

    def _fraction(self, power: int) -> Fraction:
        """Return the sum of ``w d**power``, exactly."""
        total, bits = self._moment(power, (0, 0))
        return Fraction(total, 1 << bits)

    def centred(self, V: Values, T: Values) -> tuple[Values, Values]:
        """Return V and T centred and scaled to [-1, 1] over the range of the measurements, rounded to doubles."""
        return self._x(V), self._y(T)

    def solve(self, terms: Sequence[Term]) -> Solution | None:
        """Solve for the coefficients of `terms`; None if the measurements do not determine them."""
        with decimal.localcontext(_CONTEXT):
            products = [[(a[0] + b[0], a[1] + b[1]) for b in terms] for a in terms]
            sums = {term: self._decimal(0, term) for term in {term for row in products for term in row}}
            matrix = [[sums[term] for term in row] for row in products]
            right = [self._decimal(1, term) for term in terms]
            factored = _factor(matrix)
            if factored is None:
                return None
            lower, pivots = factored
            forward: list[Decimal] = []
            for row, value in zip(lower, right, strict=True):
                forward.append(value - sum(map(mul, row, forward), Decimal(0)))
            explained = sum((z * z / pivot for z, pivot in zip(forward, pivots, strict=True)), Decimal(0))
            scaled = [z / pivot for z, pivot in zip(forward, pivots, strict=True)]
            for k in reversed(range(len(terms))):
                scaled[k] -= sum((lower[q][k] * scaled[q] for q in range(k + 1, len(terms))), Decimal(0))
            polynomial = self._expand(dict(zip(terms, scaled, strict=True)))
            squares = self._fraction(2)
            mean_part = self._fraction(1) ** 2 / self._fraction(0)
            return Solution(
                terms=tuple(terms),
                polynomial=polynomial,
                residual_squares=max(_decimal(squares) - explained, Decimal(0)),
                total_squares=_decimal(squares - mean_part),
                factor=tuple(tuple(map(float, row)) for row in lower),
                pivots=tuple(map(float, pivots)),
            )

    def leverage(self, solution: Solution, V: Values, T: Values) -> Values:
        """Return ``x' N**-1 x`` at V and T, shape (n,), for the matrix N of the normal equations.

        It is the variance of the fitted value, relative to that of a measurement of weight 1. With ``N = L D L'`` and
        ``z = L**-1 x`` it is the sum of ``z**2 / D``.
        """
        x, y = self.centred(V, T)
        highest = [max(term[axis] for term in solution.terms) for axis in (0, 1)]
        powers_x, powers_y = _powers(x, highest[0]), _powers(y, highest[1])
        leverage = np.zeros(len(V))
        reduced: list[Values] = []
        # Element by element: matrix products and the power function round differently from machine to machine.
        for (i, j), row, pivot in zip(solution.terms, solution.factor, solution.pivots, strict=True):
            column = powers_x[i] * powers_y[j]
            for factor, before in zip(row, reduced, strict=True):
                column = column - factor * before
            reduced.append(column)
            leverage = leverage + column**2 / pivot
        return leverage

    def _expand(self, scaled: dict[Term, Decimal]) -> Polynomial:
        """Return the polynomial in V and T, not centred."""
        m, n = (max(term[axis] for term in scaled) for axis in (0, 1))
        sums = [[Fraction(0)] * (n + 1) for _ in range(m + 1)]
        powers_x, powers_y = [self._x.power(i) for i in range(m + 1)], [self._y.power(j) for j in range(n + 1)]
        for (i, j), value in scaled.items():
            for p, v in enumerate(powers_x[i]):
                part = Fraction(value) * v
                for q, t in enumerate(powers_y[j]):
                    sums[p][q] += part * t
        widths = [max(j for i, j in scaled if i == p) + 1 for p in range(m + 1)]
        rounded = [[float(a) for a in row[:width]] for row, width in zip(sums, widths, strict=True)]
        return Polynomial.from_numbers(rounded)


def _powers(values: Values, highest: int) -> list[Values]:
    return list(itertools.accumulate([values] * highest, np.multiply, initial=np.ones(len(values))))


class _Part:
    """Sums of ``w d**k x**i y**j`` over some rows. All are integers; w may have either sign."""

    def __init__(self, w: list[int], d: list[int], x: list[int], y: list[int]) -> None:
        self._x, self._y = x, y
        with_d = list(map(mul, w, d))
        self._left = [[w], [with_d], [list(map(mul, with_d, d))]]  # [k][i]
        self._right = [[1] * len(y), y]  # [j]

    def sum(self, k: int, i: int, j: int) -> int:
        left, right = self._left[k], self._right
        while len(left) <= i:
            left.append(list(map(mul, left[-1], self._x)))
        while len(right) <= j:
            right.append(list(map(mul, right[-1], self._y)))
        return sum(left[i]) if j == 0 else sum(map(mul, left[i], right[j]))


@dataclass(frozen=True)
class _Centred:
    """``x = (value - centre) / half`` in [-1, 1] as ``integers / 2**bits``; `half` is a power of two."""

    centre: float
    half: float
    integers: list[int]
    bits: int

    @classmethod
    def of(cls, values: Values) -> _Centred:
        low, high = float(values.min()), float(values.max())
        centre = low + (high - low) / 2
        exponent = math.ceil(math.log2(max(high - centre, centre - low))) if high > low else 0
        (middle, *integers), bits = _integers(np.concatenate(([centre], values)))
        # values differ from the centre by 2**-bits or more, so bits + exponent is not negative
        return cls(centre, 2.0**exponent, [value - middle for value in integers], bits + exponent)

    def __call__(self, values: Values) -> Values:
        return (values - self.centre) / self.half

    def power(self, exponent: int) -> list[Fraction]:
        """Return the coefficients of ``x**exponent`` as a polynomial in the value, constant first."""
        centre, half = Fraction(self.centre), Fraction(self.half)
        return [math.comb(exponent, k) * (-centre) ** (exponent - k) / half**exponent for k in range(exponent + 1)]


def _integers(values: Values) -> tuple[list[int], int]:
    """Return doubles as integers times ``2**-bits``: the integers, and `bits`, which is 0 or more."""
    ratios = [value.as_integer_ratio() for value in values.tolist()]
    bits = max(denominator for _, denominator in ratios).bit_length() - 1
    return [numerator << (bits + 1 - denominator.bit_length()) for numerator, denominator in ratios], bits


def _decimal(value: Fraction) -> Decimal:
    return Decimal(value.numerator) / Decimal(value.denominator)


def _factor(matrix: list[list[Decimal]]) -> tuple[list[list[Decimal]], list[Decimal]] | None:
    """Factor a symmetric matrix into ``L diag(pivots) L'``; None if a term depends on the terms before it.

    Row k of L holds the k entries left of the unit diagonal. The ratio of a pivot to the diagonal entry is the squared
    sine of the angle between the term and the span of the terms before it.
    """
    lower: list[list[Decimal]] = []
    pivots: list[Decimal] = []
    for k, given in enumerate(matrix):
        row: list[Decimal] = []
        products: list[Decimal] = []  # entries of row k times the pivots
        for q in range(k):
            product = given[q] - sum(map(mul, lower[q], products), Decimal(0))
            products.append(product)
            row.append(product / pivots[q])
        pivot = given[k] - sum(map(mul, row, products), Decimal(0))
        if pivot <= given[k] * Decimal(MIN_SINE) ** 2:
            return None
        lower.append(row)
        pivots.append(pivot)
    return lower, pivots
