"""The polynomial of a day: as high an order in the voltage as the day's own curve needs, and never one that folds back.

The curve of a day is smooth over the clearance but no parabola: its error has a correlation length of its own. What a
polynomial misses of it is judged by the uncertainty that the curve has anyway.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from sosmith.gen.calibration.fit import Measurements
from sosmith.gen.calibration.least_squares import Sums, Term
from sosmith.instrument.calibration.acceptance import Range
from sosmith.instrument.calibration.covered_region import CoveredRegion
from sosmith.instrument.calibration.mixed_effects.model import Posterior
from sosmith.instrument.calibration.sensor_type import LEAST_ORDER, TERMS
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial

PROJECTED = (33, 9)
"""Voltages and temperatures at which the day's curve is fitted by a polynomial."""

BESIDE = 10.0
"""Where all measurements are of one temperature, the polynomial holds so many kelvins about it as well: there the type
says how the curve goes on."""

SMALLEST = 1.0
"""Clearance in mm below which the projection weights errors equally; above it, relative to the clearance."""

FOLLOWED = 0.1
"""What a polynomial may miss of the day's curve, relative to the standard uncertainty of the curve there, rms: it
widens intervals by half a percent."""

FARTHER = Fraction(1, 2)
"""How much farther in mm the polynomial of a day may leave the range of the clearance than that of the deviations."""

PIECES = 16
"""Pieces of a range on which a polynomial is enclosed by its Bernstein coefficients."""


def polynomial_of(
    posterior: Posterior, measurements: Measurements, region: CoveredRegion, ranges: tuple[Range, Range, Range]
) -> tuple[Polynomial, bool]:
    """Return the polynomial, and whether the day's own curve is left out of it.

    Raises
    ------
    SpecificationError
        If even the curve without the day's own falls with the voltage somewhere in `region`.
    """
    own = nearest(posterior, measurements, region, ranges) if posterior.same_day else None
    if own is not None:
        return own, False
    plain = posterior.sensor_type.polynomial(posterior.deviations)
    slope = lowest_slope(plain, region)
    if not slope > 0:
        raise SpecificationError(
            f"{measurements.source}: the clearance must rise with voltage_V over all measurements, "
            f"not with a slope of {float(slope):.3g} mm/V somewhere"
        )
    return plain, True


def nearest(
    posterior: Posterior, measurements: Measurements, region: CoveredRegion, ranges: tuple[Range, Range, Range]
) -> Polynomial | None:
    """Return the polynomial nearest to the day's curve over the voltages of the port and the measured temperatures.

    The order in the voltage rises from `LEAST_ORDER` to that of the sensor's type, until the polynomial follows the
    curve as `FOLLOWED` says. If that one leaves what is `_allowed`, or falls with the voltage, a lower order takes its
    place; None if all do.
    """
    V, T = projected_at(ranges[1], temperatures_about(measurements.covered[1]))
    curve = posterior.curve(V, T)
    sums = Sums(curve, V, T, 1.0 / np.maximum(curve, SMALLEST) ** 2)
    variance = posterior.scatters.mean_of(posterior.predicted(V, T)[1])
    made: list[Polynomial] = []
    for order in range(LEAST_ORDER, posterior.sensor_type.order + 1):
        solution = sums.solve(terms_up_to(order))
        assert solution is not None, "a grid determines the terms"
        made.append(solution.polynomial)
        if float(np.mean((made[-1](V, T) - curve) ** 2 / variance)) <= FOLLOWED**2:
            break
    low, high = _allowed(posterior, ranges)
    for one in reversed(made):
        least, most = extremes(one, ranges)
        if low <= least and most <= high and lowest_slope(one, region) > 0:
            return one
    return None


def projected_at(voltages: Range, temperatures: Range) -> tuple[Values, Values]:
    """Return the voltages and temperatures at which a curve is fitted by a polynomial."""
    axes = (
        np.linspace(low, high, count) for (low, high), count in zip((voltages, temperatures), PROJECTED, strict=True)
    )
    V, T = (grid.ravel() for grid in np.meshgrid(*axes))
    return V, T


def terms_up_to(order: int) -> tuple[Term, ...]:
    """Return the terms of a day's polynomial: those of a type curve, or all up to an order above, linear in T."""
    return TERMS if order == LEAST_ORDER else tuple(itertools.product(range(order + 1), range(2)))


def temperatures_about(covered: Range) -> Range:
    """Return the measured temperatures, or those `BESIDE` the only one."""
    low, high = covered
    return (low, high) if low < high else (low - BESIDE, high + BESIDE)


def stays_within(polynomial: Polynomial, ranges: tuple[Range, Range, Range]) -> bool:
    """Whether a polynomial, linear in the temperature, provably stays in the range of clearance.

    At all voltages and temperatures of `ranges`; in exact arithmetic, without doubt up to order 2 in the voltage.
    """
    low, high = extremes(polynomial, ranges)
    return Fraction(ranges[0][0]) <= low <= high <= Fraction(ranges[0][1])


def extremes(polynomial: Polynomial, ranges: tuple[Range, Range, Range]) -> tuple[Fraction, Fraction]:
    """Enclose the clearances in mm of a polynomial, linear in the temperature, over the ports; exact up to order 2."""
    v_low, v_high = map(Fraction, ranges[1])
    ends = [
        _extremes(
            _composed(
                [
                    sum((value * Fraction(T) ** j for j, value in enumerate(row)), Fraction(0))
                    for row in polynomial.coefficients
                ],
                v_low,
                v_high - v_low,
            )
        )
        for T in ranges[2]
    ]
    return min(low for low, _ in ends), max(high for _, high in ends)


def _allowed(posterior: Posterior, ranges: tuple[Range, Range, Range]) -> tuple[Fraction, Fraction]:
    """Return the clearances that the day's polynomial may have: those of the port.

    A sensor may leave them at temperatures at which nobody reads it, on any day; then the day's polynomial may do so,
    too, and a little farther. To leave its own curve out would not help.
    """
    low, high = extremes(posterior.sensor_type.polynomial(posterior.deviations), ranges)
    c_low, c_high = map(Fraction, ranges[0])
    return min(c_low, low - FARTHER * (low < c_low)), max(c_high, high + FARTHER * (high > c_high))


def lowest_slope(polynomial: Polynomial, region: CoveredRegion) -> Fraction:
    """Return the lowest slope in mm/V of a polynomial over a region, or a bound just below it; exact up to order 2.

    The polynomial is linear in the temperature, so that the slope is lowest on the region's edge.
    """
    corners = [(Fraction(v), Fraction(T)) for v, T in region.corners]
    found = []
    for (v, T), (v_next, T_next) in zip(corners, corners[1:] + corners[:1], strict=True):
        along: list[Fraction] = [Fraction(0)]
        for power, row in reversed(list(enumerate(polynomial.coefficients))[1:]):
            by_T = [power * value for value in row]
            along = _sum(_times(along, [v, v_next - v]), _composed(by_T, T, T_next - T))
        found.append(_extremes(along)[0])
    return min(found)


def _extremes(coefficients: Sequence[Fraction]) -> tuple[Fraction, Fraction]:
    """Enclose the values of a polynomial over [0, 1]; exact up to order 2."""
    if any(coefficients[3:]):
        values = [
            value
            for k in range(PIECES)
            for value in _bernstein(_composed(coefficients, Fraction(k, PIECES), Fraction(1, PIECES)))
        ]
    else:
        c, b, a = (*coefficients[:3], Fraction(0), Fraction(0), Fraction(0))[:3]
        turn = -b / (2 * a) if a else Fraction(0)
        values = [c, c + b + a, *([(a * turn + b) * turn + c] if 0 < turn < 1 else [])]
    return min(values), max(values)


def _bernstein(coefficients: Sequence[Fraction]) -> list[Fraction]:
    """Return the coefficients in the basis of Bernstein, between which all values over [0, 1] lie."""
    n = len(coefficients) - 1
    return [
        sum((Fraction(math.comb(i, k), math.comb(n, k)) * coefficients[k] for k in range(i + 1)), Fraction(0))
        for i in range(n + 1)
    ]


def _composed(coefficients: Sequence[Fraction], start: Fraction, span: Fraction) -> list[Fraction]:
    """Return the polynomial in s at ``start + span s``."""
    total: list[Fraction] = [Fraction(0)]
    for value in reversed(coefficients):
        total = _sum(_times(total, [start, span]), [value])
    return total[: len(coefficients)]


def _times(a: Sequence[Fraction], b: Sequence[Fraction]) -> list[Fraction]:
    product = [Fraction(0)] * (len(a) + len(b) - 1)
    for (i, x), (j, y) in itertools.product(enumerate(a), enumerate(b)):
        product[i + j] += x * y
    return product


def _sum(a: Sequence[Fraction], b: Sequence[Fraction]) -> list[Fraction]:
    return [x + y for x, y in itertools.zip_longest(a, b, fillvalue=Fraction(0))]
