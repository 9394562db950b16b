"""The interface of every bench: it takes input beats and returns output beats and clock counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from sosmith.sim.beats import Beats

Progress = Callable[[int, int], None]
"""Called with the number of beats received and their total."""


@dataclass(frozen=True, kw_only=True)
class BenchRun:
    """Result of running a bench.

    Attributes
    ----------
    received : Beats
        Output beats, in order.
    cycles : int
        Clocks from the end of reset to the last beat received.
    seconds : float
        Processor time that these clocks took, in a simulator; the rest of the machine's load is not in it.
    tools : mapping of str to str
        Versions of the tools that ran the core, by name.
    """

    received: Beats
    cycles: int
    seconds: float
    tools: Mapping[str, str]


class Bench(Protocol):
    """Something that runs a core."""

    @property
    def name(self) -> str:
        """Name of the simulator or board that runs the core."""
        ...

    def run(self, sent: Beats, progress: Progress) -> BenchRun:
        """Reset the core, send it all beats of `sent`, and receive all their results.

        Raises
        ------
        ShortfallError
            If the core breaks a rule of AXI4-Stream.
        ToolError
            If a tool is missing or fails.
        """
        ...
