"""Roundoff noise of state-space systems in double precision: Gramians, second-order modes, minimum-noise coordinates.

A system ``x(n+1) = A x + B u, y = C x + D u`` has the Gramians ``K = A K A' + B B'`` of its states (their variances
for white input of variance 1) and ``W = A' W A + C' C`` (the energy at the output of a unit error of each state).
If each state uses its full range, the variance of the rounding error of state i is proportional to ``K_ii``, and its
noise at the output to ``K_ii W_ii``; the sum over the states is the noise gain. No coordinates make it smaller than
``(sum mu)**2 / n`` with the second-order modes mu, the square roots of the eigenvalues of K W
(Mullis and Roberts 1976; Hwang 1977).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_FLOOR = 1e-12  # relative to the largest eigenvalue: below it a state is nearly uncontrollable or unobservable


@dataclass(frozen=True, eq=False)
class StateSystem:
    """A single-input, single-output system.

    Attributes
    ----------
    A : array, shape (n, n)
    B : array, shape (n,)
    C : array, shape (n,)
    D : float
    """

    A: Array
    B: Array
    C: Array
    D: float

    @cached_property
    def controllability(self) -> Array:
        """Controllability Gramian, shape (n, n)."""
        return _gramian(self.A, self.B)

    @cached_property
    def observability(self) -> Array:
        """Observability Gramian, shape (n, n)."""
        return _gramian(self.A.T, self.C)

    @property
    def noise(self) -> Array:
        """``K_ii W_ii`` of every state, shape (n,): its contribution to the noise gain."""
        return np.asarray(np.diag(self.controllability) * np.diag(self.observability), dtype=np.float64)

    @property
    def energy(self) -> float:
        """Sum of the squares of the impulse response: noise gain from a white input to the output."""
        return float(self.D**2 + self.C @ self.controllability @ self.C)

    def transformed(self, T: Array) -> StateSystem:
        """Return the system in the coordinates ``T^-1 x``."""
        inverse: Array = np.linalg.inv(T).astype(np.float64)
        return StateSystem(inverse @ self.A @ T, inverse @ self.B, self.C @ T, self.D)


def _gramian(A: Array, B: Array) -> Array:
    from scipy import linalg  # noqa: PLC0415 - a design uses the system alone

    return np.asarray(linalg.solve_discrete_lyapunov(A, np.outer(B, B)), dtype=np.float64)


def companion(row: Sequence[float]) -> StateSystem:
    """Second-order section in direct form II: the states are its internal signal, delayed by one and two samples.

    Parameters
    ----------
    row : sequence of float
        b0, b1, b2, 1, a1, a2.
    """
    b0, b1, b2, _, a1, a2 = row
    return StateSystem(
        np.array([[0.0, 1.0], [-a2, -a1]]), np.array([0.0, 1.0]), np.array([b2 - b0 * a2, b1 - b0 * a1]), b0
    )


def cascade(systems: Sequence[StateSystem]) -> StateSystem:
    """Combine several systems into one, each driven by the previous one; the states are theirs, in order."""
    whole = systems[0]
    for after in systems[1:]:
        n, m = len(whole.B), len(after.B)
        whole = StateSystem(
            np.block([[whole.A, np.zeros((n, m))], [np.outer(after.B, whole.C), after.A]]),
            np.concatenate([whole.B, after.B * whole.D]),
            np.concatenate([after.D * whole.C, after.C]),
            after.D * whole.D,
        )
    return whole


def second_order_modes(system: StateSystem) -> Array:
    """Second-order modes, largest first, shape (n,); invariant under changes of coordinates and of frequency."""
    squares = np.linalg.eigvals(system.controllability @ system.observability)
    return np.sort(np.sqrt(np.maximum(squares.real, 0.0)))[::-1]


def minimum_gain(modes: Array) -> float:
    """Smallest noise gain in any coordinates if all states have the same word length."""
    return float(modes.sum() ** 2 / len(modes))


def minimum_noise_coordinates(K: Array, W: Array) -> Array:
    """Coordinates T, shape (2, 2), in which two states with these Gramians make the least noise.

    In balanced coordinates, K and W are the same diagonal matrix of the modes. After a rotation by 45 degrees they are
    still equal, and so are both diagonal entries, which is the condition for the minimum.
    """
    lower = np.linalg.cholesky(K)
    squares, U = np.linalg.eigh(lower.T @ W @ lower)
    squares = np.maximum(squares, _FLOOR * (squares[-1] or 1.0))
    turn = np.array([[1.0, -1.0], [1.0, 1.0]]) / np.sqrt(2.0)
    return np.asarray(lower @ U @ np.diag(squares**-0.25) @ turn, dtype=np.float64)


def block_optimal(systems: Sequence[StateSystem]) -> list[StateSystem]:
    """Second-order sections, each in the coordinates with the least noise within their cascade."""
    whole = cascade(systems)
    blocks = [slice(2 * i, 2 * i + 2) for i in range(len(systems))]
    return [
        system.transformed(
            minimum_noise_coordinates(whole.controllability[block, block], whole.observability[block, block])
        )
        for system, block in zip(systems, blocks, strict=True)
    ]
