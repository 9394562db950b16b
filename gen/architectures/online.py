"""The online architecture: sections work on signed digits, the most significant first."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import NO_LIMIT, Blocks
from sosmith.gen.fpga.boards import Board
from sosmith.gen.specification.combinations import ONLINE
from sosmith.gen.word_lengths.cost import Cost
from sosmith.gen.word_lengths.objective import Objective
from sosmith.gen.word_lengths.online_units import OnlineUnits, online_cost, unsuitable_online
from sosmith.hdl.plan import online_clocks
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.online import OnlineError, OnlineSchedule

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component


@dataclass(frozen=True)
class Online(Architecture):
    """Sections work on signed digits, the most significant first."""

    terms = ONLINE
    checked = "the file is that of the certificate, which proves that no residual of its units leaves its range"

    @classmethod
    def is_tried(cls, blocks: Blocks) -> bool:
        """Return False: only where it is asked for, as it takes more than the others."""
        del blocks
        return False

    @classmethod
    def objective(cls, board: Board | None, *, adders: bool = False, blocks: Blocks = NO_LIMIT) -> Objective:
        """Return the estimated area of the units for its rate."""
        del board, adders, blocks
        return OnlineUnits()

    @cached_property
    def online(self) -> OnlineSchedule:
        """Clocks of the units.

        Raises
        ------
        ShortfallError
            If a section is not one for on-line arithmetic.
        """
        try:
            return online_clocks.schedule_of(self.datapath)
        except OnlineError as error:
            raise ShortfallError(unsuitable_online(error)) from None

    @property
    def cost(self) -> Cost:
        """Operators before synthesis."""
        return online_cost(self.datapath)

    @property
    def _latency_cycles(self) -> int:
        return online_clocks.latency_cycles(self.datapath)

    @property
    def _cycles_per_sample(self) -> int:
        return self.online.interval

    def _core(self, *, before: bool = False) -> Component:
        del before
        from sosmith.hdl.online.core import OnlineCore  # only what makes hardware loads Amaranth

        return OnlineCore(self.datapath)
