"""Motion of a linear system whose wheelsets meet nonlinear contact forces: an exponential integrator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.instrument.vehicle.linear_motion import Array, LinearSystem
from sosmith.instrument.vehicle.saturated_contact import Contacts
from sosmith.model.arithmetic.matrices import product
from sosmith.model.errors import SpecificationError

TOLERANCE = 10.0
"""Change of every contact force in N, and of its moment in N m, in the last iteration of a step.

The iteration is nearly Newton's, so what is left is far less; the friction limit of a wheel is of the order of 1e4 N.
"""

MAX_ITERATIONS = 40
"""Most iterations of a step; a step usually takes one or two."""

REFRESH = 8
"""Steps for which the slopes of the contact forces are kept, if the iteration does not need them anew."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """The track under m wheelsets at n times.

    Attributes
    ----------
    pose : ndarray, shape (n, 4, m)
        Lateral position of the rails in m, their direction in rad, the rate of the position in m/s, and zero: what to
        take from the state of a wheelset for the state of its contact. The yaw rate stays absolute.
    room : ndarray, shape (n, m)
        Way in m from the middle of the rails to first contact of a flange.
    load_shift : ndarray, shape (n, m)
        Load of the left wheel less that of the right one in N, from cant and curve alone.
    load_gain : ndarray, shape (2 * coordinates, m)
        The same per displacement and velocity of each coordinate.
    """

    pose: Array
    room: Array
    load_shift: Array
    load_gain: Array

    def relative(self, states: Array) -> Array:
        """Return the states of the contacts, shape (n, 4, m), in motions of shape (n, 2 * coordinates)."""
        return np.asarray(states[:, _places(states.shape[1], self.room.shape[1])] - self.pose)

    def loads(self, states: Array, contacts: Contacts) -> Array:
        """Return the loads of left and right wheels in N, shape (n, 2, m), in motions of shape (n, 2 * coordinates)."""
        half = (product(states, self.load_gain) + self.load_shift) / 2
        return np.stack([contacts.load + half, contacts.load - half], axis=1)


def _places(states: int, wheelsets: int) -> Array:
    """Return where the four numbers of each wheelset stand in a state, shape (4, wheelsets)."""
    return np.add.outer([0, 1, states // 2, states // 2 + 1], 2 * np.arange(wheelsets))


def respond(
    system: LinearSystem,
    force: Array,
    step: float,
    contacts: Contacts,
    course: Course,
    start: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Return the motion of `system`, whose first coordinates are lateral and yaw of each wheelset in turn.

    The linear part, linear contacts included, is solved exactly, as by `LinearSystem.respond`; so is the answer to what
    the contacts exert beyond it, taken as linear between samples like every other force: the exponential trapezoidal
    rule, of second order. A step is implicit in the contact forces and solved by Newton's method with the coupling of
    each wheelset's own force and moment; so stiff creep at low speed needs no short steps. Where the contacts are
    linear, so is the motion, to rounding. No result depends on the processor.

    Parameters
    ----------
    system : LinearSystem
    force : ndarray, shape (n, coordinates)
        As for `LinearSystem.respond`.
    step : float
        Time step in s.
    contacts : Contacts
    course : Course
        Of as many samples as `force`.
    start : pair of ndarray, shape (coordinates,), optional
        Displacements and velocities at time 0; zero by default.

    Returns
    -------
    displacement, velocity : ndarray, shape (n, coordinates)

    Raises
    ------
    SpecificationError
        If the contact forces of a step are not found.
    """
    n, m = len(system.names), course.room.shape[1]
    move, hold, ramp = system.transition(step)
    push = product(force[:-1], hold.T) + product(np.diff(force, axis=0), ramp.T)
    places = _places(2 * n, m)
    own = places[:2].ravel()
    late = np.ascontiguousarray(ramp[:, own].T)
    both = np.vstack([move.T, (hold - ramp)[:, own].T])
    # what a unit of force and of moment on a wheelset moves in its own contact within a step
    ways = np.stack([late[part * m + np.arange(m), places] for part in (0, 1)])
    near = np.ascontiguousarray(late[:, places.ravel()])

    states = np.zeros((len(force), 2 * n))
    if start is not None:
        states[0] = np.concatenate(start)
    at = contacts.loaded(course.loads(states[:1], contacts)[0])
    exerted = contacts.beyond_linear(states[0][places] - course.pose[0], course.room[0], at)
    before = exerted
    known = np.concatenate([states[0], exerted.ravel()])
    inverse = _inverse(np.zeros((2, 2, m)))
    for k in range(1, len(force)):
        base = np.add.reduce(both * known[:, np.newaxis], axis=0) + push[k - 1]
        half = (np.add.reduce(course.load_gain * base[:, np.newaxis], axis=0) + course.load_shift[k]) / 2
        at = contacts.loaded(np.array([contacts.load + half, contacts.load - half]))
        still, room = base[places] - course.pose[k], course.room[k]
        guess = 2 * exerted - before
        before = exerted
        for tried in range(MAX_ITERATIONS):
            state = still + np.add.reduce(near * guess.reshape(-1, 1), axis=0).reshape(4, m)
            if tried > 1 or (tried == 0 and k % REFRESH == 1):
                found, slopes = contacts.with_slopes(state, room, at, ways)
                inverse = _inverse(slopes)
            else:
                found = contacts.beyond_linear(state, room, at)
            missing = found - guess
            change = inverse[0] * missing[0] + inverse[1] * missing[1]
            guess = guess + change
            if np.abs(change).max() < TOLERANCE:
                break
        else:
            raise SpecificationError(
                f"the sample rate must be high enough to follow the contact forces, not {1 / step:g} Hz "
                f"at {contacts.speed:g} m/s"
            )
        exerted = guess
        states[k] = base + np.add.reduce(late * exerted.reshape(-1, 1), axis=0)
        known = np.concatenate([states[k], exerted.ravel()])
    return states[:, :n], states[:, n:]


def _inverse(slopes: Array) -> Array:
    """Return the inverses of (1 - slopes), two by two for each wheelset: column, row, wheelset."""
    (a, c), (b, d) = slopes  # of force and moment along a unit of force, then of moment
    scale = (1 - a) * (1 - d) - b * c
    return np.asarray(np.array([[1 - d, c], [b, 1 - a]]) / scale)
