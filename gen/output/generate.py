"""Writes a core's files: SystemVerilog, RTLIL, manifest, certificate, the bit-true C model, and its registers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.certificate import about, certificate
from sosmith.gen.output.core_facts import CoreFacts, core_facts
from sosmith.gen.output.header import with_comments
from sosmith.gen.output.manifest import manifest
from sosmith.gen.output.verilog import core_texts
from sosmith.gen.reload.register_map import c_registers, systemrdl
from sosmith.model.dataflow.c_model import c_header, c_source
from sosmith.model.text_files import to_json, write_files
from sosmith.verify.certificate_file import Certificate, certificate_text, sealed


def generate(
    design: CoreDesign,
    directory: Path,
    progress: Callable[[str], None] = lambda step: None,
    *,
    facts: CoreFacts | None = None,
    claims: Certificate | None = None,
) -> list[Path]:
    """Write SystemVerilog, RTLIL, manifest, certificate and C model; return the paths of the files.

    A reloadable core also gets its register map as a C header and in SystemRDL. Two runs on the same specification
    write the same bytes.

    Parameters
    ----------
    design : CoreDesign
        The core.
    directory : Path
        Folder for the files, created if missing.
    progress : callable
        Called with the name of each step.
    facts : CoreFacts or None
        The facts about the core, if they have been collected already.
    claims : Certificate or None
        Its certificate, if it has been made already; what is written names the files too.

    Raises
    ------
    ToolError
        If Yosys fails, or the disk is full.
    SpecificationError
        If the folder cannot be written.
    """
    return write_files(directory, generated(design, progress, facts=facts, claims=claims))


def generated(
    design: CoreDesign,
    progress: Callable[[str], None] = lambda step: None,
    *,
    facts: CoreFacts | None = None,
    claims: Certificate | None = None,
) -> dict[str, str]:
    """Return the texts that `generate` writes, by the names of the files; parameters and errors as there."""
    name, datapath = design.spec.name, design.datapath
    known = facts or core_facts(design)
    first = _hardware(design, known, progress) | {f"{name}.json": to_json(manifest(known))}
    rest = {f"{name}.c": c_source(datapath), f"{name}.h": c_header(datapath), **_register_files(design)}
    progress("certificate")
    proven = claims or certificate(design.quantized, design.spec.max_error, online=design.architecture.online)
    named = sealed(proven.model_copy(update={"about": about(design, {**first, **rest})}))
    return {**first, f"{name}.certificate.json": certificate_text(named), **rest}


def _hardware(design: CoreDesign, known: CoreFacts, progress: Callable[[str], None]) -> dict[str, str]:
    """Return SystemVerilog and RTLIL of a core; nothing if its hardware stands with that of others."""
    if not design.architecture.has_module:
        return {}
    progress("SystemVerilog")
    verilog, rtlil = core_texts(design)
    name = design.spec.name
    return {f"{name}.sv": with_comments(verilog, design, known), f"{name}.il": rtlil}


def _register_files(design: CoreDesign) -> dict[str, str]:
    fingerprint = design.architecture.fingerprint
    if fingerprint is None or not design.architecture.reload_registers:
        return {}
    name, (words, _) = design.spec.name, design.architecture.bank_size
    protected, lock = design.architecture.protect != "none", design.architecture.reload_lock
    return {
        f"{name}_registers.h": c_registers(name, words=words, design=fingerprint, protected=protected, lock=lock),
        f"{name}.rdl": systemrdl(name, words=words, design=fingerprint, protected=protected, lock=lock),
    }
