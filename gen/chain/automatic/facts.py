"""The table of the structures that were looked at."""

from __future__ import annotations

from sosmith.gen.chain.automatic.choice import Choice, Looked
from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.facts.table import Table


def looked_table(design: ChainDesign, choice: Choice) -> Table:
    """Say what structures there were, what they take, and why all but one were not taken."""
    device = choice.device
    rows = [(each.structure, *_cost(each), each.verdict) for each in choice.looked]
    head = ("structure", "LUT4", "multipliers", "memory bits", "cost", "verdict")
    note = "Cost: LUT4, and what multipliers and memory take of the FPGA's as LUT4"
    if device.multipliers:
        note += f", {round(device.logic_cells / device.multipliers):,} for a multiplier"
    note += "; a row with ≈ is what is expected, without a design."
    title = f"{design.name}: structures, for the {device.title}"
    return Table(title, rows, head, numbers=(1, 2, 3, 4), notes=(note,))


def _cost(each: Looked) -> tuple[str, ...]:
    """Return what it takes, with a sign where it was not designed."""
    if each.cost is None or each.weighed is None:
        return ("",) * 4
    luts, *others = (f"{round(value):,}" for value in (*each.cost, each.weighed))
    return (luts if each.designed else f"≈ {luts}", *others)
