"""Saturated creep and flanges: their limits, their slopes, and the linear model as what is left for small motion."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from sosmith.instrument.vehicle.lateral import lateral_dynamics, wheelset_load
from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.saturated_contact import FULL_SLIDING, Contacts, saturation
from sosmith.instrument.vehicle.wheel_rail_contact import GRAVITY, contact_matrices, creep_coefficients

GIVEN = built_in()
SPEED = 20.0
CONTACTS: Contacts = lateral_dynamics(GIVEN, SPEED).contacts()
STATIC = np.full((2, 6), CONTACTS.load)
ROOM = np.full(6, 0.009)
RNG = np.random.default_rng(7)
STATES = RNG.uniform(-1, 1, (40, 4, 6)) * np.array([0.02, 0.01, 0.2, 0.1])[:, np.newaxis]
"""From rolling to sliding, within and beyond the flanges."""
LOADS = RNG.uniform(0.2, 1.8, (40, 2, 6)) * CONTACTS.load


def test_the_factor_is_the_cubic_law() -> None:
    """In rationals, at its ends and between; value, slope and curvature meet at full sliding."""
    for ratio in (Fraction(1, 8), Fraction(3, 2), Fraction(11, 4)):
        force = ratio - ratio**2 / 3 + ratio**3 / 27  # Vermeulen and Johnson's, over the limit
        assert float(ratio) * saturation(np.array(float(ratio))) == pytest.approx(float(force), rel=1e-15)
    assert saturation(np.array([0.0, 1e-300])).tolist() == [1.0, 1.0]
    around = FULL_SLIDING + np.array([-2e-3, -1e-3, 0.0, 1e-3, 2e-3])
    values = saturation(around)
    assert np.diff(values) / 1e-3 == pytest.approx([-1 / 9] * 4, abs=2e-4)
    assert np.diff(values, 2) / 1e-6 == pytest.approx([2 / 27] * 3, abs=2e-4)


def test_no_wheel_exceeds_its_friction() -> None:
    at = CONTACTS.loaded(LOADS)
    forces, used = CONTACTS.creep_forces(STATES, at, saturated=True)
    resultant = np.hypot(forces[:, 0], forces[:, 1]) / at.limit
    assert resultant == pytest.approx(used, rel=1e-12)
    assert used.max() == 1.0
    assert used.min() < 0.5
    _, wanted = CONTACTS.creep_forces(STATES, at, saturated=False)
    assert wanted.max() > 5
    assert (used <= np.minimum(wanted, 1)).all()


def test_kalkers_coefficients_grow_with_the_load() -> None:
    at = CONTACTS.loaded(LOADS)
    for k, side, wheelset in ((0, 0, 0), (7, 1, 4), (31, 0, 5)):
        load = LOADS[k, side, wheelset]
        creep = creep_coefficients(GIVEN.contact, load)
        half = GIVEN.wheelset.contact_half_spacing
        expected = [[creep.f11, 0, 0], [0, -creep.f22, -creep.f23], [-half * creep.f11, creep.f23, -creep.f33]]
        assert at.kalker[k, :, :, side, wheelset] == pytest.approx(np.array(expected), rel=1e-12)
        assert at.limit[k, side, wheelset] == pytest.approx(0.3 * load, rel=1e-15)


def test_linear_forces_are_those_of_the_linear_model() -> None:
    """Both wheels of a wheelset together, under their static load, without the gravitational stiffness."""
    wheelset = GIVEN.wheelset
    damping, stiffness = contact_matrices(
        creep_coefficients(GIVEN.contact, wheelset_load(GIVEN) / 2), speed=SPEED, conicity=wheelset.conicity,
        rolling_radius=wheelset.rolling_radius, half_spacing=wheelset.contact_half_spacing, load=0.0,
    )  # fmt: skip
    forces, _ = CONTACTS.creep_forces(STATES[0], CONTACTS.loaded(STATIC), saturated=False)
    expected = -stiffness @ STATES[0, :2] - damping @ STATES[0, 2:]
    assert forces[1:].sum(axis=1) == pytest.approx(expected, rel=1e-11)


def test_for_small_motion_the_linear_model_is_left() -> None:
    """At rest the slopes of what comes on top of it are zero: its matrices are the Jacobian, to rounding."""
    at = CONTACTS.loaded(STATIC)
    ways = np.repeat(np.eye(4)[:, :, np.newaxis], 6, axis=2)
    exerted, slopes = CONTACTS.with_slopes(np.zeros((4, 6)), ROOM, at, ways)
    assert not exerted.any()
    linear = np.abs(at.kalker).max()
    assert np.abs(slopes).max() < 1e-15 * linear
    small, smaller = (np.abs(CONTACTS.beyond_linear(1e-3 * scale * STATES, ROOM, at)).max() for scale in (1.0, 0.1))
    assert smaller == pytest.approx(0.01 * small, rel=0.05)  # of second order


def test_slopes_are_those_of_the_forces() -> None:
    """By central differences, for rolling and sliding wheels, within and beyond the flanges."""
    at = [CONTACTS.loaded(loads) for loads in LOADS]
    ways = RNG.uniform(-1, 1, (2, 4, 6)) * np.array([1e-2, 1e-2, 0.2, 0.2])[:, np.newaxis]
    for k, state in enumerate(STATES[:20]):
        exerted, slopes = CONTACTS.with_slopes(state, ROOM, at[k], ways)
        assert exerted == pytest.approx(CONTACTS.beyond_linear(state, ROOM, at[k]), rel=1e-12)
        for way, slope in zip(ways, slopes, strict=True):
            more, less = (CONTACTS.beyond_linear(state + sign * 1e-5 * way, ROOM, at[k]) for sign in (1, -1))
            assert slope == pytest.approx((more - less) / 2e-5, rel=1e-5, abs=1e-5 * np.abs(slope).max())


def test_a_flange_pushes_only_towards_the_middle_and_only_beyond_its_clearance() -> None:
    flange = CONTACTS.flange
    way = np.linspace(-2e-3, 6e-3, 4001)
    force = flange.force(way)
    assert not force[way <= 0].any()
    assert (np.diff(force[way > 0]) > 0).all()
    assert np.gradient(force, way) == pytest.approx(flange.slope(way), abs=2e-3 * flange.stiffness)
    assert np.gradient(flange.energy(way), way) == pytest.approx(force, abs=20)
    assert flange.slope(way).max() == flange.stiffness == 14.6e6
    at = CONTACTS.loaded(STATIC)
    still = np.zeros((4, 6))
    still[0] = np.array([-0.013, -0.0095, -0.008, 0.008, 0.0095, 0.013])
    without = replace(CONTACTS, flange=replace(flange, stiffness=1e-12))
    pushed = (CONTACTS.beyond_linear(still, ROOM, at) - without.beyond_linear(still, ROOM, at))[0]
    assert pushed == pytest.approx(np.sign(-still[0]) * flange.force(np.abs(still[0]) - 0.009), abs=1e-6)
    assert pushed[0] == pytest.approx(14.6e6 * 0.0035)


def test_friction_limit_is_that_of_the_wheels_weight() -> None:
    assert CONTACTS.load == pytest.approx(138_000 * GRAVITY / 12)
