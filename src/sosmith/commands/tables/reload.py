"""The table of a set of coefficients that may be loaded."""

from __future__ import annotations

from typing import Any

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.gen.core import CoreDesign
from sosmith.gen.reload.reload import Swap
from sosmith.gen.specification.specification import Specification


def _start(made: CoreDesign) -> str:
    """Say how a core starts with a new set."""
    settling = made.quantized.settling
    if not settling:
        return "in the steady state of its next sample"
    seconds = settling / float(made.spec.sample_rate)
    return f"from zero; it flags {settling:,} samples as settling, {seconds:.3g} s"


def print_swap(made: CoreDesign, wanted: Specification, swap: Swap, tree: dict[str, Any]) -> None:
    """Print the error bound of the new set and the transient of the swap; `tree` is the content of the file."""
    console = TableConsole()
    output, quantized = made.datapath.output, swap.made.quantized
    unit = escape(f" {output.unit}".rstrip())
    bound, allowed = quantized.bound * output.lsb, wanted.max_error
    table = new_table(f"{made.spec.name}: the set may be loaded", ["", ""])
    if quantized.filter is not None:
        table.add_row("filter", quantized.filter.describe)
    table.add_row("error bound", f"{float(bound):.3g}{unit} of {float(allowed):.3g}{unit} allowed")
    table.add_row("headroom", f"{float(allowed - bound):.3g}{unit}, {float(100 * (1 - bound / allowed)):.1f} %")
    if swap.samples:
        seconds = swap.samples / float(made.spec.sample_rate)
        table.add_row("transient", f"{swap.samples:,} samples, {seconds:.3g} s, until the bound holds again")
    else:
        table.add_row("transient", "none, the bound holds from the first sample")
    if made.architecture.restarts:
        table.add_row("the core restarts", _start(made))
    table.add_row("states", f"use at most {100 * float(swap.use):.3g} % of their range")
    crc = tree["writes"][-1][1]
    table.add_row("load", f"version {tree['version']}, {tree['words']:,} words, CRC 0x{crc:08X}")
    table.add_row("for the design", f"0x{tree['design']:08X}")
    console.print(table)
