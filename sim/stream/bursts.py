"""The random pace of a bench: bursts of waiting, and the clocks to probe, drawn from one seed.

The draws are stated here down to the bit, because a second implementation in ``loop.h`` must draw the same:

- ``random()`` and ``getrandbits()`` are those of Python's `random.Random`: the Mersenne Twister MT19937, whose 32-bit
  words w give ``getrandbits(k) = w >> (32 - k)`` and, from two of them, ``random() = ((w1 >> 5) * 2**26 + (w2 >> 6)) /
  2**53``.
- `below` draws an integer by rejection: as many bits as the limit has, until they are below it.
- A `Pace` draws at the start of each phase its length, ``20 + below(180)`` clocks, and then ``below(3)``: whether it
  waits for less than its share of clocks, for just that share, or for more. Then, for each clock, one ``random()``.
"""

from __future__ import annotations

import random

SHORTEST, LENGTHS = 20, 180
"""Clocks in a phase: the least, and how many different lengths there are."""


def below(limit: int, source: random.Random) -> int:
    """Draw an integer from 0 to ``limit - 1``."""
    bits = limit.bit_length()
    drawn = source.getrandbits(bits)
    while drawn >= limit:
        drawn = source.getrandbits(bits)
    return drawn


class Pace:
    """Random sequence of go and wait with the given share of waiting: in bursts, at full speed, and single clocks.

    Attributes
    ----------
    waiting : float
        Share of clocks to wait, in [0, 1).
    spread : float
        By how much the share of a phase may differ from it; phases average to `waiting`.
    """

    def __init__(self, source: random.Random, waiting: float) -> None:
        self.waiting = waiting
        self.spread = min(waiting, 1 - waiting, 0.4)
        self._source = source
        self._left, self._share = 0, 0.0

    def __next__(self) -> bool:
        """Whether to go in the next clock."""
        if self._left == 0:
            self._left = SHORTEST + below(LENGTHS, self._source)
            self._share = self.waiting + (-self.spread, 0.0, self.spread)[below(3, self._source)]
        self._left -= 1
        return self._source.random() >= self._share
