"""FIR filters inside a mask whose taps have few signed digits: `filter.freedom = "mask"`.

A multiplication by a constant takes an adder for each signed digit of the constant but the first, and taps that are
equal but for their sign and a power of two share theirs; each tap that is not 0 takes one adder more. So the filter
with few digits and few taps is the cheapest one, and its taps are exact. It is searched near the family's filters of
the fewest taps and of some more: these are scaled to several levels within the limits of the pass band and rounded to
several grids. Then taps are moved by units of the grid, alone and two at once (Samueli 1989): first into the mask, and
then inside it, as long as that costs less.

Gains are whole numbers at a number of frequencies, so that every machine chooses the same. What is found is proven at
all frequencies by `sosmith.gen.filter.gain_limits`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from functools import lru_cache, reduce
from operator import or_
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from flint import arb, fmpq

from sosmith.gen.filter.fir_design import designed_taps, ripples, taps_of_length
from sosmith.gen.filter.gain_limits import keeps_to
from sosmith.gen.filter.loss_mask import LossMask
from sosmith.model.arithmetic.correct_rounding import ball, evaluate
from sosmith.model.errors import ShortfallError

Array = npt.NDArray[np.float64]
Whole = npt.NDArray[np.int64]

_MORE = 5
"""Numbers of taps that are tried, from the fewest on."""

_FINER = 9
"""Grids that are tried, each with half the unit of the one before; the first unit is the narrowest limit."""

_ENOUGH = 2
"""Grids with a filter inside the mask, after which no finer one is tried."""

_LEVELS = 5
"""Levels of the pass band between its limits."""

_COSINE_BITS = 24
"""Fraction bits of cosines."""

_SUM_BITS = 20
"""Bits of what exceeds a limit, in sums of squares."""

_ADDER, _BIT = 16, 1
"""What an adder costs, and a fraction bit of a tap that is not 0: words have some 16 bits and those."""

_MOVES = tuple(d for r in range(1, 13) for d in (r, -r))
"""Units by which a tap is moved to cost less, the smallest moves first."""

_BESIDE = tuple((d,) for d in _MOVES[:6])
"""Units by which another one is moved with it."""

_PAIRS = 700
"""About how many pairs of taps are moved at once; of more, only those next to each other."""

_POINTS = (6, 24)
"""Frequencies for each tap; the next number where a gain between them was found to be too high or too low."""


class _Places(NamedTuple):
    """The taps of the first half that are not 0, and frequencies in all bands.

    Attributes
    ----------
    numbers : list of int
        Of the taps, from 0 on.
    copies : list of int
        How often each of them is in the filter: 2, or 1 of the one in the middle.
    cosines : array
        Shape (taps, n): what a unit of each, and of its mirror image, adds to the gain.
    passing : array
        Shape (n,): which frequencies are in a pass band.
    """

    numbers: list[int]
    copies: list[int]
    cosines: Whole
    passing: npt.NDArray[np.bool_]


class _Limits(NamedTuple):
    """Limits of gains, shape (n,), of taps in whole numbers."""

    least: Whole
    most: Whole


@lru_cache(maxsize=32)
def short_taps(family: str, mask: LossMask) -> tuple[Fraction, ...]:
    """Search symmetric taps with few digits whose gains are proven to keep to a mask.

    Parameters
    ----------
    family : str
        Near whose filters.
    mask : LossMask
        What gains must keep to.

    Raises
    ------
    SpecificationError
        If 256 taps of the family are not enough.
    ShortfallError
        If no filter that keeps to the mask is found.

    Examples
    --------
    >>> low, high = Fraction(1, 10), Fraction(3, 10)
    >>> mask = LossMask(((Fraction(0), low),), ((high, Fraction(1, 2)),), Fraction(3), Fraction(20))
    >>> [str(tap) for tap in short_taps("equiripple", mask)]
    ['5/32', '5/16', '5/16', '5/32']
    """
    fewest = len(designed_taps(family, mask))
    lengths = range(fewest, fewest + _MORE)
    nominal = [np.array(each) for length in lengths if (each := taps_of_length(family, length, mask))]
    for points in _POINTS:
        found = [each for start in nominal for each in _near(start, mask, points)]
        for _, taps in sorted(found):
            if keeps_to(taps, mask):
                return taps
        if not found:  # nor will there be one on more frequencies
            break
    raise ShortfallError(
        "filter.freedom must be left out for these edges and losses: no filter with short taps was found that keeps to "
        "them"
    )


def _near(nominal: Array, mask: LossMask, points: int) -> Iterator[tuple[int, tuple[Fraction, ...]]]:
    """Yield filters inside the mask on a grid of frequencies near one, the cheapest of each grid of taps."""
    length = len(nominal)
    places = _places(nominal, mask, points * length)
    first = max(2, math.ceil(-math.log2(min(ripples(mask)))))
    inside = 0
    for frac in range(first, first + _FINER):
        limits = _limits(places.passing, mask, frac)
        found: list[tuple[int, list[int]]] = []
        for level in _levels(mask):
            search = _Search(places, limits, np.rint(nominal[places.numbers] * level * 2.0**frac), frac)
            if search.enters():
                search.shortens()
                found.append((search.cost(search.taps.tolist()), search.taps.tolist()))
        if found:
            cost, taps = min(found)
            yield cost, _mirrored(taps, places.numbers, length, frac)
            inside += 1
            if inside == _ENOUGH:
                return


def _levels(mask: LossMask) -> list[float]:
    """Return levels of a pass band of 1 between its limits, that in the middle first."""
    least = 10 ** (-float(mask.passband_loss) / 20)
    middle, reach = (1 + least) / 2, (1 - least) / 4
    return [middle + reach * k / (_LEVELS // 2) for k in sorted(range(-(_LEVELS // 2), _LEVELS // 2 + 1), key=abs)]


def _mirrored(taps: Sequence[int], numbers: Sequence[int], length: int, frac: int) -> tuple[Fraction, ...]:
    whole = [0] * length
    for number, tap in zip(numbers, taps, strict=True):
        whole[number] = whole[length - 1 - number] = tap
    first = next(k for k, tap in enumerate(whole) if tap)  # those at the ends may have become 0
    return tuple(Fraction(tap, 1 << frac) for tap in whole[first : length - first])


def _places(nominal: Array, mask: LossMask, points: int) -> _Places:
    length = len(nominal)
    bands = (*mask.passbands, *mask.stopbands)
    width = sum(end - start for start, end in bands)
    counts = [max(4, round(points * (end - start) / width)) for start, end in bands]
    frequencies = [
        start + (end - start) * Fraction(k, count)
        for (start, end), count in zip(bands, counts, strict=True)
        for k in range(count + 1)
    ]
    numbers = [number for number in range((length + 1) // 2) if nominal[number]]
    copies = [1 if 2 * number == length - 1 else 2 for number in numbers]

    def units(number: int, frequency: Fraction) -> int:
        angle = frequency * (length - 1 - 2 * number)
        return _rounded(arb.cos_pi_fmpq(fmpq(angle.numerator, angle.denominator)) * (1 << _COSINE_BITS))

    table = evaluate(lambda: [[units(number, each) for each in frequencies] for number in numbers])
    cosines: Whole = np.array(table, dtype=np.int64) * np.array(copies)[:, None]
    passing = np.arange(len(frequencies)) < sum(count + 1 for count in counts[: len(mask.passbands)])
    return _Places(numbers, copies, cosines, passing)


def _rounded(value: arb) -> int:
    """Return a whole number next to the middle of a ball, the same on every machine."""
    whole = (value.mid() + 0.5).floor().unique_fmpz()
    assert whole is not None  # the middle is exact
    return int(whole)


def _limits(passing: npt.NDArray[np.bool_], mask: LossMask, frac: int) -> _Limits:
    """Return the limits of gains of taps in units of ``2**-frac``."""
    top = 1 << (frac + _COSINE_BITS)
    losses = mask.passband_loss, mask.stopband_loss
    least, most = evaluate(lambda: [_rounded(arb(10) ** (-ball(loss) / 20) * top) for loss in losses])
    return _Limits(np.where(passing, least, -most), np.where(passing, top, most))


class _Search:
    """The search on one grid of taps, from one filter on.

    Attributes
    ----------
    taps : array
        Shape (taps,): those of the places, in units of the grid.
    """

    def __init__(self, places: _Places, limits: _Limits, taps: Array, frac: int) -> None:
        self.taps = taps.astype(np.int64)
        self._cosines, self._copies = places.cosines, places.copies
        self._limits = limits
        self._frac = frac
        self._gains = self.taps @ self._cosines
        count = len(taps)
        beside = max(1, _PAIRS // count)
        pairs = [(i, j) for i in range(count) for j in range(i + 1, min(count, i + 1 + beside))]
        self._pairs = np.array(pairs, dtype=np.int64).reshape(-1, 2)

    def enters(self) -> bool:
        """Move taps by units until all gains are within their limits; say whether they are."""
        total = int(self._totals(self._gains))
        while total:
            better = self._better(total)
            if better is None:
                return False
            total = better
        return True

    def _better(self, total: int) -> int | None:
        """Make the best move of one tap, or else of two; return what then exceeds, or None if nothing is better."""
        cosines, count = self._cosines, len(self.taps)
        sums = self._totals(self._gains + np.concatenate([cosines, -cosines]))
        best = int(sums.argmin())
        moves = [(best % count, 1 if best < count else -1)]
        if sums[best] >= total and len(self._pairs):
            first, second = cosines[self._pairs[:, 0]], cosines[self._pairs[:, 1]]
            signs = ((1, 1), (1, -1), (-1, 1), (-1, -1))
            sums = np.concatenate([self._totals(self._gains + a * first + b * second) for a, b in signs])
            best = int(sums.argmin())
            moves = list(
                zip(self._pairs[best % len(self._pairs)].tolist(), signs[best // len(self._pairs)], strict=True)
            )
        if sums[best] >= total:
            return None
        self._move(moves)
        return int(sums[best])

    def _excess(self, gains: Whole) -> Whole:
        """Return by how much gains, shape (..., n), exceed their limits."""
        exceeded: Whole = np.maximum(np.maximum(self._limits.least - gains, gains - self._limits.most), 0)
        return exceeded

    def _totals(self, gains: Whole) -> Whole:
        """Return the sums of squares of what exceeds limits, in units so large that they fit a word."""
        units = -(-self._excess(gains) >> max(0, self._frac + _COSINE_BITS - _SUM_BITS))
        return np.asarray(np.square(units).sum(axis=-1), dtype=np.int64)

    def _move(self, moves: Iterable[tuple[int, int]]) -> None:
        for k, by in moves:
            self.taps[k] += by
            self._gains = self._gains + by * self._cosines[k]

    def cost(self, taps: Sequence[int]) -> int:
        """Return what taps cost: adders of their products and of their sum, and bits."""
        odd = {abs(tap) // (tap & -tap) for tap in taps if tap}
        nonzero = sum(copies for copies, tap in zip(self._copies, taps, strict=True) if tap)
        lowest = reduce(or_, taps, 0)
        bits = self._frac - ((lowest & -lowest).bit_length() - 1) if lowest else 0
        return _ADDER * (sum((3 * each ^ each).bit_count() - 1 for each in odd) + nonzero) + _BIT * bits * nonzero

    def shortens(self) -> None:
        """Move taps inside the mask, alone and two at once, as long as that costs less."""
        singles = [(k,) for k in range(len(self.taps))]
        places = [*singles, *map(tuple, self._pairs.tolist()), *map(tuple, self._pairs[:, ::-1].tolist())]
        self._now = self.cost(self.taps.tolist())
        at, unchanged = 0, 0
        cheaper: dict[int, list[int]] = {}
        while unchanged < len(places):
            if self._shortens_at(places[at], cheaper):
                unchanged = 0
                cheaper.clear()
            else:
                unchanged += 1
            at = (at + 1) % len(places)

    def _shortens_at(self, places: tuple[int, ...], cheaper: dict[int, list[int]]) -> bool:
        """Move a tap to cost less, and another one a little if there is one; say whether a move is inside the mask."""
        taps, now = self.taps.tolist(), self._now
        first = places[0]
        if first not in cheaper:
            cheaper[first] = [d for d in _MOVES if self._cost_moved(taps, (first,), (d,)) < now]
        moves = [(d, *rest) for d in cheaper[first] for rest in (_BESIDE if len(places) > 1 else [()])]
        if not moves:
            return False
        moved: Whole = self._gains + np.array(moves, dtype=np.int64) @ self._cosines[list(places)]
        for at in np.flatnonzero(~self._excess(moved).any(axis=-1)).tolist():
            cost = self._cost_moved(taps, places, moves[at])
            if cost < now:
                self._move(zip(places, moves[at], strict=True))
                self._now = cost
                return True
        return False

    def _cost_moved(self, taps: Sequence[int], places: Sequence[int], by: Sequence[int]) -> int:
        moved = list(taps)
        for k, units in zip(places, by, strict=True):
            moved[k] += units
        return self.cost(moved)
