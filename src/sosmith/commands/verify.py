"""The command `verify`: prove a certificate by an independent method."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.terminal import JSON_OPTION, print_json, show_progress


@click.command()
@click.argument("certificate", type=click.Path(path_type=Path))
@JSON_OPTION
def verify(certificate: Path, as_json: bool) -> None:
    """Prove CERTIFICATE by an independent method: the error bound, and no internal overflow.

    CERTIFICATE is the <name>.certificate.json that `sosmith generate` writes; no other file is read. The method is
    different from the one that made the certificate. Exits with 1 and the reason if any claim does not follow exactly.

    \b
        sosmith verify my_core/my.certificate.json
    """
    from sosmith.interface.certificate import Certificate
    from sosmith.model.errors import ShortfallError

    read = Certificate.load(certificate)
    with show_progress() as step:
        try:
            proof = read.verify(step)
        except ShortfallError as error:
            raise ShortfallError(f"{certificate}: {error}") from None
    if as_json:
        print_json(
            {
                "name": read.name,
                "proven": True,
                "error_bound": proof.bound,
                "error_parts": proof.budget,
                "error_unit": proof.bound.unit,
                "max_error": float(read.entries.max_error),
                "nodes": proof.nodes,
                "ranges_from_peak_gains": proof.ranges,
            }
        )
    else:
        from sosmith.commands.tables.certificate import print_proof

        print_proof(read.entries, proof)
