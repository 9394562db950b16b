"""Track geometry along the distance: course, cant, and a single lateral irregularity."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PPoly

from sosmith.instrument.vehicle.linear_motion import Array
from sosmith.instrument.vehicle.parameters import TrackTable


@dataclass(frozen=True, kw_only=True, eq=False)
class Track:
    """A track whose curvature and cant are continuous and piecewise linear.

    Before its beginning and after its end it continues straight, with constant cant.

    Attributes
    ----------
    corners : ndarray, shape (k,)
        Distances in m at which the slopes of curvature and cant change, rising; the first is 0, the last is the length.
    curvature : ndarray, shape (k,)
        Curvature at the corners in 1/m, positive to the left.
    cant : ndarray, shape (k,)
        Cant at the corners in m: height of the outer rail above the inner; in a curve to the left the right rail is
        the outer one.
    irregularity, irregularity_length : float
        Amplitude (to the left) and length in m of one lateral irregularity (1 - cos)/2 at the beginning.
    gauge_widening : float
        Gauge widening in m at the largest curvature; proportional to the curvature elsewhere.
    """

    corners: Array
    curvature: Array
    cant: Array
    irregularity: float = 0.0
    irregularity_length: float = 1.0
    gauge_widening: float = 0.0
    _curvature: PPoly = field(init=False, repr=False)
    _cant: PPoly = field(init=False, repr=False)

    def __post_init__(self) -> None:
        ends = np.concatenate([[self.corners[0] - 1e5], self.corners, [self.corners[-1] + 1e5]])
        for name, values in (("_curvature", self.curvature), ("_cant", self.cant)):
            padded = np.concatenate([values[:1], values, values[-1:]])
            slopes = np.diff(padded) / np.diff(ends)
            object.__setattr__(self, name, PPoly(np.array([slopes, padded[:-1]]), ends))

    @property
    def length(self) -> float:
        """Length in m."""
        return float(self.corners[-1])

    def curvature_at(self, distance: Array) -> Array:
        """Return the curvature in 1/m."""
        return np.asarray(self._curvature(distance))

    def heading_at(self, distance: Array) -> Array:
        """Return the direction of the track in rad, positive to the left, 0 at the beginning."""
        turned = self._curvature.antiderivative()
        return np.asarray(turned(distance) - turned(0.0))

    def offset_at(self, distance: Array) -> Array:
        """Return the lateral offset of the track in m for small angles: the curvature integrated twice."""
        turned = self._curvature.antiderivative()
        moved = turned.antiderivative()
        return np.asarray(moved(distance) - moved(0.0) - turned(0.0) * distance)

    def cant_at(self, distance: Array) -> Array:
        """Return the cant in m."""
        return np.asarray(self._cant(distance))

    def cant_slope_at(self, distance: Array) -> Array:
        """Return the slope of the cant in m per m; at a corner, the slope after it."""
        return np.asarray(self._cant.derivative()(distance))

    def irregularity_at(self, distance: Array) -> Array:
        """Return the single lateral irregularity in m, positive to the left."""
        inside = (distance > 0) & (distance < self.irregularity_length)
        wave = (1 - np.cos(2 * np.pi * distance / self.irregularity_length)) / 2
        return np.asarray(np.where(inside, self.irregularity * wave, 0.0))

    def widening_at(self, distance: Array) -> Array:
        """Return the gauge widening in m."""
        largest = float(np.abs(self.curvature).max())
        share = np.abs(self.curvature_at(distance)) / largest if largest else np.zeros_like(distance)
        return self.gauge_widening * share


def curved_track(table: TrackTable) -> Track:
    """Return a track of tangent, spiral, curve to the left, spiral and tangent, as in section 5.1 of the paper."""
    lengths = np.array([table.tangent, table.spiral, table.curve, table.spiral, table.run_out])
    inside = np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    corners, first = np.unique(np.concatenate([[0.0], np.cumsum(lengths)]), return_index=True)
    inside = inside[first]
    return Track(
        corners=corners,
        curvature=inside / table.radius,
        cant=inside * table.cant,
        irregularity=table.irregularity,
        irregularity_length=table.irregularity_length,
        gauge_widening=table.gauge_widening,
    )


def tangent_track(table: TrackTable) -> Track:
    """Return a straight track of the same length, with only the single irregularity."""
    length = table.tangent + 2 * table.spiral + table.curve + table.run_out
    return Track(
        corners=np.array([0.0, length]),
        curvature=np.zeros(2),
        cant=np.zeros(2),
        irregularity=table.irregularity,
        irregularity_length=table.irregularity_length,
    )
