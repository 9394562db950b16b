"""Runs over a track: forces in a long curve, geometry of the sensor, units, limits, refusals."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from sosmith.instrument.vehicle.choices import MODELS
from sosmith.instrument.vehicle.lateral import (
    COORDINATES,
    frame_positions,
    lateral_dynamics,
    wheelset_load,
    wheelset_positions,
)
from sosmith.instrument.vehicle.limits import limits
from sosmith.instrument.vehicle.motion import Motion, clearance_change
from sosmith.instrument.vehicle.parameters import Parameters, built_in
from sosmith.instrument.vehicle.run import run as run_any
from sosmith.instrument.vehicle.track import Track, curved_track, tangent_track
from sosmith.instrument.vehicle.wheel_rail_contact import GRAVITY, creep_coefficients
from sosmith.model.errors import SpecificationError

GIVEN = built_in()
PAPER = curved_track(GIVEN.track)
run = partial(run_any, model="linear")


@pytest.fixture(scope="module")
def motion() -> Motion:
    return run(GIVEN, PAPER, speed=20.0, sample_rate=100.0)


@pytest.mark.slow
def test_a_run_lasts_until_the_first_wheelset_is_at_the_end(motion: Motion) -> None:
    assert len(motion.time) == 3051
    assert motion.time == pytest.approx(np.arange(3051) / 100, abs=1e-12)
    assert motion.distance[-1] == pytest.approx(610)
    for one in fields(motion):
        values = getattr(motion, one.name)
        assert np.isfinite(values).all()
        assert values.shape[0] == 3051


@pytest.mark.slow
def test_motion_begins_and_ends_at_rest(motion: Motion) -> None:
    for name in ("wheelset_lateral", "frame_lateral", "body_lateral", "frame_vertical", "body_vertical"):
        values = getattr(motion, name)
        assert not values[0].any()
        assert np.abs(values[-1]).max() < 5e-5
        assert np.abs(values).max() > 5e-3


@pytest.mark.slow
def test_motion_is_the_same_in_coordinates_that_go_with_the_track() -> None:
    """Seen from the moving track, inertia and springs feel its course, and the contacts do not: solved that way too."""
    speed, step = 20.0, 2.5e-4
    table = replace(GIVEN.track, curve=10.0, run_out=10.0)
    track = curved_track(table)
    found = run(GIVEN, track, speed=speed, sample_rate=1 / step)
    lateral = lateral_dynamics(GIVEN, speed)
    system, suspension = lateral.system, lateral.suspension
    ahead = wheelset_positions(GIVEN.layout)
    clock = step * np.arange(-1, len(found.time) + 1)
    centre = speed * clock - ahead[0]
    roll = -np.stack([track.cant_at(centre + x) / (2 * 0.7465) for x in ahead], axis=1)
    course = np.hstack([lateral.track_pose(track, centre), roll])
    rate = (course[2:] - course[:-2]) / (2 * step)
    acceleration = (course[2:] - 2 * course[1:-1] + course[:-2]) / step**2
    course = course[1:-1]
    force = -(course @ suspension.stiffness[:21].T + rate @ suspension.damping[:21].T)
    force -= acceleration[:, :21] @ system.mass
    heights = {"wheelset": 0.625, "frame": 0.8, "body": 2.2}
    contact_damping = system.damping - suspension.damping[:21, :21]
    contact_stiffness = system.stiffness - suspension.stiffness[:21, :21]
    for k, name in enumerate(COORDINATES):
        if name.endswith("lateral"):
            # what the pose adds for the height comes back as the cant
            part = name.split(" ")[0]
            x = {"wheelset": ahead, "frame": frame_positions(GIVEN.layout), "body": np.zeros(1)}[part]
            place = centre[1:-1] + x[0 if part == "body" else int(name.split(" ")[1]) - 1]
            cant = track.cant_at(place) / (2 * 0.7465)
            assert course[:, k] == pytest.approx(track.offset_at(place) + heights[part] * cant, abs=1e-12)
            force[:, k] += system.mass[k, k] * GRAVITY * cant
        if name.startswith("wheelset") and name.endswith("yaw"):
            force -= np.outer(rate[:, k], contact_damping[:, k])  # creep along the rails knows the curve
            irregularity = track.irregularity_at(speed * clock[1:-1] + ahead[k // 2] - ahead[0])
            force += np.outer(irregularity, contact_stiffness[:, k - 1])
    moved, _ = system.respond(force, step)
    together = {
        "wheelset_lateral": moved[:, 0:12:2], "wheelset_yaw": moved[:, 1:12:2], "frame_lateral": moved[:, 12:18:3],
        "frame_yaw": moved[:, 13:18:3], "frame_roll": moved[:, 14:18:3], "body_lateral": moved[:, 18],
        "body_yaw": moved[:, 19], "body_roll": moved[:, 20],
    }  # fmt: skip
    for name, values in together.items():
        difference = np.abs(values - getattr(found, name)).max()
        assert difference < 5e-4 * np.abs(values).max(), name


def test_a_canted_track_leans_the_vehicle_to_the_raised_rails_other_side() -> None:
    """In a curve to the left the right rail is raised: by rotation of a rigid vehicle about the left rail's level."""
    lateral, centre = lateral_dynamics(GIVEN, 20.0), np.array([200.0])
    (pose,) = lateral.track_pose(PAPER, centre)
    found = dict(zip(COORDINATES, pose.tolist(), strict=True))
    right, left = np.array([-0.7465, 0.09]), np.array([0.7465, 0.0])
    along = (left - right) / np.hypot(*(left - right))
    assert found["body roll"] == pytest.approx(np.arcsin(along[1]), rel=2e-3)
    upward = np.array([-along[1], along[0]])  # of the vehicle, to the left of the vertical
    lean = (2.2 - 0.625) * upward[0]
    wheelset = PAPER.offset_at(centre + wheelset_positions(GIVEN.layout)[0])[0]
    straight = found["wheelset 1 lateral"] - wheelset
    assert found["body lateral"] - PAPER.offset_at(centre)[0] - straight == pytest.approx(lean, rel=2e-3)
    assert lean > 0.09


def in_a_long_curve(speed: float) -> tuple[Motion, int]:
    """Return a run through a curve so long that every motion has died away, and the index of a sample there."""
    track = curved_track(replace(GIVEN.track, curve=50 * speed, run_out=0.0, irregularity=0.0))
    steady = run(GIVEN, track, speed=speed, sample_rate=10.0)
    return steady, int(np.argmin(np.abs(steady.distance - (50 + 50 * speed))))


@pytest.fixture(scope="module")
def steady() -> tuple[Motion, int]:
    return in_a_long_curve(20.0)


@pytest.mark.slow
def test_forces_balance_in_a_long_curve(steady: tuple[Motion, int]) -> None:
    """Kalker's forces written out from the motion alone hold the vehicle in its curve, and turn it at a steady rate."""
    found, k = steady
    y, psi = found.wheelset_lateral[k], found.wheelset_yaw[k]
    load, curvature = wheelset_load(GIVEN), 1 / 350
    creep = creep_coefficients(GIVEN.contact, load / 2)
    r, l, c = 0.625, 0.7465, 0.15  # noqa: E741
    lateral = 2 * creep.f22 * psi - 2 * creep.f23 * curvature - load * c / l * y
    moment = (
        -2 * creep.f11 * l * (l * curvature + c * y / r)
        - 2 * creep.f23 * psi
        - 2 * creep.f33 * curvature
        + load * c * l * psi
    )
    wanted = GIVEN.total_mass * (20.0**2 * curvature - GRAVITY * 0.09 / (2 * l))
    assert wanted > 50e3
    assert lateral.sum() == pytest.approx(wanted, rel=1e-6)
    # the track's parabola, taken as linear over 20 mm, is off by 0.1 micrometres, which conicity turns into moment
    assert (wheelset_positions(GIVEN.layout) @ lateral + moment.sum()) / wanted == pytest.approx(0, abs=1e-4)


@pytest.mark.slow
def test_creep_force_is_kalkers(steady: tuple[Motion, int]) -> None:
    """By the creepages of one wheel in the long curve."""
    found, k = steady
    creep = creep_coefficients(GIVEN.contact, wheelset_load(GIVEN) / 2)
    along = creep.f11 * (0.7465 / 350 + 0.15 * found.wheelset_lateral[k] / 0.625)
    across = -creep.f22 * found.wheelset_yaw[k] + creep.f23 / 350
    limit = 0.3 * wheelset_load(GIVEN) / 2
    assert limit * found.friction_used[k] == pytest.approx(np.hypot(along, across), rel=1e-6)


@pytest.mark.slow
def test_the_body_rolls_with_the_cant_deficiency(steady: tuple[Motion, int]) -> None:
    """At the speed for which the cant was made, gravity and centrifugal force add up across the track to nothing."""
    balanced = float(np.sqrt(GRAVITY * 0.09 / (2 * 0.7465) * 350))
    found, k = in_a_long_curve(balanced)
    slow, slow_k = in_a_long_curve(balanced / 2)
    assert abs(found.body_roll[k]) < 5e-4
    assert slow.body_roll[slow_k] < -3e-3  # to the inside, which is left: left side down
    assert steady[0].body_roll[steady[1]] > 3e-3


@pytest.mark.slow
def test_motion_is_in_proportion_to_the_irregularity() -> None:
    """Mirrored, the irregularity gives the mirrored motion; doubled, the double."""
    table = replace(GIVEN.track, irregularity=0.01)
    straight = tangent_track(table)
    once = run(GIVEN, straight, speed=20.0, sample_rate=50.0)
    other = replace(straight, irregularity=-0.02)
    twice = run(GIVEN, other, speed=20.0, sample_rate=50.0)
    for name in ("wheelset_lateral", "wheelset_yaw", "frame_roll", "body_lateral", "clearance_mm"):
        assert getattr(twice, name) == pytest.approx(-2 * getattr(once, name), rel=1e-9, abs=1e-15)
    assert np.abs(once.clearance_mm).max() > 0.1


@pytest.mark.slow
def test_samples_inside_are_fine_enough() -> None:
    """Four times as many change the motion by less than a hundredth of a millimetre."""
    short = curved_track(replace(GIVEN.track, curve=20.0, run_out=0.0))
    coarse, fine = (run(GIVEN, short, speed=20.0, sample_rate=rate) for rate in (100.0, 4000.0))
    for name in ("wheelset_lateral", "frame_lateral", "body_lateral", "frame_vertical", "body_vertical"):
        assert np.abs(getattr(fine, name)[::40] - getattr(coarse, name)).max() < 1e-5
    assert np.abs(fine.clearance_mm[::40] - coarse.clearance_mm).max() < 1e-2


def scaled(value: Any, units: dict[str, float]) -> Any:
    """Return the same parameters in other units of mass, length and time."""
    if not is_dataclass(value):
        return value
    changes = {}
    for one in fields(value):
        part = getattr(value, one.name)
        if "unit" in one.metadata:
            over, _, under = one.metadata["unit"].partition("/")
            for unit in over.split(" "):
                part *= units[unit]
            part /= units[under or "1"]
        else:
            part = scaled(part, units)
        changes[one.name] = part
    return replace(value, **changes)


@pytest.mark.slow
def test_units_fit_together() -> None:
    """In other units of mass, length and time every result is the same: each formula is right in its dimensions.

    Only the acceleration of gravity has its unit built in, so the unit of length goes with the square of that of time.
    """
    time, length, mass = 0.5, 0.25, 3.0
    force = mass * length / time**2
    units = {
        "1": 1.0, "kg": mass, "m": length, "m^2": length**2, "s": time, "N": force, "rad": 1.0,
        "Pa": force / length**2,
    }  # fmt: skip
    other: Parameters = scaled(GIVEN, units)
    assert other.primary.lateral_damping == pytest.approx(10e3 * force * time / length)
    assert other.irregularities.level_low == pytest.approx(4.032e-7 * length)
    here = run(GIVEN, PAPER, speed=20.0, sample_rate=1000.0)
    there = run(other, curved_track(other.track), speed=20.0 * length / time, sample_rate=1000.0 / time)
    for one in fields(Motion):
        factor = length
        if "yaw" in one.name or "roll" in one.name or "pitch" in one.name:
            factor = 1.0
        factor = 1.0 if one.name == "friction_used" else factor
        factor = force if one.name in ("wheel_load", "guiding_force") else factor
        factor = {"time": time, "flange_force": force, "body_acceleration": length / time**2}.get(one.name, factor)
        expected = factor * getattr(here, one.name)
        assert np.abs(getattr(there, one.name) - expected).max() <= 1e-9 * np.abs(expected).max(), one.name


def clearance(**moved: float) -> np.ndarray:
    """Change of clearance for a single motion."""
    zero = {name: np.zeros((1, 6)) for name in ("wheelset_lateral", "wheelset_yaw")}
    zero |= {name: np.zeros((1, 2)) for name in ("frame_lateral", "frame_yaw", "frame_roll")}
    for name, value in moved.items():
        zero[name][:] = value
    (row,) = clearance_change(GIVEN, **zero)
    return row


def test_clearance_follows_from_the_geometry_of_the_sensor() -> None:
    """Signs and sizes by hand: the sensor at the right wheel looks to the left, from the field side."""
    assert clearance(wheelset_lateral=1e-3) == pytest.approx([1.0] * 6)
    assert clearance(frame_lateral=1e-3) == pytest.approx([-1.0] * 6)
    # 1 mrad: 0.635 mm at the arm's end, less what the flank that leans by 0.364 gives back over 0.7465 mm
    yaw = 0.635 - 0.364 * 0.7465
    assert clearance(wheelset_yaw=1e-3) == pytest.approx([yaw] * 6)
    axles = np.array([2.125, -0.125, -2.125, 2.125, 0.125, -2.125])
    assert clearance(frame_yaw=1e-3) == pytest.approx(-axles - yaw)
    # the frame's centre is 175 mm above the axles: rolling left side up, its lower part goes to the left
    assert clearance(frame_roll=1e-3) == pytest.approx([-0.175] * 6)
    together = clearance(wheelset_lateral=2e-3, frame_lateral=2e-3)
    assert together == pytest.approx([0.0] * 6)


def test_clearance_is_blind_to_rigid_motion() -> None:
    lateral, yaw, roll = 3e-3, 2e-3, 1e-3
    ahead = np.array([2.125, -0.125, -2.125, 2.125, 0.125, -2.125])
    row = clearance_change(
        GIVEN,
        wheelset_lateral=(lateral + ahead * yaw - 0.625 * roll)[np.newaxis],
        wheelset_yaw=np.full((1, 6), yaw),
        frame_lateral=np.full((1, 2), lateral - 0.8 * roll),
        frame_yaw=np.full((1, 2), yaw),
        frame_roll=np.full((1, 2), roll),
    )
    assert row == pytest.approx(np.zeros((1, 6)), abs=1e-12)


@pytest.mark.slow
def test_in_the_curve_wheelsets_yaw_in_their_frames(motion: Motion) -> None:
    """Between axles that stay parallel the track turns: relative yaw is what the link springs allow."""
    k = 1500
    frame = np.repeat(motion.frame_yaw[k], 3)
    straightened = motion.wheelset_yaw[k] + np.array([2.125, -0.125, -2.125, 2.125, 0.125, -2.125]) / 350
    assert motion.wheelset_yaw_to_frame[k] == pytest.approx(straightened - frame, abs=1e-9)


@pytest.mark.slow
def test_vertical_motion_holds_half_the_cant_and_the_cones_lift_wheels(motion: Motion) -> None:
    assert motion.wheelset_vertical[1500] == pytest.approx([0.045] * 6)
    assert motion.frame_vertical[1500] == pytest.approx([0.045] * 2, abs=1e-4)
    assert motion.body_vertical[1500] == pytest.approx(0.045, abs=2e-4)
    assert motion.left_wheel_rise == pytest.approx(0.15 * motion.lateral_to_rails)
    assert (motion.right_wheel_rise == -motion.left_wheel_rise).all()


@pytest.mark.slow
def test_limits_tell_where_flanges_and_friction_would_act(motion: Motion) -> None:
    found = limits(GIVEN, PAPER, motion)
    assert not found.kept
    assert found.beyond_flange[0] > 0.01  # the first wheelset runs far beyond its flange in this curve
    assert found.friction_used[0] > 1
    assert found.friction_used[0] == motion.friction_used[:, 0].max()
    straight = tangent_track(replace(GIVEN.track, irregularity=0.002))
    small = limits(GIVEN, straight, run(GIVEN, straight, speed=20.0, sample_rate=100.0))
    assert small.kept
    assert not small.beyond_flange_share.any()
    assert -0.009 < small.beyond_flange[0] < 0


@pytest.mark.slow
@pytest.mark.parametrize("level", ["low", "high"])
def test_the_model_holds_over_random_irregularities_of_a_straight_track(level: str) -> None:
    straight = tangent_track(replace(GIVEN.track, irregularity=0.0))
    found = run(GIVEN, straight, speed=20.0, sample_rate=100.0, irregularity=level)
    assert limits(GIVEN, straight, found).kept
    assert np.std(found.clearance_mm) > 0.1


def test_widening_moves_the_flange() -> None:
    still = Motion(**{one.name: np.zeros((2, 6)) for one in fields(Motion)} | {
        "time": np.array([0.0, 0.01]), "distance": np.array([0.0, 200.0]),
        "wheel_load": np.ones((2, 6, 2)), "guiding_force": np.zeros((2, 6, 2)),
    })  # fmt: skip
    assert limits(GIVEN, PAPER, still).beyond_flange == pytest.approx([-0.009] * 6)
    wide = replace(PAPER, curvature=np.full_like(PAPER.curvature, 1 / 350))
    assert limits(GIVEN, wide, still).beyond_flange == pytest.approx([-0.014] * 6)


@pytest.mark.slow
def test_random_irregularities_come_from_the_seed() -> None:
    arguments: dict[str, Any] = {"speed": 20.0, "sample_rate": 100.0, "irregularity": "low"}
    straight = tangent_track(replace(GIVEN.track, irregularity=0.0, curve=50.0))
    first, again = (run(GIVEN, straight, seed=3, **arguments) for _ in range(2))
    other = run(GIVEN, straight, seed=4, **arguments)
    assert (first.clearance_mm == again.clearance_mm).all()
    assert not np.allclose(first.clearance_mm, other.clearance_mm)
    assert first.time[0] == 0
    assert first.distance[0] == 0
    assert np.abs(first.wheelset_lateral[0]).max() > 0  # the run-in has set it moving
    assert np.std(first.wheelset_vertical[:, 0]) > 1e-4


def test_columns_have_names_with_units(motion: Motion) -> None:
    columns = dict(motion.columns())
    names = list(columns)
    assert names[:4] == ["time_s", "distance_m", "wheelset1_lateral_mm", "wheelset1_vertical_mm"]
    assert len(names) == 2 + 6 * 3 + 2 * 5 + 5 + 6 + 6
    assert (columns["wheelset2_yaw_mrad"] == 1e3 * motion.wheelset_yaw[:, 1]).all()
    assert (columns["body_roll_mrad"] == 1e3 * motion.body_roll).all()
    assert (columns["clearance6_mm"] == motion.clearance_mm[:, 5]).all()
    with pytest.raises(ValueError, match="read-only"):
        motion.clearance_mm[0] = 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"speed": 0.0}, "the speed must be from 1 to 100 m/s, not 0"),
        ({"speed": float("nan")}, "the speed must be from 1 to 100 m/s, not nan"),
        ({"sample_rate": 0.5}, "the sample rate must be from 1 to 20000 Hz, not 0.5"),
        ({"irregularity": "medium"}, "the irregularities must be one of none, low, high, not medium"),
        ({"seed": -1}, "the seed must be 0 or more, not -1"),
        (
            {"speed": 1.0, "sample_rate": 10_000.0},
            "the run must take at most 5,000,000 internal samples, not 6,100,000: "
            "shorten the track, raise the speed or lower the sample rate",
        ),
    ],
)
def test_what_cannot_be_run_is_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(SpecificationError) as caught:
        run(GIVEN, PAPER, **({"speed": 20.0, "sample_rate": 100.0} | arguments))
    assert str(caught.value) == message


def test_an_unstable_vehicle_is_refused() -> None:
    loose = replace(GIVEN.primary, longitudinal_stiffness=1e4, lateral_stiffness=1e4, middle_lateral_stiffness=1e4)
    sharp = replace(GIVEN, primary=loose, wheelset=replace(GIVEN.wheelset, conicity=0.4))
    with pytest.raises(
        SpecificationError,
        match=r"^the speed must be one at which the linear vehicle is stable, not 20 m/s, "
        r"where a motion grows by [\d.]+ per second$",
    ):
        run(sharp, PAPER, speed=20.0, sample_rate=100.0)


def test_a_track_goes_on_as_it_ends() -> None:
    """A track may end in its curve; what is behind is curve too."""
    bend = Track(corners=np.array([0.0, 10.0, 60.0]), curvature=np.array([0, 0, 0.002]), cant=np.array([0, 0, 0.05]))
    assert bend.curvature_at(np.array([-5.0, 35, 61, 80])) == pytest.approx([0, 0.001, 0.002, 0.002])
    assert bend.length == 60
    circle = Track(corners=np.array([0.0, 100.0]), curvature=np.full(2, 0.002), cant=np.zeros(2))
    s = np.array([-10.0, 0, 50, 200])
    assert circle.heading_at(s) == pytest.approx(0.002 * s, abs=1e-9)
    assert circle.offset_at(s) == pytest.approx(0.001 * s**2, abs=1e-6)


@pytest.mark.slow
def test_position_on_the_rails_is_that_on_the_track_less_the_irregularity() -> None:
    straight = tangent_track(GIVEN.track)
    found = run(GIVEN, straight, speed=20.0, sample_rate=100.0)
    assert found.lateral_to_rails[25, 0] == pytest.approx(found.wheelset_lateral[25, 0] - 0.02)  # at 5 m
    place = found.distance - (wheelset_positions(GIVEN.layout)[0] - wheelset_positions(GIVEN.layout)[4])
    expected = found.wheelset_lateral[:, 4] - straight.irregularity_at(place)
    assert found.lateral_to_rails[:, 4] == pytest.approx(expected, abs=1e-12)


@pytest.fixture(scope="module")
def ridden() -> tuple[Track, Motion]:
    """Ride into the paper's curve with the nonlinear model, without the single irregularity."""
    track = curved_track(replace(GIVEN.track, irregularity=0.0))
    return track, run_any(GIVEN, track, speed=20.0, sample_rate=50.0, distance=220.0)


@pytest.mark.slow
def test_flanges_and_friction_hold_the_vehicle_in_its_curve(ridden: tuple[Track, Motion]) -> None:
    track, found = ridden
    assert found.distance[-1] == pytest.approx(220.0)
    assert limits(GIVEN, track, found).kept
    beyond = np.abs(found.lateral_to_rails[-1]) - 0.014
    assert beyond.max() > 5e-3
    assert found.flange_force[-1] == pytest.approx(14.6e6 * np.maximum(beyond - 5e-4, 0), rel=1e-9)
    assert found.friction_used.max() == 1.0
    slope = 0.15 * (1 - found.lateral_to_rails[-1, 0] / 0.7465)
    creep = found.guiding_force[-1, 0, 1] - found.flange_force[-1, 0] - slope * 138_000 * GRAVITY / 12
    assert 0 < -creep < 0.3 * found.wheel_load[-1, 0, 1]  # it pushes the outer wheel on to its flange
    guiding = (found.guiding_force[-1, :, 1] - found.guiding_force[-1, :, 0]).sum()
    assert guiding == pytest.approx(138_000 * (400 / 350 - GRAVITY * 0.09 / (2 * 0.7465)), rel=0.01)
    quotient = found.guiding_force[-1, 0, 1] / found.wheel_load[-1, 0, 1]
    assert found.derailment_quotient[-1, 0] == pytest.approx(quotient)
    assert 0.3 < quotient < limits(GIVEN, track, found).nadal


@pytest.mark.slow
def test_wheel_loads_carry_weight_and_overturning_moment(ridden: tuple[Track, Motion]) -> None:
    """The moments of all masses about the track, and of the springs' static loads under masses that roll."""
    _, found = ridden
    assert found.wheel_load.sum(axis=(1, 2)) == pytest.approx(138_000 * GRAVITY)
    outward = 400 / 350 - GRAVITY * 0.09 / (2 * 0.7465)
    moment = outward * (86_000 * 2.2 + 2 * 14_000 * 0.8 + 6 * 4_000 * 0.625)
    moment += GRAVITY * 86_000 * (2.2 - 1.2) * found.body_roll[-1]
    moment += GRAVITY * (43_000 * (1.2 - 0.8) + 57_000 * (0.8 - 0.625)) * found.frame_roll[-1].sum()
    loads = found.wheel_load[-1]
    assert 0.7465 * (loads[:, 1] - loads[:, 0]).sum() == pytest.approx(moment, rel=0.02)


@pytest.mark.slow
def test_small_motion_is_the_linear_models() -> None:
    straight = tangent_track(replace(GIVEN.track, irregularity=2e-5))
    both = [run_any(GIVEN, straight, speed=20.0, sample_rate=50.0, distance=40.0, model=name) for name in MODELS]
    for name in ("wheelset_lateral", "wheelset_yaw", "frame_roll", "body_lateral", "clearance_mm", "guiding_force"):
        nonlinear, linear = (getattr(motion, name) for motion in both)
        assert np.abs(nonlinear - linear).max() < 2e-3 * np.abs(linear).max(), name
    assert both[0].wheel_load == pytest.approx(both[1].wheel_load, rel=1e-3)


@pytest.mark.slow
def test_the_papers_curve_is_ridden_within_the_flanges_and_the_friction() -> None:
    found = run_any(GIVEN, PAPER, speed=20.0, sample_rate=100.0)
    held = limits(GIVEN, PAPER, found)
    assert held.kept
    assert held.beyond_flange == pytest.approx(held.flange_force / 14.6e6 + 5e-4, abs=5e-4)
    assert held.beyond_flange.max() < 8e-3
    assert held.friction_used.max() == 1.0
    assert held.derailment_quotient.max() < 0.8
    finer = run_any(GIVEN, PAPER, speed=20.0, sample_rate=4000.0, distance=150.0)
    coarse = slice(len(finer.time[::40]))
    assert np.abs(finer.lateral_to_rails[::40] - found.lateral_to_rails[coarse]).max() < 1e-5
    assert np.abs(finer.clearance_mm[::40] - found.clearance_mm[coarse]).max() < 2e-2


@pytest.mark.slow
def test_above_its_critical_speed_the_locomotive_hunts_between_its_flanges() -> None:
    loose = replace(GIVEN.primary, longitudinal_stiffness=1e4, lateral_stiffness=1e4, middle_lateral_stiffness=1e4)
    sharp = replace(GIVEN, primary=loose, wheelset=replace(GIVEN.wheelset, conicity=0.4))
    track = tangent_track(replace(GIVEN.track, irregularity=0.01))
    with pytest.raises(SpecificationError, match=r"^the speed must be one at which the linear vehicle is stable"):
        run(sharp, track, speed=30.0, sample_rate=50.0)
    found = run_any(sharp, track, speed=30.0, sample_rate=50.0)
    away = np.abs(found.lateral_to_rails)
    assert 9e-3 < away.max() < 18e-3
    assert away[-300:].max(axis=0) == pytest.approx(away[-600:-300].max(axis=0), rel=0.01)  # a limit cycle
