"""Vertical dynamics of a six-axle locomotive: bounce and pitch of frames and body on rigid rails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.instrument.vehicle.lateral import FRAMES, WHEELSETS, axle_positions, frame_of, frame_positions
from sosmith.instrument.vehicle.lateral import wheelset_positions as positions_of
from sosmith.instrument.vehicle.linear_motion import Array, LinearSystem, Suspension
from sosmith.instrument.vehicle.parameters import Parameters
from sosmith.instrument.vehicle.track import Track
from sosmith.instrument.vehicle.track_irregularity import Irregularity
from sosmith.model.arithmetic.matrices import product

COORDINATES = (
    *(f"frame {k + 1} {motion}" for k in FRAMES for motion in ("vertical", "pitch")),
    "body vertical",
    "body pitch",
)
"""The six coordinates in m and rad. Positive: vertical upward, pitch with the nose down."""

RAILS = tuple(f"wheelset {k + 1} vertical" for k in WHEELSETS)
"""Heights of the wheelsets, prescribed by the rails, which are rigid."""


@dataclass(frozen=True, kw_only=True, eq=False)
class VerticalDynamics:
    """The vertical equations of motion; they do not depend on the speed.

    Attributes
    ----------
    parameters : Parameters
        Parameters of the vehicle.
    system : LinearSystem
        Equations of motion in `COORDINATES`.
    suspension : Suspension
        Springs and dampers in `COORDINATES` and `RAILS`.
    """

    parameters: Parameters
    system: LinearSystem
    suspension: Suspension

    def rails(
        self, track: Track, irregularity: Irregularity | None, centre: Array, speed: float
    ) -> tuple[Array, Array]:
        """Return the height of the track centre under the wheelsets in m and its rate in m/s, shape (n, 6).

        The inner rail keeps its height, so the centre rises by half the cant.
        """
        height, rate = np.zeros((len(centre), 6)), np.zeros((len(centre), 6))
        for k, ahead in enumerate(positions_of(self.parameters.layout)):
            s = centre + ahead
            height[:, k] = track.cant_at(s) / 2
            rate[:, k] = track.cant_slope_at(s) / 2
            if irregularity is not None:
                height[:, k] += irregularity.level.at(s)
                rate[:, k] += irregularity.level.slope_at(s)
        return height, speed * rate

    def forces(self, height: Array, rate: Array) -> Array:
        """Return the forces that the rails exert on the coordinates, shape (n, 6)."""
        count = len(COORDINATES)
        stiffness, damping = self.suspension.stiffness[:count, count:], self.suspension.damping[:count, count:]
        return -product(height, stiffness.T) - product(rate, damping.T)


def vertical_dynamics(parameters: Parameters) -> VerticalDynamics:
    """Assemble the vertical equations of motion."""
    suspension = Suspension(COORDINATES + RAILS)
    primary, secondary = parameters.primary, parameters.secondary
    axles = axle_positions(parameters.layout)
    for k in WHEELSETS:
        frame = f"frame {frame_of(k) + 1}"
        elongation = {f"wheelset {k + 1} vertical": 1.0, f"{frame} vertical": -1.0, f"{frame} pitch": float(axles[k])}
        suspension.add(elongation, primary.vertical_stiffness, primary.vertical_damping, count=2)
    for k, ahead in enumerate(frame_positions(parameters.layout)):
        elongation = {f"frame {k + 1} vertical": 1.0, "body vertical": -1.0, "body pitch": float(ahead)}
        suspension.add(elongation, secondary.vertical_stiffness, secondary.vertical_damping, count=2)
    frame_part, body = parameters.frame, parameters.body
    masses = [frame_part.mass, frame_part.pitch_inertia] * 2 + [body.mass, body.pitch_inertia]
    count = len(COORDINATES)
    system = LinearSystem(
        names=COORDINATES,
        mass=np.diag(masses),
        damping=suspension.damping[:count, :count],
        stiffness=suspension.stiffness[:count, :count],
    )
    return VerticalDynamics(parameters=parameters, system=system, suspension=suspension)
