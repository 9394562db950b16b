"""Multiplier blocks that there are for a core."""

from __future__ import annotations

from typing import NamedTuple

from sosmith.gen.fpga.boards import Board
from sosmith.gen.word_lengths.cost import MULTIPLIER_BITS


class Blocks(NamedTuple):
    """How many multiplier blocks there are, None for as many as it takes, and the bits of a signed operand."""

    available: int | None
    bits: int = MULTIPLIER_BITS


NO_LIMIT = Blocks(None)


def blocks_for(wanted: int | None, board: Board | None) -> Blocks:
    """Multiplier blocks that a core may take: as the specification says, or else all that the board has."""
    if board is None:
        return Blocks(wanted)
    device = board.device
    return Blocks(device.multipliers if wanted is None else wanted, device.factor_bits or MULTIPLIER_BITS)
