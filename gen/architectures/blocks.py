"""Multiplier blocks that there are for a core."""

from __future__ import annotations

from typing import NamedTuple

from sosmith.gen.fpga.boards import Board
from sosmith.gen.word_lengths.cost import MULTIPLIER_BITS


class Blocks(NamedTuple):
    """Multiplier blocks for a core.

    Attributes
    ----------
    available : int or None
        How many there are; None for as many as it takes.
    bits : int
        Bits of a signed operand.
    asked : int or None
        How many the specification names, of those that have not been taken; None if it leaves their number open.
    """

    available: int | None
    bits: int = MULTIPLIER_BITS
    asked: int | None = None

    def without(self, taken: int) -> Blocks:
        """Return what is left of them."""
        left = (None if count is None else max(0, count - taken) for count in (self.available, self.asked))
        available, asked = left
        return self._replace(available=available, asked=asked)

    def keeping_one(self) -> Blocks:
        """Return them for hardware that leaves one of those that the specification names to other hardware."""
        return self._replace(asked=None if self.asked is None else max(0, self.asked - 1))


NO_LIMIT = Blocks(None)


def blocks_for(wanted: int | None, board: Board | None) -> Blocks:
    """Multiplier blocks that a core may take: as the specification says, or else all that the board has."""
    if board is None:
        return Blocks(wanted, asked=wanted)
    device = board.device
    return Blocks(device.multipliers if wanted is None else wanted, device.factor_bits or MULTIPLIER_BITS, wanted)
