"""The table of a proven certificate."""

from __future__ import annotations

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole
from sosmith.commands.tables.design import print_budget
from sosmith.gen.verifier.certificate_file import Certificate
from sosmith.interface.certificate import Proof
from sosmith.interface.quantity import Quantity


def print_proof(certificate: Certificate, proof: Proof) -> None:
    """Print the proven error budget, and the number of ranges checked."""
    console = TableConsole()
    ranges = f"{proof.nodes} nodes within their ranges, {proof.ranges} by peak gains: nothing inside overflows"
    print_budget(
        console, proof.budget, certificate.output.lsb, Quantity(float(certificate.max_error), proof.bound.unit)
    )
    console.print(f"[bold green]proven[/]: {escape(certificate.name)}, {ranges}")
