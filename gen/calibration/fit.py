"""Regression of the clearance on voltage and temperature, from reference measurements.

The paper's method (section 2.2): fit by least squares (equations 2 and 3), start with the linear polynomial,
raise the orders until the adjusted coefficient of correlation reaches 0.975, and keep the smallest polynomial
that reaches it.

Equation 3 states the normal equations. `Sums` accumulates them exactly and solves them in high precision, so the
same measurements give the same bits on every machine and in any order. A robust fit weights outliers down.
"""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from sosmith.gen.calibration.acceptance import REQUIRED_R
from sosmith.gen.calibration.least_squares import Solution, Sums, Term
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.tables.csv_table import LARGEST, NUMBER, CsvTable, check_rows, read_csv_table

COLUMNS = ("clearance_mm", "voltage_V", "temperature_C")
"""Columns of a measurement file, in their documented order."""

DATE_COLUMN = "date"
"""Optional column with the date of each measurement, such as 2024-03-01."""

UNCERTAINTY_COLUMNS = ("uncertainty_mm", "uncertainty_V", "uncertainty_C")
"""Optional columns with the standard uncertainty of a measurement's clearance, voltage and temperature."""

MAX_ORDER = 6
"""Highest order tried: 28 terms. The paper needs order 2."""

HUBER = 1.345
"""Residual, in standard deviations, above which a robust fit reduces the weight of a measurement.

Huber's constant: 95 % of the efficiency of least squares for normally distributed errors.
"""

NORMAL_CONSISTENCY = 1.4826
"""Ratio of the standard deviation of a normal error to the median of its magnitude."""

MIN_SCATTER = 1e-6
"""Lower limit of the estimated standard deviation in mm: 1 nm, finer than any measurement here."""

WEIGHT_STEPS = 1024
"""Weights are multiples of 1/1024, so that the reweighting iteration reaches a fixed point or a cycle."""

MAX_ROUNDS = 25
"""Limit on reweighting iterations. About ten are usual, but weights can cycle."""


Progress = Callable[[int, int], None]
"""Callback that receives the number of steps done and their total."""


@dataclass(frozen=True)
class Accept:
    """The largest interval of a reading's clearance that is acceptable.

    Attributes
    ----------
    limit : float
        Largest half-width in mm over the region that the measurements cover.
    half_width : callable
        Computes it for a fit to measurements.
    """

    limit: float
    half_width: Callable[[Measurements, Fit], float]


def unacceptable(measurements: Measurements, limit: float, half_width: float) -> str:
    """Return why a calibration is not accepted: its largest half-width in mm is above the limit."""
    return (
        f"{measurements.source}: the calibration must hold 95 % of the clearances within {limit:g} mm wherever there "
        f"are measurements, not within {half_width:.3g} mm only"
    )


def untold(done: int, total: int) -> None:
    """Ignore progress."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """Reference measurements; every array has one element per measurement.

    Attributes
    ----------
    clearance : ndarray, shape (n,)
        Micrometer reading in mm, 0 or more.
    voltage : ndarray, shape (n,)
        Sensor voltage in V.
    temperature : ndarray, shape (n,)
        Temperature at the sensor in degC.
    source : str
        Origin of the measurements, for messages.
    days : tuple of int
        Proleptic ordinal of the day of each measurement; empty if unknown.
    uncertainty : ndarray, shape (3, n), or None
        Standard uncertainties in mm, V and degC where they are stated, else 0; None if none is.
    """

    clearance: Values
    voltage: Values
    temperature: Values
    source: str = "measurements"
    days: tuple[int, ...] = ()
    uncertainty: Values | None = None

    def __post_init__(self) -> None:
        for name in ("clearance", "voltage", "temperature"):
            values: Values = getattr(self, name)
            if values.ndim != 1 or len(values) != len(self.clearance):
                raise ValueError(f"{name} must be of shape ({len(self.clearance)},), not {values.shape}")
            if not np.all(np.isfinite(values)):
                raise ValueError(f"{name} must be finite, not {values[~np.isfinite(values)][0]}")
        if len(self.days) not in (0, len(self.clearance)):
            raise ValueError(f"days must be of length {len(self.clearance)}, not {len(self.days)}")
        if self.uncertainty is not None:
            if self.uncertainty.shape != (3, len(self.clearance)):
                raise ValueError(
                    f"uncertainty must be of shape (3, {len(self.clearance)}), not {self.uncertainty.shape}"
                )
            if not np.all(np.isfinite(self.uncertainty) & (self.uncertainty >= 0)):
                raise ValueError("uncertainty must be 0 or more and finite")

    def __len__(self) -> int:
        """Return the number of measurements."""
        return len(self.clearance)

    def of(self, chosen: Values) -> Measurements:
        """Return those measurements for which `chosen`, shape (n,), is true."""
        days = tuple(day for day, one in zip(self.days, chosen.tolist(), strict=True) if one) if self.days else ()
        stated = None if self.uncertainty is None else self.uncertainty[:, chosen]
        columns = (self.clearance[chosen], self.voltage[chosen], self.temperature[chosen])
        return Measurements(*columns, self.source, days, stated)

    @property
    def covered(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lowest and highest voltage in V, and lowest and highest temperature in degC."""
        voltage, temperature = (
            (float(values.min()), float(values.max())) for values in (self.voltage, self.temperature)
        )
        return voltage, temperature


@dataclass(frozen=True)
class Trial:
    """The orders of one fitted polynomial, and its quality.

    Attributes
    ----------
    orders : tuple of int
        Highest powers (m, n) of voltage and temperature.
    terms : int
        Number of coefficients.
    adjusted_r_squared : float
        Adjusted coefficient of determination; at most 1, and negative for a model worse than the mean.
    """

    orders: tuple[int, int]
    terms: int
    adjusted_r_squared: float

    @property
    def adjusted_r(self) -> float:
        """Square root of the adjusted R squared, or 0 if that is negative."""
        return math.sqrt(max(self.adjusted_r_squared, 0.0))


@dataclass(frozen=True)
class Fit:
    """The accepted regression.

    Attributes
    ----------
    polynomial : Polynomial
        Clearance in mm; every coefficient is exactly a double.
    accepted : Trial
        The orders of `polynomial` and its quality.
    rms : float
        Root mean square residual in mm, over all measurements, unweighted.
    rejected : tuple of Trial
        The smaller polynomials that were not good enough, in the order in which they were tried.
    covered : tuple of (float, float)
        Lowest and highest voltage in V and temperature in degC of the measurements.
    weights : tuple of float
        Weight of each measurement, from 0 (left out) to 1; empty if all are equal.
    """

    polynomial: Polynomial
    accepted: Trial
    rms: float
    rejected: tuple[Trial, ...]
    covered: tuple[tuple[float, float], tuple[float, float]]
    weights: tuple[float, ...] = ()

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
    """Read a CSV file with the columns clearance_mm, voltage_V and temperature_C, in any order.

    If present, also those for the date and for uncertainties, whose cells may be empty.

    Raises
    ------
    SpecificationError
        As for `read_csv_table`; if a clearance is negative; if two rows are equal, which those of two days are not.
    """
    readers = {DATE_COLUMN: _ordinal, **dict.fromkeys(UNCERTAINTY_COLUMNS, _stated)}
    table = read_csv_table(path, (*COLUMNS, *readers), required=COLUMNS, readers=readers)
    clearance, voltage, temperature = (table.column(name) for name in COLUMNS)
    days = tuple(map(int, table.column(DATE_COLUMN).tolist())) if DATE_COLUMN in table else ()
    check_rows(table, clearance < 0, lambda k: f"clearance_mm must be 0 or more, not {clearance[k]}")
    _refuse_repeated_row(table)
    absent = np.zeros(len(clearance))
    stated = np.array([table.column(name) if name in table else absent for name in UNCERTAINTY_COLUMNS])
    return Measurements(clearance, voltage, temperature, str(path), days, stated if stated.any() else None)


def _stated(text: str) -> float:
    """Read an uncertainty; 0 for an empty cell."""
    if not text:
        return 0.0
    if not NUMBER.fullmatch(text) or not 0 < float(text) <= LARGEST:
        raise ValueError("more than 0, or empty where it is not known")
    return float(text)


def _ordinal(text: str) -> float:
    try:
        day = datetime.date.fromisoformat(text)
    except ValueError:
        day = None
    if day is None or day.isoformat() != text:
        raise ValueError("a date such as 2024-03-01")
    return float(day.toordinal())


def _refuse_repeated_row(table: CsvTable) -> None:
    first_line: dict[tuple[float, ...], int] = {}
    own = [table.header.index(name) for name in (*COLUMNS, DATE_COLUMN) if name in table]
    for index, row in enumerate(table.values[:, own].tolist()):
        line = first_line.setdefault(tuple(row), table.lines[index])
        if line != table.lines[index]:
            raise table.refuse(index, f"row must be a new measurement, not a duplicate of line {line}")


def fit(
    measurements: Measurements,
    required_r: float = REQUIRED_R,
    *,
    robust: bool = False,
    accept: Accept | None = None,
    progress: Progress = untold,
) -> Fit:
    """Find the smallest polynomial whose adjusted r reaches `required_r`.

    1. Orders (m, n) are tried from (1, 1) on by rising number of terms, then by rising max(m, n), then by
       rising n. The terms of (m, n) are ``V**i T**j`` with i <= m, j <= n, i + j <= max(m, n): equation 5b
       is (1, 1), equations 4 and 5a are (2, 1).
    2. Least squares gives the coefficients and the residual sum of squares RSS.
    3. With N measurements, p terms and the total sum of squares TSS,
       ``adjusted R**2 = 1 - (RSS / (N - p)) / (TSS / (N - 1))``, and r is its square root.

    Orders that the measurements cannot determine are skipped: too few rows, or too few distinct values of a
    variable.

    With `robust`, step 2 weights each measurement by ``min(1, HUBER * s / |residual|)``, where s is the scatter
    estimated from the median absolute residual, and repeats until the weights no longer change (Huber's M-estimator
    by iteratively reweighted least squares). RSS and TSS are weighted likewise. An outlier in clearance that is also
    far out in voltage or temperature can still pull the fit towards itself; its leverage shows that.

    Where uncertainties are stated, squared residuals, RSS and TSS are weighted by them; see `stated_weights`.

    With `accept`, a polynomial must also keep its largest interval within a limit, or the orders are raised further.

    `progress` receives the number of orders tried and the number of all orders.

    Raises
    ------
    SpecificationError
        If there are fewer measurements than the linear polynomial needs; if a quantity does not vary, or voltage and
        temperature vary only together; if uncertainties are stated in some rows only; if no polynomial up to
        `MAX_ORDER` reaches `required_r`, or keeps `accept`.
    """
    check_variation(measurements)
    count = len(measurements)
    rejected: list[Trial] = []
    widths: list[float] = []
    stated = stated_weights(measurements)
    minimize = _huber(measurements, stated) if robust else _least_squares(measurements, stated)
    every = candidate_orders()
    for tried, orders in enumerate(every):
        progress(tried, len(every))
        terms = terms_of(orders)
        found = minimize(terms) if len(terms) < count else None
        if found is None:
            if not rejected:
                raise SpecificationError(
                    f"{measurements.source}: voltage_V and temperature_C must vary independently, "
                    "not along one straight line"
                )
            continue
        solution, weights = found
        unexplained = (solution.residual_squares / (count - len(terms))) / (solution.total_squares / (count - 1))
        trial = Trial(orders, len(terms), 1.0 - float(unexplained))
        if trial.adjusted_r >= required_r:
            rms = root_mean_square(residuals(measurements, solution.polynomial))
            found_fit = Fit(solution.polynomial, trial, rms, tuple(rejected), measurements.covered, weights)
            if accept is None:
                return found_fit
            widths.append(accept.half_width(measurements, found_fit))
            if widths[-1] <= accept.limit:
                return found_fit
        rejected.append(trial)
    if accept is not None and widths:
        raise SpecificationError(unacceptable(measurements, accept.limit, min(widths)))
    best = max(rejected, key=lambda trial: trial.adjusted_r_squared)
    raise SpecificationError(
        f"{measurements.source}: adjusted r must reach {required_r} "
        f"with a polynomial up to order {MAX_ORDER}, not at most {best.adjusted_r:.4f} "
        f"(orders {best.orders[0]}, {best.orders[1]})"
    )


def residuals(measurements: Measurements, polynomial: Polynomial) -> Values:
    """Return measured clearance minus fitted clearance in mm, shape (n,)."""
    return measurements.clearance - polynomial(measurements.voltage, measurements.temperature)


def root_mean_square(values: Values) -> float:
    """Return the root mean square. The sum is rounded once, so the result is the same on every machine."""
    return math.sqrt(math.fsum(values**2) / len(values))


_Minimize = Callable[[tuple[Term, ...]], tuple[Solution, tuple[float, ...]] | None]
"""Maps terms to coefficients and weights; None if the measurements do not determine them."""


WIDEST = Fraction(10) ** 18
"""Largest ratio of two squared uncertainties."""


def stated_weights(measurements: Measurements) -> Values | None:
    """Return the weights of squared residuals, from 0 to 1; None if no uncertainties are stated.

    A weight is the smallest squared uncertainty over that of the row, rounded to a double once. The squared uncertainty
    of a row is ``u_d**2 + (a u_V)**2 + (b u_T)**2``, with the slopes a and b of the linear polynomial that fits all
    rows by unweighted least squares: it is the same whatever orders are tried.

    Raises
    ------
    SpecificationError
        If uncertainties are stated in some rows only: the rule does not know how the others scatter. If they differ by
        more than a factor of 1e9.
    """
    if measurements.uncertainty is None:
        return None
    u_d, u_v, u_t = ([Fraction(value) for value in row] for row in measurements.uncertainty.tolist())
    slopes = [Fraction(0), Fraction(0)]
    if any(u_v) or any(u_t):
        sums = Sums(measurements.clearance, measurements.voltage, measurements.temperature)
        linear = sums.solve(terms_of((1, 1)))
        if linear is not None:  # else there will be no polynomial either
            (_, of_temperature), (of_voltage,) = linear.polynomial.coefficients
            slopes = [Fraction(of_voltage), Fraction(of_temperature)]
    squares = [d**2 + (slopes[0] * v) ** 2 + (slopes[1] * t) ** 2 for d, v, t in zip(u_d, u_v, u_t, strict=True)]
    least = min(squares)
    if not least > 0:
        raise SpecificationError(
            f"{measurements.source}: uncertainties must be stated in every row or in none for the paper's rule, "
            f"not in {sum(map(bool, squares)):,} of {len(squares):,}"
        )
    if max(squares) > WIDEST * least:
        raise SpecificationError(
            f"{measurements.source}: uncertainties must be within a factor of 1e9 of each other, not "
            f"{float(max(squares) / least) ** 0.5:.3g}"
        )
    return np.array([float(least / square) for square in squares])


def _least_squares(measurements: Measurements, weights: Values | None) -> _Minimize:
    sums = Sums(measurements.clearance, measurements.voltage, measurements.temperature, weights)
    given = () if weights is None else tuple(weights.tolist())

    def minimize(terms: tuple[Term, ...]) -> tuple[Solution, tuple[float, ...]] | None:
        solution = sums.solve(terms)
        return None if solution is None else (solution, given)

    return minimize


def _huber(measurements: Measurements, weights: Values | None) -> _Minimize:
    equal = np.ones(len(measurements)) if weights is None else weights
    narrow = np.sqrt(equal)
    unweighted = Sums(measurements.clearance, measurements.voltage, measurements.temperature, equal)

    def minimize(terms: tuple[Term, ...]) -> tuple[Solution, tuple[float, ...]] | None:
        sums, weights = unweighted, equal
        rounds: list[tuple[Solution, Values]] = []
        while True:
            solution = sums.solve(terms)
            if solution is None:
                return None
            rounds.append((solution, weights))
            off = np.abs(residuals(measurements, solution.polynomial)) * narrow
            allowed = HUBER * max(NORMAL_CONSISTENCY * float(np.median(off)), MIN_SCATTER)
            exact = allowed / np.maximum(off, allowed)
            weights = np.maximum(np.rint(exact * WEIGHT_STEPS), 1.0) / WEIGHT_STEPS * equal
            again = [k for k, (_, earlier) in enumerate(rounds) if np.array_equal(weights, earlier)]
            if again or len(rounds) == MAX_ROUNDS:
                # Equal weights repeat every later iteration: the weights cycle, a fixed point being a cycle of one.
                last = again[0] + (MAX_ROUNDS - 1 - again[0]) % (len(rounds) - again[0]) if again else -1
                solution, weights = rounds[last]
                return solution, tuple(weights.tolist())
            sums = sums.reweighted(weights)

    return minimize


def candidate_orders() -> tuple[tuple[int, int], ...]:
    """Return the orders (m, n) in the sequence in which `fit` tries them."""
    every = [(m, n) for m in range(1, MAX_ORDER + 1) for n in range(1, MAX_ORDER + 1)]
    return tuple(sorted(every, key=lambda orders: (len(terms_of(orders)), max(orders), orders[1])))


def terms_of(orders: tuple[int, int]) -> tuple[Term, ...]:
    """Return the powers (i, j) of voltage and temperature in a polynomial of `orders`."""
    m, n = orders
    return tuple((i, j) for i in range(m + 1) for j in range(n + 1) if i + j <= max(m, n))


def check_variation(measurements: Measurements, names: tuple[str, ...] = COLUMNS) -> None:
    """Raise `SpecificationError` for measurements that are too few, or do not vary in the columns of these names."""
    fewest = len(terms_of((1, 1))) + 1
    if len(measurements) < fewest:
        raise SpecificationError(
            f"{measurements.source} must hold at least {fewest} measurements for a linear regression, "
            f"not {len(measurements)}"
        )
    columns = (measurements.clearance, measurements.voltage, measurements.temperature)
    for name, values in zip(COLUMNS, columns, strict=True):
        if name in names and values.min() == values.max():
            raise SpecificationError(f"{measurements.source}: {name} must vary, not be {values[0]} in every row")
