"""The files of a chain: those of each stage, and top, manifest, C model and certificate of the whole."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from sosmith.gen.chain.c_model import chain_header, chain_source
from sosmith.gen.chain.design import ChainDesign, Folding, Kept
from sosmith.gen.chain.joints.registers import registers_unit
from sosmith.gen.chain.shared_hardware import shared_hardware
from sosmith.gen.chain.top import chain_interface, top_text
from sosmith.gen.filter.largest_gain import Peak
from sosmith.gen.output.certificate import certificate, port_entry
from sosmith.gen.output.generate import generated
from sosmith.gen.output.manifest import stream_entry
from sosmith.gen.version import __version__
from sosmith.model.text_files import to_json, write_files
from sosmith.verify.certificate_file import Certificate, FileEntry, below_on_grid, entries_text, on_grid
from sosmith.verify.chain.chain_file import (
    ChainCertificate,
    ChainStageEntry,
    FoldingEntry,
    KeptEntry,
    LargestEntry,
    LimitedEntry,
    sealed_chain,
)

Claims = list[tuple[Certificate, ...]]
"""The certificates of the cores of each stage."""

Progress = Callable[[str], None]


def generate_chain(design: ChainDesign, directory: Path, progress: Progress = lambda step: None) -> list[Path]:
    """Write all files of a chain into a folder; return their paths. Two runs write the same bytes.

    Raises
    ------
    SpecificationError
        If the folder cannot be written.
    ToolError
        If Yosys fails, or the disk is full.
    """
    return write_files(directory, chain_texts(design, progress))


def chain_texts(design: ChainDesign, progress: Progress = lambda step: None) -> dict[str, str]:
    """Return the texts that `generate_chain` writes, by the names of the files."""
    name, texts, claims = design.name, dict[str, str](), _claims(design)
    for stage, proven in zip(design.stages, claims, strict=True):
        for core, each in zip(stage.cores, proven, strict=True):
            progress(f"stage {stage.spec.name}")
            texts |= generated(core, claims=each)
            texts[f"{each.name}.toml"] = core.spec.text
    own = {
        f"{name}.sv": top_text(design),
        f"{name}.json": to_json(_manifest(design, claims)),
        f"{name}.c": chain_source(design),
        f"{name}.h": chain_header(design),
    }
    for stage in design.stages:
        own |= shared_hardware(stage)
    for stage in design.stages:
        registers = registers_unit(design, stage)
        own |= {} if registers is None else registers.files()
    certified = entries_text(_certified(design, claims, texts, own))
    written = {f"{name}.toml": design.spec.text} if design.spec.is_written else {}
    return {**own, f"{name}.certificate.json": certified, **written, **texts}


def chain_manifest(design: ChainDesign) -> dict[str, Any]:
    """Return what software needs to know of a chain: the content of ``<name>.json``."""
    return _manifest(design, _claims(design))


def _manifest(design: ChainDesign, claims: Claims) -> dict[str, Any]:
    """Return the manifest of a chain whose stages have these claims."""
    errors = list(map(_error, claims))
    shares = [error * stage.gain for error, stage in zip(errors, design.stages, strict=True)]
    interface = chain_interface(design)
    return {
        "name": design.name,
        "core": "chain",
        "sosmith_version": __version__,
        "spec": design.spec.source,
        "channels": design.spec.base.channels,
        "streams": {"s_axis": stream_entry(interface.inputs), "m_axis": stream_entry(interface.outputs)},
        "stages": [
            {
                "name": stage.spec.name,
                "kind": stage.spec.kind,
                "cores": [core.datapath.name for core in stage.cores],
                "architectures": [core.architecture.name for core in stage.cores],
                "interpolate": stage.rate.rise,
                "decimate": stage.rate.factor,
                "error_bound": float(error),
                "gain_to_the_end": float(stage.gain),
            }
            for stage, error in zip(design.stages, errors, strict=True)
        ],
        "interpolate": design.rise,
        "decimate": design.factor,
        "settling_results": design.settling,
        "error_bound": float(sum(shares, Fraction(0))),
        "error_parts": {stage.spec.name: float(share) for stage, share in zip(design.stages, shares, strict=True)},
        "error_unit": design.spec.base.output.unit,
    }


def chain_certificate(design: ChainDesign) -> ChainCertificate:
    """Certify a chain before its files are written."""
    claims = _claims(design)
    texts = {f"{each.name}.certificate.json": entries_text(each) for proven in claims for each in proven}
    return _certified(design, claims, texts, {})


def _claims(design: ChainDesign) -> Claims:
    """Certify the cores of the stages one by one."""
    return [
        tuple(certificate(core.quantized, core.spec.max_error, online=core.architecture.online) for core in stage.cores)
        for stage in design.stages
    ]


def _error(proven: Sequence[Certificate]) -> Fraction:
    """Bound on the error of a stage, that of its worst core."""
    return max(each.claims.bound for each in proven) * proven[0].output.lsb


def _certified(
    design: ChainDesign, claims: Claims, texts: Mapping[str, str], own: Mapping[str, str]
) -> ChainCertificate:
    """Certify a chain whose stages have these claims, and whose files have these texts."""
    base = design.spec.base
    entries = tuple(
        ChainStageEntry(
            name=stage.spec.name,
            kind=stage.spec.kind,
            certificates=tuple(
                _file(f"{each.name}.certificate.json", texts[f"{each.name}.certificate.json"]) for each in proven
            ),
            error=_error(proven),
            gain=stage.gain,
        )
        for stage, proven in zip(design.stages, claims, strict=True)
    )
    return sealed_chain(
        ChainCertificate(
            format="sosmith chain certificate 1",
            name=design.name,
            specification=design.spec.text,
            inputs=tuple(map(port_entry, base.inputs)),
            output=port_entry(base.output),
            max_error=base.max_error,
            channels=base.channels,
            stages=entries,
            bound=sum((entry.error * entry.gain for entry in entries), Fraction(0)),
            settling=design.settling,
            folding=tuple(map(_folding, design.foldings)),
            limited=_limited(design),
            files=tuple(_file(name, text) for name, text in own.items()),
            certificate="0" * 64,
        )
    )


def _folding(folding: Folding) -> FoldingEntry:
    return FoldingEntry(
        rise=folding.segment.rise,
        factor=folding.segment.factor,
        anywhere=_largest(folding.anywhere),
        edge=folding.edge,
        passing=None if folding.passing is None else _largest(folding.passing),
        kept=None if folding.kept is None else _kept(folding.kept),
    )


def _limited(design: ChainDesign) -> LimitedEntry | None:
    """Return what is claimed of some stages that have limits; None if those are of all stages, or there are none."""
    if design.spec.span is None or design.limited is None:
        return None
    first, end = design.spec.span
    return LimitedEntry(**dict(_folding(design.limited)), first=first, last=end - 1)


def _kept(kept: Kept) -> KeptEntry:
    return KeptEntry(
        least=LargestEntry(gain=below_on_grid(kept.least.gain), at=kept.least.at),
        most=_largest(kept.most),
        stop=kept.stop,
        stopped=None if kept.stopped is None else _largest(kept.stopped),
    )


def _largest(peak: Peak) -> LargestEntry:
    return LargestEntry(gain=on_grid(peak.gain), at=peak.at)


def _file(name: str, text: str) -> FileEntry:
    return FileEntry(name=name, sha256=hashlib.sha256(text.encode()).hexdigest())
