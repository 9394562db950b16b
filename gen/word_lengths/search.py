"""Trims the formats of a cascade, by greedy descent: fraction bits of every quantizer, bits of every coefficient.

The start keeps to the error allowed. Each step is the one that saves the most estimated size for the error it costs;
the search ends when no further step fits. A step drops bits of one quantizer, of the calibration or of one
coefficient, which may become either neighbour of its ideal value; or it starts to quantize a product's operand so that
it fits one hardware multiplier. Where every bit of a sum takes an adder, all products of a section may drop bits, too;
and where no step is left, one that errs too much is tried with more bits elsewhere. Where products are made of adders,
a coefficient may also become a number near its ideal value that has fewer signed digits. Where no step fits any more,
what lowers the error and costs nothing is taken: neighbouring values of one or two coefficients, and bits of
quantizers, as memory words may have room for them.

All errors here are linear estimates (`sosmith.gen.word_lengths.estimates`), which only guide the choice; the result is
proven afterwards.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import combinations, pairwise, zip_longest
from typing import Any, NamedTuple, TypeVar

import numpy as np

from sosmith.gen.realizations.coefficients import lowest_terms, round_significant, with_fewer_digits
from sosmith.gen.realizations.kept_formats import Choice
from sosmith.gen.realizations.registry import realization_of
from sosmith.gen.realizations.section_format import MIN_BITS, SectionFormat, unknown_range
from sosmith.gen.realizations.tied_formats import Group, groups_of, tied_start, tied_step
from sosmith.gen.word_lengths.cost import MULTIPLIER_BITS
from sosmith.gen.word_lengths.estimates import Estimate, FormatErrors, estimates_of
from sosmith.gen.word_lengths.input_stage import InputStage
from sosmith.gen.word_lengths.objective import SMALL_AREA, Objective
from sosmith.model.dataflow.graph import Op, Range
from sosmith.model.dataflow.structure import Stage
from sosmith.model.errors import ShortfallError

_FEW = 16
"""Coefficients up to which neighbours are tried two at a time."""

_WORTH = 2.0**-10
"""Share of the error that a step which costs nothing must save, and the error in output LSBs that is left as it is.

Without the latter, a quantizer whose bits take no logic would be given bits without end.
"""

_UNNOTICED = 2.0**-10
"""Error at the output, in LSBs, with which products begin to drop bits."""

_STEPS = (1, 2, 3)
"""Bits that one step may drop: several, as a shorter fraction may save something only once it is the shortest one."""


_MANY, _ALIKE = 10, 0.5
"""Coefficients of a stage beyond which one look at all steps takes several, and how much of the best one's merit."""


_V = TypeVar("_V")


class _Input(NamedTuple):
    """Output range of an input stage, its error at the filter's output in LSBs, and its estimated size."""

    x: Range
    error: float
    size: float


class Search:
    """Searches for the formats of a cascade.

    Parameters
    ----------
    parts : sequence
        What the realization makes its stages from, in their order: b0, b1, b2, 1, a1, a2 of each section of a cascade.
    realization : str
        Its name, known to `sosmith.gen.realizations.registry.realization_of`.
    input_stages : sequence of InputStage
        Possible input stages, each a little coarser than the previous one.
    gain : Fraction
        Gain of the filter, by which their errors are multiplied.
    objective : Objective
        The size to be saved.
    steady : bool
        Whether the filter starts from its first sample, and not from zero.

    Whatever looks at the sections raises ShortfallError if one cannot be built, or its response does not decay in time.
    """

    def __init__(
        self,
        parts: Sequence[Any],
        realization: str,
        input_stages: Sequence[InputStage],
        gain: Fraction,
        objective: Objective = SMALL_AREA,
        *,
        steady: bool = False,
    ) -> None:
        self._build, self._transfer = realization_of(realization).build, realization_of(realization).transfer
        self._parts = parts
        self._input_stages = input_stages
        self._gain = gain
        self._objective = objective
        self._inputs = self._sized_inputs()
        x = self._inputs[0].x
        low, high = x.low * 2.0**-x.frac, x.high * 2.0**-x.frac
        self._windows = [(0.0, high), (low, 0.0)] if steady else [(low, high)]
        self._realization = realization
        self._ranges: dict[tuple[object, ...], dict[str, tuple[int, int]]] = {}
        self._known: dict[tuple[object, ...], tuple[float, Range, dict[str, int]]] = {}
        self._saved: dict[tuple[object, ...], list[float]] = {}
        self._merely: tuple[Choice, float, Choice] | None = None
        self._known_start: tuple[Choice, Choice] | None = None

    @cached_property
    def _all_groups(self) -> tuple[Group, ...]:
        return groups_of(self._parts, self._realization)

    @property
    def _groups(self) -> tuple[Group, ...]:
        """Sections that have the same formats; none where each has its own."""
        return self._all_groups if self._objective.tied else ()

    @property
    def _alike(self) -> Sequence[Group]:
        """All sections, those together that have the same formats."""
        return self._groups or [(k,) for k in range(len(self._parts))]

    @cached_property
    def _estimates(self) -> list[Estimate]:
        return estimates_of(self._parts, self._realization, self._windows)

    @cached_property
    def _errors(self) -> FormatErrors:
        return FormatErrors(self._estimates, self._windows)

    @property
    def _ideals(self) -> list[dict[str, float]]:
        """Ideal coefficients of each section by name."""
        return [estimate.ideal for estimate in self._estimates]

    def gain(self, section: int, quantizer: str) -> float:
        """Largest centred error in output LSBs of a quantizer of a section, if it rounds to integers."""
        return self._estimates[section].gains[quantizer]

    @property
    def work(self) -> int:
        """Samples of the responses to all coefficients together, which decide how long trimming takes."""
        return sum(len(slope) for estimate in self._estimates for slope in estimate.slopes.values())

    @property
    def key(self) -> tuple[object, ...]:
        """All that its results depend on besides what they are asked with, with equal representations if equal."""
        plain = self._transfer is None  # rows, of numbers that may have other types
        parts = [[float(value) for value in part] if plain else part for part in self._parts]
        inputs = [(*each.x, float(each.error), float(each.size)) for each in self._inputs]
        return self._realization, parts, inputs, self._windows, self._objective

    def under(self, objective: Objective) -> Search:
        """Return the same search for another objective."""
        if objective == self._objective:
            return self
        other = copy.copy(self)
        other.__dict__.pop("_errors", None)
        other._objective = objective
        other._inputs = other._sized_inputs()
        other._known = {}
        other._merely = None
        other._known_start = None
        return other

    def _sized_inputs(self) -> list[_Input]:
        return [
            _Input(s.output, float(s.error * self._gain), _size(s.stages, self._objective)) for s in self._input_stages
        ]

    def start(self, share: float, most: int) -> Choice | None:
        """Find formats whose coefficients and whose quantizers each keep their error within `share` output LSBs.

        Every coefficient has the same number of significant bits; the quantizers share the allowed error equally. None
        if a coefficient or a quantizer would need more than `most` bits.
        """
        names = [[name for name in e.gains if name not in e.optional] for e in self._estimates]
        count = sum(map(len, names))
        fracs = [
            {name: max(0, _bits_below(e.gains[name] * count, share)) for name in required}
            for e, required in zip(self._estimates, names, strict=True)
        ]
        if max((frac for quantizers in fracs for frac in quantizers.values()), default=0) > most:
            return None
        bits = MIN_BITS
        while bits <= most:
            formats = tuple(
                SectionFormat(
                    coefficients={name: round_significant(value, bits) for name, value in e.ideal.items()}, fracs=kept
                )
                for e, kept in zip(self._estimates, fracs, strict=True)
            )
            choice = Choice(0, formats)
            error = self.coefficient_error(choice)
            if error <= share and self._is_stable(choice):
                return choice
            # Each bit halves the error, sometimes more: jump most of the way.
            bits += max(1, _bits_below(error, share) - 3)
        return None

    def trimmed(self, start: Choice, allowed: float) -> Choice:
        """Trim the formats until no step saves any more.

        Parameters
        ----------
        start : Choice
            Initial formats.
        allowed : float
            Allowed sum of the errors of input stage, coefficients and rounding, in output LSBs.
        """
        start = self._tied(start)
        ways = []
        if len(self._inputs) > 1:
            ways.append(self._trimmed_once(start, allowed, calibration=False))
        ends = [self._closely_trimmed(self.merely_trimmed(start, allowed), allowed)]
        ends += [self._closely_trimmed(self._trimmed_once(way, allowed), allowed) for way in ways]
        return min(ends, key=lambda choice: (self.size(choice), self.error(choice)))

    def merely_trimmed(self, start: Choice, allowed: float) -> Choice:
        """Return formats trimmed without a look at what costs nothing; parameters as of `trimmed`."""
        start = self._tied(start)
        if self._merely is None or self._merely[0] is not start or self._merely[1] != allowed:
            self._merely = start, allowed, self._trimmed_once(start, allowed)
        return self._merely[2]

    def _tied(self, start: Choice) -> Choice:
        """Return formats that are the same where they must be."""
        if self._known_start is None or self._known_start[0] is not start:
            self._known_start = start, tied_start(self._groups, self._ideals, start) if self._groups else start
        return self._known_start[1]

    def _all_tied(self, before: Choice, steps: Iterable[Choice]) -> Iterator[Choice]:
        """Yield steps, each with all sections changed that have the same formats as the one that it changes."""
        if not self._groups:
            yield from steps
            return
        for step in steps:
            tied = tied_step(self._groups, self._ideals, before, step)
            if tied is not None:
                yield tied

    def with_free_bits(self, choice: Choice) -> Choice:
        """Return formats with a smaller error, for a negligible size."""
        return self._closer(choice, more=self._objective.negligible)

    def _closely_trimmed(self, choice: Choice, allowed: float) -> Choice:
        """Trim a trimmed choice further: by what is closer and costs nothing, as long as there is any.

        Where no format fits, all sizes are infinite and say of no step what it saves: nothing is gained then.
        """
        while True:
            closer = self._closer(choice)
            if closer is choice:
                return choice
            trimmed = self._trimmed_once(closer, allowed)
            if (self.size(trimmed), self.error(trimmed)) >= (self.size(choice), self.error(choice)):
                return choice
            choice = trimmed

    def _trimmed_once(self, start: Choice, allowed: float, *, calibration: bool = True) -> Choice:
        choice, error, size = start, self.error(start), self.size(start)
        while error <= allowed:
            self._errors.refer_to(choice.formats)
            steps: list[tuple[float, Choice, float, float]] = []
            for candidate in self._all_tied(choice, self._steps(choice, calibration=calibration)):
                after = self.error(candidate)
                if after > allowed:
                    continue
                saved = size - self.size(candidate)
                if saved <= 0:
                    continue
                steps.append((saved / max(after - error, 1e-6 * allowed), candidate, after, size - saved))
            if not steps:
                exchange = self._exchange(choice, size, allowed, calibration=calibration)
                if exchange is None:
                    break
                choice, size = exchange
                error = self.error(choice)
                continue
            before = choice
            best, choice, error, size = max(steps, key=lambda step: step[0])
            if len(self._estimates[0].ideal) > _MANY:
                likely = sorted((step for step in steps if step[0] > best * _ALIKE), key=lambda step: -step[0])
                choice, error, size = self._further(before, (choice, error, size), likely[1:], allowed)
        return choice

    def _further(
        self,
        before: Choice,
        taken: tuple[Choice, float, float],
        likely: Sequence[tuple[float, Choice, float, float]],
        allowed: float,
    ) -> tuple[Choice, float, float]:
        """Take steps of other places too, as far as they save something together with what has been taken."""
        choice, error, size = taken
        for _, candidate, _, _ in likely:
            other = _with_step(choice, before, candidate)
            if other is None:
                continue
            after, smaller = self.error(other), self.size(other)
            if after <= allowed and smaller < size:
                choice, error, size = other, after, smaller
        return choice, error, size

    def _exchange(
        self, choice: Choice, size: float, allowed: float, *, calibration: bool
    ) -> tuple[Choice, float] | None:
        """Return a smaller choice that has bits less in one place and more in others, and its size; None without one.

        Bits that cost next to nothing go first, as those of products; what that took may be worth more elsewhere.
        """
        best: tuple[Choice, float] | None = None
        steps = self._steps(choice, calibration=calibration) if self._objective.floors_products else ()
        steps = self._all_tied(choice, steps)
        most = len(choice.formats) * max(_STEPS)
        for candidate in steps:
            other, error, smallest = candidate, self.error(candidate), size if best is None else best[1]
            if error - self._most_saved(candidate, most) > allowed:
                continue
            for _ in range(most):
                if error <= allowed or self.size(other) >= smallest:
                    break
                longer = [
                    (each, self.error(each), self.size(each)) for each in self._all_tied(other, self._longer(other))
                ]
                before, grown = error, self.size(other)
                merits = [(before - after) / max(larger - grown, 1.0) for _, after, larger in longer]
                other, error, _ = longer[merits.index(max(merits))]
            if error <= allowed and (smaller := self.size(other)) < smallest:
                best = other, smaller
        return best

    def _longer(self, choice: Choice) -> Iterator[Choice]:
        """Yield choices where one section keeps one bit more, of its products or of another quantizer."""
        for k, form in enumerate(choice.formats):
            for names in self._places(k, form):
                kept = {**form.fracs, **{name: form.fracs[name] + 1 for name in names}}
                yield choice.with_format(k, replace(form, fracs=kept))

    def _places(self, k: int, form: SectionFormat) -> list[tuple[str, ...]]:
        """Return what keeps a bit more at once in section k: a quantizer, or all products that are added up."""
        estimate = self._estimates[k]
        alone = [(name,) for name in form.fracs if name not in estimate.products]
        together = [tuple(name for name in group.products if name in form.fracs) for group in estimate.groups]
        return [*alone, *together]

    def _most_saved(self, choice: Choice, bits: int) -> float:
        """Return how much the error falls if the best places keep so many bits more in all, whatever their size."""
        saved: list[float] = []
        for group in self._alike:  # a bit more in one of them is a bit more in all
            each_saves = (self._saved_by_bits(k, choice.formats[k], bits) for k in group)
            saved += map(sum, zip_longest(*each_saves, fillvalue=0.0))
        return sum(sorted(saved, reverse=True)[:bits])

    def _saved_by_bits(self, k: int, form: SectionFormat, bits: int) -> list[float]:
        """Return by how much the error falls with each further bit at each place of section k."""
        key = (k, bits, tuple(form.fracs.items()))
        if key not in self._saved:
            rounding, saved = self._estimates[k].rounding, []
            for names in self._places(k, form):
                errors = [
                    rounding({**form.fracs, **{name: form.fracs[name] + more for name in names}})
                    for more in range(bits + 1)
                ]
                saved += [before - after for before, after in pairwise(errors)]
            self._saved[key] = saved
        return self._saved[key]

    def with_closer_coefficients(self, choice: Choice) -> Choice:
        """Return the same formats with coefficients whose error is smaller, of no more bits."""
        return self._closer(choice, self._moved)

    def _closer(
        self, choice: Choice, neighbours: Callable[[Choice], Iterator[Choice]] | None = None, more: float = 0.0
    ) -> Choice:
        """Take what lowers the error and costs at most `more` in all, the best first, until nothing does."""
        size = self.size(choice) + more
        while True:
            self._errors.refer_to(choice.formats)
            error = self.error(choice)
            if error <= _WORTH:
                return choice
            least = (1 - _WORTH) * error
            others = [*self._all_tied(choice, (neighbours or self._neighbours)(choice))]
            errors = [self.error(other) for other in others]
            better = (at for at in np.argsort(errors, kind="stable").tolist() if errors[at] < least)
            free = next((others[at] for at in better if self.size(others[at]) <= size), None)
            if free is None:
                return choice
            choice = free

    def _neighbours(self, choice: Choice) -> Iterator[Choice]:
        """Yield formats with a finer input stage or quantizer, or other coefficients."""
        if choice.input_stage:
            yield replace(choice, input_stage=choice.input_stage - 1)
        for k, form in enumerate(choice.formats):
            for name, frac in form.fracs.items():
                yield choice.with_format(k, form.with_frac(name, frac + 1))
        yield from self._moved(choice)

    def _moved(self, choice: Choice) -> Iterator[Choice]:
        """Yield formats with one coefficient, or two if there are few, next to what they were."""
        places = [(k, name) for k, form in enumerate(choice.formats) for name in form.coefficients]
        moves: list[tuple[tuple[tuple[int, str], int], ...]] = [((place, by),) for place in places for by in (-1, 1)]
        if len(places) <= _FEW:
            moves += [(*one, *other) for one, other in combinations(moves, 2) if one[0][0] != other[0][0]]
        for move in moves:
            moved = choice
            for (k, name), by in move:
                integer, frac = moved.formats[k].coefficients[name]
                if integer + by:
                    value = self._shortest(integer + by, frac)
                    moved = moved.with_format(k, moved.formats[k].with_coefficient(name, value))
            yield moved

    def _steps(self, choice: Choice, *, calibration: bool) -> Iterator[Choice]:
        first = choice.input_stage + 1
        for index in range(first, min(first + len(_STEPS), len(self._inputs)) if calibration else first):
            yield replace(choice, input_stage=index)
        x = self._inputs[choice.input_stage].x
        for k, form in enumerate(choice.formats):
            _, y, fits = self._section(k, x, form)
            for changed in self._changes(k, form, fits):
                yield choice.with_format(k, changed)
            x = y

    def _changes(self, k: int, form: SectionFormat, fits: Mapping[str, int]) -> Iterator[SectionFormat]:
        """Yield formats of section k with fewer bits in one place.

        `fits` holds the fraction bits with which an operand that is too long would fit a multiplier.
        """
        for name, frac in form.fracs.items():
            for step in _STEPS:
                if frac >= step:
                    yield form.with_frac(name, frac - step)
        for name, frac in fits.items():
            yield form.with_frac(name, frac)
        if self._objective.floors_products:
            yield from self._shorter_products(k, form)
        for name, (integer, frac) in form.coefficients.items():
            if self._objective.few_digits:
                for nearest in with_fewer_digits(integer, self._estimates[k].ideal[name] * 2.0**frac):
                    yield form.with_coefficient(name, lowest_terms(nearest, frac))
            for step in _STEPS:
                exact = self._estimates[k].ideal[name] * 2.0 ** (frac - step)
                if abs(integer).bit_length() > step + 1:
                    for neighbour in {math.floor(exact), math.ceil(exact)} - {0}:
                        yield form.with_coefficient(name, self._shortest(neighbour, frac - step))

    def _shortest(self, integer: int, frac: int) -> tuple[int, int]:
        """Return a coefficient in lowest terms, unless it has as many fraction bits as others."""
        return (integer, frac) if self._groups else lowest_terms(integer, frac)

    def _shorter_products(self, k: int, form: SectionFormat) -> Iterator[SectionFormat]:
        """Yield formats where all products of a sum drop more bits: one that keeps more keeps the words long."""
        estimate = self._estimates[k]
        for _, products in estimate.groups:
            kept = [form.fracs[name] for name in products if name in form.fracs]
            gain = sum(estimate.gains[name] for name in products)
            most = min(kept) if kept else _bits_below(gain, _UNNOTICED) + 1
            for step in _STEPS:
                if most >= step:
                    yield replace(form, fracs={**form.fracs, **dict.fromkeys(products, most - step)})

    def error(self, choice: Choice) -> float:
        """Estimated sum of the errors of input stage, coefficients and rounding, in output LSBs."""
        rounding = self._errors.of_rounding(choice.formats)
        return self._inputs[choice.input_stage].error + rounding + self.coefficient_error(choice)

    def coefficient_error(self, choice: Choice) -> float:
        """Estimated error of the coefficients in output LSBs."""
        return self._errors.of_coefficients(choice.formats)

    def _is_stable(self, choice: Choice) -> bool:
        return self.size(choice) < math.inf

    def size(self, choice: Choice) -> float:
        """Estimated size of the input stage and the sections, infinite if rounded coefficients are unstable."""
        sizes = [size for size, _ in self._built_sections(choice)]
        return self._inputs[choice.input_stage].size + sum(max(sizes[k] for k in group) for group in self._alike)

    def output(self, choice: Choice) -> Range:
        """Return the estimated output range of the last section."""
        *_, (_, passed) = self._built_sections(choice)
        return passed

    def _built_sections(self, choice: Choice) -> Iterator[tuple[float, Range]]:
        passed = self._inputs[choice.input_stage].x
        for k, form in enumerate(choice.formats):
            size, passed, _ = self._section(k, passed, form)
            yield size, passed

    def _section(self, k: int, x: Range, form: SectionFormat) -> tuple[float, Range, dict[str, int]]:
        """Size and output of section k, and the fraction bits with which each long operand would fit a multiplier."""
        key = (k, x, tuple(form.coefficients.items()), tuple(form.fracs.items()))
        if key not in self._known:
            try:
                self._known[key] = self._built(k, x, form)
            except ShortfallError:
                self._known[key] = math.inf, x, {}
        return self._known[key]

    def _built(self, k: int, x: Range, form: SectionFormat) -> tuple[float, Range, dict[str, int]]:
        name = f"section{k}"
        ranges = self._ranges_of(k, x.frac, form, name)
        section = self._build(self._parts[k], replace(form, ranges=ranges, x=x), name)
        graph = section.graph
        output = graph.nodes[graph.outputs[0]]
        optional = section.optional_quantizers
        operands = {node.name: node for node in graph.nodes if node.name in optional and node.op is not Op.SCALE}
        fits = {
            name: node.frac - (node.width - MULTIPLIER_BITS)
            for name, node in operands.items()
            if node.width > MULTIPLIER_BITS
        }
        return self._objective.of_graph(graph), output.range, fits

    def _ranges_of(self, k: int, frac: int, form: SectionFormat, name: str) -> dict[str, tuple[int, int]]:
        """Estimated codes of the nodes of section k, which do not depend on the range of its input.

        Of the coefficients, only what decides which nodes there are and where their points lie counts: the fraction
        bits, and whether a product is none, a shift or a multiplication.
        """
        kinds = tuple((one, frac_of, _kind(integer)) for one, (integer, frac_of) in form.coefficients.items())
        key = (k, frac, kinds, tuple(form.fracs.items()))
        if key not in self._ranges:
            ranges = {}
            section = self._build(self._parts[k], replace(form, x=unknown_range(frac)), name)
            for node, bits in section.stated_fracs.items():
                low, high = self._estimates[k].limits_of(node, form.fracs)
                ranges[node] = math.floor(low * 2.0**bits), math.ceil(high * 2.0**bits)
            self._ranges[key] = ranges
        return self._ranges[key]


def _with_step(choice: Choice, before: Choice, candidate: Choice) -> Choice | None:
    """Return a choice with the step from `before` to a candidate; None if that place has another format by now."""
    if candidate.input_stage != before.input_stage:
        return None
    for k, (old, new) in enumerate(zip(before.formats, candidate.formats, strict=True)):
        if new is old:
            continue
        now = choice.formats[k]
        coefficients = _with_changes(now.coefficients, old.coefficients, new.coefficients)
        fracs = _with_changes(now.fracs, old.fracs, new.fracs)
        if coefficients is None or fracs is None:
            return None
        choice = choice.with_format(k, replace(now, coefficients=coefficients, fracs=fracs))
    return choice


def _with_changes(now: Mapping[str, _V], old: Mapping[str, _V], new: Mapping[str, _V]) -> Mapping[str, _V] | None:
    """Return values with what has changed from `old` to `new`; None if one of these has changed otherwise by now."""
    changed = {name: value for name, value in new.items() if old.get(name) != value}
    if any(now.get(name) != old.get(name) for name in changed):
        return None
    return {**now, **changed} if changed else now


@lru_cache(maxsize=64)  # an input stage is the same for every realization
def _size(stages: tuple[Stage, ...], objective: Objective) -> float:
    return sum(objective.of_graph(stage.graph) for stage in stages)


def _kind(integer: int) -> int | None:
    """Return the value of a coefficient that takes no multiplication, 0 or a power of two; None for all others."""
    return None if abs(integer) & (abs(integer) - 1) else integer


def _bits_below(error: float, share: float) -> int:
    """Fraction bits that bring `error` below `share`."""
    return math.ceil(math.log2(error / share)) if error else 0
