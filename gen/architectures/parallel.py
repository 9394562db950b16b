"""The parallel architecture: every operation has its own hardware, and a beat goes in at every clock."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import NO_LIMIT, Blocks
from sosmith.gen.architectures.look_ahead_products import products_for
from sosmith.gen.fpga.boards import Board
from sosmith.gen.specification.combinations import PARALLEL
from sosmith.gen.word_lengths.cost import Cost, cost_of_graphs, products_from_adders
from sosmith.gen.word_lengths.objective import FEW_ADDERS, SMALL_AREA, Objective
from sosmith.hdl.plan import parallel_clocks
from sosmith.hdl.plan.look_ahead import Products, in_pieces
from sosmith.model.dataflow.adder_graph import scalings
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Op
from sosmith.model.reload.constants import with_room
from sosmith.model.sections.truncated_products import constants_of

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component


@dataclass(frozen=True)
class Parallel(Architecture):
    """Every operation has its own hardware."""

    terms = PARALLEL
    checked = "the pipeline computes the datapath's graphs, register by register, in every lane and for each channel"

    @classmethod
    def is_tried(cls, blocks: Blocks) -> bool:
        """Return True: it is the fastest."""
        del blocks
        return True

    @classmethod
    def objective(cls, board: Board | None, *, adders: bool = False, blocks: Blocks = NO_LIMIT) -> Objective:
        """Return the estimated area of the operators."""
        del board, blocks
        return FEW_ADDERS if adders else SMALL_AREA

    @cached_property
    def adders(self) -> tuple[frozenset[int], ...]:
        """Products by constants that are made of adders, by stage: none with constants to load."""
        if self.products is not None:
            return self.products.adders
        return products_from_adders(self.graphs, None if self.reload else self.blocks.available, self.blocks.bits)

    @cached_property
    def products(self) -> Products | None:
        """How products by constants are made with look-ahead; None without."""
        return products_for(self.graphs, self.blocks) if self.look_ahead else None

    @cached_property
    def _own_cost(self) -> Cost:
        """Operators at a clock, with products in pieces as multiplier blocks take them where there is look-ahead.

        Products made of adders share sums within a pipeline stage.
        """
        if self.products is not None:
            pieces = in_pieces(self.graphs, self.products)
            return cost_of_graphs(
                [graph for graph, _ in pieces], [scalings(graph) - blocks for graph, blocks in pieces]
            )
        clocks = parallel_clocks.pipeline_stages_of(self.graphs, self.channels, self.protect, self.adders)
        return cost_of_graphs(self.graphs, self.adders, pipeline_stages=clocks)

    @cached_property
    def built(self) -> Datapath:
        """The datapath with the widths of the hardware."""
        return with_room(self.datapath) if self.reload else self.datapath

    @property
    def _is_block(self) -> bool:
        """Whether the hardware is a `sosmith.hdl.cores.block.BlockCore`."""
        return self.look_ahead or self.samples_per_clock > 1

    @property
    def _latency_cycles(self) -> int:
        if self._is_block:
            return parallel_clocks.block_latency_cycles(self.datapath, self.samples_per_clock, self.products)
        return parallel_clocks.latency_cycles(self.built, self.channels, protect=self.protect, adders=self.adders)

    @property
    def _cycles_per_sample(self) -> int:
        return 1

    @property
    def _cleared_cycles(self) -> int:
        return self.channels if self.channels > 1 else 0

    @property
    def clock_estimate(self) -> float:
        """Estimate of the highest clock for one channel, on an ECP5, in Hz."""
        return parallel_clocks.clock_estimate(self.datapath, self.samples_per_clock, self.products)

    def _core(self, *, before: bool = False) -> Component:
        from sosmith.hdl.cores.block import BlockCore  # only what makes hardware loads Amaranth
        from sosmith.hdl.cores.parallel import Core

        if self._is_block:
            return BlockCore(self.datapath, self.samples_per_clock, products=self.products, adders=self.adders)
        return Core(
            self.built.behind_decimator,
            self.channels,
            fingerprint=self.fingerprint,
            protect=self.protect,
            lock=self.reload_lock,
            adders=self.adders,
            pins=self.bank_pins,
            flags_given=self._flags_given,
            before_decimator=before,
        )

    def reason(self, why: str, available: int) -> str:
        """Say in a sentence that it was chosen and `why`, and which products are made of adders."""
        del available
        lanes = self.samples_per_clock
        several = f", {lanes} samples a clock" if lanes > 1 else ""
        return f"{self.name}: {why}{several}{self._made_of_adders()}"

    @property
    def _truncated(self) -> int:
        """Products that are sums in the graphs themselves."""
        return sum(graph.nodes[index].op is not Op.SCALE for graph in self.graphs for index in constants_of(graph))

    def _made_of_adders(self) -> str:
        count, there = sum(map(len, self.adders)) + self._truncated, self.blocks.available
        if not count:
            return ""
        products = f"{count} product{'s' * (count > 1)} by constants made of adders"
        if self.look_ahead:
            return f"; {products}, with registers between them"
        blocks = "without multiplier blocks" if not there else f"with at most {there} multiplier blocks"
        return f"; {blocks}, {products}"
