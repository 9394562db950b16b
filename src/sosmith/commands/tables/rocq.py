"""What Rocq's kernel accepted of a certificate, claim by claim, and what was written for other provers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole
from sosmith.interface.certificate import RocqVerdict


def print_rocq(checked: RocqVerdict | None, written: Sequence[Path]) -> None:
    """Print each theorem that was accepted, the axioms they rest on, and what was not checked."""
    console = TableConsole()
    if written:
        console.print(f"[bold green]written[/]: {len(written)} files for Rocq in {escape(str(written[0].parent))}")
    if checked is None:
        return
    for name, words in checked.claims.items():
        console.print(f"[bold green]checked by Rocq[/]: {name}: {escape(words)}")
    axioms = ", ".join(checked.axioms) or "none"
    console.print(f"[bold green]axioms[/]: {escape(axioms)}; Rocq {escape(checked.version)}")
    for part in checked.given:
        console.print(f"[bold green]taken as given[/]: {escape(part)}")
    for part in checked.unchecked:
        console.print(f"[bold yellow]not checked by Rocq[/]: {escape(part)}")


def print_goals(written: Sequence[Path]) -> None:
    """Print how many goals were written for solvers."""
    if written:
        folder = escape(str(written[0].parent))
        TableConsole().print(
            f"[bold green]written[/]: {len(written)} goals in {folder}, to be unsat in any solver of QF_BV"
        )
