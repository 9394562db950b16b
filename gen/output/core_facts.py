"""Facts about a generated core, collected once for its manifest, its co-simulation and its report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from sosmith.gen.core import CoreDesign
from sosmith.gen.filter.impulse_invariance import Aliasing
from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.output.decimation_facts import (
    DecimationFacts,
    DownsamplingFacts,
    decimation_facts,
    downsampling_facts,
)
from sosmith.gen.proof.limit_cycles import limit_cycles, recursions
from sosmith.gen.proof.linear_model import linear_model
from sosmith.gen.proof.settling import SETTLED
from sosmith.gen.word_lengths.cost import Cost
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.hdl.plan.streams import Field, dest_width, fields
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph
from sosmith.model.dataflow.program import Program
from sosmith.model.dataflow.status import STATUS_BITS, Flag
from sosmith.model.dataflow.structure import Stage
from sosmith.model.full_scale import is_sound
from sosmith.model.port import Port
from sosmith.model.reload.registers import BANK_INPUTS, INTERFACE
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.truncated_products import constants_of


@dataclass(frozen=True, kw_only=True)
class StreamFacts:
    """An AXI4-Stream of a core.

    Attributes
    ----------
    fields : tuple of Field
        Position of each quantity in ``tdata``, the lowest first.
    dest_width : int
        Bits of ``tdest``; 0 if there is none.
    flags : mapping of str to int
        Bit position of each flag in ``tuser``, by name; empty if there is no ``tuser``.
    lanes : int
        Samples of a beat, the first one lowest: `fields` and `flags` are those of one of them.
    """

    fields: tuple[Field, ...]
    dest_width: int = 0
    flags: Mapping[str, int] = field(default_factory=dict)
    lanes: int = 1

    @property
    def sample_width(self) -> int:
        """Bits of ``tdata`` for one sample."""
        return sum(each.padded for each in self.fields)

    @property
    def width(self) -> int:
        """Bits of ``tdata``."""
        return self.sample_width * self.lanes

    @property
    def user_width(self) -> int:
        """Bits of ``tuser``; 0 if there is none."""
        return STATUS_BITS * self.lanes if self.flags else 0


@dataclass(frozen=True, kw_only=True)
class InterfaceFacts:
    """Facts needed to drive a core: its streams and timing.

    Attributes
    ----------
    name : str
        Name of the top module.
    inputs, outputs : StreamFacts
        ``s_axis`` and ``m_axis``.
    reset_cycles : int
        Clocks after a reset until the first sample is accepted.
    latency_cycles : int
        Largest number of clocks from the edge that accepts a sample to the edge that can output its result.
    samples_per_result : int
        Samples of a channel for each result; the first sample brings one, and then every so many of them.
    copies_per_result : int
        Times that each result is handed out, one after the other.
    rates : tuple of tuple of int
        By how much each stage of a chain that interpolates does so, and decimates, in order; empty for any other.
    idle : tuple of str
        Inputs beside the streams that are 0 where nothing is loaded: pins in place of registers.
    """

    name: str
    inputs: StreamFacts
    outputs: StreamFacts
    reset_cycles: int
    latency_cycles: int
    samples_per_result: int = 1
    copies_per_result: int = 1
    rates: tuple[tuple[int, int], ...] = ()
    idle: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class WearFacts:
    """Clearances of one channel at which the wear flags are set, in the output's unit, and their codes."""

    warning: float
    critical: float
    codes: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class ReloadFacts:
    """Facts that a set of constants for this core has to match, and the files that describe its registers.

    Attributes
    ----------
    interface : int
        Version of the register interface.
    design : int
        Fingerprint of everything except the constants.
    words, word_bits : int
        Size of a bank of constants.
    restarts : bool
        Whether the core restarts with a set that is loaded, as after a reset.
    registers : tuple of str
        Names of the files that describe the registers; none if they are elsewhere.
    """

    interface: int
    design: int
    words: int
    word_bits: int
    restarts: bool
    registers: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class SettlingFacts:
    """How long the past of a filter that starts from zero matters.

    Attributes
    ----------
    samples : int
        Number of samples after a start until no other past could change the output by more than `limit`; proven. So
        many are flagged.
    seconds : float
        The same at the sample rate.
    limit : float
        In the output's unit.
    """

    samples: int
    seconds: float
    limit: float


@dataclass(frozen=True, kw_only=True)
class CoefficientFacts:
    """A coefficient of a section: ``value == integer * 2**-frac``."""

    name: str
    integer: int
    frac: int
    value: float


@dataclass(frozen=True, kw_only=True)
class SectionFacts:
    """One recursion of a section.

    Attributes
    ----------
    name : str
        Name of the section, followed by that of the output where it has several.
    coefficients : tuple of CoefficientFacts
        In the order of computation.
    states : mapping of str to str
        Q format of each state, by name.
    b, a : tuple of float, length 3 or, with look-ahead, more
        Transfer function with the integer coefficients, in powers of ``z**-1``.
    input, output : str
        Q formats.
    error_feedback : tuple of int or None
        Weights of the dropped bits of earlier samples; None if the realization has no error feedback, if the section
        has no recursion, or if nothing is dropped.
    """

    name: str
    coefficients: tuple[CoefficientFacts, ...]
    states: Mapping[str, str] = field(default_factory=dict)
    b: tuple[float, ...] = ()
    a: tuple[float, ...] = ()
    input: str = ""
    output: str = ""
    error_feedback: tuple[int, ...] | None = None


@dataclass(frozen=True, kw_only=True)
class NodeFormat:
    """Number format of a named node of the datapath.

    Attributes
    ----------
    stage, node : str
        Their names.
    format : str
        Q format, such as ``Q4.11`` or ``UQ5.11``.
    low, high : float
        Smallest and largest value, in `unit`.
    unit : str
        Unit of the node, ``""`` for a dimensionless number.
    """

    stage: str
    node: str
    format: str
    low: float
    high: float
    unit: str = ""


@dataclass(frozen=True, kw_only=True)
class LimitCycleFacts:
    """Limit cycles and dead band of one recursion, at its own output.

    Attributes
    ----------
    section : str
        Name of the recursion, as in `SectionFacts`.
    largest, dead_band : float
        Bounds, in the unit of the core's output, on a limit cycle without input and on the error of a constant output.
    none : bool
        Whether it is proven that there is no limit cycle.
    lyapunov : tuple of Fraction or None
        Weights of a diagonal Lyapunov function; None if there is none.
    """

    section: str
    largest: float
    dead_band: float
    none: bool
    lyapunov: tuple[Fraction, ...] | None


@dataclass(frozen=True, kw_only=True)
class CoreFacts:
    """All facts about a generated core for its manifest and its report.

    Attributes
    ----------
    core : str
        One of `sosmith.gen.core.CORES`.
    description : str
        The filter in words; empty without one.
    output : Port
        Format, range and unit of the output.
    max_error : float
        Largest error that the specification allows, in `unit`.
    filter : FilterFacts or None
        The filter as specified and as realized; None without one.
    spec : dict
        The specification as read, in the types of JSON.
    channels : int
        Number of channels.
    interface : InterfaceFacts
        Streams and clocks.
    cycles_per_sample : int
        Largest number of clocks between samples at the highest rate; with a decimator on average, rounded up.
    wear : tuple of WearFacts or None
        One for all channels, or one for each; None without wear limits.
    realization : str or None
        Name of the realization; None without sections.
    start : str or None
        One of `sosmith.gen.specification.choices.STARTS`; None without sections.
    settling : SettlingFacts or None
        Settling after a start from zero; None without sections and after any other start.
    architecture : str
        Name of the architecture.
    look_ahead : bool
        Whether its loops are pipelined with look-ahead.
    program : Program or None
        Program of the folded and serial architectures; None in the others.
    reload : ReloadFacts or None
        Facts for reloading; None if the core is not reloadable.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    reasons : mapping of str to str
        Reasons for this realization and this architecture.
    sections : tuple of SectionFacts
        In the order of the cascade.
    formats : tuple of NodeFormat
        In the order of the datapath.
    error_bound : float
        Proven bound on the error, in `unit`.
    error_parts : mapping of str to float
        Its parts.
    limit_cycles : tuple of LimitCycleFacts
        One for each of `sections`.
    aliasing : Aliasing or None
        Aliasing of an impulse-invariant filter; None for all others.
    decimation : DecimationFacts or None
        The decimator before the filter; None without one.
    downsampling : DownsamplingFacts or None
        What an FIR filter leaves out that decimates by itself; None for any other.
    cost : Cost
        Operators of the online architecture, or else of the parallel one.
    clock : float
        Rate of the clock in Hz, as specified.
    """

    core: str
    description: str
    output: Port
    max_error: float
    filter: FilterFacts | None
    spec: dict[str, Any]
    channels: int
    interface: InterfaceFacts
    cycles_per_sample: int
    wear: tuple[WearFacts, ...] | None
    realization: str | None
    start: str | None
    settling: SettlingFacts | None
    architecture: str
    look_ahead: bool
    program: Program | None
    reload: ReloadFacts | None
    protect: str
    reasons: Mapping[str, str]
    sections: tuple[SectionFacts, ...]
    formats: tuple[NodeFormat, ...]
    error_bound: float
    error_parts: Mapping[str, float]
    limit_cycles: tuple[LimitCycleFacts, ...]
    aliasing: Aliasing | None
    decimation: DecimationFacts | None
    downsampling: DownsamplingFacts | None
    cost: Cost
    clock: float

    @property
    def name(self) -> str:
        """Name of the core."""
        return self.interface.name

    @property
    def lower_rate(self) -> DecimationFacts | DownsamplingFacts | None:
        """What is known of results that are fewer than samples; None where all samples have one."""
        return self.decimation or self.downsampling

    @property
    def unit(self) -> str:
        """Unit of the output."""
        return self.output.unit

    @property
    def lsb(self) -> float:
        """One step of the output's code, in `unit`."""
        return float(self.output.lsb)

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest value of the output, in `unit`."""
        low, high = self.output.decode(np.array([self.output.lowest, self.output.highest]))
        return float(low), float(high)

    @property
    def is_sound(self) -> bool:
        """Whether it is a filter of signals whose full scale is 1."""
        return self.core == "filter" and is_sound([each.port for each in self.interface.inputs.fields], self.output)

    @property
    def why(self) -> str:
        """The reasons in sentences."""
        return " ".join(f"{chosen[0].upper()}{chosen[1:]} {reason}." for chosen, reason in self.reasons.items())


def core_facts(design: CoreDesign) -> CoreFacts:
    """Collect the facts about a core."""
    quantized, datapath, architecture = design.quantized, design.datapath, design.architecture
    output = datapath.output
    parts = [pair for section in quantized.sections for pair in recursions(section).items()]
    return CoreFacts(
        core=design.core,
        description="" if quantized.filter is None else quantized.filter.describe,
        output=output,
        max_error=float(design.spec.max_error),
        filter=quantized.filter_facts,
        spec=design.spec.source,
        channels=design.spec.channels,
        interface=interface_facts(design),
        cycles_per_sample=architecture.cycles_per_sample,
        wear=_wear(design),
        realization=quantized.realization if quantized.sections else None,
        start=_start(quantized),
        settling=_settling(design),
        architecture=architecture.name,
        look_ahead=architecture.look_ahead,
        program=architecture.program,
        reload=_reload(design),
        protect=architecture.protect,
        reasons=design.reasons,
        sections=tuple(each for section in quantized.sections for each in _sections(section)),
        formats=tuple(row for each in _in_order(datapath) for stage in each.stages for row in _formats(stage, each)),
        error_bound=float(quantized.bound * output.lsb),
        error_parts={part: float(value * output.lsb) for part, value in quantized.budget.items()},
        limit_cycles=tuple(_limit_cycles(name, graph, output) for name, graph in parts),
        aliasing=None if quantized.filter is None else quantized.filter.aliasing,
        decimation=decimation_facts(design),
        downsampling=downsampling_facts(design),
        cost=architecture.cost,
        clock=float(design.spec.hardware.clock),
    )


def interface_facts(design: CoreDesign) -> InterfaceFacts:
    """Collect the facts needed to drive a core."""
    datapath, width = design.datapath, dest_width(design.spec.channels)
    flags = {flag.name.lower(): flag.value for flag in Flag}
    lanes = design.architecture.samples_per_clock
    return InterfaceFacts(
        name=datapath.name,
        inputs=StreamFacts(fields=fields(datapath.inputs), dest_width=width, lanes=lanes),
        outputs=StreamFacts(fields=fields((datapath.output,)), dest_width=width, flags=flags, lanes=lanes),
        reset_cycles=design.architecture.reset_cycles,
        latency_cycles=design.architecture.latency_cycles,
        samples_per_result=datapath.samples_per_result,
        copies_per_result=design.architecture.copies_per_result,
        idle=_idle(design),
    )


def _idle(design: CoreDesign) -> tuple[str, ...]:
    if design.architecture.bank_pins is None:
        return ()
    return BANK_INPUTS if design.architecture.protect != "none" else BANK_INPUTS[:-1]


def _start(quantized: Quantized) -> str | None:
    if not quantized.sections:
        return None
    return "steady" if quantized.starts_steady else "zero"


def _settling(design: CoreDesign) -> SettlingFacts | None:
    samples, output = design.quantized.settling, design.datapath.output
    if not samples:
        return None
    return SettlingFacts(
        samples=samples,
        seconds=float(design.quantized.settling_of_input / design.spec.sample_rate),
        limit=float(SETTLED * output.lsb),
    )


def _wear(design: CoreDesign) -> tuple[WearFacts, ...] | None:
    if design.spec.wear is None:
        return None
    clearances = design.spec.wear.clearances()[: len(design.datapath.wear)]
    return tuple(
        WearFacts(warning=float(warning), critical=float(critical), codes=tuple(codes))
        for (warning, critical), codes in zip(clearances, design.datapath.wear, strict=True)
    )


def _sections(section: Stage) -> Sequence[SectionFacts]:
    """Facts about each recursion of a section."""
    feedback: tuple[int, int] | None = getattr(section, "error_feedback", None)  # only direct forms have one
    return [_section(name, graph, feedback) for name, graph in recursions(section).items()]


def _section(name: str, graph: Graph, feedback: tuple[int, ...] | None) -> SectionFacts:
    nodes = graph.nodes
    model = linear_model(graph)
    b, a = (
        tuple([*map(float, values), 0.0, 0.0][: max(3, len(values))]) for values in (model.transfer, model.denominator)
    )
    return SectionFacts(
        name=name,
        coefficients=tuple(
            CoefficientFacts(
                name=nodes[index].name.removeprefix("product_"),
                integer=by.integer,
                frac=by.frac,
                value=by.integer / 2**by.frac,
            )
            for index, by in constants_of(graph).items()
        ),
        states={nodes[i].name: nodes[i].format for i in graph.delays},
        b=b,
        a=a,
        input=nodes[graph.inputs[0]].format,
        output=nodes[graph.outputs[0]].format,
        error_feedback=feedback,
    )


def _limit_cycles(name: str, graph: Graph, output: Port) -> LimitCycleFacts:
    cycles = limit_cycles(graph)
    return LimitCycleFacts(
        section=name,
        largest=float(cycles.largest * output.lsb),
        dead_band=float(cycles.dead_band * output.lsb),
        none=cycles.none,
        lyapunov=None if cycles.lyapunov is None else tuple(cycles.lyapunov),
    )


def _reload(design: CoreDesign) -> ReloadFacts | None:
    if design.architecture.fingerprint is None:
        return None
    words, bits = design.architecture.bank_size
    return ReloadFacts(
        interface=INTERFACE,
        design=design.architecture.fingerprint,
        words=words,
        word_bits=bits,
        restarts=design.architecture.restarts,
        registers=(f"{design.spec.name}_registers.h", f"{design.spec.name}.rdl")
        if design.architecture.reload_registers
        else (),
    )


def _in_order(datapath: Datapath) -> Sequence[Datapath]:
    """Return what stands before a decimator, if anything does, and the datapath itself."""
    return (datapath,) if datapath.calibration is None else (datapath.calibration, datapath)


def _formats(stage: Stage, datapath: Datapath) -> Sequence[NodeFormat]:
    """Return the formats of the named nodes of a stage.

    Values inside are in LSBs of its output, except the polynomial's variables, which are fractions of their range.
    """
    variables = {port.name for port in datapath.inputs}
    rows = []
    for node in stage.graph.nodes:
        if node.name:
            plain = isinstance(stage, HornerStep) and node.name in variables
            scale = (1.0 if plain else float(datapath.output.lsb)) * 2.0**-node.frac
            rows.append(
                NodeFormat(
                    stage=stage.name,
                    node=node.name,
                    format=node.format,
                    low=node.low * scale,
                    high=node.high * scale,
                    unit="" if plain else datapath.output.unit,
                )
            )
    return rows
