"""The integrator of nonlinear contacts: its linear limit, its order, other integrators, and a published bogie."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.instrument.vehicle.contacts import cooperrider

from sosmith.instrument.vehicle import nonlinear_motion
from sosmith.instrument.vehicle.linear_motion import Array, LinearSystem
from sosmith.instrument.vehicle.nonlinear_motion import Course, respond
from sosmith.instrument.vehicle.saturated_contact import Contacts, Flange
from sosmith.instrument.vehicle.wheel_rail_contact import Creep, contact_matrices
from sosmith.model.errors import SpecificationError

FLANGE = Flange(stiffness=14.6e6, transition=1e-4)
KALKER = Creep(f11=12e6, f22=11e6, f23=4e4, f33=200.0)
LOAD = 60e3


def contacts(speed: float, friction: float = 0.3, creep: Creep = KALKER) -> Contacts:
    return Contacts(
        speed=speed, conicity=0.1, rolling_radius=0.45, half_spacing=0.75, creep=creep, load=LOAD,
        friction=friction, flange=FLANGE,
    )  # fmt: skip


def wheelset(speed: float, spring: float = 0.0, creep: Creep = KALKER) -> LinearSystem:
    """Return one wheelset on springs to a body that stands still."""
    damping, stiffness = contact_matrices(
        creep, speed=speed, conicity=0.1, rolling_radius=0.45, half_spacing=0.75, load=0.0
    )
    own = np.diag([spring, spring])
    return LinearSystem(names=("y", "yaw"), mass=np.diag([1500.0, 800.0]), damping=damping, stiffness=stiffness + own)


def straight(samples: int, wheelsets: int, coordinates: int, room: float = 9e-3) -> Course:
    return Course(
        pose=np.zeros((samples, 4, wheelsets)), room=np.full((samples, wheelsets), room),
        load_shift=np.zeros((samples, wheelsets)), load_gain=np.zeros((2 * coordinates, wheelsets)),
    )  # fmt: skip


def test_small_motion_is_the_linear_one() -> None:
    """Ten times smaller, the difference from the exact linear solution is ten times smaller still."""
    system, samples, step = wheelset(20.0, 5e5), 1000, 1e-3
    still = np.zeros((samples, 2))
    parts = []
    for size in (1e-5, 1e-6):
        start = (np.array([size, 0.0]), np.zeros(2))
        found, _ = respond(system, still, step, contacts(20.0), straight(samples, 1, 2), start)
        linear, _ = system.respond(still, step, start)
        parts.append(np.abs(found - linear).max() / size)
    assert parts[1] == pytest.approx(parts[0] / 10, rel=0.05)
    assert parts[1] < 1e-2


@pytest.mark.slow
def test_a_free_wheelset_has_klingels_wavelength() -> None:
    """At walking speed, where creep is as stiff as it gets, one wave of 2 pi sqrt(r l / c) takes 11.5 m."""
    speed, step = 1.0, 5e-3
    wave = 2 * math.pi * math.sqrt(0.45 * 0.75 / 0.1)
    samples = round(2.2 * wave / speed / step)
    start = (np.array([1e-5, 0.0]), np.zeros(2))
    y, _ = respond(wheelset(speed), np.zeros((samples, 2)), step, contacts(speed), straight(samples, 1, 2), start)
    crossings = np.flatnonzero(np.diff(np.sign(y[:, 0])) > 0)
    assert len(crossings) == 2
    assert (crossings[1] - crossings[0]) * step * speed == pytest.approx(wave, rel=2e-3)


@pytest.mark.slow
def test_between_its_flanges_a_wheelset_without_friction_keeps_its_energy() -> None:
    tiny = Creep(f11=1e-3, f22=1e-3)
    system = wheelset(20.0, 2e6, creep=tiny)
    samples = 4000
    start = (np.zeros(2), np.array([0.9, 0.0]))
    course = straight(samples, 1, 2)
    y, v = respond(system, np.zeros((samples, 2)), 2.5e-4, contacts(20.0, 1e-12, tiny), course, start)
    stored = FLANGE.energy(np.abs(y[:, 0]) - 9e-3)
    energy = (1500 * v[:, 0] ** 2 + 2e6 * y[:, 0] ** 2) / 2 + stored
    assert stored.max() > 0.5 * energy[0]
    assert np.abs(energy / energy[0] - 1).max() < 5e-3


def reference(speed: float, spring: float, friction: float, start: Array, end: float) -> tuple[float, float]:
    """Return position and yaw at time `end` by another integrator and the equations written out for one wheel each."""

    def rate(_: float, x: Array) -> list[float]:
        y, psi, vy, vpsi = x.tolist()
        force, moment = -spring * y, -spring * psi
        for side in (1, -1):
            along = -side * (0.75 * vpsi / speed + 0.1 * y / 0.45)
            across, spin = vy / speed - psi, vpsi / speed
            fx, fy = -KALKER.f11 * along, -KALKER.f22 * across - KALKER.f23 * spin
            mz = KALKER.f23 * across - KALKER.f33 * spin
            wanted, limit = math.hypot(fx, fy), friction * LOAD
            u = wanted / limit
            factor = 1.0
            if wanted:
                factor = limit * (1.0 if u > 3 else u - u**2 / 3 + u**3 / 27) / wanted
            force += factor * fy
            moment += factor * (mz - side * 0.75 * fx)
        way = abs(y) - 9e-3
        if way > 0:
            push = 14.6e6 * (way**2 / 2e-4 if way < 1e-4 else way - 5e-5)
            force -= math.copysign(push, y)
        return [vy, vpsi, force / 1500, moment / 800]

    found = solve_ivp(rate, (0, end), start, method="Radau", rtol=1e-9, atol=1e-12)
    return found.y[0, -1], found.y[1, -1]


@pytest.mark.slow
def test_a_stiff_integrator_of_others_finds_the_same() -> None:
    """Large motion, sliding and striking the flanges; halving the step quarters the difference."""
    speed, spring, end = 20.0, 5e5, 0.3
    start = np.array([8e-3, 0.0, 0.4, 0.1])
    expected = np.array(reference(speed, spring, 0.3, start, end))
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        samples = round(end / step) + 1
        found, _ = respond(
            wheelset(speed, spring), np.zeros((samples, 2)), step, contacts(speed), straight(samples, 1, 2),
            (start[:2], start[2:]),
        )  # fmt: skip
        assert np.abs(found[:, 0]).max() > 9e-3
        errors.append(np.abs(found[-1] - expected).max())
    assert errors[2] < 2e-6
    assert errors[2] < errors[1] / 2 < errors[0] / 4


BOGIE = Creep(f11=6.563e6 / 0.60252, f22=6.563e6 / 0.54219)


def bogie(speed: float, start: float, seconds: float, stiffness: float = 14.6e6) -> Array:
    """Return the wheelsets' and the frame's lateral motion of Cooperrider's bogie from its front wheelset's offset.

    Friction limit of 10 kN and dead band of 9.1 mm as in papers of True and Kaas-Petersen, from memory.
    """
    samples = round(seconds / 1e-3)
    made = Contacts(
        speed=speed, conicity=0.05, rolling_radius=0.4572, half_spacing=0.716, creep=BOGIE, load=LOAD,
        friction=10e3 / LOAD, flange=Flange(stiffness=stiffness, transition=1e-5),
    )  # fmt: skip
    first = np.zeros(7)
    first[0] = start
    y, _ = respond(
        cooperrider(speed), np.zeros((samples, 7)), 1e-3, made, straight(samples, 2, 7, 9.1e-3), (first, np.zeros(7))
    )
    return y[:, [0, 2, 4]]


@pytest.mark.slow
def test_cooperriders_bogie_hunts_between_its_flanges_above_its_critical_speed() -> None:
    """As on bifurcation.de (exd10): from an offset of 0.1 it comes to rest at 60 and to a periodic orbit at 70 m/s.

    That page has its bifurcation at 68.66, ours is at 68.64 m/s (`test_wheel_rail_contact.py`).
    """
    slow, fast = bogie(60.0, 0.1, 4.0), bogie(70.0, 0.1, 4.0)
    assert np.abs(slow[-1000:]).max() < 0.5 * np.abs(slow[-2000:-1000]).max() < 2e-3
    late = np.abs(fast[-1000:, :2])
    assert 9.1e-3 < late.max() < 12e-3
    assert late[:500].max(axis=0) == pytest.approx(late[500:].max(axis=0), rel=1e-3)  # it neither grows nor dies


@pytest.mark.slow
def test_the_orbit_does_not_depend_on_where_it_began() -> None:
    ends = [np.abs(bogie(70.0, start, 20.0)[-2000:]).max(axis=0) for start in (1e-3, 0.1)]
    assert ends[0] == pytest.approx(ends[1], rel=0.01)


@pytest.mark.slow
def test_without_flanges_the_loss_of_stability_is_hard() -> None:
    """Below the critical speed a small disturbance dies and a large one does not: the bifurcation is subcritical."""
    small, large = (np.abs(bogie(66.0, start, 12.0, 1e-9)[-1000:]).max() for start in (9e-3, 0.1))
    assert small < 1e-3
    assert large > 30e-3


def test_a_step_that_does_not_converge_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nonlinear_motion, "MAX_ITERATIONS", 1)
    monkeypatch.setattr(nonlinear_motion, "TOLERANCE", 1e-9)
    start = (np.array([8e-3, 0.0]), np.array([0.4, 0.0]))
    message = r"^the sample rate must be high enough to follow the contact forces, not 1000 Hz at 20 m/s$"
    with pytest.raises(SpecificationError, match=message):
        respond(wheelset(20.0), np.zeros((9, 2)), 1e-3, contacts(20.0), straight(9, 1, 2), start)


def test_loads_shift_from_wheel_to_wheel() -> None:
    course = replace(straight(1, 1, 2), load_shift=np.full((1, 1), 8e3), load_gain=np.full((4, 1), 1e6))
    loads = course.loads(np.array([[1e-3, 0.0, 0.0, 1e-3]]), contacts(20.0))
    assert loads == pytest.approx(np.array([[[LOAD + 5e3], [LOAD - 5e3]]]))
