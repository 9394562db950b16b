"""What every bench does, whatever runs the core: it takes input beats and gives output beats and clock counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from sosmith.sim.stream_packing import Beats

Progress = Callable[[int, int], None]
"""Told the number of beats received and their total."""


@dataclass(frozen=True, kw_only=True)
class BenchRun:
    """What a bench saw.

    Attributes
    ----------
    received : Beats
        Output beats, in order.
    cycles : int
        Clocks from the end of reset to the last beat received.
    seconds : float
        Duration of the run, without building.
    tools : mapping of str to str
        Versions of what ran the core, by name.
    """

    received: Beats
    cycles: int
    seconds: float
    tools: Mapping[str, str]


class Bench(Protocol):
    """Something that runs a core."""

    @property
    def name(self) -> str:
        """Name of what runs the core, such as a simulator."""
        ...

    def run(self, sent: Beats, progress: Progress) -> BenchRun:
        """Reset the core, send it all of `sent`, and receive as many beats.

        Raises
        ------
        ShortfallError
            If the core breaks a rule of AXI4-Stream.
        ToolError
            If a tool is missing or fails.
        """
        ...
