"""Lets values of a program share words of memory where they are not needed at the same time.

Each value is written and read within a live range of instructions, and lies in a block of consecutive words. Blocks
whose live ranges do not overlap may share words. As in a linear-scan register allocator, blocks are given addresses in
the order of their first use, each the lowest one that is free::

    instruction   0   1   2   3   4   5   6
    a, 2 words    |-------|                    words 0..1
    b, 1 word         |-----------|            word  2
    c, 2 words                |-----------|    words 0..1, free again since `a` is dead

>>> a, b, c = WordBlock(0, 2), WordBlock(2, 1), WordBlock(3, 2)
>>> new, end = packed([(a, LiveRange(0, 2)), (b, LiveRange(1, 4)), (c, LiveRange(3, 6))], start=0)
>>> new[a], new[b], new[c], end
(0, 2, 0, 3)
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple


class WordBlock(NamedTuple):
    """Consecutive words that hold a value: the lowest address and how many."""

    address: int
    words: int


class LiveRange(NamedTuple):
    """First and last instruction that writes or reads a value."""

    first: int
    last: int


def packed(values: Sequence[tuple[WordBlock, LiveRange]], start: int) -> tuple[dict[WordBlock, int], int]:
    """Give each block the lowest address from `start` on that no other live block uses.

    Parameters
    ----------
    values : sequence of (WordBlock, LiveRange)
        Blocks, no two of which overlap, and their live ranges.
    start : int
        Lowest address to be given.

    Returns
    -------
    dict of WordBlock to int, int
        New address of each block, and the first address behind all of them.
    """
    given: dict[WordBlock, int] = {}
    live: list[tuple[int, int, int]] = []  # first address, address behind the last, last use
    end = start
    for block, span in sorted(values, key=lambda value: value[1].first):
        live = [entry for entry in live if entry[2] >= span.first]
        address = _gap(((low, high) for low, high, _ in live), block.words, start)
        given[block] = address
        live.append((address, address + block.words, span.last))
        end = max(end, address + block.words)
    return given, end


def _gap(taken: Iterable[tuple[int, int]], words: int, start: int) -> int:
    """Return the lowest address from `start` on with so many free `words`."""
    address = start
    for low, high in sorted(taken):
        if address + words <= low:
            break
        address = max(address, high)
    return address
