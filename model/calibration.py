"""Regression of the clearance on voltage and temperature, from reference measurements.

The paper's method (section 2.2): least squares for the coefficients (equations 2 and 3), starting with
the linear polynomial, orders raised until the adjusted coefficient of correlation reaches 0.975; the
smallest polynomial that reaches it is kept.

Equation 3 is the normal equations. Their matrix holds sums of ``V**(2m) T**(2n)``, and solving them as
printed squares a condition number that is already large. Here the same minimum is found from the
measurements themselves: both variables are mapped to [-1, 1], the columns scaled to equal length, and the
overdetermined system solved by its singular values. The mapping is undone in exact rational arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from sosmith.model.csv_table import CsvTable, check_rows, read_csv_table
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Values

COLUMNS = ("clearance_mm", "voltage_V", "temperature_C")
"""The columns of a measurement file, in the order of the contract."""

REQUIRED_R = 0.975
"""Adjusted r at which a polynomial is accepted (the paper's section 2.2)."""

HIGHEST_ORDER = 6
"""Highest total order tried: 28 terms, far beyond the paper's second order."""

RANK_TOLERANCE = 1e-10
"""Ratio of singular values (columns of equal length) below which coefficients are not determined.

Five digits above the rounding of the doubles, so that columns which depend on each other except for
rounding count as dependent, and well below what measurable variation of both variables gives.
"""


@dataclass(frozen=True, eq=False)
class Measurements:
    """Reference measurements, one element of every array per measurement.

    Attributes
    ----------
    clearance : ndarray, shape (n,)
        Micrometer reading in mm, not negative.
    voltage : ndarray, shape (n,)
        Sensor voltage in V.
    temperature : ndarray, shape (n,)
        Temperature at the sensor in degC.
    source : str
        Where they come from, for messages.
    """

    clearance: Values
    voltage: Values
    temperature: Values
    source: str = "measurements"

    def __post_init__(self) -> None:
        for name in ("clearance", "voltage", "temperature"):
            values: Values = getattr(self, name)
            if values.ndim != 1 or len(values) != len(self.clearance):
                raise ValueError(f"{name} must be of shape ({len(self.clearance)},), not {values.shape}")
            if not np.all(np.isfinite(values)):
                raise ValueError(f"{name} must be finite, not {values[~np.isfinite(values)][0]}")

    def __len__(self) -> int:
        """Count of measurements."""
        return len(self.clearance)

    @property
    def covered(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Least and largest voltage and temperature."""
        voltage, temperature = (
            (float(values.min()), float(values.max())) for values in (self.voltage, self.temperature)
        )
        return voltage, temperature


@dataclass(frozen=True)
class Trial:
    """Orders that were tried, and how well they fit.

    Attributes
    ----------
    orders : tuple of int
        Highest powers (m, n) of voltage and temperature.
    terms : int
        Count of coefficients.
    adjusted_r_squared : float
        Adjusted coefficient of determination; at most 1, negative for a useless model.
    """

    orders: tuple[int, int]
    terms: int
    adjusted_r_squared: float

    @property
    def adjusted_r(self) -> float:
        """Root of the adjusted R squared; 0 where that is negative."""
        return math.sqrt(max(self.adjusted_r_squared, 0.0))


@dataclass(frozen=True)
class Fit:
    """The accepted regression.

    Attributes
    ----------
    polynomial : Polynomial
        Clearance in mm; every coefficient is a double, so printing it loses nothing.
    accepted : Trial
        Orders and quality of `polynomial`.
    rms : float
        Root mean square residual in mm.
    rejected : tuple of Trial
        The smaller polynomials that fell short, in the order they were tried.
    covered : tuple of (float, float)
        Least and largest voltage in V and temperature in degC of the measurements.
    """

    polynomial: Polynomial
    accepted: Trial
    rms: float
    rejected: tuple[Trial, ...]
    covered: tuple[tuple[float, float], tuple[float, float]]

    @property
    def orders(self) -> tuple[int, int]:
        """Highest powers (m, n) of voltage and temperature."""
        return self.accepted.orders

    @property
    def adjusted_r_squared(self) -> float:
        """Adjusted coefficient of determination."""
        return self.accepted.adjusted_r_squared

    @property
    def adjusted_r(self) -> float:
        """Adjusted coefficient of correlation, at least `REQUIRED_R`."""
        return self.accepted.adjusted_r


def read_measurements(path: Path) -> Measurements:
    """Read the CSV file with the columns clearance_mm, voltage_V and temperature_C, in any order.

    Raises
    ------
    SpecificationError
        As `read_csv_table`; if a clearance is negative; if a row repeats another one.
    """
    table = read_csv_table(path, COLUMNS, required=COLUMNS)
    clearance, voltage, temperature = (table.column(name) for name in COLUMNS)
    check_rows(table, clearance < 0, lambda k: f"clearance_mm must be 0 or more, not {clearance[k]}")
    _refuse_repeated_row(table)
    return Measurements(clearance, voltage, temperature, str(path))


def _refuse_repeated_row(table: CsvTable) -> None:
    first_line: dict[tuple[float, ...], int] = {}
    for index, row in enumerate(table.values.tolist()):
        line = first_line.setdefault(tuple(row), table.lines[index])
        if line != table.lines[index]:
            raise table.refuse(index, f"row must be a measurement of its own, not a duplicate of line {line}")


def fit(measurements: Measurements, required_r: float = REQUIRED_R) -> Fit:
    """Find the smallest polynomial whose adjusted r reaches `required_r`.

    1. Orders (m, n) are tried by rising count of terms from (1, 1) on; among equals the lower total
       order first, then the lower order in temperature. The terms of (m, n) are ``V**i T**j`` with
       i <= m, j <= n, i + j <= max(m, n): equation 5b is (1, 1), equations 4 and 5a are (2, 1).
    2. Least squares give the coefficients and the residual sum of squares RSS.
    3. With N measurements, p terms and the total sum of squares TSS,
       ``adjusted R**2 = 1 - (RSS / (N - p)) / (TSS / (N - 1))`` and r is its root.

    Orders that the measurements cannot determine are passed over: too few rows, or too few different
    values of a variable.

    Raises
    ------
    SpecificationError
        If there are fewer measurements than the linear polynomial needs; if a quantity does not vary, or
        voltage and temperature only together; if no polynomial up to `HIGHEST_ORDER` is good enough.
    """
    _check_variation(measurements)
    voltage, temperature = _Mapping.of(measurements.voltage), _Mapping.of(measurements.temperature)
    x, y = voltage(measurements.voltage), temperature(measurements.temperature)
    rejected: list[Trial] = []
    for orders in candidate_orders():
        terms = _terms(orders)
        scaled = _least_squares(x, y, measurements.clearance, terms) if len(terms) < len(measurements) else None
        if scaled is None:
            if not rejected:
                raise SpecificationError(
                    f"{measurements.source}: voltage_V and temperature_C must vary independently, "
                    "not along one straight line"
                )
            continue
        polynomial = _unscale(dict(zip(terms, scaled.tolist(), strict=True)), voltage, temperature)
        residual = measurements.clearance - polynomial(measurements.voltage, measurements.temperature)
        trial = Trial(orders, len(terms), _adjusted_r_squared(measurements.clearance, residual, len(terms)))
        if trial.adjusted_r >= required_r:
            rms = math.sqrt(float(np.mean(residual**2)))
            return Fit(polynomial, trial, rms, tuple(rejected), measurements.covered)
        rejected.append(trial)
    best = max(rejected, key=lambda trial: trial.adjusted_r_squared)
    raise SpecificationError(
        f"{measurements.source}: adjusted r must reach {required_r} "
        f"with a polynomial up to order {HIGHEST_ORDER}, not at most {best.adjusted_r:.4f} "
        f"(orders {best.orders[0]}, {best.orders[1]})"
    )


def candidate_orders() -> tuple[tuple[int, int], ...]:
    """Orders (m, n) in the sequence in which `fit` tries them."""
    every = [(m, n) for m in range(1, HIGHEST_ORDER + 1) for n in range(1, HIGHEST_ORDER + 1)]
    return tuple(sorted(every, key=lambda orders: (len(_terms(orders)), max(orders), orders[1])))


def _terms(orders: tuple[int, int]) -> tuple[tuple[int, int], ...]:
    m, n = orders
    return tuple((i, j) for i in range(m + 1) for j in range(n + 1) if i + j <= max(m, n))


def _check_variation(measurements: Measurements) -> None:
    fewest = len(_terms((1, 1))) + 1
    if len(measurements) < fewest:
        raise SpecificationError(
            f"{measurements.source} must hold at least {fewest} measurements for a linear regression, "
            f"not {len(measurements)}"
        )
    columns = (measurements.clearance, measurements.voltage, measurements.temperature)
    for name, values in zip(COLUMNS, columns, strict=True):
        if values.min() == values.max():
            raise SpecificationError(f"{measurements.source}: {name} must vary, not be {values[0]} in every row")


@dataclass(frozen=True)
class _Mapping:
    """``x = (value - centre) / half``, into [-1, 1]; `half` is a power of two, so that dividing is exact."""

    centre: float
    half: float

    @classmethod
    def of(cls, values: Values) -> _Mapping:
        low, high = float(values.min()), float(values.max())
        centre = low + (high - low) / 2
        return cls(centre, 2.0 ** math.ceil(math.log2(max(high - centre, centre - low))))

    def __call__(self, values: Values) -> Values:
        return (values - self.centre) / self.half

    def power(self, exponent: int) -> Iterator[tuple[int, Fraction]]:
        """Powers and exact coefficients of ``x**exponent`` as a polynomial of the value."""
        centre, half = Fraction(self.centre), Fraction(self.half)
        for k in range(exponent + 1):
            yield k, math.comb(exponent, k) * (-centre) ** (exponent - k) / half**exponent


def _least_squares(x: Values, y: Values, d: Values, terms: tuple[tuple[int, int], ...]) -> Values | None:
    """Coefficients of `terms` in the mapped variables, or None if they are not determined."""
    matrix = np.stack([x**i * y**j for i, j in terms], axis=1)
    length = np.linalg.norm(matrix, axis=0)
    if not length.all():
        return None
    solution, _, rank, _ = np.linalg.lstsq(matrix / length, d, rcond=RANK_TOLERANCE)
    return np.asarray(solution / length) if rank == len(terms) else None


def _unscale(scaled: dict[tuple[int, int], float], voltage: _Mapping, temperature: _Mapping) -> Polynomial:
    """Polynomial of volts and degC, expanded exactly; then each coefficient rounded once, to a double."""
    m, n = (max(term[axis] for term in scaled) for axis in (0, 1))
    sums = [[Fraction(0)] * (n + 1) for _ in range(m + 1)]
    for (i, j), value in scaled.items():
        for p, v in voltage.power(i):
            for q, t in temperature.power(j):
                sums[p][q] += Fraction(value) * v * t
    widths = [max(j for i, j in scaled if i == p) + 1 for p in range(m + 1)]
    return Polynomial.from_numbers([[float(a) for a in row[:width]] for row, width in zip(sums, widths, strict=True)])


def _adjusted_r_squared(d: Values, residual: Values, terms: int) -> float:
    rss = float(np.sum(residual**2))
    tss = float(np.sum((d - d.mean()) ** 2))
    return 1.0 - (rss / (len(d) - terms)) / (tss / (len(d) - 1))
