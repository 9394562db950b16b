"""Linear mechanical systems: assembly from springs and dampers, modes, exact response."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
import numpy.typing as npt
from flint import acb, arb, arb_mat, fmpq, fmpq_mat

from sosmith.model.arithmetic.correct_rounding import evaluate, nearest_double
from sosmith.model.arithmetic.matrices import power, product

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Mode:
    """A mode of free vibration, exp(growth t) cos(2 pi frequency t).

    Attributes
    ----------
    frequency : float
        Frequency in Hz; 0 for a mode that decays or grows without oscillating.
    growth : float
        Real part of the eigenvalue in 1/s; negative if the mode decays.
    coordinate : str
        The kind of coordinate with the largest share of kinetic energy: a coordinate's name without numbers, since in
        a symmetric system only rounding would distinguish equal coordinates.
    """

    frequency: float
    growth: float
    coordinate: str

    @property
    def damping(self) -> float:
        """Damping ratio: minus the real part over the magnitude of the eigenvalue; 1 without oscillation."""
        size = float(np.hypot(self.growth, 2 * np.pi * self.frequency))
        return -self.growth / size if size else 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearSystem:
    """The equations of motion mass q'' + damping q' + stiffness q = force.

    Attributes
    ----------
    names : tuple of str
        Names of the n coordinates.
    mass, damping, stiffness : ndarray, shape (n, n)
        Matrices in SI units; the mass matrix is symmetric and positive definite.
    """

    names: tuple[str, ...]
    mass: Array
    damping: Array
    stiffness: Array

    def state_matrix(self) -> Array:
        """Return the matrix A of x' = A x + (0, mass^-1 force) for the state x = (q, q'), shape (2 n, 2 n)."""
        return evaluate(lambda: _doubles(self._state_matrix()))

    def _state_matrix(self) -> arb_mat:
        mass, damping, stiffness = (_balls(matrix) for matrix in (self.mass, self.damping, self.stiffness))
        n = len(self.names)
        none, one = _balls(np.zeros((n, n))), _balls(np.eye(n))
        return _blocks([[none, one], [-mass.solve(stiffness), -mass.solve(damping)]])

    def modes(self) -> tuple[Mode, ...]:
        """Return all modes by rising frequency, then growth; one per conjugate pair, so n to 2 n modes."""
        kinds = [" ".join(word for word in name.split(" ") if not word.isdigit()) for name in self.names]
        found = []
        values, vectors = np.linalg.eig(self.state_matrix())
        for frequency, growth in evaluate(self._eigenvalues):
            nearest = int(np.argmin(np.hypot(values.real - growth, values.imag - 2 * np.pi * frequency)))
            # displacements come first; velocities differ only by a factor
            energy = dict.fromkeys(kinds, 0.0)
            for kind, mass, moved in zip(kinds, np.diag(self.mass), vectors[: len(kinds), nearest], strict=True):
                energy[kind] += float(mass * abs(moved) ** 2)
            most = max(kinds, key=lambda kind: energy[kind])
            found.append(Mode(frequency=frequency, growth=growth, coordinate=most))
        return tuple(sorted(found, key=lambda mode: (mode.frequency, mode.growth)))

    def _eigenvalues(self) -> list[tuple[float, float]]:
        """Frequency in Hz and growth in 1/s of every eigenvalue that is real or above the real axis.

        They are roots of the characteristic polynomial, whose coefficients are exact: so close modes and those that
        stand still are told apart.
        """
        mass, damping, stiffness = (_rationals(matrix) for matrix in (self.mass, self.damping, self.stiffness))
        n = len(self.names)
        turned, slowed = mass.solve(stiffness).tolist(), mass.solve(damping).tolist()
        rows = [[fmpq(0)] * n + [fmpq(int(i == j)) for j in range(n)] for i in range(n)]
        rows += [[-value for value in (*pull, *drag)] for pull, drag in zip(turned, slowed, strict=True)]
        # The library's own types leave out the multiplicities.
        roots = cast("list[tuple[acb, int]]", fmpq_mat(rows).charpoly().numer().complex_roots())
        return [
            (nearest_double(root.imag / (2 * arb.pi())), nearest_double(root.real))
            for root, count in roots
            if root.imag.is_zero() or root.imag > 0
            for _ in range(count)
        ]

    def energy(self, displacement: Array, velocity: Array) -> Array:
        """Return kinetic plus elastic energy in J, shape (m,), of motions of shape (m, n).

        It is an energy only if the stiffness matrix is symmetric.
        """
        kinetic = np.einsum("ti,ij,tj->t", velocity, self.mass, velocity)
        elastic = np.einsum("ti,ij,tj->t", displacement, self.stiffness, displacement)
        return np.asarray((kinetic + elastic) / 2)

    def respond(self, force: Array, step: float, start: tuple[Array, Array] | None = None) -> tuple[Array, Array]:
        """Return the motion under a force that is linear between its samples, exact except for rounding.

        Parameters
        ----------
        force : ndarray, shape (m, n)
            Force on each coordinate at times 0, step, 2 step, ...
        step : float
            Time step in s.
        start : pair of ndarray, shape (n,), optional
            Displacements and velocities at time 0; zero by default.

        Returns
        -------
        displacement, velocity : ndarray, shape (m, n)
        """
        n = len(self.names)
        move, hold, ramp = self.transition(step)
        push = product(force[:-1], hold.T) + product(np.diff(force, axis=0), ramp.T)
        first = np.zeros(2 * n) if start is None else np.concatenate(start)
        states = _accumulate(move, push, first)
        return states[:, :n], states[:, n:]

    def transition(self, step: float) -> tuple[Array, Array, Array]:
        """Return the factors of the state, the force and its change over a step, in the state one step later."""
        return evaluate(lambda: self._transition(step))

    def _transition(self, step: float) -> tuple[Array, Array, Array]:
        n = len(self.names)
        none, one = _balls(np.zeros((n, n))), _balls(np.eye(n))
        inputs = _blocks([[none], [_balls(self.mass).inv()]])
        # x' = A x + B u with u' = constant over a step: Van Loan's block exponential gives all three factors
        small = arb(step)
        block = _blocks(
            [
                [self._state_matrix() * small, inputs * small, _balls(np.zeros((2 * n, n)))],
                [_balls(np.zeros((n, 2 * n))), none, one],
                [_balls(np.zeros((n, 2 * n))), none, none],
            ]
        )
        exponential = _doubles(block.exp())
        move, hold, ramp = (exponential[: 2 * n, part] for part in _thirds(n))
        return move, hold, ramp


def _balls(matrix: Array) -> arb_mat:
    return arb_mat(len(matrix), matrix.shape[1], [arb(value) for value in matrix.ravel().tolist()])


def _rationals(matrix: Array) -> fmpq_mat:
    return fmpq_mat([[fmpq(*value.as_integer_ratio()) for value in row] for row in matrix.tolist()])


def _blocks(blocks: Sequence[Sequence[arb_mat]]) -> arb_mat:
    """Make one matrix of blocks."""
    lines = [[part.tolist() for part in line] for line in blocks]
    return arb_mat([list(itertools.chain(*parts)) for line in lines for parts in zip(*line, strict=True)])


def _doubles(matrix: arb_mat) -> Array:
    return np.array([[nearest_double(value) for value in row] for row in matrix.tolist()], dtype=np.float64)


def _accumulate(move: Array, push: Array, first: Array) -> Array:
    """Return the states of x[k + 1] = move x[k] + push[k] from x[0] = first, shape (m + 1, d) for push of shape (m, d).

    About sqrt(m) blocks advance in parallel from zero; then each gets the contribution of the previous block's end.
    """
    count, width = push.shape
    size = max(1, math.isqrt(count))
    blocks = max(1, -(-count // size))
    own = np.zeros((blocks, size, width))
    own.reshape(-1, width)[:count] = push
    for k in range(1, size):
        own[:, k] += product(own[:, k - 1], move.T)
    over = power(move, size)
    starts = np.zeros((blocks, width))
    starts[0] = first
    for k in range(1, blocks):
        starts[k] = product(over, starts[k - 1, :, np.newaxis])[:, 0] + own[k - 1, -1]
    for k in range(size):
        starts = product(starts, move.T)
        own[:, k] += starts
    return np.vstack([first, own.reshape(-1, width)[:count]])


def _thirds(n: int) -> tuple[slice, slice, slice]:
    return slice(0, 2 * n), slice(2 * n, 3 * n), slice(3 * n, 4 * n)


class Suspension:
    """Stiffness and damping matrices of springs and dampers between named coordinates, built element by element.

    An element with the elongation u = sum of factor * coordinate adds k u^2 / 2 to the elastic energy and c u'^2 / 2
    to the dissipation. The matrices are therefore symmetric and passive for any set of elements.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self.names = tuple(names)
        self._index = {name: k for k, name in enumerate(self.names)}
        self.stiffness: Array = np.zeros((len(self.names), len(self.names)))
        self.damping: Array = np.zeros_like(self.stiffness)

    def add(self, elongation: Mapping[str, float], stiffness: float, damping: float = 0.0, count: int = 1) -> None:
        """Add `count` equal springs in N/m and dampers in N s/m with this `elongation`."""
        for (one, a), (other, b) in itertools.product(elongation.items(), repeat=2):
            place = self._index[one], self._index[other]
            self.stiffness[place] += count * stiffness * a * b
            self.damping[place] += count * damping * a * b
