"""Makes direct form I sections: chooses products, integer part and error feedback."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from itertools import product as cartesian

import numpy as np

from sosmith.gen.filter.design import decay_length
from sosmith.gen.realizations.coefficients import Rounding
from sosmith.gen.realizations.tied_row import TiedRow
from sosmith.model.arithmetic.recursive_filters import lfilter
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.direct_form import DirectForm1, Product

Row = Sequence[float]

_EQUAL = 1e-9  # relative distance below which a design's numbers count as equal


def products(
    row: Row, rounding: Rounding, name: str, side: int | None = None
) -> tuple[tuple[Product, ...], tuple[int, int]]:
    """Products and integer part of a section with rounded coefficients.

    The recursion is written about z = s, with s = 1 or -1. Its coefficients A1 and A2 are small if s is on the side
    of the poles; on either side, A2 sets the gain at z = s. A section with unity gain at z = s uses A2 in its numerator
    too, so that the gain is exactly one however A2 is rounded. Numerators (1, 2, 1) and (1, -2, 1) then need no
    product of their own.

    Parameters
    ----------
    row : sequence of float
        b0, b1, b2, 1, a1, a2.
    rounding : Rounding
        Rounds the coefficients.
    name : str
        Name of the section, for messages.
    side : int or None
        s; None selects the side with unity gain, or else that of the poles.

    Returns
    -------
    products : tuple of Product
    integer_part : tuple of int
        (m1, m2).

    Raises
    ------
    ShortfallError
        If the section passes nothing.
    """
    b0, b1, b2, _, a1, a2 = row
    if side is None:
        side = _side(row)
    if a2 == 0 and b2 == 0:
        terms, integer_part = _first_order(b0, b1, a1, side)
    else:
        terms, integer_part = _second_order(row, side)
    made = tuple(Product(label, *rounding(label, value), x, y, shift) for label, value, x, y, shift in terms if value)
    if not any(any(p.x) for p in made):
        raise ShortfallError(f"numerator of {name} must not be zero")
    return made, integer_part


_Term = tuple[str, float, tuple[int, int, int], tuple[int, int], int]


def _side(row: Row) -> int:
    """Side of the unit circle about which the section is described: with unity gain, or else with the poles."""
    gains = {s: _gain(row, s) for s in (1, -1)}
    unity = [s for s in (1, -1) if abs(gains[s] - 1) < _EQUAL]
    near = pole_side(row)
    return near if near in unity or not unity else unity[0]


def pole_side(row: Row) -> int:
    """Side of the unit circle where the poles lie: 1 or -1."""
    return -1 if row[4] > 0 else 1


def _gain(row: Row, side: int) -> float:
    b0, b1, b2, _, a1, a2 = row
    return (b0 + side * b1 + b2) / (1 + side * a1 + a2)


def _first_order(b0: float, b1: float, a1: float, side: int) -> tuple[list[_Term], tuple[int, int]]:
    pole = 1 + side * a1
    unity = abs((b0 + side * b1) - pole) < _EQUAL * abs(pole)
    integer_part = (-side, 0)
    if unity and abs(b1 - side * b0) <= _EQUAL * abs(b0):
        return [("A1", pole, (1, side, 0), (-2 * side, 0), 1)], integer_part
    recursion: _Term = ("A1", pole, (0, 0, 0), (-side, 0), 0)
    if unity:
        return [("A1", pole, (0, side, 0), (-side, 0), 0), ("b0", b0, (1, -side, 0), (0, 0), 0)], integer_part
    for ratio in (1, -1):
        if b0 and abs(b1 - ratio * b0) <= _EQUAL * abs(b0):
            return [recursion, ("b0", b0, (1, ratio, 0), (0, 0), 0)], integer_part
    return [recursion, ("b0", b0, (1, 0, 0), (0, 0), 0), ("b1", b1, (0, 1, 0), (0, 0), 0)], integer_part


def _second_order(row: Row, side: int) -> tuple[list[_Term], tuple[int, int]]:
    b0, b1, b2, _, a1, a2 = row
    big1, big2 = 2 + side * a1, 1 + side * a1 + a2
    integer_part = (-2 * side, 1)
    terms: list[_Term] = [("A1", big1, (0, 0, 0), (-side, 1), 0)]
    scale = max(abs(b0), abs(b1), abs(b2))
    symmetric = abs(b2 - b0) <= _EQUAL * scale
    if abs(_gain(row, side) - 1) < _EQUAL:
        if symmetric and abs(b1 - 2 * side * b0) <= _EQUAL * scale:
            return [*terms, ("A2", big2, (1, 2 * side, 1), (0, -4), 2)], integer_part
        terms.append(("A2", big2, (0, side, 0), (0, -1), 0))
        if symmetric:
            return [*terms, ("b0", b0, (1, -2 * side, 1), (0, 0), 0)], integer_part
        return [
            *terms,
            ("b0", b0, (1, -side, 0), (0, 0), 0),
            ("b2", b2, (0, -side, 1), (0, 0), 0),
        ], integer_part
    terms.append(("A2", big2, (0, 0, 0), (0, -1), 0))
    return [*terms, *_numerator(b0, b1, b2, scale)], integer_part


def numerator_terms(row: Row) -> list[_Term]:
    """Products of a section's numerator on its own, of whatever order, as few as its symmetry allows."""
    b0, b1, b2 = row[:3]
    for ratio in (1, -1):
        if b2 == 0 and b0 and abs(b1 - ratio * b0) <= _EQUAL * abs(b0):
            return [("b0", b0, (1, ratio, 0), (0, 0), 0)]
    return _numerator(b0, b1, b2, max(abs(b0), abs(b1), abs(b2)))


def _numerator(b0: float, b1: float, b2: float, scale: float) -> list[_Term]:
    """Products of a numerator on its own, as few as its symmetry allows."""
    for sign in (1, -1):
        if not b0 or abs(b2 - sign * b0) > _EQUAL * scale:
            continue
        for middle in (0, 1, -1, 2, -2):
            if abs(b1 - middle * b0) <= _EQUAL * scale:
                return [("b0", b0, (1, middle, sign), (0, 0), 0)]
        return [("b0", b0, (1, 0, sign), (0, 0), 0), ("b1", b1, (0, 1, 0), (0, 0), 0)]
    return [
        ("b0", b0, (1, 0, 0), (0, 0), 0),
        ("b1", b1, (0, 1, 0), (0, 0), 0),
        ("b2", b2, (0, 0, 1), (0, 0), 0),
    ]


def direct_form(
    row: Row,
    *,
    name: str,
    feedback_order: int,
    rounding: Rounding,
    x: Range,
    fracs: Mapping[str, int],
    ranges: Mapping[str, tuple[int, int]],
    wide: tuple[int, int],
) -> DirectForm1:
    """Make a section.

    Parameters
    ----------
    row : sequence of float
        b0, b1, b2, 1, a1, a2.
    name : str
        Its name.
    feedback_order : int
        0, 1 or 2.
    rounding : Rounding
        Rounds the coefficients.
    x : Range
        Fraction bits and range of the input's code.
    fracs : mapping of str to int
        Fraction bits kept by the quantizers of v, and of ``taps_A1``, ``product_A1``, ``product_A1_sums`` and the like.
        If missing, v keeps as many as x has, and the others keep all.
    ranges : mapping of str to tuple of int
        Smallest and largest code of v and of ``taps_A1`` and the like.
    wide : tuple of int
        Range of a code that `ranges` does not name.

    Raises
    ------
    ShortfallError
        If the section passes nothing, or its rounded coefficients are unstable.
    """
    made, integer_part = products(row, rounding, name)
    floored = [replace(p, floored=fracs.get(p.label), sums=fracs.get(p.sums_label)) for p in made]
    fitted = tuple(
        replace(p, kept=fracs.get(p.operand), range=ranges.get(p.operand, wide)) if p.is_sum else p for p in floored
    )
    try:
        section = DirectForm1(
            name=name,
            products=fitted,
            integer_part=integer_part,
            feedback=(0, 0),
            x=x,
            y_frac=fracs.get("v", x.frac),
            v_range=ranges.get("v", wide),
        )
    except ValueError as error:
        raise ShortfallError(f"{name} must be stable with coefficients of {rounding.bits} bits: {error}") from None
    tied = row.feedback if isinstance(row, TiedRow) else None
    feedback = tied or best_feedback(section.denominator, integer_part, feedback_order)
    # Where sections take turns, states are there before the input is: what is added up of them alone delays nothing.
    return replace(section, feedback=feedback, adds_early=not isinstance(row, TiedRow))


def best_feedback(denominator: tuple[Fraction, Fraction], integer_part: tuple[int, int], order: int) -> tuple[int, int]:
    """Multiplier-free error feedback (k1, k2) of a given order with the smallest peak gain to the section's output.

    Double precision is sufficient for this choice. Among equal gains the integer part is preferred, because one
    register then holds both state and error.
    """
    gains = _feedback_gains(denominator, order)
    return min(gains, key=lambda k: (gains[k], k != integer_part))


def common_feedback(rows: Sequence[Row], order: int) -> tuple[int, int]:
    """Return the error feedback of at most a given order that is best for several sections together."""
    each = [_feedback_gains((Fraction(row[4]), Fraction(row[5])), order) for row in rows]
    side = pole_side(rows[0])
    integer_part = (-2 * side, 1) if rows[0][5] else (-side, 0)
    possible = [k for k in each[0] if all(k in gains for gains in each)]
    return min(possible, key=lambda k: (sum(gains[k] for gains in each), k != integer_part))


@lru_cache(maxsize=1024)
def _feedback_gains(denominator: tuple[Fraction, Fraction], order: int) -> dict[tuple[int, int], float]:
    """Return the peak gain to the section's output of each error feedback of a given order, without multipliers."""
    if order == 0:
        return {(0, 0): 1.0}
    second = order == 2 and denominator[1] != 0
    first_choices, second_choices = (range(-2, 3), range(-1, 2)) if second else (range(-1, 2), range(1))
    a = [1.0, float(denominator[0]), float(denominator[1])]
    impulse = np.zeros(decay_length(np.array([[1.0, 0.0, 0.0, *a]])))
    impulse[0] = 1.0
    plain = lfilter([1.0], a, impulse)

    def gain(k: tuple[int, int]) -> float:
        shaped = np.array(plain)
        for delay, weight in enumerate(k, start=1):
            shaped[delay:] += weight * plain[:-delay]
        return round(float(np.abs(shaped).sum()), 6)

    return {k: gain(k) for k in cartesian(first_choices, second_choices)}
