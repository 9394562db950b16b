"""That a core always goes on: within how many clocks it takes a sample and gives its result."""

from __future__ import annotations

from typing import NamedTuple


class Progress(NamedTuple):
    """Most clocks that things take while nothing outside stands in the way.

    Attributes
    ----------
    taken : int
        Clocks in which a sample on offer is taken, once the core is not being cleared, while the sink is ready.
    given : int
        Clocks from the edge that takes it to the edge at which its result leaves, while the sink is ready.
    cleared : int
        Clocks after a reset in which no sample is taken.
    """

    taken: int
    given: int
    cleared: int

    def __str__(self) -> str:
        cleared = f", {self.cleared} clocks after a reset" if self.cleared else ""
        return (
            f"while the sink is ready, a sample on offer is taken within {self.taken} clocks{cleared}, "
            f"and its result leaves within {self.given} clocks"
        )
