"""The search for a core's realization, its word lengths, and the hardware that an architecture makes of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.budget import Budget
from sosmith.gen.architectures.registry import fitting
from sosmith.gen.filter.design import Filter
from sosmith.gen.fpga.boards import Board
from sosmith.gen.realizations.registry import LOOK_AHEAD, REALIZATIONS
from sosmith.gen.specification import combinations
from sosmith.gen.specification.choices import AUTO
from sosmith.gen.specification.specification import Specification
from sosmith.gen.word_lengths.decimation.decimator import PreStage
from sosmith.gen.word_lengths.objective import FEW_ADDERS, FewSums
from sosmith.gen.word_lengths.other_realization import with_realization
from sosmith.gen.word_lengths.quantize import Plan, least_size, plan, prove
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.gen.word_lengths.selection import Progress, Selection
from sosmith.gen.word_lengths.settling import samples_to_settle, with_settling
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.downsampler import Downsampler
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port

if TYPE_CHECKING:
    from sosmith.gen.calibration.fit import Fit


@dataclass(frozen=True, kw_only=True)
class Response:
    """What a core computes, exactly.

    Attributes
    ----------
    inputs : tuple of Port
        What goes into the datapath's first stage: behind a decimator, its output.
    codes : tuple of (int, int)
        Lowest and highest code of each input that the measurements covered; empty if none are known.
    polynomial : Polynomial or None
        The calibration; None without one.
    fit : Fit or None
        The fit, if the calibration comes from measurements.
    pre_stage : PreStage or None
        What stands before the filter; None if all samples go in.
    ideal : Filter or None
        The filter; None of a calibration alone.
    factor : int
        Results for each of which one leaves, of a filter that decimates by itself; 1 if all do.
    """

    inputs: tuple[Port, ...]
    codes: tuple[tuple[int, int], ...]
    polynomial: Polynomial | None
    fit: Fit | None
    pre_stage: PreStage | None
    ideal: Filter | None
    factor: int = 1


class AskedRealization(NamedTuple):
    """The realization that is asked for.

    Attributes
    ----------
    name : str
        As in the specification; "auto" for the cheapest proven one.
    source : str
        Where it is asked for, a phrase.
    widths_of : str or None
        Realization for which the word lengths are chosen; None for itself.
    """

    name: str
    source: str
    widths_of: str | None


class Candidate(NamedTuple):
    """A proven design, the reason for its realization, and its hardware."""

    quantized: Quantized
    reason: str
    architecture: Architecture


@dataclass(frozen=True, kw_only=True)
class Search:
    """Everything that the designs of one core in several architectures share.

    Attributes
    ----------
    spec : Specification
        The specification.
    response : Response
        What the core computes.
    asked : AskedRealization
        The realization that is asked for.
    budget : Budget
        Time and multiplier blocks.
    calibration : Architecture or None
        Hardware of the calibration before a decimator; None without one.
    board : Board or None
        Target board.
    progress : callable
        Called with the name of each step.
    """

    spec: Specification
    response: Response
    asked: AskedRealization
    budget: Budget
    calibration: Architecture | None
    board: Board | None
    progress: Progress
    _plans: dict[tuple[str, bool, bool], Plan] = field(default_factory=dict)

    def first_that_keeps_up(self, kinds: Sequence[type[Architecture]]) -> tuple[Candidate, str]:
        """Return the first design that keeps up, and why the one before did not, if there was one.

        Raises
        ------
        ShortfallError
            If none does; gives the reason of the last one.
        """
        refused = ""
        for kind in kinds[:-1]:
            try:
                return self._design_in(kind), refused
            except ShortfallError as error:
                refused = str(error)
        return self._design_in(kinds[-1]), refused

    @property
    def _looks_ahead(self) -> bool:
        return self.spec.hardware.pipeline == "look-ahead"

    def _design_in(self, kind: type[Architecture]) -> Candidate:
        """Choose everything for an architecture."""
        if self._looks_ahead and self.response.ideal is not None:
            return self._looking_ahead(kind)
        quantized, reason = self._select(kind)
        plain = Candidate(quantized, reason, self._in_hardware(kind, quantized.datapath, look_ahead=self._looks_ahead))
        return self._faster(plain) if self._may_look_ahead(plain) else plain

    def _select(self, kind: type[Architecture]) -> tuple[Quantized, str]:
        """Choose the realization and its word lengths for an architecture, and say why it is that one."""
        ideal, asked = self.response.ideal, self.asked
        if ideal is None:
            return prove(self._plan_of(next(iter(REALIZATIONS)), kind)), "none: a calibration has no filter sections"
        adders = self.budget.adders or self._looks_ahead
        objective = kind.objective(self.board, adders=adders, blocks=self.budget.blocks)
        selection = Selection(
            lambda name: self._plan_of(name, kind).under(objective),
            lambda name: least_size(ideal, name, objective),
            objective,
            self.progress,
            accept=partial(self._in_hardware, kind, look_ahead=self._looks_ahead),
            key=self._key_of(kind),
            fir=ideal.is_fir,
        )
        if asked.widths_of is not None:
            quantized = with_realization(selection.proven(asked.widths_of), asked.name)
            return quantized, f"{asked.name} at the word lengths chosen for {asked.widths_of}, as asked"
        if asked.name == AUTO:
            return selection.cheapest()
        try:
            return selection.proven(asked.name), f"{asked.name}: asked for {asked.source}"
        except ShortfallError as error:
            raise ShortfallError(f"{error}{self._other_that_does(selection)}") from None

    def _key_of(self, kind: type[Architecture]) -> tuple[object, ...]:
        """Return all that it depends on whether an architecture takes a datapath, but for the datapath's formats."""
        response, spec = self.response, replace(self.spec, path=Path())
        rows = None if response.ideal is None else response.ideal.rows
        return kind.__name__, self.budget, self.board, spec, response.polynomial, response.codes, rows

    def _other_that_does(self, selection: Selection) -> str:
        """Say which realization meets the specification as it is, if one does."""
        try:
            other, _ = selection.cheapest()
        except ShortfallError:
            return ""
        return f'; hardware.realization = "{other.realization}" meets the specification as it is'

    def _plan_of(self, realization: str, kind: type[Architecture]) -> Plan:
        """Plan a realization, once for all architectures that start alike."""
        steady = self.spec.hardware.start == "steady" and not kind.is_filled
        key = realization, steady, kind.shares_sections
        if key not in self._plans:
            spec, response = self.spec, self.response
            pre_stage, ideal = response.pre_stage, response.ideal
            self.progress(f"word lengths, {realization}" if ideal is not None else "word lengths")
            self._plans[key] = plan(
                name=spec.name,
                inputs=response.inputs,
                output=spec.output,
                max_error=spec.max_error - (0 if pre_stage is None else pre_stage.error * spec.output.lsb),
                ideal=ideal,
                polynomial=response.polynomial if pre_stage is None else None,
                realization=realization,
                steady=steady,
                loads=spec.hardware.reload,
                together=kind.shares_sections,
            )
        return self._plans[key]

    def _in_hardware(self, kind: type[Architecture], datapath: Datapath, *, look_ahead: bool) -> Architecture:
        """Return the hardware of a datapath with its flags, for which a program has instructions.

        The flags are of the range that was calibrated, of the limits of wear, and of settling.

        Raises
        ------
        ShortfallError
            If the architecture does not take the datapath, or does not keep up.
        """
        spec, pre_stage, codes = self.spec, self.response.pre_stage, self.response.codes
        wear = () if spec.wear is None else spec.wear.codes(spec.output)
        # Constants that are loaded may make the filter slower, and the count is not among them.
        spare = 3 if spec.hardware.reload else 1
        filled = kind.is_filled and spec.hardware.start == "steady"
        settles = 0 if filled else spare * samples_to_settle(datapath)
        settles += 0 if pre_stage is None or not settles else pre_stage.decimator.remembered
        flagged = replace(with_settling(datapath, settles), wear=wear)
        if kind.is_filled:
            flagged = replace(flagged, downsampler=self._downsampler(datapath, filled=filled))
        if pre_stage is None:
            whole = replace(flagged, calibrated=codes)
            return fitting(kind, self.budget, whole, self.board, look_ahead=look_ahead)
        return fitting(kind, self.budget, pre_stage.before(flagged, codes), self.board, calibration=self.calibration)

    def _downsampler(self, datapath: Datapath, *, filled: bool) -> Downsampler:
        """Return what hands on the results of a filter alone, or some of them, which remembers so many samples."""
        remembered = sum(len(stage.graph.delays) for stage in datapath.stages)
        return Downsampler(factor=self.response.factor, filled=max(1, remembered) if filled else 0)

    def _may_look_ahead(self, plain: Candidate) -> bool:
        """Say whether look-ahead may take the place of plain loops: if nothing is asked for that excludes it."""
        hardware, terms = self.spec.hardware, plain.architecture.terms
        return (
            hardware.pipeline == AUTO
            and self.asked.name == AUTO
            and self.response.ideal is not None
            and terms.takes((combinations.LOOK_AHEAD,))
            and not combinations.excluded(combinations.LOOK_AHEAD, self.spec)
        )

    def _faster(self, plain: Candidate) -> Candidate:
        """Return a design with look-ahead, if a core must take a beat at each clock and its plain loops are too slow.

        Speeds are those of the estimate for an ECP5. The plain design stays if look-ahead cannot meet the
        specification, or is no faster.
        """
        reached = plain.architecture.clock_estimate
        if self.budget.cycles > 1 or reached is None or reached >= self.budget.clock:
            return plain
        try:
            other = self._looking_ahead(type(plain.architecture), patient=False)
        except ShortfallError:
            return plain
        if (other.architecture.clock_estimate or 0) <= reached:
            return plain
        return other._replace(reason=f"{other.reason}; plain loops reach {reached / 1e6:.0f} MHz")

    def _looking_ahead(self, kind: type[Architecture], *, patient: bool = True) -> Candidate:
        """Choose how far recursions look ahead: as little as the clock allows, by the estimate for an ECP5.

        If not `patient`, responses so long that their design takes minutes are refused.

        Raises
        ------
        ShortfallError
            If no sections with look-ahead meet the specification.
        """
        objective = FEW_ADDERS if self.budget.adders else FewSums(self.budget.blocks.bits)
        best: Candidate | None = None
        fastest = 0.0
        refused = ShortfallError("look-ahead must have more samples than a beat, and responses that are not too long")
        for samples, realization in LOOK_AHEAD.items():
            if samples <= self.budget.samples_per_clock or samples % self.budget.samples_per_clock:
                continue  # a loop would go back to other lanes of a beat
            planned = self._plan_of(realization.name, kind).under(objective)
            if planned.is_long and not patient:
                continue
            try:
                quantized = prove(planned if planned.is_long else planned.trimmed())
            except ShortfallError as error:
                refused = error
                continue
            architecture = self._in_hardware(kind, quantized.datapath, look_ahead=True)
            estimate = architecture.clock_estimate or 0.0
            if estimate > fastest:
                fastest = estimate
                best = Candidate(quantized, self._why_so_far(realization.name, estimate), architecture)
            if estimate >= self.budget.clock:
                break
        if best is None:
            raise refused
        return best

    def _why_so_far(self, realization: str, estimate: float) -> str:
        reached = estimate >= self.budget.clock
        return (
            f"{realization}: {'the shortest look-ahead that reaches' if reached else 'comes closest to'} a clock "
            f"of {float(self.budget.clock) / 1e6:,.6g} MHz on an ECP5, by an estimate of {estimate / 1e6:.0f} MHz"
        )
