"""One multiplier for all results of a stage that interpolates: each of them is an FIR filter of the same samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, cast

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.folded_fir import FoldedFir, blocks_of
from sosmith.gen.word_lengths.settling import with_settling
from sosmith.hdl.plan.tap_steps import StepsInTurn, tap_steps
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.errors import ShortfallError

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component

    from sosmith.model.sections.output import OutputStage


@dataclass(frozen=True)
class SharedFir(FoldedFir):
    """What a datapath has of hardware that computes several results of each sample, one after the other.

    Attributes
    ----------
    results : tuple of Datapath
        What is computed of each sample, in the order of the results.
    turn : int
        Which of them the datapath is.
    block : int or None
        Bits of an operand of the multiplier block that each product must fit; None for whole products.
    """

    results: tuple[Datapath, ...] = ()
    turn: int = 0
    block: int | None = None

    @cached_property
    def in_turn(self) -> StepsInTurn:
        """The steps of all results."""
        return StepsInTurn(tuple(map(tap_steps, self.results)), self.datapath.inputs[0], self.block)

    @property
    def multiplier_blocks(self) -> int:
        """Multiplier blocks that it takes: the first result has them for all."""
        return 0 if self.turn else blocks_of(self.in_turn, self.blocks.bits)

    @property
    def memory_bits(self) -> int:
        """Bits of the samples that it keeps of a channel, once, for all results."""
        return 0 if self.turn else super().memory_bits

    @property
    def _latency_cycles(self) -> int:
        return self.in_turn.latency_cycles(self.channels, self.turn)

    @property
    def has_module(self) -> bool:
        """Return False: all results share one."""
        return False

    def whole(self) -> Component:
        """Make the hardware of all results."""
        from sosmith.hdl.cores.ring import RingCore  # only what makes hardware loads Amaranth

        first, *others = self.results
        return RingCore(first, self.channels, others=others, block=self.block)


def shared(architectures: Sequence[Architecture], available: int) -> list[SharedFir]:
    """Return hardware that computes what others do, each alone, with one multiplier; `available` are clocks a sample.

    Raises
    ------
    ShortfallError
        If these keep no samples, or have constants that can be loaded or check bits, or if there are not enough clocks,
        or their products take more multiplier blocks than there are results.
    """
    # After a start from zero all results are flagged for as long as the one that settles last.
    settles = max(cast("OutputStage", each.datapath.stages[-1]).settling for each in architectures)
    results = tuple(with_settling(each.datapath, settles) for each in architectures)
    for each in architectures:
        if not isinstance(each, FoldedFir) or each.reload or each.protect != "none":
            raise ShortfallError("results that share a multiplier must have fixed taps and no check bits")
    first = architectures[0]
    wide, narrow = (
        [
            SharedFir(
                datapath=datapath,
                channels=first.channels,
                digit_bits=first.digit_bits,
                blocks=first.blocks,
                results=results,
                turn=turn,
                block=block,
            )
            for turn, datapath in enumerate(results)
        ]
        for block in (None, first.blocks.bits)
    )
    whole = wide[0].multiplier_blocks
    if whole > 1 and narrow[0].cycles_per_result <= available:
        return narrow
    if whole > max(len(results), first.blocks.asked or 0):
        raise ShortfallError(
            "results that share a multiplier must take no more multiplier blocks than there are results"
        )
    if wide[0].cycles_per_result > available:
        raise ShortfallError(
            f"one multiplier must have {wide[0].cycles_per_result:,} clocks a sample for all results, not {available:,}"
        )
    return wide
