"""The command `verify`: prove a certificate again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from rich.markup import escape

from sosmith.commands.design_tables import print_budget
from sosmith.gen.verifier.certificate_file import Certificate, read_certificate
from sosmith.gen.verifier.verification import RejectedError, Verdict
from sosmith.gen.verifier.verification import verify as verify_certificate
from sosmith.terminal import JSON_OPTION, TableConsole, print_json, show_progress


@click.command()
@click.argument("certificate", type=click.Path(path_type=Path))
@JSON_OPTION
def verify(certificate: Path, as_json: bool) -> None:
    """Prove CERTIFICATE again: the error bound, and that nothing inside can overflow.

    Reads nothing but that file, which `sosmith generate` writes as <name>.certificate.json, and works by another
    method than the one it was made with. Exits with 1 and the reason if anything claimed is not exactly what follows.
    """
    read = read_certificate(certificate)
    with show_progress() as step:
        try:
            verdict = verify_certificate(read, step)
        except RejectedError as error:
            raise RejectedError(f"{certificate}: {error}") from None
    if as_json:
        print_json(_verdict_json(read, verdict))
    else:
        _print_verdict(read, verdict)


def _verdict_json(certificate: Certificate, verdict: Verdict) -> dict[str, Any]:
    lsb = certificate.output.lsb
    return {
        "name": certificate.name,
        "proven": True,
        "error_bound": float(verdict.bound * lsb),
        "error_parts": {part: float(value * lsb) for part, value in verdict.budget.items()},
        "error_unit": certificate.output.unit,
        "max_error": float(certificate.max_error),
        "nodes": verdict.nodes,
        "ranges_from_peak_gains": verdict.ranges,
    }


def _print_verdict(certificate: Certificate, verdict: Verdict) -> None:
    console = TableConsole()
    ranges = f"{verdict.nodes} nodes within their ranges, {verdict.ranges} by peak gains: nothing inside overflows"
    print_budget(console, verdict.budget, certificate.output.lsb, certificate.output.unit, certificate.max_error)
    console.print(f"[bold green]proven[/]: {escape(certificate.name)}, {ranges}")
