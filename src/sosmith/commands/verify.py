"""The command `verify`: prove a certificate by an independent method."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from sosmith.commands.chain import prove_chain, refuse
from sosmith.terminal import JSON_OPTION, print_json, show_progress

_NOT_ALL = 4
"""Exit status if nothing is wrong, but a part of what was asked for is not proven."""


@click.command()
@click.argument("certificate", type=click.Path(path_type=Path))
@click.option(
    "--spec",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Hold the certificate against this specification, whose filter is derived again from its words.",
)
@click.option(
    "--files",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Hold the generated files in this folder against the certificate, byte for byte, and prove the SystemVerilog.",
)
@click.option("--rebuild", is_flag=True, help="Generate all files again and compare them with the certificate.")
@click.option(
    "--core",
    type=click.Choice(["instrument", "filter", "calibration"]),
    help="With --spec, the core that must be proven; all that the specification describes by default.",
)
@click.option(
    "--second-reader",
    type=click.Choice(["yosys"]),
    help="With --files, compare what is read with what this front end sees, every register bit by bit.",
)
@click.option("--rocq", is_flag=True, help="Have the kernel of the proof assistant Rocq check claims as well.")
@click.option(
    "--export",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write what Rocq checks into this folder, with a Makefile for another machine.",
)
@click.option(
    "--smt",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="With --files, write the goals of a parallel core's hardware into this folder as SMT-LIB, one text for each "
    "register, for other solvers.",
)
@click.option("--partial", is_flag=True, help="Exit with 0 where nothing is wrong, though a part is not proven.")
@click.option(
    "--time-limit",
    type=click.FloatRange(0),
    metavar="SECONDS",
    help="End with a refusal if the proof takes more processor time, or Rocq longer; 0 for no limit.  "
    "[default: 60, and 600 for Rocq]",
)
@JSON_OPTION
def verify(
    certificate: Path,
    spec: Path | None,
    files: Path | None,
    rebuild: bool,
    core: str | None,
    second_reader: str | None,
    rocq: bool,
    export: Path | None,
    smt: Path | None,
    partial: bool,
    time_limit: float | None,
    as_json: bool,
) -> None:
    """Prove CERTIFICATE by an independent method: the error bound, and no internal overflow.

    CERTIFICATE is the <name>.certificate.json that `sosmith generate` writes. Without options no other file is read.
    The method is different from the one that made the certificate. Exits with 1 and the reason if any claim does not
    follow exactly, or anything that it is held against disagrees, and with 4 if nothing is wrong but a part of what was
    asked for is not proven: the table says which, and why.

    The certificate of a chain names those of its stages, which must lie in the same folder and are proven with it.

    \b
        sosmith verify my_core/my.certificate.json
        sosmith verify my_core/my.certificate.json --spec my.toml --files my_core --rebuild
        sosmith verify my_core/my.certificate.json --rocq --export my_core/rocq
        sosmith verify my_core/my.certificate.json --files my_core --smt my_core/goals
    """
    from sosmith.interface.chain.certificate import ChainCertificate, certificate_in
    from sosmith.model.errors import ShortfallError

    if smt is not None and files is None:
        raise click.UsageError("--smt must have --files, the folder with the SystemVerilog")
    read = certificate_in(certificate)
    limit = {} if time_limit is None else {"seconds": time_limit}
    if isinstance(read, ChainCertificate):
        stage = certificate.with_name(read.entries.stages[0].certificates[0].name)
        instead = f": give it with the certificate of each stage, such as {stage}"
        refuse(instead, rebuild=rebuild, core=core, second_reader=second_reader, smt=smt)
        options: dict[str, Any] = {"spec": spec, "files": files, "rocq": rocq, "export": export}
        if not prove_chain(read, certificate, limit=limit, as_json=as_json, **options) and not partial:
            click.get_current_context().exit(_NOT_ALL)
        return
    with show_progress() as step:
        try:
            proof = read.verify(
                step,
                spec=spec,
                files=files,
                rebuild=rebuild,
                core=core,
                second_reader=second_reader,
                **limit,
            )
            written = [] if export is None else read.export_rocq(export)
            checked = read.check_in_rocq(step, **limit) if rocq else None
            goals = [] if smt is None or files is None else read.export_smt(smt, files=files)
        except ShortfallError as error:
            raise ShortfallError(f"{certificate}: {error}") from None
    if as_json:
        kernel = {
            "rocq": None if checked is None else asdict(checked),
            "rocq_files": [str(path) for path in written],
            "smt_files": [str(path) for path in goals],
        }
        print_json({"name": read.name, **proof.as_dict(), **kernel})
    else:
        from sosmith.commands.tables.certificate import print_proof
        from sosmith.commands.tables.rocq import print_goals, print_rocq

        print_proof(read.entries, proof)
        print_rocq(checked, written)
        print_goals(goals)
    if (proof.missing or (checked is not None and checked.unchecked)) and not partial:
        click.get_current_context().exit(_NOT_ALL)
