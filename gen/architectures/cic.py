"""The parallel architecture of a CIC filter: integrators and combs, one adder each, and a sample at every clock."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from sosmith.gen.architectures.decimating import AtEachClock
from sosmith.gen.architectures.fir_steps import ExactTaps
from sosmith.gen.word_lengths.cost import Cost, cost_of_graphs
from sosmith.hdl.plan.decimating.cic import CicPlan, cic_plan

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component

    from sosmith.gen.architectures.blocks import Blocks
    from sosmith.gen.fpga.boards import Board
    from sosmith.gen.word_lengths.objective import Objective


@dataclass(frozen=True)
class Cic(AtEachClock):
    """Integrators take each sample, combs every N-th, without a product."""

    checked = "integrators and combs give the results of the datapath's graphs, for all samples, stalls and resets"

    @classmethod
    def objective(cls, board: Board | None, *, adders: bool = False, blocks: Blocks | None = None) -> Objective:
        """Return that of taps as they are."""
        del board, adders, blocks
        return ExactTaps()

    @cached_property
    def plan(self) -> CicPlan:
        """Integrators and combs, and their clocks."""
        return cic_plan(self.datapath, self.channels)

    @property
    def _own_cost(self) -> Cost:
        """Operators: integrators and combs in place of the filter's graph, and those of the output."""
        behind = cost_of_graphs([self.datapath.stages[-1].graph])
        return Cost(multiplications=(), adder_bits=self.plan.adder_bits, register_bits=self.plan.register_bits).beside(
            behind
        )

    @property
    def multiplier_blocks(self) -> int:
        """Return 0."""
        return 0

    def _core(self, *, before: bool = False) -> Component:
        del before
        from sosmith.hdl.cores.channel_cic import ChannelCicCore  # only what makes hardware loads Amaranth
        from sosmith.hdl.cores.cic import CicCore

        if self.channels > 1:
            return ChannelCicCore(self.datapath, self.channels, self.copies_per_result)
        return CicCore(self.datapath, self.copies_per_result)

    def title(self, realization: str | None) -> str:
        """Return its name, and what it is made of."""
        del realization
        return f"{self.name} integrators and combs"

    def reason(self, why: str, available: int) -> str:
        """Say in a sentence that it was chosen and `why`."""
        del available
        plan = self.plan
        return (
            f"{self.name}: {why}; {plan.order} integrator{'s' * (plan.order > 1)} and as many combs of {plan.width} "
            "bits, a sample a clock"
        )
