"""The table of what a design is estimated to take on FPGAs."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.gen.estimate.estimate import Clocks, Estimate
from sosmith.gen.facts.table import Table

TITLE = "Cost of the core, estimated before synthesis"

_HEAD = ("FPGA", "LUT4", "within", "FF", "multipliers", "memory bits", "MHz")


def cost_table(estimates: Sequence[Estimate]) -> Table:
    """Say what a design takes on each FPGA, how good that is, and which clocks such cores reach."""
    rows = [
        (
            each.device,
            f"{each.luts:,}",
            f"{100 * each.tested.nine_in_ten:.0f} %",
            f"{each.flip_flops:,}",
            f"{each.multiplier_blocks:,}",
            f"{each.memory_bits:,}",
            _reached(each.clocks),
        )
        for each in estimates
    ]
    return Table(TITLE, rows, _HEAD, notes=[tested_sentence(estimates)], numbers=range(1, 7))


def tested_sentence(estimates: Sequence[Estimate]) -> str:
    """Say how good estimates are, and what clocks stand beside them."""
    tested = sum(each.tested.designs for each in estimates)
    return f"LUT4 for 9 of 10 of {tested} designs tested; MHz of placed cores of this architecture."


def _reached(clocks: Clocks | None) -> str:
    return "unknown" if clocks is None else f"{clocks.lowest:.0f} to {clocks.highest:.0f}"
