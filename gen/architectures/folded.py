"""The folded architecture: one multiplier and one accumulator run a program."""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.gen.architectures.architecture import DIGIT_BITS
from sosmith.gen.architectures.blocks import Blocks
from sosmith.gen.architectures.shared_unit import SharedUnit
from sosmith.gen.fpga.boards import Board
from sosmith.gen.specification.combinations import FOLDED


@dataclass(frozen=True)
class Folded(SharedUnit):
    """One or two multiplier blocks run a program, an instruction at each clock.

    Two where the specification names as many or more, with `hardware.multipliers`: a sample then takes some two thirds
    of the clocks.
    """

    terms = FOLDED
    bit_serial = False

    @classmethod
    def is_tried(cls, blocks: Blocks) -> bool:
        """Return True: if there is no multiplier block, synthesis makes one of LUT4."""
        del blocks
        return True

    @classmethod
    def products_with(cls, blocks: Blocks) -> int:
        """Return the products at a clock: two if the specification names so many multiplier blocks."""
        return 2 if (blocks.asked or 1) > 1 else 1

    @classmethod
    def digit_bits_on(cls, board: Board | None) -> int:
        """Width of a digit: as wide as the multiplier block of the board takes it."""
        if board is None or not board.device.factor_bits:
            return DIGIT_BITS
        return board.device.factor_bits - 1
