"""Wheel and rail: the Klingel limit, Kalker's units, a free wheelset in a curve, and a published bogie."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from tests.instrument.vehicle.contacts import cooperrider

from sosmith.instrument.vehicle.linear_motion import LinearSystem
from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.wheel_rail_contact import Creep, contact_matrices, creep_coefficients, klingel_frequency

WHEELSET = {"conicity": 0.1, "rolling_radius": 0.45, "half_spacing": 0.75}


def free_wheelset(speed: float, load: float = 0.0) -> LinearSystem:
    damping, stiffness = contact_matrices(Creep(f11=7.44e6, f22=6.79e6), speed=speed, load=load, **WHEELSET)
    return LinearSystem(names=("lateral", "yaw"), mass=np.diag([1250.0, 700.0]), damping=damping, stiffness=stiffness)


@pytest.mark.parametrize("speed", [0.01, 0.1, 1.0])
def test_a_slow_free_wheelset_moves_as_klingel_found(speed: float) -> None:
    (swinging,) = (mode for mode in free_wheelset(speed).modes() if mode.frequency > 0)
    klingel = klingel_frequency(speed, 0.1, 0.45, 0.75)
    assert klingel == speed / (2 * math.pi) * math.sqrt(0.1 / (0.45 * 0.75))
    # the first correction is of second order in the speed
    assert swinging.frequency == pytest.approx(klingel, rel=2e-4 * speed**2 + 1e-9)
    assert swinging.damping == pytest.approx(0, abs=1e-3 * speed)


@pytest.mark.parametrize("speed", [1.0, 20.0, 100.0])
def test_a_free_wheelset_hunts_at_every_speed(speed: float) -> None:
    assert max(mode.growth for mode in free_wheelset(speed).modes()) > 0


def test_gravitational_stiffness_restores_laterally_and_destabilizes_in_yaw() -> None:
    _, without = contact_matrices(Creep(f11=7e6, f22=7e6), speed=10.0, load=0.0, **WHEELSET)
    _, loaded = contact_matrices(Creep(f11=7e6, f22=7e6), speed=10.0, load=1e5, **WHEELSET)
    assert loaded - without == pytest.approx(np.diag([1e5 * 0.1 / 0.75, -1e5 * 0.1 * 0.75]), abs=1e-6)


def test_spin_acts_as_in_kalkers_linear_law() -> None:
    """From creepages to force and moment of both wheels, written out for one state of motion."""
    creep = Creep(f11=7e6, f22=6e6, f23=2e4, f33=50.0)
    speed, y, psi, y_rate, psi_rate = 10.0, 2e-3, 1e-3, 0.03, 0.02
    damping, stiffness = contact_matrices(creep, speed=speed, load=0.0, **WHEELSET)
    across, spin = y_rate / speed - psi, psi_rate / speed
    lateral = moment = 0.0
    for side in (1, -1):  # left, right
        # a wheel that runs on a larger radius, or that the yaw moves backwards, slips forwards
        along = -side * (0.75 * psi_rate / speed + 0.1 * y / 0.45)
        lateral += -creep.f22 * across - creep.f23 * spin
        moment += creep.f23 * across - creep.f33 * spin - side * 0.75 * -creep.f11 * along
    force = -damping @ [y_rate, psi_rate] - stiffness @ [y, psi]
    assert force == pytest.approx([lateral, moment], rel=1e-12)


def test_kalkers_coefficients_grow_with_the_area_of_contact() -> None:
    contact = built_in().contact
    at_reference = creep_coefficients(contact, contact.reference_load)
    # the values of the published ellipse
    assert at_reference.f11 == pytest.approx(82.7e9 * 0.005952 * 0.006653 * 4.1246, rel=1e-12)
    assert at_reference.f22 / 1e6 == pytest.approx(11.7, abs=0.05)
    eightfold = creep_coefficients(contact, 8 * contact.reference_load)
    ratios = [getattr(eightfold, name) / getattr(at_reference, name) for name in ("f11", "f22", "f23", "f33")]
    assert ratios == pytest.approx([4, 4, 8, 16], rel=1e-12)


def growth(speed: float, **dampers: float) -> float:
    return max(mode.growth for mode in cooperrider(speed, **dampers).modes())


def test_cooperriders_bogie_turns_unstable_at_its_critical_speed() -> None:
    """68.64 m/s by these equations; the 66.61 m/s of the literature (from memory) are not reproduced."""
    critical = brentq(growth, 50, 90)
    assert critical == pytest.approx(68.64, abs=0.005)
    assert growth(0.99 * critical) < 0 < growth(1.01 * critical)
    worst = max(cooperrider(critical).modes(), key=lambda mode: mode.growth)
    assert worst.frequency == pytest.approx(4.0, abs=0.01)
    swapped = brentq(lambda speed: growth(speed, side_damping=20e3, roll_damping=29.2e3), 50, 90)
    assert swapped == pytest.approx(66.78, abs=0.005)


def test_modes_of_cooperriders_bogie_at_20_metres_per_second() -> None:
    """Three of them are in other work too: 1.20, 4.85 and 7.91 Hz, beside Klingel's 1.244 Hz."""
    modes = [mode for mode in cooperrider(20.0).modes() if mode.frequency > 0]
    assert [mode.frequency for mode in modes] == pytest.approx([1.20, 1.22, 4.85, 7.87, 7.91], abs=0.01)
    assert modes[0].growth == pytest.approx(-1.25, abs=0.01)
    assert klingel_frequency(20.0, 0.05, 0.4572, 0.716) == pytest.approx(1.244, abs=5e-4)
