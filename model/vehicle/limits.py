"""Where a run leaves the validity of the linear model: flange contact, and creep forces above friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.model.vehicle.lateral import wheelset_load, wheelset_positions
from sosmith.model.vehicle.linear_motion import Array
from sosmith.model.vehicle.motion import Motion
from sosmith.model.vehicle.parameters import Parameters
from sosmith.model.vehicle.track import Track


@dataclass(frozen=True, kw_only=True, eq=False)
class Limits:
    """How far each wheelset exceeds the limits of the linear model, which does not enforce them.

    Attributes
    ----------
    beyond_flange : ndarray, shape (6,)
        Largest lateral displacement in m beyond first flange contact; negative if there is no contact.
    beyond_flange_share : ndarray, shape (6,)
        Share of time with flange contact, 0 to 1.
    friction_used : ndarray, shape (6,)
        Largest ratio of creep force to available friction force; above 1 the wheel would slide.
    friction_exceeded_share : ndarray, shape (6,)
        Share of time with a ratio above 1, 0 to 1.
    """

    beyond_flange: Array
    beyond_flange_share: Array
    friction_used: Array
    friction_exceeded_share: Array

    @property
    def kept(self) -> bool:
        """Whether the linear model holds throughout."""
        return bool(np.all(self.beyond_flange <= 0) and np.all(self.friction_used <= 1))


def limits(parameters: Parameters, track: Track, motion: Motion) -> Limits:
    """Check a run for flange contact and saturated creep."""
    ahead = wheelset_positions(parameters.layout)
    place = motion.distance[:, np.newaxis] + ahead - ahead[0]
    room = parameters.sensor.flange_clearance + track.widening_at(place) / 2
    beyond = np.abs(motion.lateral_to_rails) - room
    friction = parameters.contact.friction * wheelset_load(parameters) / 2
    used = motion.creep_force / friction
    return Limits(
        beyond_flange=beyond.max(axis=0),
        beyond_flange_share=(beyond > 0).mean(axis=0),
        friction_used=used.max(axis=0),
        friction_exceeded_share=(used > 1).mean(axis=0),
    )
