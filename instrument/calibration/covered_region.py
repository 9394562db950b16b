"""The region of voltage and temperature that measurements cover, and the difference of polynomials over it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sosmith.model.arrays import Values
from sosmith.model.polynomial import Polynomial

GRID = 65
"""Grid points along each axis at which polynomials are compared."""

Point = tuple[float, float]


@dataclass(frozen=True)
class CoveredRegion:
    """The convex hull of the measurements: inside it a polynomial interpolates, outside it extrapolates.

    Attributes
    ----------
    corners : tuple of Point
        Voltage in V and temperature in degC of the corners, counterclockwise; no three are collinear. Fewer
        than three if all measurements are collinear.
    """

    corners: tuple[Point, ...]

    @classmethod
    def of(cls, voltage: Values, temperature: Values) -> CoveredRegion:
        """Return the region of measurements at `voltage` and `temperature`, each of shape (n,)."""
        points = sorted(set(zip(voltage.tolist(), temperature.tolist(), strict=True)))
        lower, upper = _half(points), _half(reversed(points))
        return cls(tuple(lower[:-1] + upper[:-1]) or tuple(points))

    @property
    def area(self) -> float:
        """Area in V degC."""
        following = self.corners[1:] + self.corners[:1]
        return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(self.corners, following, strict=True)) / 2

    def points(self) -> tuple[Values, Values]:
        """Return the voltages and temperatures of the grid points inside the region and of its corners."""
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
        """Return the largest absolute difference of two polynomials over `points`, in mm."""
        v, t = self.points()
        return float(np.max(np.abs(one(v, t) - other(v, t))))


def _half(points: Iterable[Point]) -> list[Point]:
    """Return the half hull from the first to the last of sorted points, turning left (Andrew's monotone chain)."""
    chain: list[Point] = []
    for point in points:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0:
            chain.pop()
        chain.append(point)
    return chain


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
