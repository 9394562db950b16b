"""The multiplexed architecture: sections of the same structure share hardware, a turn each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import NO_LIMIT, Blocks
from sosmith.gen.fpga.boards import Board
from sosmith.gen.realizations.tied_formats import NONE_ALIKE
from sosmith.gen.specification.combinations import MULTIPLEXED, PARALLEL
from sosmith.gen.word_lengths.cost import Cost, cost_of_graphs
from sosmith.gen.word_lengths.objective import SHARED_AREA, Objective
from sosmith.hdl.plan.sharing.sharing import Sharing, sharing
from sosmith.model.errors import ShortfallError

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component


@dataclass(frozen=True)
class Multiplexed(Architecture):
    """Every operation of a section has its own hardware, which sections of the same structure share."""

    terms = MULTIPLEXED
    checked = "each section finds its state and its constants at its turn, and computes the datapath's graph"
    least_clocks = 2
    shares_sections = True

    def __post_init__(self) -> None:
        try:
            _ = self.plan
        except ValueError:
            raise ShortfallError(NONE_ALIKE) from None

    @classmethod
    def is_tried(cls, blocks: Blocks) -> bool:
        """Say whether there are multiplier blocks: without, products by fixed constants are smaller."""
        return blocks.available != 0

    @classmethod
    def objective(cls, board: Board | None, *, adders: bool = False, blocks: Blocks = NO_LIMIT) -> Objective:
        """Return the estimated area of the operators, with shared ones counted once."""
        del board, adders, blocks
        return SHARED_AREA

    @classmethod
    def measured_as(cls) -> str:
        """Return the parallel architecture, which has the same operators, one by one."""
        return PARALLEL.name

    @cached_property
    def plan(self) -> Sharing:
        """Which sections share hardware, and their clocks.

        Raises
        ------
        ValueError
            If none do.
        """
        return sharing(self.datapath, self.clock, self.available)

    @property
    def least_blocks(self) -> tuple[int, str]:
        """Those of all products: none is made of adders, as constants change."""
        return self.multiplier_blocks, "in the multiplexed architecture"

    @property
    def adders(self) -> tuple[frozenset[int], ...]:
        """No products: all take multiplier blocks."""
        return tuple(frozenset() for _ in self.datapath.stages)

    @cached_property
    def shared_cost(self) -> Cost:
        """Operators before synthesis, those of sections that share hardware once, and the states of all."""
        made = cost_of_graphs(self.plan.graphs)
        others = sum((len(unit.stages) - 1) * unit.state_bits for unit in self.plan.shared)
        return replace(made, register_bits=made.register_bits + others)

    @property
    def multiplier_blocks(self) -> int:
        """Multiplier blocks that it takes: those of sections that share hardware once."""
        return sum(product.blocks_of(self.blocks.bits) for product in self.shared_cost.multiplications)

    @property
    def _latency_cycles(self) -> int:
        return self.plan.latency_cycles

    @property
    def _cycles_per_sample(self) -> int:
        return self.plan.interval

    @property
    def clock_estimate(self) -> float:
        """Estimate of the highest clock, on an ECP5, in Hz."""
        return self.plan.clock_estimate

    def _core(self, *, before: bool = False) -> Component:
        del before
        from sosmith.hdl.cores.multiplexed import MultiplexedCore  # only what makes hardware loads Amaranth

        return MultiplexedCore(self.plan)

    def reason(self, why: str, available: int) -> str:
        """Say in a sentence that it was chosen and `why`, and which sections share hardware."""
        shared = " and ".join(str(len(unit.stages)) for unit in self.plan.shared)
        turns = f"{shared} sections share hardware, {self.plan.clocks} clock{'s' * (self.plan.clocks > 1)} each"
        return f"{super().reason(why, available)}; {turns}"
