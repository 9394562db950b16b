"""From a specification to a frozen datapath: formats are chosen with estimates, then proven.

All errors inside are in output LSBs. `max_error` minus the half LSB of the output rounding is at first divided equally
among calibration, filter coefficients and filter rounding. Formats are then trimmed to the smallest size, as the
architecture counts it (`sosmith.gen.word_lengths.objective`), whichever part of the error that increases
(`sosmith.gen.word_lengths.search`). For the result, the parts of the bound and the ranges of all nodes are proven.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import cast

from sosmith.gen.filter.design import Filter
from sosmith.gen.filter.sections import Row
from sosmith.gen.proof.cascade_proof import CascadeProof, ideal_gain
from sosmith.gen.realizations.kept_formats import Choice, choice_of_tree, kept_or_made, tree_of_choice
from sosmith.gen.realizations.registry import REALIZATIONS, Section, realization_of
from sosmith.gen.realizations.section_format import MAX_BITS, SectionFormat, unknown_range
from sosmith.gen.realizations.tied_formats import check_that_some_share, standing_together
from sosmith.gen.word_lengths.cascade import cascade, parts_of, stages_of, unquantized
from sosmith.gen.word_lengths.equal_shares import equally_shared
from sosmith.gen.word_lengths.fir import fir_stages
from sosmith.gen.word_lengths.input_stage import InputStage, input_stages, needs_scaling, starting
from sosmith.gen.word_lengths.objective import SMALL_AREA, Objective
from sosmith.gen.word_lengths.ordering import best_order
from sosmith.gen.word_lengths.output_stage import output_stage
from sosmith.gen.word_lengths.quantized import Quantized, assembled
from sosmith.gen.word_lengths.search import Search
from sosmith.gen.word_lengths.truncated_sums import with_truncated_sums
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port

_BITS_TO_ORDER = 24
"""Significant bits of the coefficients when orders of the sections are compared."""

_MOST_WORK = 1_000_000
"""Samples of all coefficients' responses together up to which formats with look-ahead are trimmed."""

_FINER = 4
"""How much smaller the errors are that trimming starts with where a stage has many coefficients: room to choose."""

_HOPES = (8, 4, 2, 1, 0.5)
"""What is left of the error allowed is spent so often on truncated sums: errors of different signs, which the estimate
adds up, nearly balance each other."""

_ATTEMPTS = 4
"""How often formats are chosen again with estimates before exact figures are used."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Formats chosen in double precision, not yet proven.

    Attributes
    ----------
    name, inputs, output, max_error, ideal, polynomial, realization, steady
        As for `plan`; the filter's sections are in the order of the cascade.
    gain : Fraction
        Worst-case peak gain of the filter, 1 without one.
    share : Fraction
        Error of each part of the budget except the output rounding, in output LSBs, with equal shares.
    input_stages : tuple of InputStage
        Possible input stages, each a little coarser than the previous one.
    search : Search or None
        The search that chooses the formats; None without a filter.
    start : Choice or None
        Formats that keep to `share`; None if the estimates found none.
    objective : Objective
        The size that formats are trimmed for.
    quantized : Quantized or None
        The proven design, for a realization without estimates.
    instead : tuple of Choice
        Once formats are trimmed, others to fall back on if the whole does not suit.
    loads : bool
        Whether other coefficients can be loaded.
    otherwise : Plan or None
        The same with its sections in another order, to fall back on if the proof of this one makes it larger.
    """

    name: str
    inputs: tuple[Port, ...]
    output: Port
    max_error: Fraction
    ideal: Filter | None
    polynomial: Polynomial | None
    realization: str
    steady: bool
    gain: Fraction
    share: Fraction
    input_stages: tuple[InputStage, ...]
    search: Search | None
    start: Choice | None
    objective: Objective = SMALL_AREA
    quantized: Quantized | None = None
    instead: tuple[Choice, ...] = ()
    loads: bool = False
    otherwise: Plan | None = None

    @property
    def allowed(self) -> Fraction:
        """Error allowed for everything except the output rounding, in output LSBs."""
        return self.max_error / self.output.lsb - Fraction(1, 2)

    @cached_property
    def size(self) -> float:
        """Estimated size, infinite where there is no estimate."""
        if self.quantized is not None:
            return self.objective.of_datapath(self.quantized.datapath)
        if self.search is None or self.start is None:
            return math.inf
        search, start = self.search, self.start
        before = self.input_stages[start.input_stage].start
        first_sample = None if before is None else before.first_sample

        def estimate() -> float:
            last, _ = output_stage(search.output(start), self.output, first_sample)
            return search.size(start) + self.objective.of_graph(last.graph)

        key = "size", search.key, start, self.output, first_sample
        return kept_or_made(key, estimate, float, float)

    @property
    def key(self) -> tuple[object, ...] | None:
        """All that its proof depends on, with equal representations if equal; None if it is proven already."""
        if self.search is None or self.ideal is None:
            return None
        ports, asked = (*self.inputs, self.output), (self.max_error, self.polynomial, self.ideal.exact)
        before = None if self.otherwise is None else self.otherwise.key
        return self.search.key, self.start, self.instead, ports, asked, self.steady, before

    @property
    def is_long(self) -> bool:
        """Whether sections look ahead with so long responses and so many coefficients that trimming takes minutes."""
        looks_ahead = self.realization not in REALIZATIONS
        return looks_ahead and self.search is not None and self.search.work > _MOST_WORK

    def under(self, objective: Objective) -> Plan:
        """Return the same plan, to be trimmed for another objective."""
        search = None if self.search is None else self.search.under(objective)
        other = replace(self, search=search, objective=objective)
        by_taps = self.ideal is not None and self.ideal.is_fir
        return replace(other, quantized=_by_taps(other)) if by_taps and objective != self.objective else other

    def with_rows(self, rows: tuple[Row, ...], formats: Choice) -> Plan:
        """Return the same plan for sections in another order.

        It starts from `formats` if these keep to the error allowed in that order too, else from equal shares.
        """
        assert self.ideal is not None
        ideal = replace(self.ideal, rows=rows)
        stages = parts_of(ideal, self.realization)
        search = Search(stages, self.realization, self.input_stages, self.gain, steady=self.steady)
        search = search.under(self.objective)
        other = replace(self, ideal=ideal, search=search, start=formats, instead=())
        return other if search.error(formats) <= float(self.allowed) else other.started_anew()

    def started_anew(self) -> Plan:
        """Return the same plan with formats of equal shares, to be trimmed."""
        assert self.search is not None
        return replace(self, start=_start(self.search, float(self.share)), instead=())

    def merely_trimmed(self) -> Plan:
        """Return a copy with formats trimmed without a look at what costs nothing: not the smallest ones, but soon."""
        if self.search is None or self.start is None:
            return self
        return replace(self, start=self.search.merely_trimmed(self.start, float(self.allowed)))

    def trimmed(self) -> Plan:
        """Return a copy with formats trimmed until no step saves any more."""
        if self.search is None or self.start is None:
            return self
        search, start, allowed = self.search, self.start, float(self.allowed)

        def search_formats() -> tuple[Choice, ...]:
            smallest = search.trimmed(start, allowed)
            return search.with_free_bits(smallest), smallest, search.merely_trimmed(start, allowed)

        closest, *instead = kept_or_made(
            ("trimmed", search.key, start, allowed),
            search_formats,
            lambda choices: [*map(tree_of_choice, choices)],
            lambda trees: tuple(map(choice_of_tree, trees)),
        )
        return replace(self, start=closest, instead=tuple(instead))


def plan(
    *,
    name: str,
    inputs: tuple[Port, ...],
    output: Port,
    max_error: Fraction,
    ideal: Filter | None,
    polynomial: Polynomial | None,
    realization: str,
    steady: bool = False,
    loads: bool = False,
    together: bool = False,
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
        Its name, known to `sosmith.gen.realizations.registry.realization_of`.
    steady : bool
        Whether a filter starts from the steady state of its first sample, and not from zero.
    loads : bool
        Whether other coefficients can be loaded.
    together : bool
        Whether sections of the same structure follow each other.

    Raises
    ------
    ShortfallError
        If the calibration cannot keep to its share of `max_error`, a section cannot be built, or the filter has no such
        realization.
    """
    scaled = polynomial is not None or needs_scaling(inputs[0], output)
    parts = scaled + (0 if ideal is None else 1 if ideal.is_fir else 2)  # an FIR filter rounds nothing
    share = (max_error / output.lsb - Fraction(1, 2)) / max(parts, 1)
    gain = Fraction(1) if ideal is None else gain_of(ideal)
    steady = steady and ideal is not None
    at_zero = gain_at_zero(cast("Filter", ideal)) if steady else None
    by_taps = steady and loads and cast("Filter", ideal).is_fir
    before = _input_stages(polynomial, inputs, output, share, gain, at_zero, loads=by_taps)
    search, start = None, None
    if ideal is not None and realization_of(realization).searched:
        ideal = _ordered(ideal, realization, together=together) if realization_of(realization).cascade else ideal
        stages = parts_of(ideal, realization)
        if together:
            check_that_some_share(stages, realization)
        search = Search(stages, realization, before, gain, steady=steady)
        start = _start(search, float(share) / (1 if realization_of(realization).cascade else _FINER))
    planned = Plan(
        name=name,
        inputs=inputs,
        output=output,
        max_error=max_error,
        ideal=ideal,
        polynomial=polynomial,
        realization=realization,
        steady=steady,
        gain=gain,
        share=share,
        input_stages=before,
        search=search,
        start=start,
        loads=loads,
    )
    if ideal is None or search is not None:
        return planned
    return replace(planned, quantized=_by_taps(planned) if ideal.is_fir else _equally_shared(planned, ideal))


@lru_cache(maxsize=8)
def _input_stages(
    polynomial: Polynomial | None,
    inputs: tuple[Port, ...],
    output: Port,
    share: Fraction,
    gain: Fraction,
    at_zero: Fraction | None,
    *,
    loads: bool,
) -> tuple[InputStage, ...]:
    """Return the possible input stages, which are the same for every realization.

    `at_zero` is the gain at zero frequency of a filter that starts from its first sample, None for another one; `loads`
    is as for `starting`.
    """
    before = input_stages(polynomial, inputs, output, share / gain)
    return before if at_zero is None else tuple(starting(stage, at_zero, share, loads=loads) for stage in before)


def _start(search: Search, share: float) -> Choice | None:
    """Find formats that keep to `share`; None if there are none."""
    return kept_or_made(
        ("start", search.key, share),
        lambda: search.start(share, MAX_BITS),
        lambda choice: None if choice is None else tree_of_choice(choice),
        lambda tree: None if tree is None else choice_of_tree(tree),
    )


def quantize(
    *,
    name: str,
    inputs: tuple[Port, ...],
    output: Port,
    max_error: Fraction,
    ideal: Filter | None,
    polynomial: Polynomial | None,
    realization: str,
    steady: bool = False,
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
            steady=steady,
        ).trimmed()
    )


def prove(planned: Plan) -> Quantized:
    """Fix formats and integer coefficients, and prove their error.

    If the proof finds the planned formats too short, they are chosen again with a smaller allowed error. If that fails
    too, every part of the budget gets an equal share, and exact figures replace the estimates.

    Raises
    ------
    ShortfallError
        If no formats within the limits keep to the error allowed.
    """
    if planned.otherwise is not None:
        return _smaller_of_two(planned, planned.otherwise)
    if planned.quantized is not None:
        return planned.quantized
    ideal, search, start = planned.ideal, planned.search, planned.start
    if ideal is None:
        return _assembled(planned, planned.input_stages[0], (), None)
    allowed = planned.allowed
    if search is not None and start is not None:
        choice, tried, instead = start, None, list(planned.instead)
        for _ in range(_ATTEMPTS + len(instead)):
            if choice == tried:
                break  # nothing else is to be had
            try:
                quantized = _with_formats(planned, ideal, choice)
            except ShortfallError:
                break
            excess = quantized.bound * planned.output.lsb - planned.max_error
            if excess <= 0:
                # Words that suit stage by stage may not suit as a whole.
                if not instead or planned.objective.of_datapath(quantized.datapath) < math.inf:
                    return _truncated(planned, ideal, search, choice, quantized)
                choice, *instead = instead
                continue
            if planned.is_long:
                break
            tried = choice
            allowed -= max(2 * excess / planned.output.lsb, allowed / 64)
            choice = search.trimmed(search.start(float(planned.share), MAX_BITS) or start, float(allowed))
    return _equally_shared(planned, ideal)


def _with_formats(planned: Plan, ideal: Filter, choice: Choice) -> Quantized:
    """Build the stages in given formats, and prove them."""
    before = planned.input_stages[choice.input_stage]
    stages = cascade(ideal, planned.realization, choice.formats, before.output, steady=planned.steady)
    return _assembled(planned, before, *stages)


def _truncated(planned: Plan, ideal: Filter, search: Search, choice: Choice, proven: Quantized) -> Quantized:
    """Return a proven design with truncated sums where the error that is left allows it and they make it smaller."""
    if not planned.objective.few_digits:
        return proven
    allowed = planned.max_error / planned.output.lsb
    for factor in _HOPES:
        left = factor * float(allowed - proven.bound)
        shorter = with_truncated_sums(search, choice, proven.sections, left)
        if shorter is None:
            return proven
        try:
            truncated = _with_formats(planned, ideal, shorter)
        except ShortfallError:
            return proven
        if truncated.bound <= allowed:
            return min(proven, truncated, key=lambda each: planned.objective.of_datapath(each.datapath))
    return proven


def _smaller_of_two(planned: Plan, otherwise: Plan) -> Quantized:
    """Prove a plan, and the other one if the first is not smaller once it is proven."""
    of_datapath = planned.objective.of_datapath
    try:
        quantized = prove(replace(planned, otherwise=None))
    except ShortfallError:
        return prove(otherwise)
    if of_datapath(quantized.datapath) < otherwise.size:
        return quantized
    other = prove(otherwise)
    return min(quantized, other, key=lambda each: of_datapath(each.datapath))


def _equally_shared(planned: Plan, ideal: Filter) -> Quantized:
    """Give every part of the budget an equal share, from exact figures."""
    before = planned.input_stages[0]
    shared = equally_shared(
        ideal,
        planned.realization,
        before.output,
        planned.share,
        steady=planned.steady,
        tied=planned.objective.tied,
    )
    return _assembled(planned, before, *shared)


def _by_taps(planned: Plan) -> Quantized:
    """Leave to the coefficients of an FIR filter what input stage and start do not take of the error allowed."""
    ideal, before = planned.ideal, planned.input_stages[0]
    assert ideal is not None
    spent = before.error * planned.gain + (0 if before.start is None else before.start.error)
    stages = fir_stages(
        ideal,
        planned.realization,
        before.output,
        Fraction(0) if planned.objective.exact_taps else planned.allowed - spent,
        steady=planned.steady,
        few_digits=planned.objective.few_digits,
        factor_bits=planned.objective.factor_bits,
        loads=planned.loads,
    )
    return _assembled(planned, before, *stages)


def _assembled(
    planned: Plan, input_stage: InputStage, sections: Sequence[Section], proof: CascadeProof | None
) -> Quantized:
    return assembled(
        name=planned.name,
        inputs=planned.inputs,
        output=planned.output,
        ideal=planned.ideal,
        polynomial=planned.polynomial,
        realization=planned.realization,
        gain=planned.gain,
        input_stage=input_stage,
        sections=sections,
        proof=proof,
    )


def least_size(ideal: Filter, realization: str, objective: Objective) -> float:
    """Bound the size of a realization from below, without planning it.

    Raises
    ------
    ShortfallError
        If the filter has no such realization, or the realization does not suit the objective.
    """
    parts = parts_of(ideal, realization)
    formats = [SectionFormat(coefficient_bits=_BITS_TO_ORDER)] * len(parts)
    try:
        stages = stages_of(ideal, realization, formats, unknown_range(0))
    except ShortfallError:
        return 0  # cannot be built with so few bits
    return objective.least([stage.graph for stage in stages])


def gain_at_zero(ideal: Filter) -> Fraction:
    """Return the gain of a filter at zero frequency, exact."""
    return math.prod((sum(b, Fraction(0)) / sum(a, Fraction(0)) for b, a in ideal.exact), start=Fraction(1))


def gain_of(ideal: Filter) -> Fraction:
    """Return the worst-case peak gain of a filter.

    Raises
    ------
    ShortfallError
        If a pole lies too close to the unit circle; the message says what would help.
    """
    try:
        return ideal_gain(ideal.exact)
    except ShortfallError as error:
        raise ShortfallError(f"{error}{_remedy_of_poles(ideal)}") from None


def _remedy_of_poles(ideal: Filter) -> str:
    """Suggest what would move a filter's poles away from the unit circle, if that is known."""
    if ideal.cutoff is None:
        return ""
    if ideal.decimation > 1:
        return f", decimate by {ideal.decimation} first"
    if len(ideal.cutoff) > 1:
        return ", widen the band"
    return ", move the cutoff further from 0 and from half the sample rate"


def _ordered(ideal: Filter, realization: str, *, together: bool) -> Filter:
    """Return the filter with its sections in the order with the smallest rounding error, if the gain is worth it.

    Those of the same structure may have to stand `together`: then in that order behind the first one of them.
    """

    def search_order() -> list[int]:
        try:
            models = [model for (model,) in unquantized(ideal, realization, _BITS_TO_ORDER)]
        except ShortfallError:
            return [*range(len(ideal.rows))]  # cannot be built with so few bits
        return [*best_order(models)]

    order: list[int] = kept_or_made(("order", realization, ideal.rows), search_order, list, list)
    rows = tuple(ideal.rows[k] for k in order)
    return replace(ideal, rows=standing_together(rows, realization) if together else rows)
