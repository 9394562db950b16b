"""The table of a proven certificate."""

from __future__ import annotations

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, plain, print_all
from sosmith.interface.certificate import Agreement, Entries, HardwareVerdict, ProgramVerdict, Proof
from sosmith.interface.chain.certificate import ChainProof


def print_proof(certificate: Entries, proof: Proof) -> None:
    """Print the proven error budget, and the number of ranges checked."""
    console = TableConsole()
    ranges = f"{proof.nodes} nodes within their ranges, {proof.ranges} by peak gains: nothing inside overflows"
    print_all(proof.tables())
    console.print(f"[bold green]proven[/]: {escape(plain(certificate.name))}, {ranges}")
    if proof.agreement is not None:
        console.print(f"[bold green]as specified[/]: {_agreement(proof.agreement)}")
    if proof.files:
        console.print(f"[bold green]unchanged[/]: {proof.files} files and the certificate itself, by their SHA-256")
    programs = [
        verdict.instructions for verdict in (proof.calibration, proof.program) if isinstance(verdict, ProgramVerdict)
    ]
    if programs:
        both = len(programs) > 1
        unproven = f"; the unit{'s' * both} that run{'s' * (not both)} them {'are' if both else 'is'} not part of it"
        console.print(
            f"[bold green]program{'s' * both}[/]: {' and '.join(map(str, programs))} instructions in the SystemVerilog "
            f"compute these graphs, for all inputs and states{'' if _is_unit_proven(proof) else unproven}"
        )
    if isinstance(proof.calibration, HardwareVerdict):
        _print_hardware(console, "calibration", proof.calibration)
    if proof.hardware is not None:
        _print_hardware(console, "hardware", proof.hardware)
    if proof.decimator is not None and certificate.decimation is not None:
        entry, decimator = certificate.decimation, proof.decimator
        repeated = f"; each result leaves {decimator.copies} times" if decimator.copies > 1 else ""
        parts = f"{entry.stages} integrators, {entry.stages} combs and"
        if decimator.channels > 1:
            parts = f"an adder for {entry.stages} sums and differences of each of {decimator.channels} channels and"
        before = ""
        if entry.calibration is not None and decimator.channels == 1:
            before = "; the first sample goes through the calibration once"
        console.print(
            f"[bold green]decimator[/]: {decimator.registers} registers around the core are {parts} what moves "
            f"one sample of {entry.factor} on, for all inputs, stalls and resets{before}{repeated}"
        )
    online = certificate.claims.online
    if online is not None:
        console.print(
            f"[bold green]units[/]: {online.units} for each of {len(online.sections)} sections, a sample every "
            f"{online.interval} clocks; no residual leaves its range, whatever the digits are"
        )
    if proof.rebuilt:
        console.print(f"[bold green]rebuilt[/]: {proof.rebuilt} files, the same byte for byte")
    _print_scope(console, proof)


def print_chain_proof(name: str, proof: ChainProof) -> None:
    """Print the proven error budget of a chain, and how much of each part is proven."""
    console = TableConsole()
    print_all(proof.tables())
    console.print(f"[bold green]proven[/]: {escape(plain(name))}, end to end")
    if proof.files:
        console.print(f"[bold green]unchanged[/]: {proof.files} files and the certificates, by their SHA-256")
    _print_scope(console, proof)


def _is_unit_proven(proof: Proof) -> bool:
    """Whether the unit that runs the programs is proven too."""
    return "unit" in proof.scope and not proof.scope["unit"].is_missing


def _print_scope(console: TableConsole, proof: Proof | ChainProof) -> None:
    for name, part in proof.scope.items():
        if part.asked:
            colour = "green" if part.state.value == "proven" else "yellow"
            console.print(f"[bold {colour}]{part.state.value.replace('_', ' ')}[/]: {name}: {escape(plain(part.why))}")


def _print_hardware(console: TableConsole, what: str, verdict: HardwareVerdict) -> None:
    memories = f" and {verdict.memories} memories" if verdict.memories else ""
    console.print(
        f"[bold green]{what}[/]: the SystemVerilog computes these graphs, each sample {verdict.latency} clocks "
        f"later, in {verdict.registers} registers{memories}, {verdict.states} of them states: for all inputs, stalls "
        "and resets"
    )


def _agreement(agreement: Agreement) -> str:
    parts = ["ports and allowed error"]
    if agreement.core != "filter":
        fitted = (
            f"calibration, fitted again to {agreement.measurements} measurements,"
            if agreement.fitted
            else "calibration"
        )
        parts.append(fitted)
    if agreement.by_losses:
        parts.append("filter by its edges and losses")
    elif agreement.distance is not None:
        parts.append(f"filter within a peak gain of {float(agreement.distance):.1e} of its words")
    compared = f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else parts[0]
    if agreement.not_compared:
        compared += f"; not compared: {escape(plain(', '.join(agreement.not_compared)))}"
    return compared
