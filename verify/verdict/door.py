"""The door of the verifier: certificate, specification and files in, one verdict with its scope out.

What is proven of the hardware, and by which proof, follows from the certificate alone: no file beside it decides.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from sosmith.verify.c_model.check import check_c_model
from sosmith.verify.certificate_file import Certificate, ItemEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.multiplexed.check import check_multiplexed
from sosmith.verify.multirate.cic import DecimatorVerdict, check_decimator
from sosmith.verify.multirate.decimating.cic import check_cic, is_cic
from sosmith.verify.multirate.decimating.polyphase import check_polyphase
from sosmith.verify.multirate.decimation import at_lower_rate, behind_decimator, calibration_alone, module_in
from sosmith.verify.multirate.parallel_core import check_ahead, check_behind
from sosmith.verify.multirate.ring.check import check_rings
from sosmith.verify.parallel.check import HardwareVerdict, check_hardware
from sosmith.verify.program.check import ProgramVerdict, check_program
from sosmith.verify.reader.rtlil.check import check_rtlil
from sosmith.verify.reader.rtlil.kept import check_kept
from sosmith.verify.reader.source import read_source
from sosmith.verify.specified.calibration_fit import Refit, check_fit
from sosmith.verify.specified.stated_specification import Agreement, check_specification
from sosmith.verify.specified.words import words_of
from sosmith.verify.unit.check import UnitVerdict, check_unit
from sosmith.verify.verdict.generated_files import (
    about_of,
    ascii_text,
    check_about,
    check_files,
    check_measurements,
    check_seal,
    check_text,
    unicode_text,
)
from sosmith.verify.verdict.item import (
    check_item,
    check_ports,
    check_stated,
    core_of,
    file_names,
    not_compared,
    whole_core,
)
from sosmith.verify.verdict.limits import SECONDS, limited
from sosmith.verify.verdict.manifest import read_manifest
from sosmith.verify.verdict.scope import Part, Proofs, scope_of
from sosmith.verify.verdict.shared_hardware import SharedHardware
from sosmith.verify.verification import Progress, Verdict, verify

_PLAIN = re.compile(r"[A-Za-z_]\w{0,199}", re.ASCII)


@dataclass(frozen=True)
class Stated:
    """A specification to hold a certificate against: its text, its folder, and the file of its measurements, if any."""

    text: str
    folder: Path
    measurements: Path | None = None
    core: str | None = None
    """The core that was asked for; None for all that the specification describes."""


@dataclass(frozen=True)
class Judgement:
    """The result of the checks of a certificate, and how much of what was asked for is proven."""

    verdict: Verdict
    agreement: Agreement | None
    files: Mapping[str, bytes]
    """Contents of the files that were compared, by their names."""
    proofs: Proofs
    decimator: DecimatorVerdict | None
    scope: Mapping[str, Part] = field(default_factory=dict)


def judge(
    certificate: Certificate,
    progress: Progress,
    *,
    stated: Stated | None = None,
    folder: Path | None = None,
    content: bytes = b"",
    seconds: float = SECONDS,
    elsewhere: SharedHardware | None = None,
) -> Judgement:
    """Prove a certificate, and hold it against a specification and a folder of files.

    Parameters
    ----------
    certificate : Certificate
    progress : callable
        Called with the name of a step, the amount done and the total.
    stated : Stated or None
        The specification.
    folder : Path or None
        Folder of the files that were written with it.
    content : bytes
        Content of the certificate's own file.
    seconds : float
        Time that it may take, in s; 0 for any.
    elsewhere : SharedHardware or None
        What is proven of the hardware of an item that shares it with others; None if nothing is known of it.

    Raises
    ------
    RejectedError
        If anything is wrong: what is only not proven is in the scope.
    """
    with limited(seconds):
        return _judged(certificate, progress, stated, folder, content, elsewhere)


def _judged(
    certificate: Certificate,
    progress: Progress,
    stated: Stated | None,
    folder: Path | None,
    content: bytes,
    elsewhere: SharedHardware | None,
) -> Judgement:
    item = None if certificate.about is None else certificate.about.item
    if certificate.about is not None:
        check_about(certificate.about)
    verdict = verify(certificate, progress)
    if item is not None:
        check_item(certificate, item)
    agreement, core = None, None
    if stated is not None:
        progress("specification", 0, 0)
        agreement, core = _held_against(certificate, item, stated, verdict, progress)
    contents: Mapping[str, bytes] = {}
    proofs, decimator = None, None
    if folder is not None:
        progress("files", 0, 0)
        about = check_seal(certificate, content)
        names, wanted = [entry.name for entry in about.files], file_names(certificate.name, item)
        require(names == wanted, f"the files of the certificate must be {', '.join(wanted)}, not {', '.join(names)}")
        contents = check_files(about, folder)
        proofs, decimator = _files_proven(certificate, item, contents, progress, elsewhere)
    scope = scope_of(certificate, item, agreement, core, proofs)
    return Judgement(verdict, agreement, contents, proofs or Proofs(), decimator, scope)


def _held_against(
    certificate: Certificate, item: ItemEntry | None, stated: Stated, verdict: Verdict, progress: Progress
) -> tuple[Agreement, str]:
    agreement = check_specification(certificate, stated.text, verdict.margin, stated.folder)
    about = about_of(certificate)
    refit: Refit | None = None
    check_text(about, stated.text)
    if agreement.fitted:
        require(
            about.measurements is not None and stated.measurements is not None,
            "the certificate must name the measurements that its calibration was fitted to",
        )
        assert stated.measurements is not None
        progress("fit", 0, 0)
        refit = check_fit(check_measurements(about, stated.measurements), certificate.ideal.polynomial or ())
        agreement = replace(agreement, measurements=refit.rows)
    tree = words_of(stated.text)
    agreement = replace(agreement, not_compared=not_compared(tree))
    if item is not None:
        check_stated(certificate, item, tree, refit)
    proven_core = core_of(certificate)
    if stated.core is not None:
        require(proven_core == stated.core, f"the core must be {stated.core}, as asked for, not {proven_core}")
    return agreement, stated.core or whole_core(tree)


def _files_proven(
    certificate: Certificate,
    item: ItemEntry | None,
    contents: Mapping[str, bytes],
    progress: Progress,
    elsewhere: SharedHardware | None,
) -> tuple[Proofs, DecimatorVerdict | None]:
    require(_PLAIN.fullmatch(certificate.name) is not None, "the name of a core must be a plain identifier")
    sv, c, h, il, json = (f"{certificate.name}.{end}" for end in ("sv", "c", "h", "il", "json"))
    text = "" if item is not None and item.shared else ascii_text(sv, contents[sv])
    modules = read_source(text, certificate.name).modules if text else {}
    if item is None:
        return Proofs(), None
    progress("manifest", 0, 0)
    if modules:
        check_ports(modules[certificate.name], item)
    manifest = read_manifest(contents[json], certificate, item)
    proofs, decimator = _hardware_proven(certificate, item, text, progress) if modules else (Proofs(), None)
    if elsewhere is not None:
        proofs = replace(proofs, hardware=elsewhere.hardware)
    manifest.hold_clocks(proofs.hardware or proofs.unit if certificate.decimation is None else None)
    manifest.hold_cost(certificate, item, proofs)
    manifest.hold_program(proofs.program)
    progress("C model", 0, 0)
    source, header = (unicode_text(name, contents[name]) for name in (c, h))
    model = check_c_model(source, header, certificate, item)
    rtlil = None if elsewhere is None else elsewhere.rtlil
    if modules:
        progress("RTLIL", 0, 0)
        rtlil = check_rtlil(ascii_text(il, contents[il]), modules)
        check_kept(ascii_text(il, contents[il]), modules, asked=item.keep)
    return replace(proofs, unheld=tuple(manifest.open), model=model, rtlil=rtlil), decimator


def _hardware_proven(
    certificate: Certificate, item: ItemEntry, text: str, progress: Progress
) -> tuple[Proofs, DecimatorVerdict | None]:
    if item.protect != "none":
        return Proofs(), None
    decimator = None
    if certificate.decimation is not None:
        progress("decimator", 0, 0)
        decimator = check_decimator(text, certificate, item.channels)
    if item.reload:
        return Proofs(calibration=_ahead(certificate, item, text, progress)), decimator
    program: ProgramVerdict | None = None
    hardware: HardwareVerdict | None = None
    unit: UnitVerdict | None = None
    if certificate.downsampling is not None:
        progress("hardware", 0, 0)
        hardware = _downsampled(text, certificate, item)
    elif item.architecture in {"folded", "serial"}:
        progress("program", 0, 0)
        behind = None if certificate.decimation is None else f"{certificate.name}_behind"
        program = check_program(
            behind_decimator(text, certificate),
            at_lower_rate(certificate),
            calibrated=_calibrated(certificate, item) if behind is None else None,
            top=behind,
        )
        if certificate.decimation is None:
            progress("unit", 0, 0)
            unit = check_unit(text, certificate, serial=item.architecture == "serial")
    elif item.architecture == "multiplexed":
        progress("hardware", 0, 0)
        hardware = check_multiplexed(text, certificate, item)
    elif item.architecture == "parallel":
        progress("hardware", 0, 0)
        hardware = (
            check_hardware(text, certificate, item.channels, item.samples)
            if certificate.decimation is None
            else check_behind(text, certificate, item.channels)
        )
    return Proofs(program, hardware, _ahead(certificate, item, text, progress), unit=unit), decimator


def _downsampled(text: str, certificate: Certificate, item: ItemEntry) -> HardwareVerdict:
    """Prove an FIR filter of which every N-th result leaves."""
    if item.architecture == "parallel":
        return (check_cic if is_cic(certificate) else check_polyphase)(text, certificate, item)
    require(
        item.architecture == "folded",
        f"an FIR filter that decimates must be folded or parallel, not {item.architecture}",
    )
    return check_rings(text, certificate, item)


def _ahead(
    certificate: Certificate, item: ItemEntry, text: str, progress: Progress
) -> ProgramVerdict | HardwareVerdict | None:
    """Prove the calibration before a decimator, if there is one."""
    alone = calibration_alone(certificate)
    if alone is None:
        return None
    if item.ahead == "parallel":
        progress("hardware of the calibration", 0, 0)
        return check_ahead(text, certificate, item.channels)
    require(item.ahead in {"folded", "serial"}, "a calibration before a decimator must be parallel, folded or serial")
    progress("program of the calibration", 0, 0)
    module = module_in(text, certificate.name, alone.name)
    return check_program(module, alone, calibrated=_calibrated(certificate, item))


def _calibrated(certificate: Certificate, item: ItemEntry) -> tuple[tuple[int, int], ...]:
    """Return the codes of each input that are not outside the calibration."""
    return item.calibrated or tuple((port.lowest, port.highest) for port in certificate.inputs)


__all__ = ["Judgement", "RejectedError", "Stated", "judge"]
