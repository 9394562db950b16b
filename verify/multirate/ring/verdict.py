"""What is proven of a core that keeps its samples in rings."""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.verify.parallel.check import HardwareVerdict
from sosmith.verify.progress import Progress


@dataclass(frozen=True)
class RingVerdict(HardwareVerdict):
    """The result of the check of a core with rings.

    Attributes
    ----------
    result_clocks : int
        Clocks between results of a channel at the highest rate.
    factor : int
        Samples for each of them.
    pace : Progress
        Within how many clocks samples are taken and results leave.
    """

    result_clocks: int
    factor: int
    pace: Progress

    @property
    def progress(self) -> Progress:
        """Within how many clocks samples are taken and results leave, while the sink is ready."""
        return self.pace

    @property
    def interval(self) -> int:
        """Clocks between samples at the highest rate, on average, rounded up."""
        return -(-self.result_clocks // self.factor)
