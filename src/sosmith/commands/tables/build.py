"""The table that shows a build for a board."""

from __future__ import annotations

from typing import Any

from sosmith.commands.tables.console import TableConsole, new_table


def print_build(facts: dict[str, Any]) -> None:
    """Print what a design takes of the FPGA, and how fast it could run: the content of ``build.json``."""
    table = new_table(f"{facts['name']} on {facts['title']}", ["", ""])
    table.add_row("device", facts["device"])
    table.add_row("architecture", facts["architecture"])
    for kind, cells in facts.get("utilisation", {}).items():
        if cells["used"]:
            share = 100 * cells["used"] / cells["available"]
            table.add_row(kind, f"{cells['used']:,} of {cells['available']:,}, {share:.0f} %")
    for clock in facts.get("clocks", ()):
        met = "closes" if clock["achieved_mhz"] >= clock["wanted_mhz"] else "does not close"
        table.add_row(
            "timing", f"{met}: {clock['achieved_mhz']:.2f} MHz, of which {clock['wanted_mhz']:.2f} MHz are needed"
        )
    if "project" in facts:
        table.add_row("timing", f"not known: {facts['project']['tool']} was not run")
    table.add_row("serial line", f"{facts['line_rate_baud']:,} baud")
    TableConsole().print(table)
