"""The parallel architecture of an FIR filter that decimates: a sample at every clock, products shared by phases."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from sosmith.gen.architectures.decimating import AtEachClock
from sosmith.gen.architectures.fir_steps import FewSteps
from sosmith.gen.word_lengths.cost import Multiplication, Operand
from sosmith.hdl.plan.decimating.polyphase import PolyphasePlan, polyphase_plan

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component

    from sosmith.gen.architectures.blocks import Blocks
    from sosmith.gen.fpga.boards import Board
    from sosmith.gen.word_lengths.objective import Objective


@dataclass(frozen=True)
class Polyphase(AtEachClock):
    """A multiplier for every N products of a result, which takes another one with each of N samples."""

    checked = "each multiplier takes the products of the datapath's graphs, for all samples, stalls and resets"

    @property
    def least_blocks(self) -> tuple[int, str]:
        """Those of its multipliers."""
        return self.multiplier_blocks, "for a sample at each clock"

    @classmethod
    def objective(cls, board: Board | None, *, adders: bool = False, blocks: Blocks | None = None) -> Objective:
        """Return the number of products."""
        del board, adders, blocks
        return FewSteps()

    @cached_property
    def plan(self) -> PolyphasePlan:
        """Which multiplier takes which product, and their clocks."""
        return polyphase_plan(self.datapath, self.channels)

    @property
    def multiplications(self) -> tuple[Multiplication, ...]:
        """The multipliers."""
        return (self._factors,) * self.plan.multipliers

    @property
    def _factors(self) -> Multiplication:
        data = self.plan.steps.pair_bits(self.datapath.inputs[0])
        return Multiplication(Operand(data, signed=True), Operand(self.plan.steps.factor_bits, signed=True))

    @property
    def multiplier_blocks(self) -> int:
        """Multiplier blocks that it takes."""
        return self.plan.multipliers * self._factors.blocks_of(self.blocks.bits)

    def _core(self, *, before: bool = False) -> Component:
        del before
        from sosmith.hdl.cores.channel_polyphase import ChannelPolyphaseCore  # only what makes hardware loads Amaranth
        from sosmith.hdl.cores.polyphase import PolyphaseCore

        if self.channels > 1:
            return ChannelPolyphaseCore(self.datapath, self.channels, self.copies_per_result)
        return PolyphaseCore(self.datapath, self.copies_per_result)

    def reason(self, why: str, available: int) -> str:
        """Say in a sentence that it was chosen and `why`."""
        del available
        count, plan = len(self.plan.steps.steps), self.plan
        multipliers = f"{plan.multipliers} multiplier{'s' * (plan.multipliers > 1)}"
        return f"{self.name}: {why}; {multipliers} for {count} products of a result, a sample a clock"
