"""The serial architecture: one accumulator runs a program, with shifts and additions instead of a multiplier."""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.gen.architectures.blocks import Blocks
from sosmith.gen.architectures.shared_unit import SharedUnit
from sosmith.gen.specification.combinations import SERIAL


@dataclass(frozen=True)
class Serial(SharedUnit):
    """As folded, but without a multiplier block: an instruction takes a clock for each bit of its factor."""

    terms = SERIAL
    bit_serial = True

    @classmethod
    def is_tried(cls, blocks: Blocks) -> bool:
        """Say so without multiplier blocks, where shifts and additions are smaller than a multiplier made of LUT4."""
        return blocks.available == 0
