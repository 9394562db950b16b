"""The part of the plane of voltage and temperature that measurements cover, and how far polynomials differ there."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sosmith.model.arrays import Values
from sosmith.model.calibration.polynomial import Polynomial

GRID = 65
"""Points along each axis at which polynomials are compared."""

Point = tuple[float, float]


@dataclass(frozen=True)
class CoveredRegion:
    """The convex hull of measurements: between them a polynomial is interpolated, outside extrapolated.

    Attributes
    ----------
    corners : tuple of Point
        Voltage in V and temperature in degC of the corners, counterclockwise; no three lie on a line. Fewer
        than three if all measurements lie on a line.
    """

    corners: tuple[Point, ...]

    @classmethod
    def of(cls, voltage: Values, temperature: Values) -> CoveredRegion:
        """Region of measurements at these voltages and temperatures, shape (n,) each."""
        points = sorted(set(zip(voltage.tolist(), temperature.tolist(), strict=True)))
        lower, upper = _half(points), _half(reversed(points))
        return cls(tuple(lower[:-1] + upper[:-1]) or tuple(points))

    @property
    def area(self) -> float:
        """Area in V degC."""
        following = self.corners[1:] + self.corners[:1]
        return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(self.corners, following, strict=True)) / 2

    def points(self) -> tuple[Values, Values]:
        """Voltages and temperatures of a grid inside, and of the corners."""
        (v_low, t_low), (v_high, t_high) = np.min(self.corners, axis=0), np.max(self.corners, axis=0)
        v, t = (
            axis.ravel() for axis in np.meshgrid(np.linspace(v_low, v_high, GRID), np.linspace(t_low, t_high, GRID))
        )
        inside = np.ones(len(v), dtype=np.bool_)
        for a, b in zip(self.corners, self.corners[1:] + self.corners[:1], strict=True):
            inside &= (b[0] - a[0]) * (t - a[1]) >= (b[1] - a[1]) * (v - a[0])
        corner_v, corner_t = np.array(self.corners).T
        return np.concatenate((v[inside], corner_v)), np.concatenate((t[inside], corner_t))

    def largest_difference(self, one: Polynomial, other: Polynomial) -> float:
        """Largest difference of two polynomials in mm, over the `points` of the region."""
        v, t = self.points()
        return float(np.max(np.abs(one(v, t) - other(v, t))))


def _half(points: Iterable[Point]) -> list[Point]:
    """Corners of the hull from the first to the last of sorted points, all turning left (Andrew's monotone chain)."""
    chain: list[Point] = []
    for point in points:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0:
            chain.pop()
        chain.append(point)
    return chain


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
