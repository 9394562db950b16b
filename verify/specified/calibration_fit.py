"""Fits the calibration of a specification to its measurements again, in exact rationals.

What the paper's section 2.2 asks for: polynomials by rising number of terms, then by rising highest order, then by
rising order of the temperature; each by least squares; the first whose adjusted coefficient of correlation reaches
0.975. Where the file states uncertainties, squares are weighted: by the smallest squared uncertainty over that of the
row, as a double; uncertainties of voltage and temperature count by the slopes of the linear fit without weights. The
measurements are the doubles nearest to the numbers in the file, and each coefficient is the double nearest to that of
the normal equations' only solution. So the polynomial is determined to the last bit, and must be the certificate's.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import zip_longest

from flint import fmpq, fmpq_mat

from sosmith.verify.certificate_file import PortEntry
from sosmith.verify.graph import RejectedError, require

_COLUMNS = ("clearance_mm", "voltage_V", "temperature_C")
_UNCERTAINTIES = ("uncertainty_mm", "uncertainty_V", "uncertainty_C")
_WIDEST = 10**18
"""Largest ratio of two squared uncertainties."""

_DATE = "date"
_DAY = re.compile(r"\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_HIGHEST = 6
"""Highest order that is tried."""

_REQUIRED = Fraction(975, 1000) ** 2
"""Adjusted R squared that a polynomial must reach."""

_UNDECIDED = Fraction(1, 2**40)
"""Distance of an adjusted R squared from what is required within which doubles may decide either way."""

_SINE = Fraction(1, 10**20)
"""Square of the sine of the angle between a term and those before it, up to which it counts as dependent on them."""

_MOST_ROWS = 100_000
_MOST_BITS = 400
"""Ratio of the largest magnitude of a column to its finest digit, in bits, beyond which nothing was measured."""

_Term = tuple[int, int]
_Rows = list[tuple[Fraction, Fraction, Fraction]]


@dataclass(frozen=True)
class Refit:
    """What the measurements determine.

    Attributes
    ----------
    polynomial : tuple of tuple of Fraction
        Coefficients in physical units, row i for the voltage to the power i.
    rows : int
        Number of measurements.
    covered : tuple of (Fraction, Fraction)
        Lowest and highest voltage in V and temperature in degC.
    """

    polynomial: tuple[tuple[Fraction, ...], ...]
    rows: int
    covered: tuple[tuple[Fraction, Fraction], ...]

    def codes(self, inputs: Sequence[PortEntry]) -> tuple[tuple[int, int], ...]:
        """Return the smallest range of codes of each input that holds what was measured, within its format."""
        ends = [
            (math.floor((low - port.zero) / port.lsb), math.ceil((high - port.zero) / port.lsb))
            for port, (low, high) in zip(inputs, self.covered, strict=True)
        ]
        return tuple(
            (min(max(low, port.lowest), port.highest), min(max(high, port.lowest), port.highest))
            for port, (low, high) in zip(inputs, ends, strict=True)
        )


def check_fit(content: bytes, polynomial: Sequence[Sequence[Fraction]]) -> Refit:
    """Check that a polynomial is the one that measurements determine.

    Parameters
    ----------
    content : bytes
        The file of measurements, CSV.
    polynomial : sequence of sequence of Fraction
        Coefficients in physical units, row i for the voltage to the power i.

    Raises
    ------
    RejectedError
        If the file cannot be read, determines no polynomial, or another one.
    """
    refit = fitted(content)
    for i, (row, wanted) in enumerate(zip_longest(polynomial, refit.polynomial, fillvalue=())):
        for j, (value, right) in enumerate(zip_longest(row, wanted)):
            require(
                value == right,
                f"coefficient [{i}][{j}] of the calibration must be {_said(right)}, as fitted to the measurements, "
                f"not {_said(value)}",
            )
    return refit


def _said(value: Fraction | None) -> str:
    return "absent" if value is None else repr(float(value))


def fitted(content: bytes) -> Refit:
    """Fit the polynomial to the measurements of a file.

    Raises
    ------
    RejectedError
        If the file cannot be read, or determines no polynomial.
    """
    rows, stated = _measurements(content)
    sums = _Sums(rows, _weights(rows, stated))
    total = sums.total
    require(total > 0, "the clearance of the measurements must vary")
    for terms in _candidates():
        solution = sums.solve(terms) if len(terms) < len(rows) else None
        if solution is None:
            require(len(terms) > 3, "the measurements must determine a linear polynomial")
            continue
        scaled, unexplained = solution
        adjusted = 1 - (unexplained / (len(rows) - len(terms))) / (total / (len(rows) - 1))
        require(
            abs(adjusted - _REQUIRED) > _UNDECIDED, "the quality of the fit must decide whether its order is accepted"
        )
        if adjusted > _REQUIRED:
            covered = tuple((min(column), max(column)) for column in list(zip(*rows, strict=True))[1:])
            return Refit(sums.expanded(scaled), len(rows), covered)
    raise RejectedError("a polynomial must fit the measurements, and none does")


def _candidates() -> list[tuple[_Term, ...]]:
    orders = [(m, n) for m in range(1, _HIGHEST + 1) for n in range(1, _HIGHEST + 1)]
    terms = {(m, n): tuple((i, j) for i in range(m + 1) for j in range(n + 1) if i + j <= max(m, n)) for m, n in orders}
    return [terms[order] for order in sorted(orders, key=lambda order: (len(terms[order]), max(order), order[1]))]


def _weights(rows: _Rows, stated: _Rows) -> list[Fraction]:
    """Return the weight of each row; 1 where nothing is stated."""
    if not any(any(row) for row in stated):
        return [Fraction(1)] * len(rows)
    slopes = Fraction(0), Fraction(0)
    if any(v or t for _, v, t in stated):
        plain = _Sums(rows, [Fraction(1)] * len(rows))
        linear = plain.solve(((0, 0), (0, 1), (1, 0)))
        require(linear is not None, "the measurements must determine a linear polynomial")
        assert linear is not None, "as was just required"
        (_, of_temperature), (of_voltage,) = plain.expanded(linear[0])
        slopes = of_voltage, of_temperature
    squares = [d**2 + (slopes[0] * v) ** 2 + (slopes[1] * t) ** 2 for d, v, t in stated]
    least = min(squares)
    require(least > 0, "uncertainties must be stated in every row or in none")
    require(max(squares) <= _WIDEST * least, "uncertainties must be within a factor of 1e9 of each other")
    return [Fraction(float(least / square)) for square in squares]


def _measurements(content: bytes) -> tuple[_Rows, _Rows]:
    """Return clearance, voltage and temperature of each row, and their uncertainties, 0 where none is stated."""
    try:
        reader = csv.reader(io.StringIO(content.decode("utf-8-sig"), newline=""), strict=True)
        lines = [[cell.strip() for cell in cells] for cells in reader if len(cells) > 1 or "".join(cells).strip()]
    except (UnicodeDecodeError, csv.Error):
        raise RejectedError("the measurements must be a CSV file in UTF-8") from None
    more = [name for name in (_DATE, *_UNCERTAINTIES) if lines and name in lines[0]]
    dated, columns = _DATE in more, (*_COLUMNS, *more)
    require(bool(lines) and sorted(lines[0]) == sorted(columns), f"the measurements must be {', '.join(_COLUMNS)}")
    require(len(lines) <= _MOST_ROWS, f"there must be at most {_MOST_ROWS} measurements, not {len(lines) - 1}")
    require(len(lines) > 4, f"there must be at least 4 measurements, not {len(lines) - 1}")
    order = [lines[0].index(name) for name in columns]
    rows: _Rows = []
    stated: _Rows = []
    days: list[list[str]] = []
    for line in lines[1:]:
        cells = [line[index] for index in order] if len(line) == len(order) else []
        require(
            bool(cells)
            and all(_NUMBER.fullmatch(cell) for cell in cells[: len(_COLUMNS)])
            and all(_DAY.fullmatch(cell) for cell in cells[len(_COLUMNS) : len(_COLUMNS) + dated])
            and all(not cell or _NUMBER.fullmatch(cell) for cell in cells[len(_COLUMNS) + dated :]),
            f"a measurement must be {len(_COLUMNS)} numbers{' and a date' * dated}, not {','.join(line)[:60]!r}",
        )
        values = [float(cell) for cell in cells[: len(_COLUMNS)]]
        require(all(map(math.isfinite, values)), "a measurement must be finite")
        clearance, voltage, temperature = map(Fraction, values)
        rows.append((clearance, voltage, temperature))
        days.append(cells[len(_COLUMNS) : len(_COLUMNS) + dated])
        given = {
            name: float(cell) for name, cell in zip(columns, cells, strict=True) if name in _UNCERTAINTIES and cell
        }
        require(all(0 < value < math.inf for value in given.values()), "an uncertainty must be more than 0, and finite")
        of_clearance, of_voltage, of_temperature = (Fraction(given.get(name, 0.0)) for name in _UNCERTAINTIES)
        stated.append((of_clearance, of_voltage, of_temperature))
    own = {(*row, *day) for row, day in zip(rows, days, strict=True)}
    require(len(own) == len(rows), "each measurement must be there once")
    return rows, stated


class _Sums:
    """Exact sums over the measurements, as integers; voltage and temperature count from the middle of their range.

    Weights are doubles from 0 to 1; all sums are times their common denominator.
    """

    def __init__(self, rows: _Rows, weights: Sequence[Fraction]) -> None:
        columns = list(zip(*rows, strict=True))
        self._centres = [Fraction(0), *((min(column) + max(column)) / 2 for column in columns[1:])]
        self._units: list[int] = []
        self._columns: list[list[int]] = []
        for column, centre in zip(columns, self._centres, strict=True):
            centred = [value - centre for value in column]
            unit = max(value.denominator for value in centred)
            self._units.append(unit)
            self._columns.append([int(value * unit) for value in centred])
            require(
                max(map(abs, self._columns[-1])).bit_length() <= _MOST_BITS,
                "the measurements must be of a size that was measured",
            )
        finest = max(weight.denominator for weight in weights)
        self._powers: dict[_Term, list[int]] = {(0, 0): [int(weight * finest) for weight in weights]}
        self._moments: dict[tuple[int, _Term], int] = {}

    def _product(self, term: _Term) -> list[int]:
        if term not in self._powers:
            i, j = term
            before, axis = ((i - 1, j), 1) if i else ((i, j - 1), 2)
            self._powers[term] = [a * b for a, b in zip(self._product(before), self._columns[axis], strict=True)]
        return self._powers[term]

    def _moment(self, power: int, term: _Term) -> int:
        if (power, term) not in self._moments:
            column = self._product(term)
            for _ in range(power):
                column = [a * b for a, b in zip(column, self._columns[0], strict=True)]
            self._moments[power, term] = sum(column)
        return self._moments[power, term]

    @property
    def total(self) -> Fraction:
        """Sum of the squared deviations of the clearance from its mean, in its own unit."""
        count, first, second = (self._moment(power, (0, 0)) for power in range(3))
        return second - Fraction(first * first, count)

    def solve(self, terms: Sequence[_Term]) -> tuple[dict[_Term, Fraction], Fraction] | None:
        """Solve the normal equations: coefficients of the integers, and the sum of squares that is left.

        None if a term depends on those before it.
        """
        matrix = fmpq_mat([[self._moment(0, (a[0] + b[0], a[1] + b[1])) for b in terms] for a in terms])
        right = fmpq_mat([[self._moment(1, term)] for term in terms])
        if not _independent(matrix):
            return None
        solution = [fraction for (fraction,) in _table(matrix.solve(right))]
        explained = sum((x * self._moment(1, term) for x, term in zip(solution, terms, strict=True)), Fraction(0))
        return dict(zip(terms, solution, strict=True)), self._moment(2, (0, 0)) - explained

    def expanded(self, scaled: dict[_Term, Fraction]) -> tuple[tuple[Fraction, ...], ...]:
        """Return the coefficients in physical units, each the nearest double."""
        sums: dict[_Term, Fraction] = {}
        (_, v, t), (unit, *units) = self._centres, self._units
        for (i, j), value in scaled.items():
            for p in range(i + 1):
                for q in range(j + 1):
                    part = value * units[0] ** i * units[1] ** j * math.comb(i, p) * math.comb(j, q)
                    sums[p, q] = sums.get((p, q), Fraction(0)) + part * (-v) ** (i - p) * (-t) ** (j - q)
        return tuple(
            tuple(Fraction(float(sums[i, j] / unit)) for j in range(1 + max(n for m, n in scaled if m == i)))
            for i in range(1 + max(m for m, _ in scaled))
        )


def _independent(matrix: fmpq_mat) -> bool:
    """Whether each term's vector has an angle to the span of those before it; by elimination without exchanges."""
    size = matrix.nrows()
    rest = [[matrix[a, b] for b in range(size)] for a in range(size)]
    limit = fmpq(_SINE.numerator, _SINE.denominator)
    for k in range(size):
        if rest[k][k] <= matrix[k, k] * limit:
            return False
        for a in range(k + 1, size):
            factor = rest[a][k] / rest[k][k]
            for b in range(k, size):
                rest[a][b] -= factor * rest[k][b]
    return True


def _table(matrix: fmpq_mat) -> list[list[Fraction]]:
    return [
        [Fraction(int(matrix[a, b].p), int(matrix[a, b].q)) for b in range(matrix.ncols())]
        for a in range(matrix.nrows())
    ]
