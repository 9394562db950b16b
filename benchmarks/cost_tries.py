"""What was tried for the missed goals of benchmarks/cost.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

REALIZATIONS = ("df1_ef1", "df1", "delta", "df2t", "state_space")
"""Realizations of audio_lowpass beside the one that `auto` takes."""

WISHES = ("-noccu2", "-abc2", "-retime")
"""Options of synthesis for an ECP5 that might save logic."""


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


def smaller_on_an_ecp5(measured: Mapping[str, Any]) -> Tried:
    """Return what was tried for the goal that is to beat, from the areas after synthesis that are recorded of it."""
    auto, areas = measured["auto"], measured["areas"]
    others = "; ".join(f"{name} {areas[name]:,}" for name in REALIZATIONS)
    carries, bits = auto["all_luts"] - auto["luts"], (auto["all_luts"] - auto["luts"]) // 2
    return Tried(
        goal="audio_lowpass parallel, all LUT4, at most 500 on an ECP5, by synthesis alone:",
        ways=(
            f"Realizations: {measured['realization']}, which `auto` takes, {auto['all_luts']}; {others}.",
            f"Sums from LUT4 instead of carry cells (`synth_ecp5 -noccu2`): {areas['-noccu2']:,}.",
            f"More optimization by ABC (`-abc2`) {areas['-abc2']}, retiming (`-retime`) {areas['-retime']}.",
        ),
        obstacle=f"{carries} of the {auto['all_luts']} are {bits} carry cells, counted as two LUT4 each; each bit of a "
        "sum is half of one.",
    )


TRIES = (
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
