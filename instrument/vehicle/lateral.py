"""Lateral dynamics of a six-axle locomotive: a linear model with 21 coordinates, excited by the track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.instrument.vehicle.linear_motion import Array, LinearSystem, Suspension
from sosmith.instrument.vehicle.nonlinear_motion import Course
from sosmith.instrument.vehicle.parameters import Layout, Parameters
from sosmith.instrument.vehicle.saturated_contact import Contacts, Flange
from sosmith.instrument.vehicle.track import Track
from sosmith.instrument.vehicle.track_irregularity import Irregularity
from sosmith.instrument.vehicle.wheel_rail_contact import GRAVITY, contact_matrices, creep_coefficients
from sosmith.model.arithmetic.matrices import product

WHEELSETS = range(6)
FRAMES = range(2)

COORDINATES = (
    *(f"wheelset {k + 1} {motion}" for k in WHEELSETS for motion in ("lateral", "yaw")),
    *(f"frame {k + 1} {motion}" for k in FRAMES for motion in ("lateral", "yaw", "roll")),
    *(f"body {motion}" for motion in ("lateral", "yaw", "roll")),
)
"""The 21 coordinates in m and rad. Positive: lateral to the left, yaw to the left, roll with the left side up."""

ROLLS = tuple(f"wheelset {k + 1} roll" for k in WHEELSETS)
"""Roll angles of the wheelsets, prescribed by the track."""


def frame_of(wheelset: int) -> int:
    """Return the index of the frame that a wheelset belongs to."""
    return wheelset // 3


def axle_positions(layout: Layout) -> Array:
    """Return the distance in m of each wheelset ahead of the middle of its wheelbase, shape (6,)."""
    half = (layout.outer_axle_spacing + layout.inner_axle_spacing) / 2
    middle = half - layout.outer_axle_spacing
    return np.array([half, middle, -half, half, -middle, -half])


def frame_positions(layout: Layout) -> Array:
    """Return the distance in m of each frame's centre ahead of the body's, shape (2,)."""
    return np.array([layout.bogie_distance / 2, -layout.bogie_distance / 2])


def wheelset_positions(layout: Layout) -> Array:
    """Return the distance in m of each wheelset ahead of the body's centre, shape (6,)."""
    return axle_positions(layout) + np.repeat(frame_positions(layout), 3)


def wheelset_load(parameters: Parameters) -> float:
    """Return the load in N of one wheelset on the rails; all six are equal."""
    return parameters.total_mass * GRAVITY / 6


@dataclass(frozen=True, kw_only=True, eq=False)
class LateralDynamics:
    """The lateral equations of motion at one speed, and the track forces in them.

    Lateral positions are measured from the straight line that extends the beginning of the track, so that curves
    need no extra inertia terms; subtracting `track_pose` gives positions relative to the track.

    Attributes
    ----------
    parameters : Parameters
        Parameters of the vehicle.
    speed : float
        Speed in m/s.
    system : LinearSystem
        Suspension and contacts, in `COORDINATES`.
    suspension : Suspension
        Springs and dampers only, in `COORDINATES` and `ROLLS`.
    """

    parameters: Parameters
    speed: float
    system: LinearSystem
    suspension: Suspension

    def _places(self) -> Array:
        """Return distance ahead of the body's centre and height above the rails in m per coordinate, shape (21, 2)."""
        given = self.parameters
        ahead = [*np.repeat(wheelset_positions(given.layout), 2), *np.repeat(frame_positions(given.layout), 3), 0, 0, 0]
        height = np.repeat(
            [given.wheelset.rolling_radius, given.frame.centre_height, given.body.centre_height], [12, 6, 3]
        )
        return np.stack([ahead, height], axis=1)

    def track_pose(self, track: Track, centre: Array) -> Array:
        """Return the coordinates of a vehicle that follows the track exactly, shape (n, 21).

        Parameters
        ----------
        track : Track
        centre : ndarray, shape (n,)
            Position of the body's centre along the track in m.
        """
        pose, _ = self._poses(track, centre)
        return pose

    def _poses(self, track: Track, centre: Array) -> tuple[Array, Array]:
        """Return the pose of the track at each coordinate, and its time derivative."""
        gauge = 2 * self.parameters.wheelset.contact_half_spacing
        pose = np.zeros((len(centre), len(COORDINATES)))
        rate = np.zeros_like(pose)
        for k, (name, (ahead, height)) in enumerate(zip(COORDINATES, self._places(), strict=True)):
            s = centre + ahead
            if name.endswith("lateral"):
                # the right rail is raised: what is above the rails leans to the left
                pose[:, k] = track.offset_at(s) + height * track.cant_at(s) / gauge
                rate[:, k] = track.heading_at(s) + height * track.cant_slope_at(s) / gauge
            elif name.endswith("yaw"):
                pose[:, k], rate[:, k] = track.heading_at(s), track.curvature_at(s)
            else:
                pose[:, k], rate[:, k] = -track.cant_at(s) / gauge, -track.cant_slope_at(s) / gauge
        return pose, self.speed * rate

    def forces(self, track: Track, irregularity: Irregularity | None, centre: Array) -> Array:
        """Return the track forces, shape (n, 21), with the body's centre at `centre` in m, shape (n,)."""
        given, count = self.parameters, len(COORDINATES)
        gauge = 2 * given.wheelset.contact_half_spacing
        pose, rate = self._poses(track, centre)
        # contacts and preload act on motion relative to the track; longitudinal creep acts on the absolute yaw rate
        contact_damping = self.system.damping - self.suspension.damping[:count, :count]
        contact_stiffness = self.system.stiffness - self.suspension.stiffness[:count, :count]
        lateral = [k for k, name in enumerate(COORDINATES) if name.endswith("lateral")]
        force = product(pose, contact_stiffness.T) + product(rate[:, lateral], contact_damping[:, lateral].T)
        positions = wheelset_positions(given.layout)
        for k in WHEELSETS:
            s = centre + positions[k]
            shift = track.irregularity_at(s)
            if irregularity is not None:
                shift = shift + irregularity.alignment.at(s)
            force += np.outer(shift, contact_stiffness[:, 2 * k])
            roll, roll_rate = -track.cant_at(s) / gauge, -self.speed * track.cant_slope_at(s) / gauge
            force -= np.outer(roll, self.suspension.stiffness[:count, count + k])
            force -= np.outer(roll_rate, self.suspension.damping[:count, count + k])
        for k in lateral:
            s = centre + self._places()[k, 0]
            force[:, k] += self.system.mass[k, k] * GRAVITY * track.cant_at(s) / gauge
        return force

    def contacts(self) -> Contacts:
        """Return the contacts of the six wheelsets, with the limits that friction and flange set."""
        wheelset, contact = self.parameters.wheelset, self.parameters.contact
        load = wheelset_load(self.parameters) / 2
        return Contacts(
            speed=self.speed,
            conicity=wheelset.conicity,
            rolling_radius=wheelset.rolling_radius,
            half_spacing=wheelset.contact_half_spacing,
            creep=creep_coefficients(contact, load),
            load=load,
            friction=contact.friction,
            flange=Flange(stiffness=contact.flange_stiffness, transition=contact.flange_transition),
        )

    def course(self, track: Track, irregularity: Irregularity | None, centre: Array) -> Course:
        """Return the track under the wheelsets with the body's centre at `centre` in m, shape (n,).

        The loads of the wheels follow from the balance of moments about the middle of a wheelset that rolls with the
        track: of the primary suspension's vertical and lateral forces, of its weight and its centrifugal force. Its
        inertia relative to the track is neglected.
        """
        given = self.parameters
        wheelset, primary = given.wheelset, given.primary
        gauge = 2 * wheelset.contact_half_spacing
        pose = np.zeros((len(centre), 4, len(WHEELSETS)))
        room, shift = np.zeros((len(centre), len(WHEELSETS))), np.zeros((len(centre), len(WHEELSETS)))
        count = len(COORDINATES)
        gain = np.zeros((2 * count, len(WHEELSETS)))
        arm = wheelset.rolling_radius / wheelset.contact_half_spacing
        tilt = 2 * primary.half_spacing**2 / wheelset.contact_half_spacing
        for k, ahead in enumerate(wheelset_positions(given.layout)):
            s = centre + ahead
            roll, roll_rate = -track.cant_at(s) / gauge, -self.speed * track.cant_slope_at(s) / gauge
            pose[:, 0, k] = track.offset_at(s) - wheelset.rolling_radius * roll + track.irregularity_at(s)
            if irregularity is not None:
                pose[:, 0, k] += irregularity.alignment.at(s)
            pose[:, 1, k] = track.heading_at(s)
            pose[:, 2, k] = self.speed * pose[:, 1, k] - wheelset.rolling_radius * roll_rate
            room[:, k] = given.sensor.flange_clearance + track.widening_at(s) / 2
            shift[:, k] = tilt * (primary.vertical_stiffness * roll + primary.vertical_damping * roll_rate)
            shift[:, k] -= arm * wheelset.mass * (GRAVITY * roll + self.speed**2 * track.curvature_at(s))
            across = primary.middle_lateral_stiffness if k % 3 == 1 else primary.lateral_stiffness
            for name, factor in primary_elongation(given, k).items():
                place = COORDINATES.index(name)
                gain[place, k] -= 2 * arm * across * factor
                gain[count + place, k] -= 2 * arm * primary.lateral_damping * factor
            place = COORDINATES.index(f"frame {frame_of(k) + 1} roll")
            gain[place, k] -= tilt * primary.vertical_stiffness
            gain[count + place, k] -= tilt * primary.vertical_damping
        return Course(pose=pose, room=room, load_shift=shift, load_gain=gain)


def lateral_dynamics(parameters: Parameters, speed: float) -> LateralDynamics:
    """Assemble the lateral equations of motion at `speed` in m/s."""
    suspension = lateral_suspension(parameters)
    count = len(COORDINATES)
    damping = suspension.damping[:count, :count].copy()
    stiffness = suspension.stiffness[:count, :count] + _preload(parameters)
    load, wheelset = wheelset_load(parameters), parameters.wheelset
    contact_damping, contact_stiffness = contact_matrices(
        creep_coefficients(parameters.contact, load / 2),
        speed=speed,
        conicity=wheelset.conicity,
        rolling_radius=wheelset.rolling_radius,
        half_spacing=wheelset.contact_half_spacing,
        load=load,
    )
    for k in WHEELSETS:
        place = slice(2 * k, 2 * k + 2)
        damping[place, place] += contact_damping
        stiffness[place, place] += contact_stiffness
    frame, body = parameters.frame, parameters.body
    masses = [wheelset.mass, wheelset.yaw_inertia] * 6
    masses += [frame.mass, frame.yaw_inertia, frame.roll_inertia] * 2
    masses += [body.mass, body.yaw_inertia, body.roll_inertia]
    system = LinearSystem(names=COORDINATES, mass=np.diag(masses), damping=damping, stiffness=stiffness)
    return LateralDynamics(parameters=parameters, speed=speed, system=system, suspension=suspension)


def primary_elongation(parameters: Parameters, wheelset: int) -> dict[str, float]:
    """Return the lateral elongation of the primary suspension: wheelset minus frame, at axle height."""
    below = parameters.frame.centre_height - parameters.wheelset.rolling_radius
    w, f = f"wheelset {wheelset + 1}", f"frame {frame_of(wheelset) + 1}"
    ahead = float(axle_positions(parameters.layout)[wheelset])
    return {f"{w} lateral": 1.0, f"{f} lateral": -1.0, f"{f} yaw": -ahead, f"{f} roll": -below}


def lateral_suspension(parameters: Parameters) -> Suspension:
    """Return the primary and secondary suspension in `COORDINATES` and `ROLLS`."""
    made = Suspension(COORDINATES + ROLLS)
    primary, secondary = parameters.primary, parameters.secondary
    for k in WHEELSETS:
        w, f = f"wheelset {k + 1}", f"frame {frame_of(k) + 1}"
        side = primary.half_spacing
        across = primary.middle_lateral_stiffness if k % 3 == 1 else primary.lateral_stiffness
        made.add(primary_elongation(parameters, k), across, primary.lateral_damping, count=2)
        made.add(
            {f"{w} yaw": side, f"{f} yaw": -side},
            primary.longitudinal_stiffness,
            primary.longitudinal_damping,
            count=2,
        )
        made.add({f"{w} roll": side, f"{f} roll": -side}, primary.vertical_stiffness, primary.vertical_damping, count=2)
    above = secondary.height - parameters.frame.centre_height
    below = parameters.body.centre_height - secondary.height
    for k, ahead in enumerate(frame_positions(parameters.layout)):
        f, side, outer = f"frame {k + 1}", secondary.half_spacing, secondary.yaw_damper_half_spacing
        across_body = {
            f"{f} lateral": 1.0,
            f"{f} roll": -above,
            "body lateral": -1.0,
            "body yaw": -float(ahead),
            "body roll": -below,
        }
        made.add(across_body, secondary.lateral_stiffness, secondary.lateral_damping, count=2)
        made.add(
            {f"{f} yaw": side, "body yaw": -side},
            secondary.longitudinal_stiffness,
            secondary.longitudinal_damping,
            count=2,
        )
        made.add(
            {f"{f} roll": side, "body roll": -side},
            secondary.vertical_stiffness,
            secondary.vertical_damping,
            count=2,
        )
        made.add({f"{f} yaw": outer, "body yaw": -outer}, 0.0, secondary.yaw_damping, count=2)
    return made


def _preload(parameters: Parameters) -> Array:
    """Return the geometric stiffness of the static spring loads: a mass supported below its centre tends to tip over.

    If a mass rolls by p, attachments at a height h below its centre rise by h p^2 / 2, so the load P on them does the
    work P h p^2 / 2.
    """
    stiffness = np.zeros((len(COORDINATES), len(COORDINATES)))
    body, frame, secondary = parameters.body, parameters.frame, parameters.secondary
    on_frame = body.mass * GRAVITY / 2
    on_axles = on_frame + frame.mass * GRAVITY
    index = {name: k for k, name in enumerate(COORDINATES)}
    k = index["body roll"]
    stiffness[k, k] = -2 * on_frame * (body.centre_height - secondary.height)
    for number in FRAMES:
        k = index[f"frame {number + 1} roll"]
        above = secondary.height - frame.centre_height
        below = frame.centre_height - parameters.wheelset.rolling_radius
        stiffness[k, k] = -on_frame * above - on_axles * below
    return stiffness
