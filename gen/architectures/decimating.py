"""What the parallel architectures of an FIR filter that decimates have in common: a sample at every clock."""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import Blocks
from sosmith.gen.specification.combinations import PARALLEL
from sosmith.hdl.plan.decimating.plan import DecimatingPlan
from sosmith.model.errors import ShortfallError


@dataclass(frozen=True)
class AtEachClock(Architecture):
    """Hardware that takes a sample at each clock."""

    terms = PARALLEL
    is_filled = True

    def __post_init__(self) -> None:
        try:
            _ = self.plan
        except ValueError as error:
            raise ShortfallError(f"the parallel architecture must suit the filter: its {error}") from None

    @classmethod
    def is_tried(cls, blocks: Blocks) -> bool:
        """Return True: it is the fastest."""
        del blocks
        return True

    @property
    def plan(self) -> DecimatingPlan:
        """Its plan of clocks.

        Raises
        ------
        ValueError
            If it does not suit the datapath.
        """
        raise NotImplementedError

    @property
    def copies_per_result(self) -> int:
        """Times that each result is handed out."""
        return self.plan.factor if self.hold else 1

    @property
    def _latency_cycles(self) -> int:
        return self.plan.latency_cycles

    @property
    def _cycles_per_sample(self) -> int:
        return self.plan.factor

    @property
    def _cleared_cycles(self) -> int:
        return self.plan.reset_cycles

    @property
    def cycles_per_result(self) -> int:
        """Clocks between results at the highest rate."""
        return self.plan.factor

    @property
    def cycles_per_sample(self) -> int:
        """Return 1."""
        return 1

    @property
    def clocks_per_sample(self) -> float:
        """Return 1."""
        return 1
