"""A run of the locomotive over a track: from parameters, track, speed and seed to its motion."""

from __future__ import annotations

import math

import numpy as np

from sosmith.instrument.vehicle.choices import LEVELS, MODELS
from sosmith.instrument.vehicle.lateral import (
    FRAMES,
    LateralDynamics,
    lateral_dynamics,
    wheelset_positions,
)
from sosmith.instrument.vehicle.linear_motion import Array
from sosmith.instrument.vehicle.motion import Motion, clearance_change
from sosmith.instrument.vehicle.nonlinear_motion import respond
from sosmith.instrument.vehicle.parameters import Parameters
from sosmith.instrument.vehicle.track import Track
from sosmith.instrument.vehicle.track_irregularity import Irregularity
from sosmith.instrument.vehicle.track_irregularity import irregularity as make_irregularity
from sosmith.instrument.vehicle.vertical import vertical_dynamics
from sosmith.instrument.vehicle.wheel_rail_contact import GRAVITY
from sosmith.model.errors import SpecificationError

MIN_RATE = 1000.0
"""Lowest internal sample rate in Hz; the track is taken as linear between samples (20 mm apart at 20 m/s)."""

RUN_IN = 200.0
"""Run-in distance in m before a track with random irregularities, on which the starting transient decays."""

SPEEDS = (1.0, 100.0)
"""Lowest and highest speed in m/s: linear creep has no meaning at rest."""

RATES = (1.0, 20_000.0)
"""Lowest and highest sample rate in Hz."""

LIMIT_SAMPLES = 5_000_000
"""Largest number of internal samples of a run, to catch values in a wrong unit.

The nonlinear model takes about 0.1 ms for each.
"""


def run(
    parameters: Parameters,
    track: Track,
    *,
    speed: float,
    sample_rate: float,
    irregularity: str | None = None,
    seed: int = 1,
    model: str = "nonlinear",
    distance: float = math.inf,
) -> Motion:
    """Run over a track at constant speed until the first wheelset reaches its end, or a `distance` before it.

    Springs, dampers and small motions of the contacts are linear and are solved exactly for forces that are linear
    between samples at `MIN_RATE` or more. The nonlinear model adds to these forces what the contacts exert beyond the
    linear ones (`sosmith.instrument.vehicle.nonlinear_motion`): creep forces that friction limits, and flanges. The
    linear model does without; `sosmith.instrument.vehicle.limits` reports where it would need them.

    Parameters
    ----------
    parameters : Parameters
        Parameters of the vehicle and the irregularities.
    track : Track
        Course, cant and single irregularity.
    speed : float
        Speed in m/s, within `SPEEDS`.
    sample_rate : float
        Sample rate of the motion in Hz, within `RATES`.
    irregularity : {None, "low", "high"}, optional
        Level of random irregularities, added to the single one.
    seed : int, optional
        Seed of the random irregularities, 0 or more.
    model : {"nonlinear", "linear"}, optional
        One of `MODELS`.
    distance : float, optional
        Distance in m at which the first wheelset stops, if that is before the end of the track.

    Raises
    ------
    SpecificationError
        If speed, sample rate, irregularity, seed or model is out of range, the run is too long, or the vehicle is
        unstable at that speed and the model is linear: a nonlinear one hunts between its flanges.
    """
    _check("speed", speed, SPEEDS, "m/s")
    _check("sample rate", sample_rate, RATES, "Hz")
    if irregularity not in (None, *LEVELS):
        raise SpecificationError(f"the irregularities must be one of none, {', '.join(LEVELS)}, not {irregularity}")
    if model not in MODELS:
        raise SpecificationError(f"the model must be one of {', '.join(MODELS)}, not {model}")
    if seed < 0:
        raise SpecificationError(f"the seed must be 0 or more, not {seed}")
    finer = math.ceil(MIN_RATE / sample_rate)
    step = 1 / (finer * sample_rate)
    before = finer * math.ceil(RUN_IN / (speed * step * finer)) if irregularity else 0
    behind = math.floor(min(track.length, distance) / (speed * step) + 1e-9)
    if before + behind > LIMIT_SAMPLES:
        raise SpecificationError(
            f"the run must take at most {LIMIT_SAMPLES:,} internal samples, not {before + behind:,}: "
            "shorten the track, raise the speed or lower the sample rate"
        )
    lateral = lateral_dynamics(parameters, speed)
    growing = max(mode.growth for mode in lateral.system.modes()) if model == "linear" else -math.inf
    if growing >= 0:
        raise SpecificationError(
            f"the speed must be one at which the linear vehicle is stable, not {speed:g} m/s, "
            f"where a motion grows by {growing:.3g} per second"
        )
    clock = step * np.arange(-before, behind + 1, dtype=np.float64)
    front = speed * clock
    random = None
    if irregularity is not None:
        random = make_irregularity(parameters.irregularities, irregularity, _reach(parameters, track), seed)
    return _motion(lateral, track, random, front, step, keep=slice(before, None, finer), linear=model == "linear")


def _check(name: str, value: float, allowed: tuple[float, float], unit: str) -> None:
    low, high = allowed
    if not low <= value <= high:
        raise SpecificationError(f"the {name} must be from {low:g} to {high:g} {unit}, not {value:g}")


def _reach(parameters: Parameters, track: Track) -> float:
    """Return the distance in m between the first and the last wheel contact of the run."""
    positions = wheelset_positions(parameters.layout)
    return RUN_IN + 1.0 + float(positions[0] - positions[-1]) + track.length


def _motion(
    lateral: LateralDynamics,
    track: Track,
    random: Irregularity | None,
    front: Array,
    step: float,
    keep: slice,
    *,
    linear: bool,
) -> Motion:
    parameters, speed = lateral.parameters, lateral.speed
    centre = front - wheelset_positions(parameters.layout)[0]
    pushed = lateral.forces(track, random, centre)
    if linear:
        moved, rate = lateral.system.respond(pushed, step)
    else:
        course = lateral.course(track, random, centre)
        moved, rate = respond(lateral.system, pushed, step, lateral.contacts(), course)
    vertical = vertical_dynamics(parameters)
    rails, rails_rate = vertical.rails(track, random, centre, speed)
    lifted, _ = vertical.system.respond(vertical.forces(rails, rails_rate), step)
    felt = np.gradient(rate[:, -3], step) + GRAVITY * moved[:, -1]

    moved, rate, lifted, rails, centre, felt = (array[keep] for array in (moved, rate, lifted, rails, centre, felt))
    relative = moved - lateral.track_pose(track, centre)
    w, f, b = slice(0, 12), slice(12, 18), slice(18, 21)
    yaw_to_frame = moved[:, w][:, 1::2] - np.repeat(moved[:, f][:, 1::3], 3, axis=1)
    at_wheels = _contact(lateral, track, random, centre, np.hstack([moved, rate]), linear=linear)
    rise = parameters.wheelset.conicity * at_wheels["lateral_to_rails"]
    return Motion(
        time=(front[keep] - front[keep][0]) / speed,
        distance=front[keep],
        wheelset_lateral=relative[:, w][:, 0::2],
        wheelset_yaw=relative[:, w][:, 1::2],
        wheelset_vertical=rails,
        frame_lateral=relative[:, f][:, 0::3],
        frame_yaw=relative[:, f][:, 1::3],
        frame_roll=relative[:, f][:, 2::3],
        frame_vertical=lifted[:, [2 * k for k in FRAMES]],
        frame_pitch=lifted[:, [2 * k + 1 for k in FRAMES]],
        body_lateral=relative[:, b][:, 0],
        body_yaw=relative[:, b][:, 1],
        body_roll=relative[:, b][:, 2],
        body_vertical=lifted[:, 4],
        body_pitch=lifted[:, 5],
        wheelset_yaw_to_frame=yaw_to_frame,
        left_wheel_rise=rise,
        right_wheel_rise=-rise,
        clearance_mm=clearance_change(
            parameters,
            wheelset_lateral=moved[:, w][:, 0::2],
            wheelset_yaw=moved[:, w][:, 1::2],
            frame_lateral=moved[:, f][:, 0::3],
            frame_yaw=moved[:, f][:, 1::3],
            frame_roll=moved[:, f][:, 2::3],
        ),
        body_acceleration=felt,
        **at_wheels,
    )


def _contact(
    lateral: LateralDynamics,
    track: Track,
    random: Irregularity | None,
    centre: Array,
    states: Array,
    *,
    linear: bool,
) -> dict[str, Array]:
    """Return the motion between wheels and rails and the forces there, by the names that `Motion` gives them."""
    contacts, course = lateral.contacts(), lateral.course(track, random, centre)
    wheelset, static = lateral.parameters.wheelset, contacts.load
    state = course.relative(states)
    y = state[:, 0]
    loads = np.full((len(states), 2, y.shape[1]), static) if linear else course.loads(states, contacts)
    forces, used = contacts.creep_forces(state, contacts.loaded(loads), saturated=not linear)
    flange = np.zeros_like(y) if linear else contacts.flange.force(np.abs(y) - course.room)
    outward = np.empty_like(loads)
    for side, sign in enumerate((1, -1)):
        # on cones that roll by c y / l, the load pushes each wheel towards the middle
        slope = wheelset.conicity * (1 + sign * y / wheelset.contact_half_spacing)
        outward[:, side] = static * slope - sign * forces[:, 1, side] + np.where(sign * y > 0, flange, 0.0)
    return {
        "lateral_to_rails": y,
        "friction_used": used.max(axis=1),
        "flange_force": flange,
        "wheel_load": np.moveaxis(loads, 1, 2),
        "guiding_force": np.moveaxis(outward, 1, 2),
    }
