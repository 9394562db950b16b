"""Damage to a line: flips, drops and inserts bytes at random."""

from __future__ import annotations

import random

from sosmith.model.errors import SpecificationError

KINDS = ("flip", "drop", "insert")


class LineDamage:
    """Damage to the bytes that pass through, the same for the same seed.

    Parameters
    ----------
    every : float
        One byte in so many is damaged, on average; at least 1.
    seed : int
        Seed of the places and kinds.
    kinds : tuple of str
        Some of `KINDS`, each as likely as the others.

    Raises
    ------
    SpecificationError
        If a number or a kind is none of these.
    """

    def __init__(self, every: float, seed: int, kinds: tuple[str, ...] = KINDS) -> None:
        if not every >= 1:
            raise SpecificationError(f"a fault must come once in 1 or more bytes, not in {every:g}")
        for kind in kinds:
            if kind not in KINDS:
                raise SpecificationError(f"a fault must be one of {', '.join(KINDS)}, not {kind}")
        self.count = 0
        self._every, self._kinds, self._random = every, kinds, random.Random(seed)
        self._left = self._distance()

    def _distance(self) -> int:
        """Draw how many bytes pass before the next one that is damaged."""
        return int(self._random.expovariate(1 / self._every))

    def __call__(self, data: bytes) -> bytes:
        """Return `data` with its damage."""
        damaged, start = bytearray(), 0
        while start + self._left < len(data):
            place = start + self._left
            damaged += data[start:place] + self._damaged(data[place])
            start, self._left = place + 1, self._distance()
            self.count += 1
        self._left -= len(data) - start
        return bytes(damaged + data[start:])

    def _damaged(self, byte: int) -> bytes:
        kind = self._random.choice(self._kinds)
        if kind == "flip":
            return bytes([byte ^ 1 << self._random.randrange(8)])
        return b"" if kind == "drop" else bytes([byte, self._random.randrange(256)])
