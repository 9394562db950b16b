"""Sums over the responses of one denominator: their norms, their distance from those of another, and their limits.

A response is driven by something of which a range is known. The limits of a sum of such responses hold at every sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property
from itertools import accumulate, zip_longest
from math import gcd, lcm

from flint import fmpq, fmpq_poly

from sosmith.verify.bounds.l1_response import BITS, Inverse, UndecidedError, fraction, inverse, response
from sosmith.verify.bounds.piecewise import Pieces

_SHORT = 1 << 10
"""Samples of an inverse that is faster than pieces."""

_NEGLIGIBLE = Fraction(1, 1 << 64)
"""Share of a limit that may be added to it instead of summing up to every sample."""

Driven = tuple[fmpq_poly, Fraction, Fraction]
"""Numerator of a response, and the range of what drives it."""


class Denominator:
    """Sums over responses with one denominator, each computed when it is needed first, in pieces as another's.

    A response over a polynomial in ``w**step`` is `step` responses that take turns, each over that polynomial in w: its
    norm is the sum of theirs.
    """

    def __init__(self, polynomial: fmpq_poly, like: Denominator | None = None) -> None:
        self.polynomial = polynomial
        self.step = gcd(*(k for k, value in enumerate(polynomial.coeffs()) if value)) or 1
        self._like = like

    @cached_property
    def _short(self) -> Inverse | None:
        """Approximate inverse, if it is short."""
        try:
            return inverse(self.polynomial, _SHORT)
        except UndecidedError:
            return None

    @cached_property
    def pieces(self) -> Pieces | None:
        """Responses in pieces, if they are long."""
        if self.step > 1 or self._short is not None:
            return None
        return Pieces(self.polynomial, None if self._like is None else self._like.pieces)

    @cached_property
    def inverse(self) -> Inverse:
        """Approximate inverse, however long."""
        return inverse(self.polynomial) if self._short is None else self._short

    def norm(self, numerator: fmpq_poly, *, rough: bool = False) -> Fraction:
        """Upper bound of the sum of magnitudes, exact without poles; if `rough`, it need not be close."""
        if not self.polynomial.degree():
            return sum((abs(fraction(tap / self.polynomial[0])) for tap in numerator.coeffs()), Fraction(0))
        if self.step > 1:
            parts = (fmpq_poly(numerator.coeffs()[k :: self.step]) for k in range(self.step))
            return sum((self.phase.norm(part, rough=rough) for part in parts if part), Fraction(0))
        if self.pieces is None:
            return response(numerator, self.inverse).gain
        return self.pieces.norm(numerator, rough=rough)

    @cached_property
    def phase(self) -> Denominator:
        """The polynomial in w, if this is one in ``w**step``."""
        return Denominator(fmpq_poly(self.polynomial.coeffs()[:: self.step]))

    def total(self, numerator: fmpq_poly) -> Fraction:
        """Sum of all samples, exact."""
        return fraction(numerator(1) / self.polynomial(1))


def rational(value: Fraction) -> fmpq:
    return fmpq(value.numerator, value.denominator)


def magnitude(over: Denominator, driven: Sequence[Driven]) -> Fraction:
    low, high = extremes(over, driven)
    return max(-low, high)


def deviation(
    over: Denominator,
    numerator: fmpq_poly,
    ideal: Denominator,
    exact: fmpq_poly,
    windows: Sequence[tuple[Fraction, Fraction]],
) -> Fraction:
    """Largest magnitude of one response minus that of the ideal filter, both driven by the same, within any window."""
    if over.step > 1:
        # Over a denominator in the same power of w, the ideal filter's responses take turns as well.
        factor, scattered = _scattered(ideal.polynomial, over.step)
        ideal, exact = Denominator(scattered), exact * factor
    difference = numerator * ideal.polynomial - exact * over.polynomial
    size = None
    if difference and over.pieces is not None and ideal.pieces is not None:
        size = over.pieces.distance(numerator, ideal.pieces, exact)
    if size is None or any(low > 0 or high < 0 for low, high in windows):
        both = Denominator(over.polynomial * ideal.polynomial)
        return max(magnitude(both, [(difference, *window)]) for window in windows)
    gain = abs(over.total(numerator) - ideal.total(exact))
    return max(abs(low + high) / 2 * gain + (high - low) / 2 * size for low, high in windows)


def _scattered(polynomial: fmpq_poly, step: int) -> tuple[fmpq_poly, fmpq_poly]:
    """Return a factor with which a polynomial becomes one in ``w**step``, and that; `step` is a power of two."""
    if step == 1:
        return fmpq_poly([1]), polynomial
    mirrored = polynomial(fmpq_poly([0, -1]))
    even = fmpq_poly((polynomial * mirrored).coeffs()[::2])  # in w**2
    factor, scattered = _scattered(even, step // 2)
    square = fmpq_poly([0, 0, 1])
    return mirrored * factor(square), scattered(square)


def extremes(over: Denominator, driven: Sequence[Driven], *, rough: bool = False) -> tuple[Fraction, Fraction]:
    """Limits, over all times n, of the sum over all drives of ``sum over k <= n of h_k u(n - k)``.

    If every range contains zero, each term with the worst u is on one side of it, and the limits are those of the whole
    sums: with ``u = c + v`` and ``|v| <= r``, c times the sum of all samples, and r times the sum of magnitudes. If one
    does not, sums up to some n may be beyond these, by what `_overshoot` bounds. If that is not next to nothing, they
    are followed from sample to sample, unless limits may be `rough`.
    """
    summed = _summed_up(driven)
    centre = reach = Fraction(0)
    for numerator, low, high in summed:
        centre += (low + high) / 2 * over.total(numerator)
        reach += (high - low) / 2 * over.norm(numerator, rough=rough)
    apart = [(numerator, low, high) for numerator, low, high in summed if low > 0 or high < 0]
    if not apart:
        return centre - reach, centre + reach
    if rough and over.step > 1:
        # No sum of all phases up to some n is beyond the sum of their own limits, and of 0 for one still to come.
        limits = [extremes(over.phase, phase, rough=True) for phase in _phases(driven, over.step)]
        none = Fraction(0)
        by_phase = [
            sum((min(none, low) for low, _ in limits), none),
            sum((max(none, high) for _, high in limits), none),
        ]
        # Nor is it beyond the limits of the whole sums by more than all that is still to come of the constants.
        coming = _still_to_come(over, apart)
        odd = int(coming.denom()) // (int(coming.denom()) & -int(coming.denom()))  # a norm is of binary fractions
        beyond = over.norm(coming * odd, rough=True) / odd
        return max(by_phase[0], centre - reach - beyond), min(by_phase[1], centre + reach + beyond)
    more = _overshoot(over, apart, summed)
    if more is None or (max(more) > reach * _NEGLIGIBLE and not rough):
        return _running_extremes(over, summed)
    above, below = more
    return centre - reach - below, centre + reach + above


def _phases(driven: Sequence[Driven], step: int) -> list[list[Driven]]:
    """Numerators of the polyphase components over a denominator in ``w**step``, with the same drives."""
    return [[(fmpq_poly(over.coeffs()[k::step]), low, high) for over, low, high in driven] for k in range(step)]


def _overshoot(
    over: Denominator, apart: Sequence[Driven], driven: Sequence[Driven]
) -> tuple[Fraction, Fraction] | None:
    """Bounds on how far sums up to some n leave the upper and lower limit of whole sums; None if responses are short.

    Each of the drives `apart`, whose ranges do not contain zero, is a constant, its end next to zero, and a drive from
    there on, whose range does. What is still to come after n, with the worst u, is negative at most by the magnitude of
    what is to come of the constants. Of all the others no term is negative, and those of the largest one are taken as
    they are.
    """
    if over.pieces is None:
        return None
    others = [one for one in driven if one[1] <= 0 <= one[2]]
    for numerator, low, high in apart:
        others.append((numerator, low - _constant(low, high), high - _constant(low, high)))
    largest = max(others, key=lambda one: (one[2] - one[1]) * over.norm(one[0], rough=True))
    return over.pieces.excess(_still_to_come(over, apart), *largest)


def _constant(low: Fraction, high: Fraction) -> Fraction:
    """Return the end of a range without zero that is next to it."""
    return low if low > 0 else high


def _still_to_come(over: Denominator, apart: Sequence[Driven]) -> fmpq_poly:
    """Numerator of what is still to come, behind each sample, of the constants in ranges that do not contain zero."""
    steady = fmpq_poly([0])
    for numerator, low, high in apart:
        steady += numerator * rational(_constant(low, high))
    whole = over.polynomial * (steady(1) / over.polynomial(1))
    return (whole - steady) / fmpq_poly([1, -1])


def _summed_up(driven: Sequence[Driven]) -> list[Driven]:
    """Replace drives with equal numerators, but for a factor, by one with the sum of their ranges."""
    ranges: dict[tuple[str, ...], Driven] = {}
    for numerator, *ends in driven:
        if numerator and any(ends):
            leading = numerator.leading_coefficient()
            key = tuple(map(str, (numerator / leading).coeffs()))
            first, *before = ranges.get(key, (numerator, Fraction(0), Fraction(0)))
            low, high = sorted(fraction(leading / first.leading_coefficient()) * end for end in ends)
            ranges[key] = first, before[0] + low, before[1] + high
    return list(ranges.values())


def _running_extremes(over: Denominator, driven: Sequence[Driven]) -> tuple[Fraction, Fraction]:
    """Limits as above, from the sums up to every sample."""
    scale = lcm(*(end.denominator for _, *ends in driven for end in ends))
    tops: list[int] = []
    bottoms: list[int] = []
    slack = Fraction(0)
    for numerator, *ends in driven:
        low, high = (int(end * scale) for end in ends)
        if low or high:
            reached = response(numerator, over.inverse)
            up, down = (low, high), (high, low)
            tops = _added(tops, [value * up[value > 0] for value in reached.samples])
            bottoms = _added(bottoms, [value * down[value > 0] for value in reached.samples])
            slack += max(map(abs, ends)) * reached.error
    unit = Fraction(1, scale << BITS)
    return min(accumulate(bottoms), default=0) * unit - slack, max(accumulate(tops), default=0) * unit + slack


def _added(a: list[int], b: list[int]) -> list[int]:
    return [x + y for x, y in zip_longest(a, b, fillvalue=0)]
