"""Contact forces of wheelsets whose creep saturates at the limit of friction and whose flanges meet the rails.

relative motion      creepages of both wheels     Kalker's linear forces       saturated at friction
y, psi, y', psi' --> along, across, spin -------> T_x, T_y, M_z  -----------> g(u) (T_x, T_y, M_z)
  |                                                    ^                          |      u = |T| / (mu N)
  |                                 wheel loads N -----+--------------------------+
  +--> |y| - room ---------------> progressive flange stiffness --------------->  force to the track's centre
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from sosmith.instrument.vehicle.linear_motion import Array
from sosmith.instrument.vehicle.wheel_rail_contact import Creep

FULL_SLIDING = 3.0
"""Ratio of the linear creep force to the friction limit from which on the wheel slides."""

LEAST_LOAD = 0.05
"""Smallest share of the static load at which creep forces are still computed; below it a wheel is about to lift."""


def saturation(ratio: Array) -> Array:
    """Return the factor on linear creep forces whose resultant is `ratio` times the friction limit.

    1 - u/3 + u^2/27 up to u = 3, then 1/u, so that the resultant never exceeds the limit (Vermeulen and Johnson 1964;
    with Kalker's coefficients and spin, Shen, Hedrick and Elkins 1983; both from memory).

    Examples
    --------
    >>> saturation(np.array([0.0, 1.5, 3.0, 6.0])).round(6).tolist()
    [1.0, 0.583333, 0.333333, 0.166667]
    """
    rolling = 1 + ratio * (ratio / 27 - 1 / 3)
    return np.where(ratio < FULL_SLIDING, rolling, 1 / np.maximum(ratio, FULL_SLIDING))


def _saturation_slope(ratio: Array) -> Array:
    """Return the slope of `saturation`, divided by the ratio; finite where the ratio is not 0."""
    rolling, sliding = 2 / 27 - 1 / (3 * np.maximum(ratio, 1e-12)), np.maximum(ratio, FULL_SLIDING)
    return np.where(ratio < FULL_SLIDING, rolling, -1 / (sliding * sliding * sliding))


@dataclass(frozen=True, kw_only=True)
class Flange:
    """A flange that meets its rail: no force within the clearance, then a stiffness that grows to its full value.

    Attributes
    ----------
    stiffness : float
        Full stiffness in N/m: that of the rail against lateral displacement.
    transition : float
        Way in m over which the stiffness grows in proportion to the way.
    """

    stiffness: float
    transition: float

    def force(self, way: Array) -> Array:
        """Return the force in N at a `way` in m beyond first contact; 0 before it.

        Examples
        --------
        >>> Flange(stiffness=1e6, transition=0.002).force(np.array([-0.001, 0.001, 0.002, 0.003])).round(3).tolist()
        [0.0, 250.0, 1000.0, 2000.0]
        """
        growing = np.minimum(np.maximum(way, 0.0), self.transition)
        full = np.maximum(way - self.transition, 0.0)
        return np.asarray(self.stiffness * (growing * growing / (2 * self.transition) + full))

    def slope(self, way: Array) -> Array:
        """Return the stiffness in N/m at a `way` in m beyond first contact."""
        return np.asarray(self.stiffness / self.transition * np.minimum(np.maximum(way, 0.0), self.transition))

    def energy(self, way: Array) -> Array:
        """Return the work in J done against the flange up to a `way` in m beyond first contact.

        Examples
        --------
        >>> Flange(stiffness=6e6, transition=0.001).energy(np.array([-1.0, 0.001, 0.002])).round(6).tolist()
        [0.0, 1.0, 7.0]
        """
        growing = np.minimum(np.maximum(way, 0.0), self.transition)
        full = np.maximum(way - self.transition, 0.0)
        return np.asarray(self.stiffness * (growing**3 / (6 * self.transition) + full * (full + self.transition) / 2))


@dataclass(frozen=True, kw_only=True, eq=False)
class Loaded:
    """The wheels at given loads.

    Attributes
    ----------
    kalker : ndarray, shape (..., 3, 3, 2, m)
        Forces of the left and the right wheel of each wheelset per creepage: (along, across, moment) by (along, across,
        spin), as `Contacts.linear` and `Contacts.creepages` have them.
    limit : ndarray, shape (..., 2, m)
        Friction coefficient times load, in N.
    """

    kalker: Array
    limit: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Contacts:
    """The contacts of m equal wheelsets at one speed.

    The state of a wheelset's contact is its lateral position in m and yaw in rad relative to the rails, and the rates
    of both, in this order along the last but one axis: shape (..., 4, m).

    Attributes
    ----------
    speed, conicity, rolling_radius, half_spacing : float
        In m/s, 1, m and m, as in `sosmith.instrument.vehicle.wheel_rail_contact.contact_matrices`.
    creep : Creep
        Coefficients of a wheel that carries `load`.
    load : float
        Static load of a wheel in N.
    friction : float
        Coefficient of friction.
    flange : Flange
    """

    speed: float
    conicity: float
    rolling_radius: float
    half_spacing: float
    creep: Creep
    load: float
    friction: float
    flange: Flange
    _slip: Array = field(init=False, repr=False)
    _kalker: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        creep, half, one = self.creep, self.half_spacing, 1 / self.speed
        slip = [[self.conicity / self.rolling_radius, 0, 0, half * one], [0, -1, one, 0], [0, 0, 0, one]]
        object.__setattr__(self, "_slip", np.array(slip)[..., np.newaxis])
        forces = [
            [creep.f11, 0, 0],
            [0, -creep.f22, -creep.f23],
            [-half * creep.f11, creep.f23, -creep.f33],
        ]
        object.__setattr__(self, "_kalker", np.array(forces, dtype=np.float64)[..., np.newaxis, np.newaxis])

    def loaded(self, loads: Array) -> Loaded:
        """Return the wheels under `loads` in N, shape (..., 2, m).

        The area of contact grows with the load as in Hertz's theory: f11 and f22 with its power 2/3, f23 with the load
        itself, f33 with its power 4/3.
        """
        share = np.maximum(loads / self.load, LEAST_LOAD)
        # the C library's cube roots: numpy's own depend on the processor
        root = np.array([math.cbrt(value) for value in share.ravel().tolist()]).reshape(share.shape)
        powers = np.stack([root * root, share, share * root], axis=-3)
        growth = powers[..., [[0, 0, 0], [0, 0, 1], [0, 1, 2]], :, :]
        return Loaded(kalker=growth * self._kalker, limit=share * (self.friction * self.load))

    def creepages(self, state: Array) -> Array:
        """Return longitudinal (of the right wheel), lateral creepage and spin in 1/m, shape (..., 3, m).

        Longitudinal creepage is opposite at the left wheel. Spin is that of the yaw rate; the spin of the cones, equal
        and opposite at both wheels, is left out as in the linear model.
        """
        return np.asarray(np.add.reduce(self._slip * state[..., np.newaxis, :, :], axis=-2))

    def linear(self, creepages: Array, at: Loaded) -> Array:
        """Return Kalker's forces on left and right wheel in N, N and N m, shape (..., 3, 2, m).

        They are: longitudinal, backward at the right wheel and forward at the left one; lateral, to the left; and
        their moment about the vertical with that of spin, on the wheelset.
        """
        return np.asarray(np.add.reduce(at.kalker * creepages[..., np.newaxis, :, np.newaxis, :], axis=-3))

    def creep_forces(self, state: Array, at: Loaded, *, saturated: bool) -> tuple[Array, Array]:
        """Return the creep forces, as `linear` has them, and their resultant over the friction limit."""
        forces = self.linear(self.creepages(state), at)
        ratio = self._ratio(forces, at)
        if not saturated:
            return forces, ratio
        factor = saturation(ratio)
        used = np.where(ratio < FULL_SLIDING, ratio * factor, 1.0)
        return forces * factor[..., np.newaxis, :, :], used

    def beyond_linear(self, state: Array, room: Array, at: Loaded) -> Array:
        """Return what the contacts exert beyond the linear model on the wheelsets; second order in small motion.

        Parameters
        ----------
        state : ndarray, shape (..., 4, m)
        room : ndarray, shape (..., m)
            Way in m from the middle of the rails to first contact of a flange.
        at : Loaded

        Returns
        -------
        ndarray, shape (..., 2, m)
            Lateral forces in N and moments about the vertical in N m.
        """
        creepages = self.creepages(state)
        forces = self.linear(creepages, at)
        factor = saturation(self._ratio(forces, at))
        return self._exerted(forces[..., 1:, :, :] * factor[..., np.newaxis, :, :], creepages, state, room)

    def with_slopes(self, state: Array, room: Array, at: Loaded, ways: Array) -> tuple[Array, Array]:
        """Return `beyond_linear` and its derivatives along `ways`, directions in the space of states.

        Parameters
        ----------
        state : ndarray, shape (4, m)
        room : ndarray, shape (m,)
        at : Loaded
        ways : ndarray, shape (d, 4, m)

        Returns
        -------
        exerted : ndarray, shape (2, m)
        slopes : ndarray, shape (d, 2, m)
        """
        creepages, turned = self.creepages(state), self.creepages(ways)
        forces, turning = self.linear(creepages, at), self.linear(turned, at)
        ratio = self._ratio(forces, at)
        factor = saturation(ratio)
        exerted = self._exerted(forces[1:] * factor, creepages, state, room)
        steep = _saturation_slope(ratio) / (at.limit * at.limit)
        change = steep * (forces[0] * turning[:, 0] + forces[1] * turning[:, 1])
        slopes = np.add.reduce(turning[:, 1:] * factor + forces[1:] * change[:, np.newaxis], axis=-2)
        slopes -= self._still(turned)
        slopes[:, 0] -= self.flange.slope(np.abs(state[0]) - room) * ways[:, 0]
        return exerted, slopes

    def _ratio(self, forces: Array, at: Loaded) -> Array:
        along, across = forces[..., 0, :, :], forces[..., 1, :, :]
        return np.asarray(np.sqrt(along * along + across * across) / at.limit)

    def _still(self, creepages: Array) -> Array:
        """Return the linear model's forces: those of both wheels under their static load."""
        kalker = 2 * self._kalker[1:, :, 0]
        return np.asarray(np.add.reduce(kalker * creepages[..., np.newaxis, :, :], axis=-2))

    def _exerted(self, forces: Array, creepages: Array, state: Array, room: Array) -> Array:
        exerted = np.add.reduce(forces, axis=-2) - self._still(creepages)
        y = state[..., 0, :]
        exerted[..., 0, :] -= np.copysign(self.flange.force(np.abs(y) - room), y)
        return np.asarray(exerted)
