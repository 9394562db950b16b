"""What was tried for goals of benchmarks/cost.py that are missed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tried:
    """Attempts at one goal.

    Attributes
    ----------
    goal : str
        What was to be reached.
    ways : tuple of str
        What was tried, and what came of it.
    obstacle : str
        What stands in the way.
    """

    goal: str
    ways: tuple[str, ...]
    obstacle: str


TRIES: tuple[Tried, ...] = ()
