"""Linear systems against closed forms, another solver, and conservation of energy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import integrate

from sosmith.instrument.vehicle.linear_motion import LinearSystem, Mode, Suspension

M, C, K = 3.0, 2.0, 50.0
SINGLE = LinearSystem(names=("x",), mass=np.array([[M]]), damping=np.array([[C]]), stiffness=np.array([[K]]))


def chain(damping: float) -> tuple[LinearSystem, Suspension]:
    """Return three masses in a row, the first tied to the ground."""
    suspension = Suspension(("a", "b", "c"))
    suspension.add({"a": 1.0}, 100.0, damping)
    suspension.add({"a": 1.0, "b": -1.0}, 80.0, damping, count=2)
    suspension.add({"b": 1.0, "c": -2.0}, 60.0, damping)
    system = LinearSystem(
        names=suspension.names,
        mass=np.diag([1.0, 2.0, 3.0]),
        damping=suspension.damping,
        stiffness=suspension.stiffness,
    )
    return system, suspension


def test_one_mass_swings_as_the_textbook_says() -> None:
    (mode,) = SINGLE.modes()
    assert mode.growth == pytest.approx(-C / (2 * M), rel=1e-12)
    assert 2 * np.pi * mode.frequency == pytest.approx(np.sqrt(K / M - (C / (2 * M)) ** 2), rel=1e-12)
    assert mode.damping == pytest.approx(C / (2 * np.sqrt(K * M)), rel=1e-12)
    assert mode.coordinate == "x"


def test_twins_share_their_energy() -> None:
    """Two masses of 1 kg in step hold more energy than one of 1.5 kg that moves as much as either."""
    suspension = Suspension(("mass 1 up", "mass 2 up", "beam up"))
    for name in ("mass 1 up", "mass 2 up"):
        suspension.add({name: 1.0, "beam up": -1.0}, 1e6)
    suspension.add({"beam up": 1.0}, 1.0)
    system = LinearSystem(
        names=suspension.names, mass=np.diag([1.0, 1.0, 1.5]), damping=np.zeros((3, 3)), stiffness=suspension.stiffness
    )
    assert system.modes()[0].coordinate == "mass up"


def test_overdamped_motion_has_two_modes_without_frequency() -> None:
    slow = LinearSystem(names=("x",), mass=np.eye(1), damping=np.array([[5.0]]), stiffness=np.array([[4.0]]))
    first, second = slow.modes()
    assert (first.growth, second.growth) == pytest.approx((-4.0, -1.0), rel=1e-12)
    assert first.damping == second.damping == 1.0


def test_damping_of_nothing_is_zero() -> None:
    assert Mode(frequency=0.0, growth=0.0, coordinate="x").damping == 0.0


def test_a_ramp_is_followed_exactly_whatever_the_step() -> None:
    """Under a force a t the mass moves as x = (a/K)(t - C/K) plus the free motion that starts it at rest."""
    slope, omega = 7.0, np.sqrt(K / M - (C / (2 * M)) ** 2)
    for step in (0.5, 0.05):
        t = np.arange(0, 5, step)
        x, v = SINGLE.respond((slope * t)[:, np.newaxis], step)
        decay = np.exp(-C / (2 * M) * t)
        x0, v0 = slope * C / K**2, -slope / K
        free = decay * (x0 * np.cos(omega * t) + (v0 + C / (2 * M) * x0) / omega * np.sin(omega * t))
        assert x[:, 0] == pytest.approx(slope / K * (t - C / K) + free, abs=1e-12)
        assert v[-1, 0] == pytest.approx((x[-1, 0] - x[-2, 0]) / step, abs=0.3 * step)


def test_motion_is_the_one_that_another_solver_finds() -> None:
    system, _ = chain(1.5)
    step, count = 0.02, 101
    force = np.random.default_rng(4).normal(size=(count, 3))
    start = np.array([0.1, -0.2, 0.3]), np.array([1.0, 0.0, -1.0])

    # The force has a kink at every sample, which a solver of high order must not step over.
    states = [np.concatenate(start)]
    for first, second in itertools.pairwise(force):

        def rates(t: float, state: np.ndarray, first: np.ndarray = first, second: np.ndarray = second) -> np.ndarray:
            pull = first + (second - first) * t / step - system.damping @ state[3:] - system.stiffness @ state[:3]
            return np.concatenate([state[3:], np.linalg.solve(system.mass, pull)])

        solved = integrate.solve_ivp(rates, (0, step), states[-1], method="DOP853", rtol=1e-12, atol=1e-14)
        states.append(solved.y[:, -1])
    x, v = system.respond(force, step, start)
    assert x == pytest.approx(np.array(states)[:, :3], abs=1e-11)
    assert v == pytest.approx(np.array(states)[:, 3:], abs=1e-10)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 17, 100])
def test_blocks_leave_no_trace(count: int) -> None:
    """The sums are those of stepping one sample after another, for every count of samples."""
    system, _ = chain(1.5)
    force = np.random.default_rng(count).normal(size=(count, 3))
    start = np.ones(3), np.zeros(3)
    whole, _ = system.respond(force, 0.1, start)
    position, speed = start
    for k in range(count - 1):
        assert whole[k] == pytest.approx(position, abs=1e-12)
        x, v = system.respond(force[k : k + 2], 0.1, (position, speed))
        position, speed = x[1], v[1]
    assert len(whole) == count


def test_energy_stays_without_dampers() -> None:
    system, _ = chain(0.0)
    x, v = system.respond(np.zeros((2000, 3)), 0.05, (np.array([1.0, -1.0, 0.5]), np.zeros(3)))
    energy = system.energy(x, v)
    assert energy[0] > 100
    assert energy == pytest.approx(np.full(2000, energy[0]), rel=1e-10)


def test_dampers_take_as_much_energy_as_is_lost() -> None:
    system, suspension = chain(1.5)
    step = 0.002
    x, v = system.respond(np.zeros((3000, 3)), step, (np.array([1.0, -1.0, 0.5]), np.zeros(3)))
    energy = system.energy(x, v)
    lost = integrate.trapezoid(np.einsum("ti,ij,tj->t", v, suspension.damping, v), dx=step)
    assert energy[0] - energy[-1] == pytest.approx(lost, rel=1e-4)
    assert (np.diff(energy) <= 0).all()


def test_a_suspension_is_symmetric_and_never_pushes_outward() -> None:
    _, suspension = chain(1.5)
    for matrix in (suspension.stiffness, suspension.damping):
        assert (matrix == matrix.T).all()
        assert np.linalg.eigvalsh(matrix).min() >= 0
    assert suspension.stiffness[0, 0] == 100 + 2 * 80
    assert suspension.stiffness[1, 2] == -2 * 60
