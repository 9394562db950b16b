"""Where a run leaves what a linear model can tell: wheels beyond their flanges, creep beyond friction."""

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
    """How far each wheelset goes beyond the model; nothing is cut off at these limits.

    Attributes
    ----------
    beyond_flange : ndarray, shape (6,)
        Largest way in m of the wheelset past the place where its flange would touch the rail; below 0 it stays clear.
    beyond_flange_share : ndarray, shape (6,)
        Share of the time that it is past it, 0 to 1.
    friction_used : ndarray, shape (6,)
        Largest creep force over the friction that the wheel's load gives; above 1 the wheel would slide.
    friction_exceeded_share : ndarray, shape (6,)
        Share of the time that it is above 1.
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
    """Find where flanges would have touched and creep would have saturated."""
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
