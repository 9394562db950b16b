"""From the specification of a chain to its stages: shares of the error, formats between stages, and the bound.

A stage errs by at most its own bound, whatever enters it. What it errs by reaches the end times the peak gain of the
stages behind it, so that the whole errs by at most the sum of these products, provided that no port between stages
limits what passes: each of them holds all that can come, as the exact response and the errors before it say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import prod

import numpy as np
import numpy.typing as npt

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.folded_fir import FoldedFir
from sosmith.gen.architectures.shared_fir import SharedFir, shared
from sosmith.gen.chain.automatic.limits import Limits
from sosmith.gen.chain.automatic.losses import why_not
from sosmith.gen.chain.ideal import ideal_chain
from sosmith.gen.chain.phases import specs_of
from sosmith.gen.chain.rates import Pattern, Rate, gathered, pattern_of
from sosmith.gen.chain.response import (
    Part,
    Segment,
    cic,
    folding_gain,
    gain_from,
    gain_into_passband,
    gains_in_passband,
    peak_gain,
    segments_of,
)
from sosmith.gen.chain.specification import ANY_INPUT, ANY_OUTPUT, ChainSpec, StageSpec
from sosmith.gen.core import CoreDesign, design_core, polynomial_of
from sosmith.gen.filter.design import Filter
from sosmith.gen.filter.exact_form import Exact
from sosmith.gen.filter.largest_gain import Peak
from sosmith.gen.fpga.boards import Board
from sosmith.gen.specification.choices import AUTO
from sosmith.gen.specification.combinations import FOLDED
from sosmith.gen.specification.specification import Specification
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.gen.word_lengths.selection import Progress
from sosmith.model.arrays import Codes
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.verify.certificate_file import below_on_grid, on_grid

_MAX_BITS = 32
"""Widest port between stages."""

_DIGITS = 12
"""Digits of the error that a stage is allowed."""

_EARLY_SHARE = Fraction(1, 2)
"""Share that all stages but the last one take at first of what the rounding of the output leaves."""

_SHARING = (AUTO, FOLDED.name)
"""Architectures with which the cores of a stage that interpolates may share a multiplier."""

_LEAST = Fraction(9, 16)
"""Least error that a stage is allowed, in LSBs of its output."""


@dataclass(frozen=True, kw_only=True)
class StageDesign:
    """A stage of a chain.

    Attributes
    ----------
    spec : StageSpec
        What was asked for.
    cores : tuple of CoreDesign
        Its core, proven by itself; of a stage that interpolates, one for each of the results of a sample.
    parts : tuple of Part
        Its exact response; empty for a polynomial, which has none.
    gain : Fraction
        Bound of how much of an error at its output reaches the end, as a multiple; 1 of the last stage.
    reach : Fraction
        Bound of the exact magnitude at its output, in the output's unit.
    """

    spec: StageSpec
    cores: tuple[CoreDesign, ...]
    parts: tuple[Part, ...]
    gain: Fraction
    reach: Fraction

    @property
    def design(self) -> CoreDesign:
        """Its core, or that of its first results: all have the same streams."""
        return self.cores[0]

    @property
    def shared(self) -> SharedFir | None:
        """Hardware with one multiplier for all its results; None if each core has its own."""
        architecture = self.design.architecture
        return architecture if isinstance(architecture, SharedFir) else None

    @property
    def modules(self) -> tuple[str, ...]:
        """Names of the modules of its hardware: of each core, or the one that all share."""
        names = tuple(core.datapath.name for core in self.cores)
        return names if self.shared is None else (names[0].removesuffix("_p0"),)

    @property
    def rate(self) -> Rate:
        """By how much it interpolates and decimates."""
        return Rate(len(self.cores), self.design.datapath.samples_per_result)

    @property
    def clocks_per_sample(self) -> float:
        """Clocks that each of its samples takes, on average, at the highest rate."""
        return float(max(len(self.cores), *(core.architecture.clocks_per_sample for core in self.cores)))

    @property
    def output(self) -> Port:
        """Format of its results."""
        return self.design.datapath.output

    @property
    def bound(self) -> Fraction:
        """Bound on its own error, in the unit of its output."""
        return max(core.quantized.bound for core in self.cores) * self.output.lsb

    @property
    def share(self) -> Fraction:
        """What it adds to the chain's bound, in the unit of the output."""
        return self.bound * self.gain

    def compute_with_status(self, codes: Codes) -> tuple[Codes, npt.NDArray[np.uint8]]:
        """Compute codes and flags of the results, shape (results, channels), of codes (samples, channels, inputs)."""
        results = [core.datapath.compute_with_status(codes) for core in self.cores]
        if len(results) == 1:
            return results[0]
        shape = (len(codes) * len(results), codes.shape[1])
        values, status = (np.stack(each, axis=1).reshape(shape) for each in zip(*results, strict=True))
        return values, status


@dataclass(frozen=True, kw_only=True)
class Folding:
    """What a segment of a chain makes of a sine at other frequencies.

    Attributes
    ----------
    segment : Segment
    anywhere : Peak
        Largest gain of anything that comes out at another frequency than it went in; frequencies are in units of the
        highest rate.
    edge : Fraction or None
        Upper edge of the pass band in these units; None if no stage states one, or it is above half a rate.
    passing : Peak or None
        Largest gain of what went in, or comes out, in the pass band; None without one.
    kept : Kept or None
        What a chain with limits is held against; None without them.
    """

    segment: Segment
    anywhere: Peak
    edge: Fraction | None
    passing: Peak | None
    kept: Kept | None = None


@dataclass(frozen=True, kw_only=True)
class Kept:
    """Gains of a chain with limits; frequencies are in units of the highest rate.

    Attributes
    ----------
    least, most : Peak
        Smallest and largest gain in the pass band.
    stop : Fraction or None
        Where the stop band begins; None if only aliases into the pass band count.
    stopped : Peak or None
        Largest gain from there on.
    """

    least: Peak
    most: Peak
    stop: Fraction | None
    stopped: Peak | None


@dataclass(frozen=True, kw_only=True)
class ChainDesign:
    """A designed chain: cores that are proven one by one, and what follows for all of them together."""

    spec: ChainSpec
    stages: tuple[StageDesign, ...]

    @property
    def name(self) -> str:
        """Name of the top module and of the files."""
        return self.spec.name

    @property
    def bound(self) -> Fraction:
        """Bound on the difference between hardware and exact result, in the unit of the output."""
        return sum((stage.share for stage in self.stages), Fraction(0))

    @property
    def parts(self) -> tuple[Part, ...]:
        """The exact response from end to end; behind a polynomial if there is one."""
        return tuple(part for stage in self.stages for part in stage.parts)

    @property
    def rates(self) -> tuple[Rate, ...]:
        """By how much each stage interpolates and decimates."""
        return tuple(stage.rate for stage in self.stages)

    @property
    def pattern(self) -> Pattern:
        """Which samples of the first stage's output bring results."""
        return pattern_of(self.rates[1:])

    @property
    def factor(self) -> int:
        """By how much the chain decimates: samples of a channel for each result, if no stage interpolates."""
        return prod(rate.factor for rate in self.rates)

    @property
    def rise(self) -> int:
        """By how much it interpolates: results for each sample, if no stage decimates."""
        return prod(rate.rise for rate in self.rates)

    @cached_property
    def foldings(self) -> tuple[Folding, ...]:
        """What each segment makes of a sine at other frequencies; empty if no stage changes the rate."""
        if self.limited is not None and self.spec.span is None:
            return (self.limited,)
        return foldings_of(self.spec, self.parts)

    @cached_property
    def limited(self) -> Folding | None:
        """The same of the stages that the limits hold of, with the gains in their pass band; None without limits."""
        return limited_of(self.spec, [stage.parts for stage in self.stages])

    @property
    def excess(self) -> tuple[str, ...]:
        """Which limits the chain does not keep to, a phrase for each; nothing if it keeps to all, or has none."""
        return excess_of(self.spec.limits, self.limited)

    @property
    def clocks_per_sample(self) -> float:
        """Clocks that each sample of a channel takes, on average, at the highest rate: those of the slowest stage."""
        rate = self.spec.base.sample_rate
        return max(stage.clocks_per_sample * float(stage.spec.rate / rate) for stage in self.stages)

    @property
    def carried_flags(self) -> int:
        """Flags of the inputs that a result can have: `input_at_rail`, and `outside_calibration` where some is."""
        first = self.stages[0].design.datapath
        everything = tuple((port.lowest, port.highest) for port in first.inputs)
        return 1 if first.calibrated == everything else 2

    @property
    def settling(self) -> int:
        """Results of a channel that are flagged as settling: until all stages have settled, one after the other.

        All results that come with the same sample of the first stage's output are flagged, or none. Of a single stage,
        each result of a sample has the flag of its own core.
        """
        if len(self.stages) > 1:
            return self.pattern.entries(self._settled)[1]
        cores = self.stages[0].cores
        return self._settled if len(cores) == 1 else sum(core.quantized.settling for core in cores)

    @property
    def settling_entries(self) -> int:
        """Of the samples of the first stage's output that bring results, those whose results are flagged."""
        return self.pattern.entries(self._settled)[0]

    @property
    def _settled(self) -> int:
        """Number of the first result for which all stages have settled."""
        settled = 0
        for stage in self.stages:
            settled += max(core.quantized.settling_of_input for core in stage.cores)
            settled = -(-settled * stage.rate.rise // stage.rate.factor)
        return settled

    def compute(self, codes: Codes) -> Codes:
        """Compute the output codes of input codes, bit for bit as the hardware does.

        Parameters
        ----------
        codes : integer array, shape (samples, channels, inputs)

        Returns
        -------
        int64 array, shape (results, channels)
        """
        return self.compute_with_status(codes)[0]

    def compute_with_status(self, codes: Codes) -> tuple[Codes, npt.NDArray[np.uint8]]:
        """Compute the output codes and the flags, both of the shape (results, channels).

        A result has the flags of all samples of its channel since the result before.
        """
        *early, last = self.stages
        gathering = np.zeros((len(codes), codes.shape[1]), dtype=np.uint8)
        for stage in early:
            codes, status = stage.compute_with_status(codes)
            codes = codes[:, :, None]
            if stage is early[0]:
                gathering = status & np.uint8((1 << self.carried_flags) - 1)
        results, status = last.compute_with_status(codes)
        if early:
            columns = [gathered(gathering[:, k], self.rates[1:]) for k in range(gathering.shape[1])]
            status = status | np.stack(columns, axis=1)
            status[: self.settling] |= np.uint8(1 << Flag.SETTLING)
        return results, status


def foldings_of(spec: ChainSpec, parts: Sequence[Part]) -> tuple[Folding, ...]:
    """Return what each segment of parts makes of a sine at other frequencies, without limits of the whole."""
    segments = [each for each in segments_of(parts) if each.rise > 1 or each.factor > 1]
    edge = None if spec.edge is None else spec.edge / spec.base.sample_rate
    return tuple(_folding(each, edge) for each in segments)


def limited_of(spec: ChainSpec, parts: Sequence[Sequence[Part]]) -> Folding | None:
    """Return what the stages that limits hold of make of a sine, by the parts of each stage; None without limits."""
    limits = spec.limits
    if limits is None:
        return None
    first, end = spec.span or (0, len(parts))
    rate = spec.stages[first].rate
    (segment,) = segments_of([part for each in parts[first:end] for part in each])
    return replace(_folding(segment, limits.passband_edge / rate), kept=_kept(segment, limits, rate))


def _folding(segment: Segment, edge: Fraction | None) -> Folding:
    """Return what a segment makes of a sine; the edge of the pass band is in units of the chain's first rate."""
    edge = None if edge is None else edge / segment.highest
    if edge is not None and 2 * edge * max(segment.rise, segment.factor) > 1:
        edge = None
    passing = None if edge is None else gain_into_passband(segment, edge)
    return Folding(segment=segment, anywhere=folding_gain(segment), edge=edge, passing=passing, kept=None)


def _kept(segment: Segment, limits: Limits, rate: Fraction) -> Kept:
    least, most = gains_in_passband(segment, limits.passband_edge / rate)
    stop = None if limits.stopband_edge is None else limits.stopband_edge / rate
    return Kept(least=least, most=most, stop=stop, stopped=None if stop is None else gain_from(segment, stop))


def excess_of(limits: Limits | None, folding: Folding | None) -> tuple[str, ...]:
    """Say which limits the gains of the stages that have them do not keep to, as they stand in a certificate."""
    if limits is None or folding is None:
        return ()
    kept, passing = folding.kept, folding.passing
    assert kept is not None
    assert passing is not None
    return why_not(
        limits,
        least=below_on_grid(kept.least.gain),
        most=on_grid(kept.most.gain),
        passing=on_grid(passing.gain),
        stopped=None if kept.stopped is None else on_grid(kept.stopped.gain),
    )


def design_chain(spec: ChainSpec, *, board: Board | None = None, progress: Progress = lambda step: None) -> ChainDesign:
    """Design the stages of a chain, so that the whole keeps to the error that is allowed.

    Raises
    ------
    SpecificationError
        If a stage breaks a rule.
    ShortfallError
        If no formats meet the specification, or the whole does not keep to its limits.
    """
    chain = design_stages(spec, board=board, progress=progress)
    if spec.limits is not None:
        progress("limits of the whole")
        if excess := chain.excess:
            raise ShortfallError(f"the limits of the chain must be kept, and are not: {'; '.join(excess)}")
    return chain


def design_stages(spec: ChainSpec, *, board: Board | None, progress: Progress) -> ChainDesign:
    """Design the stages of a chain, without a look at the limits of the whole; errors are those of `design_chain`."""
    return _Budget(spec, board, progress).designed()


@dataclass(frozen=True)
class _Shares:
    """The errors that stages may make, and the steps of their outputs, in the unit of the output."""

    errors: tuple[Fraction, ...]
    steps: tuple[Fraction, ...]


class _Budget:
    """The search for shares of the error."""

    def __init__(self, spec: ChainSpec, board: Board | None, progress: Progress) -> None:
        self.spec = spec
        self.board = board
        self.progress = progress
        self.allowed = spec.base.max_error
        self.last = spec.base.output

    def designed(self) -> ChainDesign:
        """Choose shares by the gains, then give up bits between stages where the whole leaves room."""
        parts = [stage.parts for stage in ideal_chain(self.spec, self.progress).stages]
        chain = self._chain(self._first_shares(parts), parts)
        for k in range(len(self.spec.stages) - 1):
            coarser = self._coarser(chain, k)
            if coarser is not None:
                chain = coarser
        return chain

    def _first_shares(self, parts: Sequence[tuple[Part, ...]]) -> _Shares:
        gains = gains_to_the_end(self.spec, parts)
        early = len(parts) - 1
        spare = (self.allowed - self.last.lsb / 2) * _EARLY_SHARE
        errors = [_rounded(spare / early / gain) for gain in gains[:-1]]
        steps = [_step_below(self._lattice(k), error) for k, error in enumerate(errors)]
        return _Shares((*errors, self.allowed), (*steps, self.last.lsb))

    def _lattice(self, k: int) -> Fraction:
        """Return a power of two of the steps that the output of a stage can have."""
        before = self.spec.stages[: k + 1]
        return self.spec.base.inputs[0].lsb if all(each.needs_powers_of_two for each in before) else self.last.lsb

    def _chain(self, shares: _Shares, parts: Sequence[tuple[Part, ...]]) -> ChainDesign:
        """Design all stages: the last one may make what the others leave of the error allowed."""
        gains, left = gains_to_the_end(self.spec, parts), self.allowed
        inputs, error = self.spec.base.inputs, Fraction(0)
        stages: list[StageDesign] = []
        for k, stage in enumerate(self.spec.stages):
            is_last = k == len(parts) - 1
            self.progress(f"stage {stage.name}")
            reach = reach_behind(self.spec, parts[: k + 1])
            allowed = _rounded(left) if is_last else shares.errors[k]
            if is_last and allowed <= self.last.lsb / 2:
                raise ShortfallError(f"stage {stage.name}: the stages before it leave no room for its rounding")
            own = parts[k]
            carried = error * peak_gain(own, steady=self.spec.is_steady) if own else Fraction(0)
            output = self.last if is_last else self._port(stage, shares.steps[k], reach + carried + allowed)
            specs = specs_of(self.spec, stage, inputs, output, allowed, own)
            cores = self._sharing(specs, stage) or tuple(self._core(spec, stage) for spec in specs)
            stages.append(StageDesign(spec=stage, cores=cores, parts=own, gain=gains[k], reach=reach))
            inputs, error = (replace(output, name=ANY_INPUT.name),), carried + stages[-1].bound
            left -= stages[-1].share
        chain = ChainDesign(spec=self.spec, stages=tuple(stages))
        now = [parts_of([core.quantized for core in stage.cores]) for stage in stages]
        return chain if now == list(parts) else self._chain(shares, now)

    def _port(self, stage: StageSpec, step: Fraction, reach: Fraction) -> Port:
        """Return the narrowest signed port that holds a magnitude without its first and last code."""
        bits = max(2, (int(reach / step) + 2).bit_length() + 1)
        if bits > _MAX_BITS:
            raise ShortfallError(
                f"stage {stage.name}: its results must fit {_MAX_BITS} bits, and need {bits} for an error this small"
            )
        return Port(name=ANY_OUTPUT.name, bits=bits, signed=True, lsb=step, zero=Fraction(0), unit=self.last.unit)

    def _sharing(self, specs: Sequence[Specification], stage: StageSpec) -> tuple[CoreDesign, ...]:
        """Design the cores of a stage that interpolates for one multiplier; none if that cannot be, or is too slow."""
        hardware = specs[0].hardware
        if len(specs) == 1 or hardware.keep or hardware.multipliers == 0 or hardware.architecture not in _SHARING:
            return ()
        available = int(hardware.clock / (specs[0].sample_rate * specs[0].channels))
        try:
            cores = [self._core(spec, stage, (FoldedFir,)) for spec in specs]
            architectures = shared([core.architecture for core in cores], available)
        except ShortfallError:
            return ()
        why = architectures[0].reason(f"one multiplier for all {len(specs)} results", available)
        return tuple(
            replace(
                core,
                quantized=replace(core.quantized, datapath=architecture.datapath),
                architecture=architecture,
                reasons={**core.reasons, "architecture": why},
            )
            for core, architecture in zip(cores, architectures, strict=True)
        )

    def _core(self, spec: Specification, stage: StageSpec, kinds: Sequence[type[Architecture]] = ()) -> CoreDesign:
        try:
            return design_core(
                spec,
                core="calibration" if stage.core == "calibration" else None,
                board=self.board,
                progress=lambda step: self.progress(f"stage {stage.name}: {step}"),
                kinds=kinds,
            )
        except ShortfallError as error:
            raise ShortfallError(f"stage {stage.name}: {error}") from None

    def _coarser(self, chain: ChainDesign, k: int) -> ChainDesign | None:
        """Design the chain with one bit less behind a stage; None if the whole then errs by too much."""
        room = self.allowed - self.last.lsb / 2
        steps = [stage.output.lsb for stage in chain.stages]
        steps[k] *= 2
        errors = [stage.bound for stage in chain.stages]
        errors[k] = _rounded(steps[k])
        if (
            sum((error * stage.gain for error, stage in zip(errors[:-1], chain.stages, strict=False)), Fraction(0))
            >= room
        ):
            return None
        # An exact stage errs by nothing, and still asks for more than the half LSB that any rounding may take.
        errors = [_rounded_up(max(error, step * _LEAST)) for error, step in zip(errors, steps, strict=True)]
        try:
            return self._chain(_Shares(tuple(errors), tuple(steps)), [stage.parts for stage in chain.stages])
        except ShortfallError:
            return None


def gains_to_the_end(spec: ChainSpec, parts: Sequence[tuple[Part, ...]]) -> list[Fraction]:
    """Return how much of an error behind each stage reaches the end."""
    behind = [tuple(part for each in parts[k + 1 :] for part in each) for k in range(len(parts))]
    return [on_grid(peak_gain(each, steady=spec.is_steady)) if each else Fraction(1) for each in behind]


def reach_behind(spec: ChainSpec, parts: Sequence[tuple[Part, ...]]) -> Fraction:
    """Bound the exact magnitude behind the last of these stages, which are the first ones of a chain."""
    base = spec.base
    largest = max(abs(end) for port in base.inputs[:1] for end in _limits(port))
    if spec.stages[0].kind == "polynomial":
        polynomial, _ = polynomial_of(base)
        largest = polynomial_reach(polynomial, base.inputs)
    whole = tuple(part for each in parts for part in each)
    return largest * on_grid(peak_gain(whole, steady=spec.is_steady)) if whole else largest


def parts_of(cores: Sequence[Quantized]) -> tuple[Part, ...]:
    """Return the exact response of what was designed for the cores of a stage.

    That of a decimator comes before its filter; without a filter it is nothing.
    """
    if len(cores) > 1:
        return (Part((_turns([core.filter for core in cores]),), 1, len(cores)),)
    (quantized,) = cores
    if quantized.filter is None:
        return ()
    decimator = quantized.datapath.decimator
    if decimator is not None:
        return cic(decimator.factor, decimator.stages), Part(quantized.filter.exact)
    return (Part(quantized.filter.exact, quantized.datapath.samples_per_result),)


def _turns(filters: Sequence[Filter | None]) -> Exact:
    """Return the filter whose phases are these."""
    phases = [filter_.exact[0][0] for filter_ in filters if filter_ is not None]
    taps = [Fraction(0)] * (len(phases) * max(map(len, phases)))
    for k, phase in enumerate(phases):
        taps[k : k + len(phases) * len(phase) : len(phases)] = phase
    while not taps[-1]:
        taps.pop()
    return tuple(taps), (Fraction(1),)


def polynomial_reach(polynomial: Polynomial, inputs: Sequence[Port]) -> Fraction:
    """Bound the magnitude of a polynomial of all inputs in range, term by term."""
    v, t = (max(map(abs, _limits(port))) for port in inputs)
    terms = (abs(a) * v**i * t**j for i, row in enumerate(polynomial.coefficients) for j, a in enumerate(row))
    return sum(terms, Fraction(0))


def _limits(port: Port) -> tuple[Fraction, Fraction]:
    return port.zero + port.lsb * port.lowest, port.zero + port.lsb * port.highest


def _step_below(lattice: Fraction, error: Fraction) -> Fraction:
    """Return the largest power of two times `lattice` that is at most `error`."""
    step = lattice
    while step > error:
        step /= 2
    while step * 2 <= error:
        step *= 2
    return step


def _rounded(value: Fraction) -> Fraction:
    """Round down to a decimal number of `_DIGITS` digits."""
    scale = _scale(value)
    return Fraction(int(value * scale), 1) / scale


def _rounded_up(value: Fraction) -> Fraction:
    scale = _scale(value)
    return Fraction(int(value * scale) + 1, 1) / scale


def _scale(value: Fraction) -> Fraction:
    scale = Fraction(1)
    while value * scale < 10 ** (_DIGITS - 1):
        scale *= 10
    return scale
