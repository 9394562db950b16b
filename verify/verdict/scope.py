"""What a verdict is about: which parts were asked for, and which of them are proven, in part, or not read at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from sosmith.verify.c_model.check import ModelVerdict
from sosmith.verify.certificate_file import Certificate, ItemEntry
from sosmith.verify.parallel.check import HardwareVerdict
from sosmith.verify.program.check import ProgramVerdict
from sosmith.verify.reader.rtlil.check import RtlilVerdict
from sosmith.verify.specified.stated_specification import Agreement
from sosmith.verify.unit.check import UnitVerdict


class State(Enum):
    """How much of a part is proven."""

    PROVEN = "proven"
    PARTIAL = "partial"
    NOT_READ = "not_read"


@dataclass(frozen=True)
class Part:
    """A part of a verdict: how much of it is proven, why not all, and whether it was asked for."""

    state: State
    why: str
    asked: bool = True

    @property
    def is_missing(self) -> bool:
        """Whether it was asked for, and is not proven as a whole."""
        return self.asked and self.state is not State.PROVEN


@dataclass(frozen=True)
class Proofs:
    """The results for the hardware; each is None if it was not tried or is not there."""

    program: ProgramVerdict | None = None
    hardware: HardwareVerdict | None = None
    calibration: ProgramVerdict | HardwareVerdict | None = None
    unheld: tuple[str, ...] = ()
    """Fields of the manifest that nothing was held against."""
    unit: UnitVerdict | None = None
    model: ModelVerdict | None = None
    rtlil: RtlilVerdict | None = None


def scope_of(
    certificate: Certificate,
    item: ItemEntry | None,
    agreement: Agreement | None,
    core: str | None,
    proofs: Proofs | None,
) -> Mapping[str, Part]:
    """Return the parts of a verdict in their order.

    Parameters
    ----------
    certificate : Certificate
        A certificate that was accepted.
    item : ItemEntry or None
        What it is about; None if it does not say.
    agreement : Agreement or None
        The agreement with the specification; None if none was given.
    core : str or None
        The core that was asked for with the specification; None without one.
    proofs : Proofs or None
        The results for the files; None if none were given.
    """
    parts = {"arithmetic": Part(State.PROVEN, "the error bound and all ranges follow from the certificate's graphs")}
    parts |= _specified(certificate, item, agreement, core)
    parts |= _hardware(item, proofs, is_decimated=certificate.decimation is not None)
    return parts


def _specified(
    certificate: Certificate, item: ItemEntry | None, agreement: Agreement | None, core: str | None
) -> dict[str, Part]:
    if agreement is None:
        unasked = Part(State.NOT_READ, "no specification was given", asked=False)
        return {"filter": unasked, "calibration": unasked}
    unstated = "" if item is not None else "; the certificate does not state what the item is"
    state = State.PARTIAL if unstated else State.PROVEN
    if agreement.distance is None:
        asked = core in {"instrument", "filter"}
        filter_ = Part(State.NOT_READ, "the certificate is that of a core without the filter", asked=asked)
    else:
        stated = "it keeps to the edges and losses of" if agreement.by_losses else "it is the one of"
        filter_ = Part(state, f"{stated} the specification's words{unstated}")
    if certificate.ideal.polynomial is None:
        asked = core in {"instrument", "calibration"}
        calibration = Part(State.NOT_READ, "the certificate is that of a core without a calibration", asked=asked)
    elif agreement.fitted:
        rows = agreement.measurements
        why = f"its coefficients are the least squares of {rows} measurements, solved exactly{unstated}"
        calibration = Part(state, why)
    else:
        calibration = Part(state, f"its coefficients are those of the specification{unstated}")
    return {"filter": filter_, "calibration": calibration}


_OF_FILES = ("manifest", "hardware", "program", "unit", "flags", "liveness", "c_model", "rtlil")


def _hardware(item: ItemEntry | None, proofs: Proofs | None, *, is_decimated: bool) -> dict[str, Part]:
    if proofs is None:
        return dict.fromkeys(_OF_FILES, Part(State.NOT_READ, "no files were given", asked=False))
    parts = {
        "c_model": _c_model(proofs),
        "rtlil": _rtlil(proofs),
    }
    parts["manifest"] = _manifest(item, proofs)
    kinds = [proofs.program, proofs.hardware, proofs.calibration]
    programs = [verdict for verdict in kinds if isinstance(verdict, ProgramVerdict)]
    pipelines = [verdict for verdict in kinds if isinstance(verdict, HardwareVerdict)]
    if not programs and not pipelines:
        why = _why_not(item)
        parts |= {name: Part(State.NOT_READ, why) for name in ("hardware", "program", "unit", "flags", "liveness")}
        return {name: parts[name] for name in _OF_FILES}
    parts["liveness"] = _liveness(proofs, is_decimated=is_decimated)
    none = Part(State.PROVEN, "there is none in this architecture", asked=False)
    parts["program"] = Part(State.PROVEN, "its instructions compute the graph") if programs else none
    parts["unit"], parts["hardware"] = _unit(proofs) if programs else (none, _REGISTERS)
    parts["flags"] = _flags(proofs, is_decimated=is_decimated)
    return {name: parts[name] for name in _OF_FILES}


def _liveness(proofs: Proofs, *, is_decimated: bool) -> Part:
    """Whether a sample is always taken, and its result always leaves."""
    if is_decimated:
        return Part(State.NOT_READ, "when a decimator takes a sample and hands its result on is not proven")
    verdict = proofs.hardware or proofs.unit
    if verdict is None:
        return Part(State.NOT_READ, "that a sample is ever taken and its result ever leaves, and when, is not proven")
    return Part(State.PROVEN, str(verdict.progress))


_REGISTERS = Part(State.PROVEN, "its registers hold the graph's nodes for all inputs, stalls and resets")


def _unit(proofs: Proofs) -> tuple[Part, Part]:
    """Return what is proven of the unit that runs a program, and of the whole."""
    if proofs.unit is None:
        why = "the unit that runs the program is not proven: counter, memories, adder"
        return Part(State.NOT_READ, why), Part(State.PARTIAL, "only its program is proven, not the unit that runs it")
    why = f"it runs the program in each of its {proofs.unit.states} states, for all words, inputs, stalls and resets"
    return Part(State.PROVEN, why), Part(State.PROVEN, "its unit runs the program, which computes the graph")


def _flags(proofs: Proofs, *, is_decimated: bool) -> Part:
    if proofs.unit is None and proofs.hardware is None:
        return Part(State.NOT_READ, "what the unit makes of its flags is not proven")
    if is_decimated:
        return Part(State.PARTIAL, "all but outside_calibration, wear_warning and wear_critical")
    return Part(State.PROVEN, "each is judged by the codes that the certificate states, and leaves with its sample")


def _c_model(proofs: Proofs) -> Part:
    if proofs.model is None:
        return Part(State.NOT_READ, "its text is held by its SHA-256 alone")
    return Part(
        State.PROVEN,
        f"its statements give what the {proofs.model.nodes} nodes of the graphs do, and the flags, without overflow; a "
        "compiler is assumed that rounds down where it shifts negative numbers to the right",
    )


def _rtlil(proofs: Proofs) -> Part:
    verdict = proofs.rtlil
    if verdict is None:
        return Part(State.NOT_READ, "its text is held by its SHA-256 alone")
    if verdict.open:
        more = f" and {len(verdict.open) - 3} more" if len(verdict.open) > 3 else ""
        return Part(State.PARTIAL, f"not shown to be as in the SystemVerilog: {', '.join(verdict.open[:3])}{more}")
    modules = f"{verdict.modules} module{'s' * (verdict.modules > 1)}"
    return Part(
        State.PROVEN,
        f"the {verdict.register_bits} bits of registers, the memories and the outputs of its {modules} "
        "do what they do in the SystemVerilog",
    )


def _manifest(item: ItemEntry | None, proofs: Proofs) -> Part:
    if item is None:
        return Part(State.NOT_READ, "the certificate does not state what the item is")
    if not proofs.unheld:
        return Part(State.PROVEN, "its fields follow from the certificate")
    return Part(State.PARTIAL, f"its fields follow from the certificate, but for {', '.join(proofs.unheld)}: not held")


def _why_not(item: ItemEntry | None) -> str:
    if item is None:
        return "the certificate does not state what the item is"
    if item.shared:
        return "its hardware is a module of a chain, and proven with that"
    if item.reload:
        return "constants that can be loaded are not proven"
    if item.protect != "none":
        return "hardware with protection against upsets is not proven"
    return f"the hardware of the architecture {item.architecture} is not proven"
