"""Second-order sections in the coordinates with the least roundoff noise, the same doubles on every machine.

The theory is in `sosmith.gen.realizations.noise`. Here the Gramians are exact rationals, and the results are correctly
rounded.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt
from flint import arb, arb_mat, fmpq, fmpq_mat

from sosmith.model.arithmetic.correct_rounding import ball, evaluate, nearest_double, sign

Array = npt.NDArray[np.float64]

_FLOOR = 1e-12  # relative to the largest eigenvalue: below it a state is nearly uncontrollable or unobservable
_EQUAL = 1e-9  # relative distance at which two eigenvalues count as one
_NOTHING = 1e-9  # relative size below which an entry of B counts as zero


def least_noise(side: int, M: Array, C: Array) -> tuple[Array, Array]:
    """Transform a section to the coordinates with the least noise.

    Parameters
    ----------
    side : int
        s, 1 or -1.
    M : array, shape (2, 2)
        ``A = s (I + M)``, stable.
    C : array, shape (2,)
        For B = (0, 1).

    Returns
    -------
    M : array, shape (2, 2)
    B : array, shape (2,)
        Powers of two that give each state a standard deviation of one half to one times that of a white input, or 0.
    """
    A = _dynamics(side, M)
    B = fmpq_mat(2, 1, [0, 1])
    output = fmpq_mat(2, 1, [_rational(value) for value in C.tolist()])
    K, W = _gramian(A, B), _gramian(A.transpose(), output)
    unit = math.sqrt(abs(M[1, 0] * M[0, 1]))
    return evaluate(lambda: _turned(M, K, W, unit))


def unit_gains(side: int, M: Array, B: Array) -> Array:
    """Powers of two that bring the states' standard deviation to one half to one times that of a white input.

    Parameters
    ----------
    side : int
        s, 1 or -1.
    M : array, shape (2, 2)
        ``A = s (I + M)``, stable.
    B : array, shape (2,)
    """
    inputs = fmpq_mat(2, 1, [_rational(value) for value in B.tolist()])
    K = _gramian(_dynamics(side, M), inputs)
    variances = [arb(K[i, i]) for i in range(2)]
    return np.array([power_of_two_below(nearest) for nearest in evaluate(lambda: _reciprocal_roots(variances))])


def power_of_two_below(value: float) -> float:
    """Largest power of two not above a positive value."""
    return math.ldexp(0.5, math.frexp(value)[1])


def _reciprocal_roots(values: Sequence[arb]) -> list[float]:
    return [nearest_double(value.rsqrt()) for value in values]


def _rational(value: float) -> fmpq:
    exact = Fraction(value)
    return fmpq(exact.numerator, exact.denominator)


def _dynamics(side: int, M: Array) -> fmpq_mat:
    return fmpq_mat(2, 2, [side * (_rational(M[i, j]) + (i == j)) for i in range(2) for j in range(2)])


def _gramian(A: fmpq_mat, B: fmpq_mat) -> fmpq_mat:
    """Solve ``K = A K A' + B B'`` for the three entries of a symmetric K."""
    (a, b), (c, d) = A.tolist()
    (p,), (q,) = B.tolist()
    system = fmpq_mat(
        3, 3, [1 - a * a, -2 * a * b, -b * b, -a * c, 1 - a * d - b * c, -b * d, -c * c, -2 * c * d, 1 - d * d]
    )
    (first,), (mixed,), (second,) = system.solve(fmpq_mat(3, 1, [p * p, p * q, q * q])).tolist()
    return fmpq_mat(2, 2, [first, mixed, mixed, second])


def _turned(M: Array, K: fmpq_mat, W: fmpq_mat, unit: float) -> tuple[Array, Array]:
    variances = arb_mat(K)
    T = _coordinates(variances, arb_mat(W))
    inverse = T.inv()
    own = inverse * variances * inverse.transpose()
    inputs, scales = [], []
    for i in range(2):
        b, deviation = inverse[i, 1], own[i, i].sqrt()  # B = (0, 1)
        size = nearest_double(abs(b) / deviation)
        inputs.append(power_of_two_below(size) if size > _NOTHING * unit else 0.0)
        scales.append(b / ball(inputs[-1]) if inputs[-1] else deviation)
    T = T * arb_mat(2, 2, [scales[0], 0, 0, scales[1]])
    turned = T.inv() * arb_mat(2, 2, [arb(value) for value in M.ravel().tolist()]) * T
    return np.array([[nearest_double(turned[i, j]) for j in range(2)] for i in range(2)]), np.array(inputs)


def _coordinates(K: arb_mat, W: arb_mat) -> arb_mat:
    """Coordinates T as in `sosmith.gen.realizations.noise.minimum_noise_coordinates`."""
    first = K[0, 0].sqrt()
    below = K[1, 0] / first
    lower = arb_mat(2, 2, [first, 0, below, (K[1, 1] - below**2).sqrt()])
    S = lower.transpose() * W * lower
    mean, half, mixed = (S[0, 0] + S[1, 1]) / 2, (S[0, 0] - S[1, 1]) / 2, S[0, 1]
    spread = (half**2 + mixed**2).nonnegative_part().sqrt()
    if sign(spread - mean * _EQUAL) > 0:
        cosine = half / spread
    else:  # any axes will do; the computed ones would depend on how the coefficients were rounded
        cosine, mixed = arb(1), arb(0)
    # the major axis of S lies at half the angle of (half, mixed)
    along = ((1 + cosine) / 2).nonnegative_part().sqrt()
    across = ((1 - cosine) / 2).nonnegative_part().sqrt() * (-1 if sign(mixed) < 0 else 1)
    major = mean + spread
    minor = (S[0, 0] * S[1, 1] - mixed**2) / major if sign(major) else arb(0)
    minor = minor.max(major * _FLOOR)
    axes = arb_mat(2, 2, [-across, along, along, across])  # minor axis first
    balance = arb_mat(2, 2, [1 / minor.root(4), 0, 0, 1 / major.root(4)])
    turn = arb_mat(2, 2, [1, -1, 1, 1]) * arb(2).rsqrt()
    return lower * axes * balance * turn
