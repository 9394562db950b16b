"""Lets values of a program that are not needed at the same time have the same words of memory."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple


class Extent(NamedTuple):
    """Words of a value: the lowest address and how many."""

    address: int
    words: int


class Life(NamedTuple):
    """First and last place in a program at which a value is written or read."""

    first: int
    last: int


def packed(values: Sequence[tuple[Extent, Life]], start: int) -> tuple[dict[Extent, int], int]:
    """Give each value the lowest address from `start` on at which no other is alive at the same time.

    Parameters
    ----------
    values : sequence of (Extent, Life)
        Where values lie, each for itself, and when they are alive.
    start : int
        First address to be given.

    Returns
    -------
    dict of Extent to int, int
        New address of each, and the one behind the highest word used.
    """
    given: dict[Extent, int] = {}
    alive: list[tuple[int, int, int]] = []  # address, the one behind, last use
    end = start
    for extent, life in sorted(values, key=lambda value: value[1].first):
        alive = [entry for entry in alive if entry[2] >= life.first]
        address = _gap(((low, high) for low, high, _ in alive), extent.words, start)
        given[extent] = address
        alive.append((address, address + extent.words, life.last))
        end = max(end, address + extent.words)
    return given, end


def _gap(taken: Iterable[tuple[int, int]], words: int, start: int) -> int:
    address = start
    for low, high in sorted(taken):
        if address + words <= low:
            break
        address = max(address, high)
    return address
