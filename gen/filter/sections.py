"""Second-order sections of a digital filter: pairs poles with zeros, orders, scales and rounds them to doubles.

The denominators and the positions of the zeros are correctly rounded. Gains are set with the rounded denominator: the
gain of a section at its reference frequency is then accurate to one rounding, even if the poles are so close to the
unit circle that rounding a1 or a2 alone would change the gain by much more. All choices compare correctly rounded
numbers, so that equal distances are equal on every machine.

What proofs compare the hardware with is not these doubles but the exact filter (`sosmith.gen.filter.exact_form`), which
has as many more bits as the poles' distance from the unit circle asks for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import acb, arb

from sosmith.gen.filter.transformations import DigitalFilter
from sosmith.model.arithmetic.correct_rounding import ball, nearest_double

Row = tuple[float, ...]
"""(b0, b1, b2, 1, a1, a2)."""

Quadratic = tuple[arb, arb, arb]
"""Coefficients of 1, 1/z and 1/z**2."""


@dataclass(frozen=True)
class Root:
    """A real zero or pole, or one of a conjugate pair; for a pair on the unit circle, `cosine` is its real part."""

    place: acb
    real: bool
    cosine: arb | None = None

    @property
    def key(self) -> tuple[float, float]:
        """Sort key for pairs before pairing, as in `scipy.signal.zpk2sos`."""
        return nearest_double(self.place.real), 0.0 if self.real else nearest_double(self.place.imag)


@dataclass(frozen=True)
class Section:
    """A section before rounding: polynomials in 1/z with a leading 1, or with a leading 1/z if there is a delay."""

    numerator: Quadratic
    denominator: Quadratic


def sections(filter_: DigitalFilter) -> list[Section]:
    """Pair poles with zeros; poles closest to the unit circle come last.

    If all zeros coincide, every section gets as many zeros as poles. Otherwise pairing and order are those of
    `scipy.signal.zpk2sos`: the pole closest to the unit circle is paired with the zeros nearest to it, and so on.

    Raises
    ------
    UndecidedError
        If the precision is too low for a choice.
    """
    if not filter_.zero_cosines and len(set(filter_.real_zeros)) == 1:
        return _with_equal_zeros(filter_, filter_.real_zeros[0])
    return paired(
        poles=[Root(pole, real=False) for pole in filter_.pole_pairs]
        + [Root(acb(pole), real=True) for pole in filter_.real_poles],
        zeros=[_on_circle(cosine) for cosine in filter_.zero_cosines]
        + [Root(acb(zero), real=True) for zero in filter_.real_zeros],
    )


def paired(*, poles: Sequence[Root], zeros: Sequence[Root]) -> list[Section]:
    """Pair poles with zeros as `scipy.signal.zpk2sos`; poles closest to the unit circle come last.

    Parameters
    ----------
    poles, zeros : sequence of Root
        As many zeros as poles, a conjugate pair counting as two.

    Raises
    ------
    UndecidedError
        If the precision is too low for a choice.
    """
    # an odd order gets a pole and a zero at the origin
    origin = [Root(acb(0), real=True)] if sum(pole.real for pole in poles) % 2 else []
    left, free = (
        _sorted([root for root in roots if not root.real]) + _sorted([root for root in [*roots, *origin] if root.real])
        for roots in (poles, zeros)
    )
    nearest_first = []
    while left:
        nearest_first.append(_next(left, free))
    return nearest_first[::-1]


def rounded(cascade: Sequence[Section], passing: acb, level: arb) -> tuple[Row, ...]:
    """Round sections, each scaled to unity gain at one frequency, except the first, which takes the total gain.

    Parameters
    ----------
    cascade : sequence of Section
    passing : acb
        Point on the unit circle where the gain is set.
    level : arb
        Total gain of all sections there, positive.

    Raises
    ------
    UndecidedError
        If a number does not round to one double.
    """
    rows = []
    for index, section in enumerate(cascade):
        denominator = [nearest_double(value) for value in section.denominator]
        gain = _magnitude([ball(value) for value in denominator], passing) / _magnitude(section.numerator, passing)
        if index == 0:
            gain *= level
        rows.append((*(nearest_double(gain * value) for value in section.numerator), *denominator))
    return tuple(rows)


def _magnitude(polynomial: Sequence[arb], z: acb) -> arb:
    c0, c1, c2 = polynomial
    return abs((c0 * z + c1) * z + c2)


def _on_circle(cosine: arb) -> Root:
    return Root(acb(cosine, (1 - cosine**2).sqrt()), real=False, cosine=cosine)


def _sorted(roots: list[Root]) -> list[Root]:
    return sorted(roots, key=lambda root: root.key)


def _with_equal_zeros(filter_: DigitalFilter, zero: int) -> list[Section]:
    one, zero_ball = arb(1), arb(0)
    of_real_poles = [Section((one, arb(-zero), zero_ball), (one, -pole, zero_ball)) for pole in filter_.real_poles]
    pairs = sorted((Root(pole, real=False) for pole in filter_.pole_pairs), key=lambda pole: (-_margin(pole), pole.key))
    return of_real_poles + [Section((one, arb(-2 * zero), one), _pair(pole)) for pole in pairs]


def _next(poles: list[Root], zeros: list[Root]) -> Section:
    """Take the remaining pole closest to the unit circle, its partner, and their zeros, as `scipy.signal.zpk2sos`."""
    pole = _taken(poles, min(poles, key=_margin))
    others = [other for other in poles if other.real]
    if pole.real and not others:
        return Section(_two(_nearest(zeros, pole, real=True), None), _two(pole, None))
    if not pole.real and len(poles) + 1 == len(zeros) and len(others) == 1 and sum(zero.real for zero in zeros) == 1:
        return Section(_pair(_nearest(zeros, pole, real=False)), _pair(pole))
    denominator = _two(pole, _taken(poles, min(others, key=_margin))) if pole.real else _pair(pole)
    zero = _nearest(zeros, pole)
    numerator = _two(zero, _nearest(zeros, pole, real=True)) if zero.real else _pair(zero)
    return Section(numerator, denominator)


def _margin(pole: Root) -> float:
    """``1 - |pole|**2``, a measure of its distance from the unit circle."""
    return nearest_double(1 - _square(pole.place))


def _nearest(zeros: list[Root], pole: Root, *, real: bool | None = None) -> Root:
    """Take the zero nearest to a pole, only among real or only among complex ones if `real` is given."""
    allowed = [zero for zero in zeros if real is None or zero.real == real]
    return _taken(zeros, min(allowed, key=lambda zero: nearest_double(_square(zero.place - pole.place))))


def _taken(roots: list[Root], chosen: Root) -> Root:
    return roots.pop(next(k for k, root in enumerate(roots) if root is chosen))


def _square(value: acb) -> arb:
    return value.real**2 + value.imag**2


def _pair(root: Root) -> Quadratic:
    """Polynomial of a conjugate pair."""
    if root.cosine is not None:
        return arb(1), -2 * root.cosine, arb(1)
    return arb(1), -2 * root.place.real, _square(root.place)


def _two(root: Root, other: Root | None) -> Quadratic:
    """Polynomial of one real root, or of two."""
    first, second = root.place.real, other.place.real if other is not None else arb(0)
    return arb(1), -(first + second), first * second
