"""Coefficients with few signed digits, whose filter keeps to a mask: `filter.freedom = "mask"`.

Where edges and losses are what is asked for, the filter of a family is one of many that keep to them. Multiplications
by constants are made of adders, one for each signed digit of a coefficient but the first, so that the filter with the
fewest digits is the cheapest one, and its coefficients are exact. It is searched near the family's filter: poles, zeros
and gain of the sections are units with some hundreds of values each; the pair of values of two units with the fewest
digits inside the mask is taken, and the next two units follow, until no pair improves.

Gains are computed on a grid of frequencies with sums, products and quotients of doubles alone, so that every machine
chooses the same. What is found is proven at all frequencies by `sosmith.gen.filter.gain_limits`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from flint import arb, fmpq, fmpq_poly

from sosmith.gen.filter.gain_limits import keeps_to
from sosmith.gen.filter.loss_mask import LossMask
from sosmith.model.arithmetic.correct_rounding import ball, evaluate, nearest_double
from sosmith.model.errors import ShortfallError

Array = npt.NDArray[np.float64]
ExactRow = tuple[Fraction, ...]
"""(b0, b1, b2, 1, a1, a2)."""

_SPARES = (*range(7), *range(8, 20, 2))
"""Bits by which the finest grid is finer than the coarsest one, in the order in which they are tried."""

_ENOUGH = 3
"""Grids with a filter inside the mask, after which no finer one is tried."""

_WINDOW, _LINE = 64, 4096
"""Most steps to both sides, of two coefficients and of one: with them, only the neighbourhood of fine grids is seen."""

_CHEAPEST, _NEAREST = 400, 100
"""Values of a unit that are tried: those with the fewest digits, and those nearest to the family's."""

_SPREAD = 0.4
"""How far poles and zeros are moved, as a share of how far they are from the ends of where they can be."""

_DIGIT = 16
"""What a digit costs in fraction bits of a coefficient: an adder is about as wide as a word."""

_LEVEL_BITS = 6
"""Fraction bits of the gain of the whole filter, where it is not 1."""

_POINTS = (48, 192, 768)
"""Frequencies in a band; the next number where a gain between them was found to be too high or too low."""

_ALL_BUT_ZERO = 1e-300
"""What counts as the square of a gain of 0."""

_TOLERANCE = 1e-9
"""Share by which a gain on the grid may exceed its limit: it may be the limit itself."""


class Nominal(NamedTuple):
    """A section of the family's filter: numerator and denominator in 1/z, both beginning with 1."""

    over: tuple[float, ...]
    under: tuple[float, ...]


@dataclass(frozen=True)
class _Limits:
    """Frequencies f as ``sin(pi f)**2``, those in pass bands first, and limits of squared gains there.

    Attributes
    ----------
    places : array
        Shape (n,).
    passing : int
        How many of them are in pass bands, where squares are from `least` to 1.
    least, most : float
        Limits in pass bands and in stop bands.
    """

    places: Array
    passing: int
    least: float
    most: float

    def excess(self, squares: Array) -> Array:
        """Return by which factor squares of gains, shape (k, n), exceed their limits where they do most."""
        inside, outside = squares[:, : self.passing], squares[:, self.passing :]
        lowest = np.maximum(inside.min(axis=-1), _ALL_BUT_ZERO)
        largest = np.maximum(inside.max(axis=-1), outside.max(axis=-1) / self.most)
        exceeded: Array = np.maximum(largest, self.least / lowest)
        return exceeded


Whole = npt.NDArray[np.int64]


@dataclass(frozen=True)
class _Unit:
    """Values of one unit, the cheapest first.

    Attributes
    ----------
    costs : array
        Shape (values,).
    taps : list of tuple of Fraction
        The coefficients of each value.
    squares : array
        Squares of its gains, shape (values, frequencies).
    near : array
        Shape (values,): whether a value is one of those nearest to the family's.
    nearest : int
        The value nearest to it.
    """

    costs: Whole
    taps: list[tuple[Fraction, ...]]
    squares: Array
    near: npt.NDArray[np.bool_]
    nearest: int


@lru_cache(maxsize=32)
def short_rows(cascade: tuple[Nominal, ...], mask: LossMask, at: int | None) -> tuple[ExactRow, ...]:
    """Search sections with few digits near those of a family, whose gains are proven to keep to a mask.

    Parameters
    ----------
    cascade : tuple of Nominal
        The family's filter.
    mask : LossMask
        What gains must keep to.
    at : int or None
        1 or -1: the z at which the gain is to be exactly 1, as far as zeros at 1 and -1 allow for it; None if the mask
        is all that is asked of it.

    Raises
    ------
    ShortfallError
        If no filter that keeps to the mask is found.
    """
    if at is not None and not all(_is_power_of_two(_value_at(section.over, at)) for section in cascade):
        at = None
    for points in _POINTS:
        limits = evaluate(partial(_limits, mask, points))
        found: list[tuple[int, tuple[ExactRow, ...]]] = []
        for spare in _SPARES:
            best = _Search(cascade, limits, at, spare).best()
            found += [] if best is None else [best]
            if len(found) == _ENOUGH:
                break
        for _, rows in sorted(found):
            if keeps_to(_multiplied([row[:3] for row in rows]), mask, _multiplied([row[3:] for row in rows])):
                return rows
        if not found:  # nor will there be one on more frequencies
            break
    raise ShortfallError(
        "filter.freedom must be left out for these edges and losses: no filter with short coefficients was found that "
        "keeps to them"
    )


def digits(value: Fraction | int) -> int:
    """Count the nonzero digits of a dyadic number in the canonical signed form, the fewest of any.

    >>> [digits(Fraction(each, 8)) for each in (0, 1, 7, 11)]
    [0, 1, 2, 3]
    """
    whole = abs(value.numerator)
    # The bits in which 3 n and n differ are where the canonical form of n has digits (Reitwieser 1960).
    return (3 * whole ^ whole).bit_count()


class _Search:
    """The search with one finest grid.

    Its units are the poles of each section, the zeros of those that have some elsewhere than at 1 and -1, and the gain
    of the whole filter, which has one value only where it is exactly 1 at one frequency.
    """

    def __init__(self, cascade: Sequence[Nominal], limits: _Limits, at: int | None, spare: int) -> None:
        self._cascade = cascade
        self._limits = limits
        self._at = at
        self._scales, level = _scales(cascade, limits.places)
        # Zeros at the same places stay there together.
        moving = sorted({over[1] for over, _ in cascade if not over[1].is_integer()})
        self._places = {middle: len(cascade) + k for k, middle in enumerate(moving)}
        self._fixed = np.ones_like(limits.places)
        for over, _ in cascade:
            if over[1] not in self._places:
                self._fixed = self._fixed * _square(over, limits.places)
        middles = [over[1] for over, _ in cascade]
        zeros = [_zeros(middle, middles.count(middle), limits.places, spare) for middle in moving]
        self._units = [*(self._poles(k, spare) for k in range(len(cascade))), *zeros, self._levels(level, spare)]

    def best(self) -> tuple[int, tuple[ExactRow, ...]] | None:
        """Return the cheapest filter that is found, with its cost; None if none keeps to the mask."""
        if not all(unit.taps for unit in self._units):
            return None
        chosen = [unit.nearest for unit in self._units]
        excess = math.inf
        pairs = list(combinations(range(len(chosen)), 2))
        at, unchanged = 0, 0
        while unchanged < len(pairs):
            better = self._better(chosen, pairs[at], excess)
            if better is not None:
                excess = better
            unchanged = unchanged + 1 if better is None else 0
            at = (at + 1) % len(pairs)
        if excess > 1 + _TOLERANCE:
            return None
        costs = [int(unit.costs[k]) for unit, k in zip(self._units, chosen, strict=True)]
        return sum(costs), self._rows([unit.taps[k] for unit, k in zip(self._units, chosen, strict=True)])

    def _better(self, chosen: list[int], pair: tuple[int, int], excess: float) -> float | None:
        """Choose other values of two units if that brings the gains nearer to the mask, or costs less inside it.

        Returns by which factor gains then exceed their limits at most; None if nothing is better.
        """
        i, j = pair
        first, second = self._units[i], self._units[j]
        rest = self._fixed
        for k, unit in enumerate(self._units):
            if k not in pair:
                rest = rest * unit.squares[chosen[k]]
        inside = excess <= 1 + _TOLERANCE
        cost = int(first.costs[chosen[i]] + second.costs[chosen[j]])
        found = None
        for index, squares in enumerate(first.squares):
            # Inside the mask, only what costs less is of interest, and values are in the order of their costs.
            end = int(np.searchsorted(second.costs, cost - first.costs[index]))
            if inside and end == 0:
                break
            if not inside and not first.near[index]:
                continue
            others = second.squares[:end] if inside else second.squares[second.near]
            exceeded = self._limits.excess(rest * squares * others)
            best = int(np.argmax(exceeded <= 1 + _TOLERANCE)) if inside else int(exceeded.argmin())
            if exceeded[best] <= (1 + _TOLERANCE if inside else excess * (1 - _TOLERANCE)):
                excess = float(exceeded[best])
                found = index, best if inside else int(np.flatnonzero(second.near)[best])
                if inside:
                    cost = int(first.costs[index] + second.costs[best])
        if found is None:
            return None
        chosen[i], chosen[j] = found
        return excess

    def _rows(self, taps: Sequence[tuple[Fraction, ...]]) -> tuple[ExactRow, ...]:
        """Return the sections with coefficients of each unit."""
        # The gain of the whole filter goes to a section in which it makes the fewest digits longer.
        leveled = next((k for k, (over, _) in enumerate(self._cascade) if over[1] not in self._places), 0)
        rows = []
        for k, (over, _) in enumerate(self._cascade):
            a1, a2 = taps[k]
            b0 = self._first(k, a1, a2) * (taps[-1][0] if k == leveled else 1)
            middle = taps[self._places[over[1]]][0] if over[1] in self._places else Fraction(over[1])
            rows.append((b0, b0 * middle, b0 * Fraction(over[2]), Fraction(1), a1, a2))
        return tuple(rows)

    def _first(self, k: int, a1: Fraction, a2: Fraction) -> Fraction:
        """Return b0 of a section, without the gain of the whole filter."""
        if self._at is None:
            return self._scales[k]
        return (1 + self._at * a1 + a2) / Fraction(_value_at(self._cascade[k].over, self._at))

    def _poles(self, k: int, spare: int) -> _Unit:
        under = self._cascade[k].under
        taps, frac = _near_poles(under, spare)
        costs = _costs(taps, frac)
        if self._at is not None:  # b0 has the digits of the denominator at this z, as all else is a power of two
            costs += _DIGIT * _digits((1 << frac) + self._at * taps[0] + taps[1])
        costs, taps = _worth_trying(costs, taps, np.array(under[1:]) * 2.0**frac)

        def square(a1: Fraction, a2: Fraction) -> Array:
            return float(self._first(k, a1, a2)) ** 2 / _square((1.0, float(a1), float(a2)), self._limits.places)

        return _unit(costs, taps, frac, square, under[1:])

    def _levels(self, nominal: float, spare: int) -> _Unit:
        frac = _LEVEL_BITS + spare if self._at is None else 0
        taps = np.array([_around(nominal, nominal / 2, frac, _LINE) if self._at is None else [1]])
        costs, taps = _worth_trying(_costs(taps, frac), taps, np.array([nominal]) * 2.0**frac)
        shape = self._limits.places.shape
        return _unit(costs, taps, frac, lambda level: np.full(shape, float(level) ** 2), (nominal,))


def _zeros(middle: float, count: int, places: Array, spare: int) -> _Unit:
    """Return values of the middle coefficient, between -2 and 2, of zeros on the unit circle in `count` sections."""
    reach = _SPREAD * (2 - abs(middle))
    frac = _bits_for(reach, spare)
    taps = np.array([_around(middle, reach, frac, _LINE)])
    costs, taps = _worth_trying(count * _costs(taps, frac), taps, np.array([middle]) * 2.0**frac)
    return _unit(costs, taps, frac, lambda c: _square((1.0, float(c), 1.0), places) ** count, (middle,))


def _unit(costs: Whole, counts: Whole, frac: int, square: Callable[..., Array], nominal: tuple[float, ...]) -> _Unit:
    """Return a unit of values with `frac` fraction bits, shape (coefficients, values), in the order of their costs."""
    taps = [tuple(Fraction(int(count), 1 << frac) for count in value) for value in counts.T]
    apart = np.abs(counts / 2.0**frac - np.array(nominal)[:, None]).max(axis=0, initial=0.0)
    near = np.isin(np.arange(len(apart)), np.argsort(apart, kind="stable")[:_NEAREST])
    return _Unit(costs, taps, np.array([square(*value) for value in taps]), near, int(apart.argmin()) if taps else 0)


def _near_poles(under: tuple[float, ...], spare: int) -> tuple[Whole, int]:
    """Return denominators of stable sections near one, and their fraction bits.

    Poles are moved by a share of what damps them, along the radius and across it, in ``2**spare`` steps or more.
    """
    _, a1, a2 = under
    if a2 == 0:
        reach = _SPREAD * (1 - abs(a1))
        frac = _bits_for(reach, spare)
        firsts = _around(a1, reach, frac, _LINE)
        return np.array([firsts, np.zeros_like(firsts)])[:, np.abs(firsts) < 1 << frac], frac
    damping = _SPREAD * (1 - a2)
    across = damping * (math.sqrt(max(0.0, 4 * a2 - a1 * a1)) + damping) / 2
    coarse, frac = _bits_for(damping, spare), _bits_for(across, spare)
    frac = max(coarse, frac)
    pairs = [np.zeros((2, 0), dtype=np.int64)]
    for second in _around(a2, damping, coarse, _WINDOW):
        # With the same angle, a1 is in proportion to the radius.
        radius = math.sqrt(max(second / 2**coarse, 0.0) / a2) if a2 > 0 else 1.0
        firsts = _around(a1 * radius, across, frac, _WINDOW)
        pairs.append(np.array([firsts, np.full_like(firsts, second << (frac - coarse))]))
    taps = np.concatenate(pairs, axis=1)
    one = 1 << frac
    return taps[:, (taps[1] < one) & (np.abs(taps[0]) < one + taps[1])], frac


def _bits_for(reach: float, spare: int) -> int:
    """Return the fraction bits with which an interval has ``2**spare`` steps or more to both sides."""
    return max(2, math.ceil(-math.log2(reach)) + spare)


def _around(middle: float, reach: float, frac: int, most: int) -> Whole:
    """Return multiples of a step in an interval, as their numbers of steps, at most so many to both sides."""
    reach = min(reach, most * 2.0**-frac)
    return np.arange(math.ceil((middle - reach) * 2**frac), math.floor((middle + reach) * 2**frac) + 1, dtype=np.int64)


def _costs(counts: Whole, frac: int) -> Whole:
    """Return what values cost, of coefficients with `frac` fraction bits, shape (coefficients, values)."""
    lowest = np.bitwise_or.reduce(counts, axis=0)
    spare = np.bitwise_count((lowest & -lowest) - 1).astype(np.int64)  # trailing zeros that all coefficients have
    return np.asarray(_DIGIT * _digits(counts).sum(axis=0) + np.maximum(0, frac - spare), dtype=np.int64)


def _digits(counts: Whole) -> Whole:
    """Count nonzero digits as `digits` does, of each of some whole numbers."""
    wholes = np.abs(counts)
    return np.bitwise_count(3 * wholes ^ wholes).astype(np.int64)


def _worth_trying(costs: Whole, counts: Whole, nominal: Array) -> tuple[Whole, Whole]:
    """Return the cheapest values and those nearest to the family's, in the order of their costs."""
    apart = np.abs(counts - nominal[:, None]).max(axis=0, initial=0.0)
    order = np.lexsort((*counts, apart, costs))
    near = np.lexsort((*counts, costs, apart))[:_NEAREST]
    kept = order[np.isin(order, near) | (np.arange(len(order)) < _CHEAPEST)]
    return costs[kept], counts[:, kept]


def _scales(cascade: Sequence[Nominal], places: Array) -> tuple[list[Fraction], float]:
    """Return the powers of two that keep the largest gain of a cascade so far nearest to 1, and what is left of it."""
    scales, so_far = [], np.ones_like(places)
    for over, under in cascade:
        so_far = so_far * _square(over, places) / _square(under, places)
        scales.append(Fraction(2) ** round(-math.log2(float(so_far.max())) / 2))
        so_far = so_far * float(scales[-1]) ** 2
    return scales, 1 / math.sqrt(float(so_far.max()))


def _limits(mask: LossMask, points: int) -> _Limits:
    """Return limits on a grid of frequencies that is denser towards the ends of each band."""
    least, most = (nearest_double(arb(10) ** (-ball(loss) / 10)) for loss in (mask.passband_loss, mask.stopband_loss))
    places = [
        nearest_double((ball(start) + ball(end - start) * (1 - arb.cos_pi_fmpq(fmpq(k, points))) / 2).sin_pi() ** 2)
        for start, end in (*mask.passbands, *mask.stopbands)
        for k in range(points + 1)
    ]
    return _Limits(np.array(places), (points + 1) * len(mask.passbands), least, most)


def _square(taps: Sequence[float], places: Array) -> Array:
    """Return the squared magnitude of ``t0 + t1/z + t2/z**2`` where ``sin(w / 2)**2`` is `places`."""
    t0, t1, t2 = taps
    bend = t1 * (t0 + t2) + 4 * t0 * t2  # nearly 0 with poles next to z = 1, and exact with coefficients as short
    return (t0 + t1 + t2) ** 2 - 4 * bend * places + 16 * t0 * t2 * places**2


def _value_at(taps: Sequence[float], z: int) -> float:
    return taps[0] + z * taps[1] + taps[2]


def _is_power_of_two(value: float) -> bool:
    return value != 0 and math.frexp(abs(value))[0] == 0.5


def _multiplied(factors: Sequence[Sequence[Fraction]]) -> list[Fraction]:
    total = fmpq_poly([1])
    for taps in factors:
        total *= fmpq_poly([fmpq(tap.numerator, tap.denominator) for tap in taps])
    return [Fraction(int(tap.p), int(tap.q)) for tap in total.coeffs()]
