"""From a specification to a frozen datapath: word lengths chosen by estimates, then proven.

All amounts inside are in output LSBs. What `max_error` leaves beside the half LSB of the output rounding is
divided equally between calibration, filter coefficients and filter rounding to begin with; then words are trimmed to
the smallest estimated area, on whichever part that costs error (`sosmith.gen.word_lengths.search`). The parts of
the bound are proven for what came out, and so are the ranges of all nodes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import cast

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.design import Filter
from sosmith.gen.proof.cascade_proof import (
    CascadeProof,
    ideal_gain,
)
from sosmith.gen.proof.linear_model import linear_model, linear_models
from sosmith.gen.realizations.effective import effective_sections
from sosmith.gen.realizations.registry import REALIZATIONS, Section
from sosmith.gen.word_lengths.cascade import MAX_BITS, cascade, format_of, ideal_sections, output_stage, parts_of, wide
from sosmith.gen.word_lengths.cost import area_of, cost_of, cost_of_graphs
from sosmith.gen.word_lengths.equal_shares import coefficient_bits, fraction_bits, rounded, within_limits
from sosmith.gen.word_lengths.input_stage import EntryStages, entries, needs_scaling
from sosmith.gen.word_lengths.ordering import best_order
from sosmith.gen.word_lengths.search import Choice, Entry, Search, Signal, Words
from sosmith.model.calibration.polynomial import Polynomial
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.output import OutputStage

Array = npt.NDArray[np.float64]


_BITS_TO_ORDER = 24
"""Significant bits of the coefficients with which orders of the sections are compared."""

_ATTEMPTS = 4
"""Times that words are chosen anew before they are chosen another way."""


@dataclass(frozen=True, kw_only=True)
class Quantized:
    """A datapath and the proven bound on its error.

    Attributes
    ----------
    datapath : Datapath
        What is computed, bit for bit.
    filter : Filter or None
        The ideal filter; None for a calibration core.
    polynomial : Polynomial or None
        The ideal polynomial; None for a filter core.
    realization : str
        Name of the sections' realization.
    budget : dict of str to Fraction
        Parts of the error bound in output LSBs, each proven.
    entry_error : Fraction
        Bound on the error of what comes before the filter, at the filter's input, in output LSBs; exact.
    proof : CascadeProof or None
        The proof of the sections; None without a filter.
    """

    datapath: Datapath
    filter: Filter | None
    polynomial: Polynomial | None
    realization: str
    budget: dict[str, Fraction]
    entry_error: Fraction
    proof: CascadeProof | None

    @property
    def bound(self) -> Fraction:
        """Proven bound on ``|output - exact|`` in output LSBs, the exact value limited to the output's range."""
        return sum(self.budget.values(), Fraction(0))

    @property
    def sections(self) -> tuple[Section, ...]:
        """The filter's sections, in the order of the cascade."""
        return tuple(cast("Section", s) for s in self.datapath.stages if not isinstance(s, HornerStep | OutputStage))

    @cached_property
    def quantized_sos(self) -> Array:
        """The transfer functions that the integer coefficients make, shape (sections, 6)."""
        return effective_sections([linear_models(section.graph) for section in self.sections])


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Words chosen in double precision, not proven yet.

    Attributes
    ----------
    name, inputs, output, max_error, ideal, polynomial, realization
        As for `plan`, the filter's sections in the order of the cascade.
    gain : Fraction
        Worst-case peak gain of the filter, 1 without one.
    share : Fraction
        Error of each part of the budget but the output rounding, in output LSBs, where all get the same.
    entries : tuple of EntryStages
        What may stand before the sections, each a little coarser than the one before.
    search : Search or None
        The search that words come from; None without a filter.
    start : Choice or None
        Words that keep to `share`; None where double precision found none.
    made : Quantized or None
        The proven design itself, of a realization that there are no estimates for.
    """

    name: str
    inputs: tuple[Port, ...]
    output: Port
    max_error: Fraction
    ideal: Filter | None
    polynomial: Polynomial | None
    realization: str
    gain: Fraction
    share: Fraction
    entries: tuple[EntryStages, ...]
    search: Search | None
    start: Choice | None
    made: Quantized | None = None

    @property
    def allowed(self) -> Fraction:
        """Error of everything but the output rounding, in output LSBs."""
        return self.max_error / self.output.lsb - Fraction(1, 2)

    @cached_property
    def area(self) -> float:
        """Estimated area, infinite where there is no estimate."""
        if self.made is not None:
            return cost_of(self.made.datapath).area
        if self.search is None or self.start is None:
            return math.inf
        last, _ = output_stage(self.search.output(self.start), self.output)
        return self.search.area(self.start) + cost_of_graphs([last.graph]).area

    def trimmed(self) -> Plan:
        """Return the same with words from which nothing more can be saved."""
        if self.search is None or self.start is None:
            return self
        return replace(self, start=self.search.trimmed(self.start, float(self.allowed)))


def plan(
    *,
    name: str,
    inputs: tuple[Port, ...],
    output: Port,
    max_error: Fraction,
    ideal: Filter | None,
    polynomial: Polynomial | None,
    realization: str,
) -> Plan:
    """Choose formats and integer coefficients that keep to equal shares of the error allowed.

    Parameters
    ----------
    name : str
        Name of the core.
    inputs, output : Port
        Its ports; two inputs with a polynomial, one without.
    max_error : Fraction
        Error allowed, in the unit of `output`; more than half an LSB.
    ideal : Filter or None
        Filter; None for a calibration core.
    polynomial : Polynomial or None
        Calibration polynomial in physical units; None for a filter core.
    realization : str
        A key of `REALIZATIONS`.

    Raises
    ------
    ShortfallError
        If the calibration cannot keep to its share of `max_error`, a section cannot be built, or the filter cannot be
        realized so.
    """
    scaled = polynomial is not None or needs_scaling(inputs[0], output)
    parts = scaled + 2 * (ideal is not None)
    share = (max_error / output.lsb - Fraction(1, 2)) / max(parts, 1)
    gain = Fraction(1) if ideal is None else gain_of(ideal)
    before = entries(polynomial, inputs, output, share / gain)
    search, start = None, None
    if ideal is not None and REALIZATIONS[realization].cascade:
        ideal = _ordered(ideal, realization)
        search = Search(
            ideal.rows,
            realization,
            [Entry(e.signal, float(e.error * gain), sum(area_of(stage.graph) for stage in e.stages)) for e in before],
        )
        start = search.start(float(share), MAX_BITS)
    planned = Plan(
        name=name,
        inputs=inputs,
        output=output,
        max_error=max_error,
        ideal=ideal,
        polynomial=polynomial,
        realization=realization,
        gain=gain,
        share=share,
        entries=before,
        search=search,
        start=start,
    )
    if ideal is None or search is not None:
        return planned
    return replace(planned, made=_equally_shared(planned, ideal))


def quantize(
    *,
    name: str,
    inputs: tuple[Port, ...],
    output: Port,
    max_error: Fraction,
    ideal: Filter | None,
    polynomial: Polynomial | None,
    realization: str,
) -> Quantized:
    """Choose formats and integer coefficients, and prove their error: `prove` of a trimmed `plan`."""
    return prove(
        plan(
            name=name,
            inputs=inputs,
            output=output,
            max_error=max_error,
            ideal=ideal,
            polynomial=polynomial,
            realization=realization,
        ).trimmed()
    )


def prove(planned: Plan) -> Quantized:
    """Fix formats and integer coefficients, and prove their error.

    Where the proof finds the planned words too short, they are chosen again with less allowed; if that does not end
    well, with the same share for every part of the budget and exact figures instead of estimates.

    Raises
    ------
    ShortfallError
        If no formats within the limits keep to the error allowed.
    """
    if planned.made is not None:
        return planned.made
    ideal, search, start = planned.ideal, planned.search, planned.start
    if ideal is None:
        return assembled(planned, planned.entries[0], (), None)
    allowed = planned.allowed
    if search is not None and start is not None:
        choice = start
        for _ in range(_ATTEMPTS):
            entry = planned.entries[choice.entry]
            try:
                made = assembled(planned, entry, *cascade(ideal, planned.realization, choice.words, entry.signal))
            except ShortfallError:
                break
            excess = made.bound * planned.output.lsb - planned.max_error
            if excess <= 0:
                return made
            allowed -= max(2 * excess / planned.output.lsb, allowed / 64)
            choice = search.trimmed(search.start(float(planned.share), MAX_BITS) or start, float(allowed))
    return _equally_shared(planned, ideal)


def _equally_shared(planned: Plan, ideal: Filter) -> Quantized:
    """Give every part of the budget the same share, by exact figures."""
    entry, realization, share = planned.entries[0], planned.realization, planned.share
    parts_of(ideal, realization)  # refused here, not for want of bits, if it cannot be realized so
    bits = coefficient_bits(ideal, realization, entry.signal, share)
    fracs = fraction_bits(ideal, realization, bits, share)
    while True:
        words = rounded(ideal, realization, bits, fracs)
        sections, proof = cascade(ideal, realization, words, entry.signal)
        if proof.rounding.magnitude <= share:
            return assembled(planned, entry, sections, proof)
        # A quantizer's error is not centred.
        finer = [{name: frac + 1 for name, frac in sources.items()} for sources in fracs]
        fracs = within_limits(finer, ideal, realization, share)


def assembled(planned: Plan, entry: EntryStages, sections: Sequence[Section], proof: CascadeProof | None) -> Quantized:
    budget: dict[str, Fraction] = {}
    if entry.stages:
        budget["calibration" if planned.polynomial is not None else "input scaling"] = entry.error * planned.gain
    if proof is not None:
        budget |= _filter_budget(proof)
    stages = (*entry.stages, *sections)
    stage, error = output_stage(format_of(stages[-1]) if stages else entry.signal, planned.output)
    budget["output rounding"] = error
    return Quantized(
        datapath=Datapath(name=planned.name, inputs=planned.inputs, output=planned.output, stages=(*stages, stage)),
        filter=planned.ideal,
        polynomial=planned.polynomial,
        realization=planned.realization,
        budget=budget,
        entry_error=entry.error,
        proof=proof,
    )


def with_realization(quantized: Quantized, realization: str) -> Quantized:
    """Return the design in another of the realizations of `ERROR_FEEDBACK`, with the same words.

    The bound is proven anew and may exceed what the specification allows.
    """
    ideal = quantized.filter
    assert ideal is not None
    stages = quantized.datapath.stages
    first = next(index for index, stage in enumerate(stages) if stage in quantized.sections)
    entry = quantized.sections[0].graph
    node = entry.nodes[entry.inputs[0]]
    words = []
    for section in quantized.sections:
        kept = {source.name: source.kept for source in linear_model(section.graph).sources if source.kept is not None}
        words.append(Words(section.coefficients, {"v": format_of(section).frac} | kept))
    sections, proof = cascade(ideal, realization, words, Signal(node.frac, node.low, node.high))
    stage, error = output_stage(format_of(sections[-1]), quantized.datapath.output)
    return replace(
        quantized,
        datapath=replace(quantized.datapath, stages=(*stages[:first], *sections, stage)),
        realization=realization,
        budget=quantized.budget | _filter_budget(proof) | {"output rounding": error},
        proof=proof,
    )


def gain_of(ideal: Filter) -> Fraction:
    try:
        return ideal_gain(ideal_sections(ideal))
    except ShortfallError as error:
        raise ShortfallError(f"{error}{_remedy_of_poles(ideal)}") from None


def _remedy_of_poles(ideal: Filter) -> str:
    """Name what moves a filter's poles away from the unit circle, if that is known."""
    if ideal.cutoff is None:
        return ""
    if ideal.decimation > 1:
        return f", decimate by {ideal.decimation} first"
    if len(ideal.cutoff) > 1:
        return ", widen the band"
    return ", move the cutoff further from 0 and from half the sample rate"


def _ordered(ideal: Filter, realization: str) -> Filter:
    """Return the filter with its sections in the order that rounds best, if that is worth a change."""
    try:
        models = [model for (model,) in wide(ideal, realization, _BITS_TO_ORDER)]
    except ShortfallError:
        return ideal  # not to be built with so few bits
    return replace(ideal, rows=tuple(ideal.rows[k] for k in best_order(models)))


def _filter_budget(proof: CascadeProof) -> dict[str, Fraction]:
    return {"filter coefficients": proof.coefficients.magnitude, "filter rounding": proof.rounding.magnitude}
