"""Makes state-space sections: minimum-noise coordinates, or normal form for truncated states.

A section is described about z = s, with s = 1 or -1 on the side of its poles, as ``A = s (I + M)``. M is small
if the poles are near s, and the coefficients are computed without cancellation.

Every state is scaled so that its input coefficient is a power of two, chosen so that a white input gives the state a
standard deviation of one half to one times the input's. The noise gains ``K_ii W_ii`` do not depend on the scaling,
and B needs no multiplication.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from sosmith.gen.realizations.coefficients import Rounding
from sosmith.gen.realizations.direct_form import pole_side
from sosmith.gen.realizations.minimum_noise import least_noise, power_of_two_below, unit_gains
from sosmith.gen.realizations.noise import StateSystem
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.state_space import Coefficient, StateSpace

Array = npt.NDArray[np.float64]
Row = Sequence[float]

_ROUNDING = 1e-13  # relative size below which an entry of A is a rounding error of this design
_EQUAL = 2.0**-36  # relative to the squared distance from s: squared imaginary part below which a pole counts as real


@dataclass(frozen=True, eq=False)
class StateDesign:
    """A section of one or two states before its coefficients are rounded.

    Attributes
    ----------
    side : int
        s, 1 or -1.
    M : array, shape (n, n)
        ``A = s (I + M)``.
    B : array, shape (n,)
        Powers of two.
    C : array, shape (n,)
    D : float
    """

    side: int
    M: Array
    B: Array
    C: Array
    D: float

    @property
    def system(self) -> StateSystem:
        """The section as a system with A, B, C, D."""
        return StateSystem(self.side * (np.eye(len(self.B)) + self.M), self.B, self.C, self.D)


def minimum_noise(row: Row) -> StateDesign:
    """Design a section with the least roundoff noise possible with two states.

    Parameters
    ----------
    row : sequence of float
        b0, b1, b2, 1, a1, a2, stable.
    """
    return _minimum_noise(tuple(row))


def normal(row: Row) -> StateDesign:
    """Design a section that comes to rest when its states are truncated towards zero.

    Complex poles ``p`` give the normal form, A = [[re p, -im p], [im p, re p]], which shortens every state vector.
    Real poles give two first-order systems in series, which come to rest one after the other. This works for all real
    poles, whereas a diagonal A is ill-conditioned if they are nearly equal.

    Parameters
    ----------
    row : sequence of float
        b0, b1, b2, 1, a1, a2, stable.
    """
    return _normal(tuple(row))


@lru_cache(maxsize=256)
def _minimum_noise(row: tuple[float, ...]) -> StateDesign:
    if _is_first_order(row):
        return _first_order(row)
    side, big1, big2 = _about_side(row)
    step = math.sqrt(big2)
    M, B = np.array([[0.0, step], [-step, -big1]]), np.array([0.0, 1.0])
    C = _completed(row, side, M, B).C
    if not C.any():  # the zeros are at the poles: no state reaches the output, and nor does its noise
        return _normal(row)
    return _completed(row, side, *least_noise(side, M, C))


@lru_cache(maxsize=256)
def _normal(row: tuple[float, ...]) -> StateDesign:
    if _is_first_order(row):
        return _first_order(row)
    side, big1, big2 = _about_side(row)
    a1, a2 = Fraction(row[4]), Fraction(row[5])
    imaginary = float(a2 - a1 * a1 / 4)  # square of the poles' imaginary part
    if imaginary > _EQUAL * big2:
        w = math.sqrt(imaginary)
        M, B = np.array([[-big1 / 2, -w], [w, -big1 / 2]]), np.array([0.0, 1.0])
        return _completed(row, side, M, B * unit_gains(side, M, B).min())
    # Roots of d**2 + big1 d + big2, the distances of the poles from s: the larger one first, to avoid cancellation.
    far = -(big1 + 2 * math.sqrt(max(-imaginary, 0.0))) / 2
    near = big2 / far
    M, B = np.array([[near, 0.0], [1.0, far]]), np.array([1.0, 0.0])
    gains = unit_gains(side, M, B)
    M[1, 0] = gains[1] / gains[0]
    return _completed(row, side, M, B * gains[0])


def _is_first_order(row: Row) -> bool:
    return row[2] == 0 and row[5] == 0


def _first_order(row: Row) -> StateDesign:
    side = pole_side(row)
    distance = float(-1 - side * Fraction(row[4]))
    B = power_of_two_below(math.sqrt(1 - row[4] ** 2))
    C = float(Fraction(row[1]) - Fraction(row[0]) * Fraction(row[4])) / B
    return StateDesign(side, np.array([[distance]]), np.array([B]), np.array([C]), row[0])


def _about_side(row: Row) -> tuple[int, float, float]:
    """Side s, and A1, A2 of ``d**2 + A1 d + A2``, whose roots are the eigenvalues of M."""
    side = pole_side(row)
    a1, a2 = side * Fraction(row[4]), Fraction(row[5])
    return side, float(2 + a1), float(1 + a1 + a2)


def _completed(row: Row, side: int, M: Array, B: Array) -> StateDesign:
    """Find C so that the system has the section's numerator: solves ``C B = h1`` and ``C A B = h2`` exactly."""
    b0, b1, b2, _, a1, a2 = map(Fraction, row)
    first = b1 - b0 * a1
    second = b2 - b0 * a2 - a1 * first
    (m11, m12), (m21, m22) = ([Fraction(float(value)) for value in line] for line in M)
    g1, g2 = (Fraction(float(value)) for value in B)
    k1, k2 = m11 * g1 + m12 * g2, m21 * g1 + m22 * g2
    change = side * second - first  # C M B
    determinant = g1 * k2 - g2 * k1
    C = [(first * k2 - change * g2) / determinant, (change * g1 - first * k1) / determinant]
    return StateDesign(side, M, B, np.array([float(value) for value in C]), row[0])


def state_space(
    row: Row,
    *,
    name: str,
    design: Callable[[Row], StateDesign],
    truncating: bool,
    rounding: Rounding,
    x: Range,
    fracs: Mapping[str, int],
    ranges: Mapping[str, tuple[int, int]],
    wide: tuple[int, int],
) -> StateSpace:
    """Make a section.

    Parameters
    ----------
    row : sequence of float
        b0, b1, b2, 1, a1, a2.
    name : str
        Its name.
    design : callable
        `minimum_noise` or `normal`.
    truncating : bool
        Whether the states are truncated towards zero instead of being rounded.
    rounding : Rounding
        Rounds the coefficients.
    x : Range
        Fraction bits and range of the input's code.
    fracs : mapping of str to int
        Fraction bits kept of ``x1_sum``, ``x2_sum`` and ``y_sum``. If missing, a sum of integer multiples keeps all,
        and any other sum keeps as many as the input has.
    ranges : mapping of str to tuple of int
        Smallest and largest code of ``x1_next``, ``x2_next`` and ``y``.
    wide : tuple of int
        Range of a code that `ranges` does not name.

    Raises
    ------
    ShortfallError
        If the section passes nothing, or its rounded coefficients are unstable.
    """
    if not any(row[:3]):
        raise ShortfallError(f"numerator of {name} must not be zero")
    made = design(row)
    states = range(len(made.B))
    a, integer_part = _rounded_matrix(made, rounding)
    b = tuple(Coefficient(*rounding(f"b{i}", value)) for i, value in enumerate(made.B, start=1))
    c = tuple(Coefficient(*rounding(f"c{i}", value)) for i, value in enumerate(made.C, start=1))
    d = Coefficient(*rounding("d", made.D))
    x_fracs = [fracs.get(f"x{i + 1}_sum", x.frac) for i in states]
    for i in [*states, *states]:  # twice, since a state that only copies another may come before it
        if f"x{i + 1}_sum" not in fracs:
            x_fracs[i] = _exact_frac([*zip(a[i], x_fracs, strict=True), (b[i], x.frac)], x.frac)
    y_frac = fracs.get("y_sum", _exact_frac([*zip(c, x_fracs, strict=True), (d, x.frac)], x.frac))
    try:
        return StateSpace(
            name=name,
            a=a,
            integer_part=integer_part,
            b=b,
            c=c,
            d=d,
            truncating=truncating,
            u=x,
            x=tuple(Range(frac, *ranges.get(f"x{i}_next", wide)) for i, frac in enumerate(x_fracs, start=1)),
            y=Range(y_frac, *ranges.get("y", wide)),
        )
    except ValueError as error:
        raise ShortfallError(f"{name} must be stable with coefficients of {rounding.bits} bits: {error}") from None


def _exact_frac(terms: Sequence[tuple[Coefficient, int]], otherwise: int) -> int:
    """Fraction bits of the exact sum if all multiples are integers, else `otherwise`."""
    used = [(coefficient, frac) for coefficient, frac in terms if coefficient.integer]
    whole = all(coefficient.frac == 0 for coefficient, _ in used)
    return max((frac for _, frac in used), default=otherwise) if whole else otherwise


def _rounded_matrix(
    made: StateDesign, rounding: Rounding
) -> tuple[tuple[tuple[Coefficient, ...], ...], tuple[int, ...]]:
    """Rows of A with the integer part of its diagonal split off, and that integer part.

    The integer part is 0 where a diagonal entry is closer to 0 than to s.
    """
    integers = [round(1 + entry) for entry in np.diag(made.M)]
    rest = made.M + np.diag([1 - integer for integer in integers])
    rest[np.abs(rest) < _ROUNDING * np.abs(rest).max()] = 0
    rows = tuple(
        tuple(Coefficient(*rounding(f"a{i}{j}", made.side * value)) for j, value in enumerate(line, start=1))
        for i, line in enumerate(rest, start=1)
    )
    return rows, tuple(made.side * integer for integer in integers)
