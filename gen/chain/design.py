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

import numpy as np
import numpy.typing as npt

from sosmith.gen.chain.response import Part, cic, factor_of, folding_gain, gain_into_passband, peak_gain
from sosmith.gen.chain.specification import ANY_INPUT, ANY_OUTPUT, ChainSpec, StageSpec
from sosmith.gen.core import CoreDesign, design_core, polynomial_of, response_of
from sosmith.gen.filter.largest_gain import Peak
from sosmith.gen.fpga.boards import Board
from sosmith.gen.specification.specification import Specification
from sosmith.gen.word_lengths.selection import Progress
from sosmith.model.arrays import Codes
from sosmith.model.dataflow.downsampler import gathered
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.verify.certificate_file import on_grid

_MAX_BITS = 32
"""Widest port between stages."""

_DIGITS = 12
"""Digits of the error that a stage is allowed."""

_EARLY_SHARE = Fraction(1, 2)
"""Share that all stages but the last one take at first of what the rounding of the output leaves."""

_LEAST = Fraction(9, 16)
"""Least error that a stage is allowed, in LSBs of its output."""


@dataclass(frozen=True, kw_only=True)
class StageDesign:
    """A stage of a chain.

    Attributes
    ----------
    spec : StageSpec
        What was asked for.
    design : CoreDesign
        Its core, proven by itself.
    parts : tuple of Part
        Its exact response; empty for a polynomial, which has none.
    gain : Fraction
        Bound of how much of an error at its output reaches the end, as a multiple; 1 of the last stage.
    reach : Fraction
        Bound of the exact magnitude at its output, in the output's unit.
    """

    spec: StageSpec
    design: CoreDesign
    parts: tuple[Part, ...]
    gain: Fraction
    reach: Fraction

    @property
    def output(self) -> Port:
        """Format of its results."""
        return self.design.datapath.output

    @property
    def bound(self) -> Fraction:
        """Bound on its own error, in the unit of its output."""
        return self.design.quantized.bound * self.output.lsb

    @property
    def share(self) -> Fraction:
        """What it adds to the chain's bound, in the unit of the output."""
        return self.bound * self.gain


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
    def factor(self) -> int:
        """Samples of a channel for each result."""
        return factor_of(self.parts)

    @property
    def edge(self) -> Fraction | None:
        """Upper edge of the pass band in units of the sample rate; None if no stage states one, or it would fold."""
        edge = self.spec.edge
        if edge is None or 2 * edge * self.factor > self.spec.base.sample_rate:
            return None
        return edge / self.spec.base.sample_rate

    @cached_property
    def folding(self) -> Peak | None:
        """Largest gain of a frequency that folds; None if none does."""
        return folding_gain(self.parts) if self.factor > 1 else None

    @cached_property
    def passing(self) -> Peak | None:
        """Largest gain of one that folds into the pass band; None without a pass band."""
        if self.edge is None or self.factor == 1:
            return None
        return gain_into_passband(self.parts, self.edge)

    @property
    def carried_flags(self) -> int:
        """Flags of the inputs that a result can have: `input_at_rail`, and `outside_calibration` where some is."""
        first = self.stages[0].design.datapath
        everything = tuple((port.lowest, port.highest) for port in first.inputs)
        return 1 if first.calibrated == everything else 2

    @property
    def settling(self) -> int:
        """Results of a channel that are flagged as settling: until all stages have settled, one after the other."""
        samples, step = 0, 1
        for stage in self.stages:
            samples += stage.design.quantized.settling * step
            step *= stage.design.datapath.samples_per_result
        return -(-samples // step)

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
            codes, status = stage.design.datapath.compute_with_status(codes)
            codes = codes[:, :, None]
            if stage is early[0]:
                gathering = status & np.uint8((1 << self.carried_flags) - 1)
        results, status = last.design.datapath.compute_with_status(codes)
        if early:
            factor = self.factor // early[0].design.datapath.samples_per_result
            columns = [gathered(gathering[:, k], factor) for k in range(gathering.shape[1])]
            status = status | np.stack(columns, axis=1)
            status[: self.settling] |= np.uint8(1 << Flag.SETTLING)
        return results, status


def design_chain(spec: ChainSpec, *, board: Board | None = None, progress: Progress = lambda step: None) -> ChainDesign:
    """Design the stages of a chain, so that the whole keeps to the error that is allowed.

    Raises
    ------
    SpecificationError
        If a stage breaks a rule.
    ShortfallError
        If no formats meet the specification.
    """
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
        parts = [self._parts(stage) for stage in self.spec.stages]
        chain = self._chain(self._first_shares(parts), parts)
        for k in range(len(self.spec.stages) - 1):
            coarser = self._coarser(chain, k)
            if coarser is not None:
                chain = coarser
        return chain

    def _parts(self, stage: StageSpec) -> tuple[Part, ...]:
        """Return the exact response of a stage, which hardly depends on its ports."""
        if stage.kind == "polynomial":
            return ()
        spec = stage.ordinary(self.spec, (ANY_INPUT,), ANY_OUTPUT)
        response, _ = response_of(spec, "filter", self.progress)
        assert response.ideal is not None
        sections, pre_stage = response.ideal.exact, response.pre_stage
        if pre_stage is None:
            return (Part(sections, response.factor),)
        return cic(pre_stage.decimator.factor, pre_stage.decimator.stages), Part(sections)

    def _first_shares(self, parts: Sequence[tuple[Part, ...]]) -> _Shares:
        gains = gains_to_the_end(parts)
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
        gains, left = gains_to_the_end(parts), self.allowed
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
            carried = error * peak_gain(own) if own else Fraction(0)
            output = self.last if is_last else self._port(stage, shares.steps[k], reach + carried + allowed)
            design = self._core(stage.ordinary(self.spec, inputs, output, allowed), stage)
            stages.append(StageDesign(spec=stage, design=design, parts=own, gain=gains[k], reach=reach))
            inputs, error = (replace(output, name=ANY_INPUT.name),), carried + stages[-1].bound
            left -= stages[-1].share
        chain = ChainDesign(spec=self.spec, stages=tuple(stages))
        now = [_parts_of(stage.design) for stage in stages]
        return chain if now == list(parts) else self._chain(shares, now)

    def _port(self, stage: StageSpec, step: Fraction, reach: Fraction) -> Port:
        """Return the narrowest signed port that holds a magnitude without its first and last code."""
        bits = max(2, (int(reach / step) + 2).bit_length() + 1)
        if bits > _MAX_BITS:
            raise ShortfallError(
                f"stage {stage.name}: its results must fit {_MAX_BITS} bits, and need {bits} for an error this small"
            )
        return Port(name=ANY_OUTPUT.name, bits=bits, signed=True, lsb=step, zero=Fraction(0), unit=self.last.unit)

    def _core(self, spec: Specification, stage: StageSpec) -> CoreDesign:
        try:
            return design_core(
                spec,
                core="calibration" if stage.core == "calibration" else None,
                board=self.board,
                progress=lambda step: self.progress(f"stage {stage.name}: {step}"),
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


def gains_to_the_end(parts: Sequence[tuple[Part, ...]]) -> list[Fraction]:
    """Return how much of an error behind each stage reaches the end."""
    behind = [tuple(part for each in parts[k + 1 :] for part in each) for k in range(len(parts))]
    return [on_grid(peak_gain(each)) if each else Fraction(1) for each in behind]


def reach_behind(spec: ChainSpec, parts: Sequence[tuple[Part, ...]]) -> Fraction:
    """Bound the exact magnitude behind the last of these stages, which are the first ones of a chain."""
    base = spec.base
    largest = max(abs(end) for port in base.inputs[:1] for end in _limits(port))
    if spec.stages[0].kind == "polynomial":
        polynomial, _ = polynomial_of(base)
        largest = polynomial_reach(polynomial, base.inputs)
    whole = tuple(part for each in parts for part in each)
    return largest * on_grid(peak_gain(whole)) if whole else largest


def _parts_of(design: CoreDesign) -> tuple[Part, ...]:
    """Return the exact response of a design."""
    quantized, datapath = design.quantized, design.datapath
    if quantized.filter is None:
        return ()
    decimator = datapath.decimator
    if decimator is not None:
        return cic(decimator.factor, decimator.stages), Part(quantized.filter.exact)
    return (Part(quantized.filter.exact, datapath.samples_per_result),)


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
