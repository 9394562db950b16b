"""What was tried for the missed goals of benchmarks/cost.py."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tried:
    """Attempts at one goal.

    Attributes
    ----------
    goal : str
        The goal.
    ways : tuple of str
        What was tried, with the result.
    obstacle : str
        What prevents reaching the goal.
    """

    goal: str
    ways: tuple[str, ...]
    obstacle: str


TRIES = (
    Tried(
        goal="audio_lowpass parallel, all LUT4, at most 500 on an ECP5, by synthesis alone:",
        ways=(
            "Realizations: df1_ef2, which `auto` takes, 623; df1_ef1 727; df1 774; delta 819; df2t 1,151; "
            "state_space 1,496.",
            "Sums from LUT4 instead of carry cells (`synth_ecp5 -noccu2`): 2,349.",
            "More optimization by ABC (`-abc2`), retiming (`-retime`): 623 as without.",
        ),
        obstacle="506 of the 623 are 253 carry cells, counted as two LUT4 each; each bit of a sum is half of one.",
    ),
    Tried(
        goal="flange_wear_locomotive folded on iCE40 UP5K, at most 10 % more logic cells for 64 channels than for one: "
        "319 for one and 355 for 64. The goal is 350.",
        ways=(
            "The end of clearing detected by a carry bit of the address counter instead of a comparison: 319 and 353, "
            "but up to twice as many clocks after a reset.",
            "The same, with one register for samples accepted and samples dropped: 317 and 353.",
            "Two memories selected by the top bit of the channel, instead of by Yosys from the address: 353 for 64 "
            "channels.",
            "A data register outside the multiplier block: 334 for one channel, which reduces the increase but "
            "enlarges the core.",
        ),
        obstacle="64 channels of 64 words each need two groups of block RAMs. Selecting between their outputs takes 16 "
        "cells, the channel number 6, the longer address counter 3. Before read-write collisions were declared unused "
        "and the data register moved into the multiplier block, it was 375 and 422.",
    ),
)
