"""One more multiple of an operand by a few more sums: the sets of values that give it, and the cheapest of them.

Every sum is ``(a << i) + (b << j)`` or a difference, of two multiples that are there or are sums before it. With three
sums beside that of the number, there are some thousand pairs of the first two, `u` and `v`; what one sum makes of the
operand and a pair, and what the number leaves with one of them, must have the third in common::

    1, u, v --- + or - ---> w <--- what is to be added or subtracted --- 1, u, v and the number

This is the search for minimum graphs of one constant (Dempster and Macleod, Constant integer multiplication using
minimum adders, IEE Proceedings - Circuits, Devices and Systems 141, 1994; Gustafsson, Dempster, Johansson, Macleod and
Wanhammar, Simplified design of constant coefficient multipliers, Circuits, Systems and Signal Processing 25, 2006), met
in the middle, for all that is there already, and with what each sum takes as the cost. With four sums beside that of
the number, the last two must have the number in common; the pairs before them are then too many, and those of the least
values are looked at.

All is exact in integers, and the same on every machine. With up to four sums, no set is missed of odd values of which
none has its negative beside it, that have at most two bits more than the number, and of shifts to the left that are at
most one bit longer than it, as long as there are not more than `most` and `_MOST_SETS` allow.

>>> sets_of_values((1,), 75, 2, most=1000)
[(5,), (15,)]
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

_Integers = npt.NDArray[np.int64]

_MOST_SETS = 1 << 11
"""Sets of which the cheapest graph is looked for, those with the least sum of values first."""

ALL = 4
"""Sums up to which all sets are looked at."""

MOST_BITS = 28
"""Bits of a number up to which sets are looked for, so that shifted values are integers of 64 bits."""


class Split(NamedTuple):
    """A number as ``parts[0] << shifts[0]`` plus or minus ``parts[1] << shifts[1]``; the parts are odd."""

    parts: tuple[int, int]
    shifts: tuple[int, int]
    subtract: bool


Bits = Callable[[int, tuple[int, int], bool], int]
"""What a sum takes, by its multiple, the shifts of its parts, and whether the second is subtracted.

A negative multiple takes no less than a positive one of the same shifts, nor does one that is shifted less far.
"""


def cheapest(
    there: Mapping[int, int], number: int, levels: int, sums: int, bits: Bits, below: int, most: int
) -> dict[int, Split] | None:
    """Return the splits that make an odd number of what is there with so many sums at the least cost.

    Parameters
    ----------
    there : mapping
        The odd multiples that are there, 1 among them, and how many sums each follows.
    number : int
        An odd number that is not there.
    levels : int
        Most sums in a row, up to that of the number.
    sums : int
        New sums, that of the number among them.
    bits : callable
        What a sum takes.
    below : int
        The cost that they must have less than.
    most : int
        Values that are made of all sets: where there would be more, only sets of the least sums are looked at.

    Returns
    -------
    dict or None
        The split of each new sum, simpler ones first; None if none has so few.
    """
    sizes = tuple(sorted({abs(part) for part in there if abs(part).bit_length() <= MOST_BITS}))
    if abs(number) in sizes:  # only its negative is there
        return None
    bounded = []
    for values in sets_of_values(sizes, abs(number), sums, most):
        missing = (*values, abs(number))
        bounded.append((_at_least(missing, sizes, bits), missing))
    best: dict[int, Split] | None = None
    for bound, missing in sorted(bounded):
        if bound >= below:
            break
        found = _of_a_set(there, missing, number, levels, bits, below)
        if found is not None:
            below, best = found
    return best


def sets_of_values(there: tuple[int, ...], number: int, sums: int, most: int) -> list[tuple[int, ...]]:
    """Return the sets of odd values that, each made by one sum, give a number by one more.

    Parameters
    ----------
    there : tuple of int
        Odd positive multiples that are there, in ascending order.
    number : int
        An odd positive number that is not among them.
    sums : int
        How many, that of the number included.
    most : int
        As for `cheapest`.

    Returns
    -------
    list of tuple of int
        The values of each set but that of the number, in ascending order; those of the least sum first.
    """
    shifts = number.bit_length() + 1
    if number.bit_length() > MOST_BITS:
        return []
    if sums == 1:
        return [()] if number in _one_more(np.array([there], dtype=np.int64), shifts) else []
    added = (_chained if sums <= ALL else _paired)(there, number, sums, most)
    added = np.unique(np.sort(added, axis=1), axis=0)
    repeated = (added[:, 1:] == added[:, :-1]).any(axis=1) | np.isin(added, (*there, number)).any(axis=1)
    added = added[~repeated]
    order = np.argsort(added.sum(axis=1), kind="stable")[:_MOST_SETS]
    return [tuple(values) for values in added[order].tolist()]


def _chained(there: tuple[int, ...], number: int, sums: int, most: int) -> _Integers:
    """Return sets of which the last value is a sum of two others, and the number one of it and another."""
    shifts = number.bit_length() + 1
    sets = _sets(there, sums - 2, shifts, most)
    from_above = _left(sets, number, shifts)
    rows, values = _met(_keys(there, sums - 2, shifts, most), from_above, from_above != 0, shifts)
    return np.column_stack([sets[rows, len(there) :], values])


def _paired(there: tuple[int, ...], number: int, sums: int, most: int) -> _Integers:
    """Return sets of which the last two values are sums of two others each, and the number one of both."""
    shifts = number.bit_length() + 1
    sets = _sets(there, sums - 3, shifts, most)
    made = _one_more(sets, shifts)
    sets = sets[: max(1, most // (made.shape[1] * 2 * shifts))]
    made = np.sort(made[: len(sets)], axis=1)
    from_above = _left(made, number, shifts)
    other = np.concatenate([np.repeat(made, shifts, axis=1)] * 2 + [made] * 2, axis=1)  # as `_left` has them
    from_above = from_above[:, : other.shape[1]]
    new = (other != 0) & (from_above > other)
    rows, values, partners = _met(_sorted(made, shifts), from_above, new, shifts, other)
    return np.column_stack([sets[rows, len(there) :], partners, values])


def _met(
    keys: _Integers, above: _Integers, new: npt.NDArray[np.bool_], shifts: int, *others: _Integers
) -> list[_Integers]:
    """Return rows and values of which there are keys, and what others have in their places."""
    row = np.arange(len(above), dtype=np.int64)[:, None] << (shifts + 1)
    wanted = (above + row)[new]
    places = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    met = keys[places] == wanted
    return [wanted[met] >> (shifts + 1), wanted[met] & ((2 << shifts) - 1), *(other[new][met] for other in others)]


@lru_cache(maxsize=2)
def _keys(there: tuple[int, ...], sums: int, shifts: int, most: int) -> _Integers:
    """Return what one sum makes of `_sets`, as `_sorted` does; constants of one design often have as many bits."""
    return _sorted(_one_more(_sets(there, sums, shifts, most), shifts), shifts)


def _sorted(values: _Integers, shifts: int) -> _Integers:
    """Return values below ``2 << shifts`` with the numbers of their rows above them, in ascending order."""
    return np.sort(values + (np.arange(len(values), dtype=np.int64)[:, None] << (shifts + 1)), axis=None)


@lru_cache(maxsize=16)
def _sets(there: tuple[int, ...], sums: int, shifts: int, most: int) -> _Integers:
    """Return what is there with so many sums more, a set in a row, those of the least sum first."""
    sets = np.array([there], dtype=np.int64)
    for _ in range(sums):
        values = _one_more(sets, shifts)
        rows = np.repeat(np.arange(len(sets)), values.shape[1])
        flat = values.ravel()
        new = (flat != 0) & ~(sets[rows] == flat[:, None]).any(axis=1)
        added = np.column_stack([sets[rows[new], len(there) :], flat[new]])
        added = np.unique(np.sort(added, axis=1), axis=0)
        added = added[np.argsort(added.sum(axis=1), kind="stable")]
        size = len(there) + added.shape[1]
        added = added[: max(1, most // (size * size * 2 * shifts))]
        sets = np.column_stack([np.tile(np.array(there, dtype=np.int64), (len(added), 1)), added])
    return sets


def _one_more(sets: _Integers, shifts: int) -> _Integers:
    """Return the odd values below ``2 << shifts`` that one sum makes of two of a set, by set; 0 for others."""
    shifted = sets[:, None, :, None] << np.arange(1, shifts + 1)
    alone = sets[:, :, None, None]
    values = np.concatenate([alone + shifted, abs(alone - shifted)], axis=1).reshape(len(sets), -1)
    return np.where(values < 2 << shifts, values, 0)


def _left(sets: _Integers, number: int, shifts: int) -> _Integers:
    """Return the odd values that give a number, with one of a set or alone, by one sum; 0 for those that are large."""
    shifted = (sets[:, :, None] << np.arange(1, shifts + 1)).reshape(len(sets), -1)
    even = np.concatenate([number - sets, number + sets], axis=1)
    odd = abs(even) // np.maximum(even & -even, 1)
    factors = [factor for k in range(1, shifts) for factor in ((1 << k) - 1, (1 << k) + 1) if factor > 1]
    parts = [number // factor for factor in factors if number % factor == 0]
    alone = np.tile(np.array(parts, dtype=np.int64), (len(sets), 1))
    values = np.concatenate([abs(number - shifted), number + shifted, odd, alone], axis=1)
    return np.where(values < 2 << shifts, values, 0)


def _of_a_set(
    made: Mapping[int, int], missing: Sequence[int], number: int, levels: int, bits: Bits, below: int
) -> tuple[int, dict[int, Split]] | None:
    """Return the least cost of all missing values, each positive or negative, and their splits, the number's last."""
    if _at_least(missing, tuple(map(abs, made)), bits) >= below:
        return None
    if not missing:
        return 0, {}
    best: tuple[int, dict[int, Split]] | None = None
    for size in missing:
        last = size == abs(number)
        if last and len(missing) > 1:
            continue
        rest = [other for other in missing if other != size]
        for value in (number,) if last else (size, -size):
            for takes, split in _splits(value, made, levels - (not last), bits):
                level = 1 + max(made[part] for part in split.parts)
                found = _of_a_set({**made, value: level}, rest, number, levels, bits, below - takes)
                if found is not None:
                    below = takes + found[0]
                    best = below, {value: split, **found[1]}
    return best


def _splits(value: int, made: Mapping[int, int], levels: int, bits: Bits) -> list[tuple[int, Split]]:
    """Return the ways to make a value of two that are made, on at most so many levels, and what they take."""
    usable = sorted((part for part in made if made[part] < levels), key=lambda part: (abs(part), part))
    found = []
    for a, b in combinations_with_replacement(usable, 2):
        for split in _ways(value, a, b):
            found.append((bits(value, split.shifts, split.subtract), split))
    return sorted(found)


@lru_cache(maxsize=1 << 16)
def _ways(value: int, a: int, b: int) -> tuple[Split, ...]:
    """Return the ways to make an odd value of two odd ones, of which one is shifted."""
    ways = []
    for alone, shifted in dict.fromkeys(((a, b), (b, a))):
        for sign in (1, -1):
            rest = value - sign * alone
            shift = (rest & -rest).bit_length() - 1 if rest else 0
            if rest >> shift == shifted and sign > 0:
                ways.append(Split((alone, shifted), (0, shift), subtract=False))
            elif rest >> shift == shifted:
                ways.append(Split((shifted, alone), (shift, 0), subtract=True))
            elif rest >> shift == -shifted and sign > 0:
                ways.append(Split((alone, shifted), (0, shift), subtract=True))
    return tuple(ways)


def _at_least(missing: Sequence[int], there: Sequence[int], bits: Bits) -> int:
    """Return what missing values take at least, whatever their signs and their order."""
    sizes = {*there, *missing}
    return sum(bits(size, (0, _shift(size, sizes)), False) for size in missing)


def _shift(size: int, sizes: Iterable[int]) -> int:
    """Return how far one of two sizes is shifted at most where they give another; 0 if none do."""
    pairs = combinations_with_replacement(sorted(other for other in sizes if other != size), 2)
    return max((_shift_of(size, *pair) for pair in pairs), default=0)


@lru_cache(maxsize=1 << 16)
def _shift_of(size: int, a: int, b: int) -> int:
    """Return how far one of two values is shifted at most where they give another; 0 if they do not."""
    shifts = [0]
    for alone, shifted in ((a, b), (b, a)):
        for rest in (size - alone, size + alone):
            low = rest & -rest
            if rest and abs(rest) == shifted * low:
                shifts.append(low.bit_length() - 1)
    return max(shifts)
