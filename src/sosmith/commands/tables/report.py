"""The table of a co-simulation's results."""

from __future__ import annotations

from typing import Any

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table


def print_summary(summary: dict[str, Any]) -> None:
    """Print verdict, errors and speed; `summary` is the content of ``report.json``."""
    unit = escape(f" {summary['error']['unit']}".rstrip())
    verdict = "[bold green]passed[/]" if summary["passed"] else "[bold red]fell short[/]"
    table = new_table(f"{summary['name']}: {verdict}", ["", ""])
    exact = (
        "yes, all"
        if summary["bit_exact"]
        else f"no: {summary['mismatches']} differ, the first at {summary['first_mismatch']}"
    )
    table.add_row("hardware equals integer model", f"{exact} of {summary['samples']} samples")
    error = summary["error"]
    table.add_row(
        "largest error against golden",
        f"{error['max_abs']:.4g}{unit} = {error['max_lsb']:.3f} LSB (bound {error['bound']:.4g}{unit})",
    )
    if summary["sqnr_db"] is not None:
        table.add_row("signal to quantization noise", f"{summary['sqnr_db']:.1f} dB")
    accuracy = summary["accuracy_percent"]
    if accuracy["hardware"] is not None:
        measured = ", ".join(f"{chain} {percent:.4f} %" for chain, percent in accuracy.items())
        table.add_row("accuracy by the paper's measure", measured)
    for other in summary["alternatives"]:
        table.add_row(f"  {other['name']} at the same widths", f"largest error {other['max_abs']:.4g}{unit}")
    for reason in summary["shortfalls"]:
        table.add_row("[red]short[/]", escape(reason))
    gates = "" if summary["gates"] is None else f", the netlist for {summary['gates']}"
    speed = (
        f"{summary['simulator']}{gates}, {summary['cycles']} clocks at {summary['cycles_per_second']:.3g} per second"
    )
    table.add_row("simulated in", speed)
    TableConsole().print(table)
