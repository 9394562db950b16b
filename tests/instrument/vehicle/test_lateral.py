"""The equations of the locomotive: rigid motion, symmetry, modes, the Klingel limit, energy, preload."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sosmith.instrument.vehicle.lateral import (
    COORDINATES,
    ROLLS,
    axle_positions,
    frame_positions,
    lateral_dynamics,
    lateral_suspension,
    wheelset_load,
    wheelset_positions,
)
from sosmith.instrument.vehicle.linear_motion import LinearSystem
from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.vertical import COORDINATES as VERTICAL
from sosmith.instrument.vehicle.vertical import vertical_dynamics
from sosmith.instrument.vehicle.wheel_rail_contact import GRAVITY, klingel_frequency

GIVEN = built_in()
NAMES = COORDINATES + ROLLS
AHEAD = [*np.repeat(wheelset_positions(GIVEN.layout), 2), *np.repeat(frame_positions(GIVEN.layout), 3), 0, 0, 0]
HEIGHT = [0.625] * 12 + [0.8] * 6 + [2.2] * 3


def rigid(lateral: float, yaw: float, roll: float) -> np.ndarray:
    """All coordinates of the vehicle moved as one body about the rails under its centre."""
    moved = []
    for name, x, h in zip(NAMES, [*AHEAD, *[0] * 6], [*HEIGHT, *[0] * 6], strict=True):
        motion = name.rsplit(" ", 1)[1]
        moved.append({"lateral": lateral + x * yaw - h * roll, "yaw": yaw, "roll": roll}[motion])
    return np.array(moved)


def test_there_are_21_coordinates() -> None:
    assert len(COORDINATES) == 21
    assert sum(name.endswith("lateral") for name in COORDINATES) == 9
    assert sum(name.endswith("yaw") for name in COORDINATES) == 9
    assert sum(name.endswith("roll") for name in COORDINATES) == 3


def test_axles_stand_where_the_layout_says() -> None:
    assert axle_positions(GIVEN.layout) == pytest.approx([2.125, -0.125, -2.125, 2.125, 0.125, -2.125])
    positions = wheelset_positions(GIVEN.layout)
    assert np.diff(positions) == pytest.approx([-2.25, -2.0, -7.35, -2.0, -2.25])
    assert positions == pytest.approx(-positions[::-1])


@pytest.mark.parametrize("motion", [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_the_suspension_takes_no_notice_of_rigid_motion(motion: tuple[float, float, float]) -> None:
    suspension = lateral_suspension(GIVEN)
    moved = rigid(*motion)
    for matrix in (suspension.stiffness, suspension.damping):
        assert matrix @ moved == pytest.approx(np.zeros(27), abs=1e-8 * np.abs(matrix).max())
        assert (matrix == matrix.T).all()
        values = np.linalg.eigvalsh(matrix)
        assert values.min() > -1e-9 * values.max()


def test_front_and_rear_mirror_each_other() -> None:
    """Seen from its other end the vehicle is the same: yaw changes sign, numbers count backwards."""
    order, sign = [], []
    for name in COORDINATES:
        part, *number, motion = name.split(" ")
        last = {"wheelset": 7, "frame": 3}.get(part)
        twin = f"{part} {last - int(number[0])} {motion}" if last else name
        order.append(COORDINATES.index(twin))
        sign.append(-1 if motion == "yaw" else 1)
    suspension = lateral_suspension(GIVEN)
    for matrix in (suspension.stiffness[:21, :21], suspension.damping[:21, :21]):
        mirrored = matrix[np.ix_(order, order)] * np.outer(sign, sign)
        assert mirrored == pytest.approx(matrix, abs=1e-9 * np.abs(matrix).max())


@pytest.mark.slow
def test_without_contact_energy_is_lost_to_the_dampers_alone() -> None:
    suspension = lateral_suspension(GIVEN)
    mass = lateral_dynamics(GIVEN, 20.0).system.mass
    start = np.random.default_rng(2).normal(size=21) * 1e-3, np.random.default_rng(3).normal(size=21) * 1e-2
    free = LinearSystem(
        names=COORDINATES, mass=mass, damping=np.zeros((21, 21)), stiffness=suspension.stiffness[:21, :21]
    )
    energy = free.energy(*free.respond(np.zeros((2000, 21)), 0.005, start))
    assert energy == pytest.approx(np.full(2000, energy[0]), rel=1e-9)
    damped = LinearSystem(
        names=COORDINATES,
        mass=mass,
        damping=suspension.damping[:21, :21],
        stiffness=suspension.stiffness[:21, :21],
    )
    energy = damped.energy(*damped.respond(np.zeros((2000, 21)), 0.005, start))
    assert (np.diff(energy) <= 1e-12 * energy[0]).all()
    assert energy[-1] < 0.5 * energy[0]


def test_slow_wheelsets_without_springs_move_as_klingel_found() -> None:
    loose = replace(
        GIVEN.primary,
        longitudinal_stiffness=0.0,
        lateral_stiffness=0.0,
        middle_lateral_stiffness=0.0,
        longitudinal_damping=0.0,
        lateral_damping=0.0,
    )
    speed = 0.5
    modes = lateral_dynamics(replace(GIVEN, primary=loose), speed).system.modes()
    slowest = [mode for mode in modes if mode.frequency > 0 and mode.coordinate.startswith("wheelset")]
    klingel = klingel_frequency(speed, 0.15, 0.625, 0.7465)
    assert len(slowest) == 6
    # gravitational stiffness and spin, some thousandths of the creep, are what is between
    assert [mode.frequency for mode in slowest] == pytest.approx([klingel] * 6, rel=3e-3)
    assert all(abs(mode.damping) < 3e-3 for mode in slowest)


def test_soft_springs_leave_the_vehicle_near_the_klingel_limit() -> None:
    soft = replace(
        GIVEN.primary,
        longitudinal_stiffness=1.0,
        lateral_stiffness=1.0,
        middle_lateral_stiffness=1.0,
        longitudinal_damping=0.0,
        lateral_damping=0.0,
    )
    stiff = lateral_dynamics(GIVEN, 0.5).system.modes()
    loose = lateral_dynamics(replace(GIVEN, primary=soft), 0.5).system.modes()
    klingel = klingel_frequency(0.5, 0.15, 0.625, 0.7465)
    assert sum(mode.frequency == pytest.approx(klingel, rel=3e-3) for mode in loose) == 6
    assert not any(mode.frequency == pytest.approx(klingel, rel=3e-3) for mode in stiff)


@pytest.mark.parametrize("speed", [5.0, 20.0, 33.0])
def test_the_locomotive_is_stable_up_to_its_top_speed_of_120_kilometres_per_hour(speed: float) -> None:
    assert max(mode.growth for mode in lateral_dynamics(GIVEN, speed).system.modes()) < -0.1


def test_the_locomotive_hunts_where_nothing_holds_its_wheelsets() -> None:
    """The check of stability can fail: with soft axle boxes and sharp cones a mode grows at 20 m/s."""
    loose = replace(GIVEN.primary, longitudinal_stiffness=1e4, lateral_stiffness=1e4, middle_lateral_stiffness=1e4)
    sharp = replace(GIVEN, primary=loose, wheelset=replace(GIVEN.wheelset, conicity=0.4))
    assert max(mode.growth for mode in lateral_dynamics(sharp, 20.0).system.modes()) > 0.1


def test_the_load_on_the_springs_weakens_roll() -> None:
    """The body topples over when the springs' moment falls below its weight times its height above them."""
    system = lateral_dynamics(GIVEN, 20.0).system
    suspension = lateral_suspension(GIVEN)
    k = COORDINATES.index("body roll")
    assert suspension.stiffness[k, k] - system.stiffness[k, k] == pytest.approx(86_000 * GRAVITY * (2.2 - 1.2))
    k = COORDINATES.index("frame 2 roll")
    upper, lower = 43_000 * GRAVITY * (1.2 - 0.8), 57_000 * GRAVITY * (0.8 - 0.625)
    assert suspension.stiffness[k, k] - system.stiffness[k, k] == pytest.approx(upper + lower)


def test_the_axles_carry_the_whole_weight() -> None:
    assert 6 * wheelset_load(GIVEN) == pytest.approx(138_000 * 9.81)


def test_vertical_suspension_knows_rigid_motion_and_static_deflection() -> None:
    vertical = vertical_dynamics(GIVEN)
    frames = frame_positions(GIVEN.layout)
    for lift, pitch in ((1.0, 0.0), (0.0, 1.0)):
        moved = [value for x in frames for value in (lift - x * pitch, pitch)] + [lift, pitch]
        rails = [lift - x * pitch for x in wheelset_positions(GIVEN.layout)]
        force = vertical.suspension.stiffness @ np.array(moved + rails)
        assert force == pytest.approx(np.zeros(12), abs=1e-6)
    weights = -GRAVITY * np.array([14e3, 0, 14e3, 0, 86e3, 0])
    sunk = np.linalg.solve(vertical.system.stiffness, weights)
    primary = -114_000 * GRAVITY / 12 / 2.0e6
    assert sunk[VERTICAL.index("frame 1 vertical")] == pytest.approx(primary, rel=0.02)
    assert sunk[VERTICAL.index("body vertical")] == pytest.approx(primary - 86_000 * GRAVITY / 4 / 1.6e6, rel=0.01)
    bounce = [mode for mode in vertical.system.modes() if mode.coordinate == "body vertical"]
    assert 1.0 < bounce[0].frequency < 1.5
    assert all(mode.growth < 0 for mode in vertical.system.modes())
