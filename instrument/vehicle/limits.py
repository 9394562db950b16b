"""How close a run comes to its limits: flange clearance, friction, derailment quotient, wheel loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.instrument.vehicle.lateral import wheelset_load, wheelset_positions
from sosmith.instrument.vehicle.linear_motion import Array
from sosmith.instrument.vehicle.motion import Motion
from sosmith.instrument.vehicle.parameters import Parameters
from sosmith.instrument.vehicle.track import Track

SLIDING = 2.0
"""Length in m over which UIC 518 and EN 14363 average guiding forces and Y/Q (gensys.se, UIC518_tests): a shorter peak
moves no track and climbs no rail."""

QUOTIENT = 0.8
"""Limit of UIC 518 for the average of Y/Q over `SLIDING` (railwaynews.net on its 4th edition); that of EN 14363 is
assumed to be the same."""

TRACK_RESISTANCE, OF_LOAD = 10e3, 1 / 3
"""Force in N and share of the load of a wheelset that the track resists sideways: 1 t + Q / 3 (Prud'homme 1967, by
github.com/StructuralWizard/Rail, en/12Mechanics), times 0.85 there. Here that factor is 1, and 1 t 10 kN: k1 of
EN 14363 for vehicles with drives, which is assumed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Limits:
    """How close each wheelset comes to its limits. The linear model does not enforce them.

    Attributes
    ----------
    beyond_flange : ndarray, shape (6,)
        Largest lateral displacement in m beyond first flange contact; negative if there is no contact.
    beyond_flange_share : ndarray, shape (6,)
        Share of time with flange contact, 0 to 1.
    flange_force : ndarray, shape (6,)
        Largest force in N of a rail against a flange; 0 in the linear model.
    friction_used : ndarray, shape (6,)
        Largest ratio of creep force to available friction force; above 1 only in the linear model.
    friction_exceeded_share : ndarray, shape (6,)
        Share of time with a ratio above 1, 0 to 1.
    sliding_share : ndarray, shape (6,)
        Share of time with a wheel that slides fully, with a ratio of 1 or more, 0 to 1.
    derailment_quotient : ndarray, shape (6,)
        Largest Y/Q of both wheels.
    nadal : float
        Y/Q at which the flange would begin to climb.
    sliding_quotient : ndarray, shape (6,)
        Largest average of Y/Q over `SLIDING` of both wheels, to be held against `QUOTIENT`.
    guiding_sum : ndarray, shape (6,)
        Largest average over `SLIDING` of the force in N with which both wheels push the track to one side.
    prudhomme : float
        Such a force in N that shifts the track.
    load_share : ndarray, shape (6,)
        Smallest load of both wheels over their static load.
    """

    beyond_flange: Array
    beyond_flange_share: Array
    flange_force: Array
    friction_used: Array
    friction_exceeded_share: Array
    sliding_share: Array
    derailment_quotient: Array
    nadal: float
    sliding_quotient: Array
    guiding_sum: Array
    prudhomme: float
    load_share: Array

    @property
    def kept(self) -> bool:
        """Whether flanges hold what goes beyond them, friction carries creep, and no wheel climbs or lifts."""
        held = (self.beyond_flange <= 0) | (self.flange_force > 0)
        safe = (self.derailment_quotient < self.nadal) & (self.load_share > 0)
        return bool(np.all(held & (self.friction_used <= 1) & safe))


def nadal_limit(tangent: float, friction: float) -> float:
    """Return the Y/Q at which a flange of this slope begins to climb: (t - mu) / (1 + mu t) (Nadal 1896, from memory).

    Parameters
    ----------
    tangent : float
        Tangent of the flange angle.
    friction : float
        Coefficient of friction.

    Examples
    --------
    >>> round(nadal_limit(2.747, 0.3), 2)
    1.34
    """
    return (tangent - friction) / (1 + friction * tangent)


def prudhomme_limit(load: float) -> float:
    """Return the force in N on the track by one wheelset that shifts it: 10 kN + 2 Q0 / 3; see `TRACK_RESISTANCE`.

    Parameters
    ----------
    load : float
        Static load 2 Q0 of the wheelset in N.

    Examples
    --------
    >>> round(prudhomme_limit(225e3))
    85000
    """
    return TRACK_RESISTANCE + OF_LOAD * load


def sliding_mean(values: Array, distance: Array) -> Array:
    """Return the means of `values`, shape (n, ...), over `SLIDING` of the `distance` in m, shape (n,), which is even.

    A shorter record has one mean.
    """
    step = float(distance[-1] - distance[0]) / max(len(distance) - 1, 1)
    count = min(max(round(SLIDING / step), 1) if step > 0 else 1, len(values))
    total = np.cumsum(np.concatenate((np.zeros_like(values[:1]), values)), axis=0)
    return np.asarray((total[count:] - total[:-count]) / count)


def limits(parameters: Parameters, track: Track, motion: Motion) -> Limits:
    """Hold a run against flange clearance, friction, Nadal's limit and the static load of the wheels."""
    ahead = wheelset_positions(parameters.layout)
    place = motion.distance[:, np.newaxis] + ahead - ahead[0]
    room = parameters.sensor.flange_clearance + track.widening_at(place) / 2
    beyond = np.abs(motion.lateral_to_rails) - room
    used, load = motion.friction_used, wheelset_load(parameters)
    pushed = sliding_mean(motion.guiding_force[:, :, 1] - motion.guiding_force[:, :, 0], motion.distance)
    return Limits(
        beyond_flange=beyond.max(axis=0),
        beyond_flange_share=(beyond > 0).mean(axis=0),
        flange_force=motion.flange_force.max(axis=0),
        friction_used=used.max(axis=0),
        friction_exceeded_share=(used > 1).mean(axis=0),
        sliding_share=(used >= 1).mean(axis=0),
        derailment_quotient=motion.derailment_quotient.max(axis=0),
        nadal=nadal_limit(1 / parameters.sensor.flank_slope, parameters.contact.friction),
        sliding_quotient=sliding_mean(motion.guiding_force / motion.wheel_load, motion.distance).max(axis=(0, 2)),
        guiding_sum=np.abs(pushed).max(axis=0),
        prudhomme=prudhomme_limit(load),
        load_share=motion.wheel_load.min(axis=(0, 2)) / (load / 2),
    )
