"""Trims the formats of a cascade, by greedy descent: fraction bits of every quantizer, bits of every coefficient.

The start keeps to the error allowed. Each step is the one that saves the most estimated size for the error it costs;
the search ends when no further step fits. A step drops bits of one quantizer, of the calibration or of one
coefficient, which may become either neighbour of its ideal value; or it starts to quantize a product's operand so that
it fits one hardware multiplier. Where every bit of a sum takes an adder, all products of a section may drop bits, too;
and where no step is left, one that errs too much is tried with more bits elsewhere. Where products are made of adders,
a coefficient may also become a number near its ideal value that has fewer signed digits. Where no step fits any more,
what lowers the error and costs nothing is taken: neighbouring values of one or two coefficients, and bits of
quantizers, as memory words may have room for them.

All errors here are linear estimates in double precision: the gain to the output for a quantizer, the response of the
derivative for a coefficient, so that errors of several coefficients may cancel. They only guide the choice; the result
is proven afterwards.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations, zip_longest
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.design import estimated_length
from sosmith.gen.proof.linear_model import Source, linear_model, quantizers, transfer_function
from sosmith.gen.realizations.coefficients import lowest_terms, round_significant, with_fewer_digits
from sosmith.gen.realizations.kept_formats import Choice
from sosmith.gen.realizations.registry import Section, realization_of
from sosmith.gen.realizations.section_format import SectionFormat, unknown_range
from sosmith.gen.word_lengths.bit_limits import MIN_BITS
from sosmith.gen.word_lengths.cost import MULTIPLIER_BITS
from sosmith.gen.word_lengths.input_stage import InputStage
from sosmith.gen.word_lengths.objective import SMALL_AREA, Objective
from sosmith.model.arithmetic.recursive_filters import lfilter, sosfilt
from sosmith.model.dataflow.graph import Op, Range
from sosmith.model.errors import ShortfallError

Array = npt.NDArray[np.float64] | npt.NDArray[np.float32]

Window = tuple[float, float]
"""Smallest and largest value of an input."""

_EXACT_BITS = 50
"""Significant bits at which a coefficient counts as exact."""

_ENOUGH = 1 << 14
"""Number of values to which long responses are added up."""

_LOST = 2.0**-16
"""Share of a response's sum of magnitudes that may be lost when samples with different signs are added up."""

_FEW = 16
"""Coefficients up to which neighbours are tried two at a time."""

_WORTH = 2.0**-10
"""Share of the error that a step which costs nothing must save."""

_UNNOTICED = 2.0**-10
"""Error at the output, in LSBs, with which products begin to drop bits."""

_STEPS = (1, 2, 3)
"""Bits that one step may drop: several, as a shorter fraction may save something only once it is the shortest one."""


class _Input(NamedTuple):
    """Output range of an input stage, its error at the filter's output in LSBs, and its estimated size."""

    x: Range
    error: float
    size: float


@dataclass(frozen=True, eq=False)
class _Base:
    """Reference formats, which others differ from in a few coefficients, and their deviation and error.

    `errors` holds those of the others that are known, by the sections and coefficients in which they differ.
    """

    formats: tuple[SectionFormat, ...]
    deviation: Array
    error: float
    errors: dict[tuple[object, ...], float]


class Search:
    """Searches for the formats of a cascade.

    Parameters
    ----------
    rows : sequence of sequence of float
        b0, b1, b2, 1, a1, a2 of each section.
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

    Raises
    ------
    ShortfallError
        If a section cannot be built, or its response does not decay in time.
    """

    def __init__(
        self,
        rows: Sequence[Sequence[float]],
        realization: str,
        input_stages: Sequence[InputStage],
        gain: Fraction,
        objective: Objective = SMALL_AREA,
        *,
        steady: bool = False,
    ) -> None:
        self._build = realization_of(realization).build
        self._rows = rows
        self._input_stages = input_stages
        self._gain = gain
        self._objective = objective
        self._inputs = self._sized_inputs()
        x = self._inputs[0].x
        low, high = x.low * 2.0**-x.frac, x.high * 2.0**-x.frac
        self._windows = [(0.0, high), (low, 0.0)] if steady else [(low, high)]
        self._estimates = _estimates(rows, realization, self._windows)
        self._base: _Base | None = None
        self._ranges: dict[tuple[object, ...], dict[str, tuple[int, int]]] = {}
        self._known: dict[tuple[object, ...], tuple[float, Range, dict[str, int]]] = {}

    @property
    def work(self) -> int:
        """Samples of the responses to all coefficients together, which decide how long trimming takes."""
        return sum(len(slope) for estimate in self._estimates for slope in estimate.slopes.values())

    @property
    def key(self) -> tuple[object, ...]:
        """All that `trimmed` depends on besides the realization, with equal representations where it is equal."""
        rows = [[float(value) for value in row] for row in self._rows]
        inputs = [(*each.x, float(each.error), float(each.size)) for each in self._inputs]
        return rows, inputs, self._windows, self._objective

    def under(self, objective: Objective) -> Search:
        """Return the same search for another objective."""
        if objective == self._objective:
            return self
        other = copy.copy(self)
        other._objective = objective
        other._inputs = other._sized_inputs()
        other._known = {}
        return other

    def _sized_inputs(self) -> list[_Input]:
        return [
            _Input(
                s.output, float(s.error * self._gain), sum(self._objective.of_graph(part.graph) for part in s.stages)
            )
            for s in self._input_stages
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
        ways = [start]
        if len(self._inputs) > 1:
            ways.append(self._trimmed_once(start, allowed, calibration=False))
        ends = [self._trimmed_closer(way, allowed) for way in ways]
        return min(ends, key=lambda choice: (self.size(choice), self.error(choice)))

    def merely_trimmed(self, start: Choice, allowed: float) -> Choice:
        """Return formats trimmed without a look at what costs nothing; parameters as of `trimmed`."""
        return self._trimmed_once(start, allowed)

    def with_free_bits(self, choice: Choice) -> Choice:
        """Return formats with a smaller error, for a negligible size."""
        return self._closer(choice, more=self._objective.negligible)

    def _trimmed_closer(self, start: Choice, allowed: float) -> Choice:
        choice = self._trimmed_once(start, allowed)
        while True:
            closer = self._closer(choice)
            if closer is choice:
                return choice
            choice = self._trimmed_once(closer, allowed)

    def _trimmed_once(self, start: Choice, allowed: float, *, calibration: bool = True) -> Choice:
        choice, error, size = start, self.error(start), self.size(start)
        while error <= allowed:
            self._base = self._based(choice.formats)
            best: tuple[float, Choice, float, float] | None = None
            for candidate in self._steps(choice, calibration=calibration):
                after = self.error(candidate)
                if after > allowed:
                    continue
                saved = size - self.size(candidate)
                if saved <= 0:
                    continue
                merit = saved / max(after - error, 1e-6 * allowed)
                if best is None or merit > best[0]:
                    best = merit, candidate, after, size - saved
            if best is None:
                exchange = self._exchange(choice, size, allowed, calibration=calibration)
                if exchange is None:
                    break
                choice, size = exchange
                error = self.error(choice)
                continue
            _, choice, error, size = best
        return choice

    def _exchange(
        self, choice: Choice, size: float, allowed: float, *, calibration: bool
    ) -> tuple[Choice, float] | None:
        """Return a smaller choice that has bits less in one place and more in others, and its size; None without one.

        Bits that cost next to nothing go first, as those of products; what that took may be worth more elsewhere.
        """
        best: tuple[Choice, float] | None = None
        steps = self._steps(choice, calibration=calibration) if self._objective.floors_products else ()
        for candidate in steps:
            other, error, smallest = candidate, self.error(candidate), size if best is None else best[1]
            for _ in range(len(choice.formats) * max(_STEPS)):
                if error <= allowed or self.size(other) >= smallest:
                    break
                longer = [(each, self.error(each), self.size(each)) for each in self._longer(other)]
                before, grown = error, self.size(other)
                merits = [(before - after) / max(larger - grown, 1.0) for _, after, larger in longer]
                other, error, _ = longer[merits.index(max(merits))]
            if error <= allowed and (smaller := self.size(other)) < smallest:
                best = other, smaller
        return best

    def _longer(self, choice: Choice) -> Iterator[Choice]:
        """Yield choices where one section keeps one bit more, of its products or of another quantizer."""
        for k, form in enumerate(choice.formats):
            products = self._estimates[k].products
            places = [(name,) for name in form.fracs if name not in products]
            for names in (*places, tuple(name for name in products if name in form.fracs)):
                kept = {**form.fracs, **{name: form.fracs[name] + 1 for name in names}}
                yield choice.with_format(k, replace(form, fracs=kept))

    def with_closer_coefficients(self, choice: Choice) -> Choice:
        """Return the same formats with coefficients whose error is smaller, of no more bits."""
        return self._closer(choice, self._moved)

    def _closer(
        self, choice: Choice, neighbours: Callable[[Choice], Iterator[Choice]] | None = None, more: float = 0.0
    ) -> Choice:
        """Take what lowers the error and costs at most `more` in all, the best first, until nothing does."""
        size = self.size(choice) + more
        while True:
            self._base = self._based(choice.formats)
            least = (1 - _WORTH) * self.error(choice)
            others = [*(neighbours or self._neighbours)(choice)]
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
                    value = lowest_terms(integer + by, frac)
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
                        yield form.with_coefficient(name, lowest_terms(neighbour, frac - step))

    def _shorter_products(self, k: int, form: SectionFormat) -> Iterator[SectionFormat]:
        """Yield formats whose products all drop more bits: one that keeps more keeps the words long."""
        estimate = self._estimates[k]
        if not estimate.products:
            return
        kept = [form.fracs[name] for name in estimate.products if name in form.fracs]
        gain = sum(estimate.gains[name] for name in estimate.products)
        most = min(kept) if kept else _bits_below(gain, _UNNOTICED) + 1
        for step in _STEPS:
            if most >= step:
                yield replace(form, fracs={**form.fracs, **dict.fromkeys(estimate.products, most - step)})

    def error(self, choice: Choice) -> float:
        """Estimated sum of the errors of input stage, coefficients and rounding, in output LSBs."""
        rounding = sum(
            estimate.rounding(form.fracs) for estimate, form in zip(self._estimates, choice.formats, strict=True)
        )
        return self._inputs[choice.input_stage].error + rounding + self.coefficient_error(choice)

    def coefficient_error(self, choice: Choice) -> float:
        """Estimated error of the coefficients in output LSBs."""
        base = self._base
        if base is None:
            return _largest(self._deviation(choice.formats, None), self._windows)
        changed = tuple(
            (k, *form.coefficients.items())
            for k, (form, before) in enumerate(zip(choice.formats, base.formats, strict=True))
            if form.coefficients is not before.coefficients
        )
        if not changed:
            return base.error
        if changed not in base.errors:
            base.errors[changed] = _largest(self._deviation(choice.formats, base), self._windows)
        return base.errors[changed]

    def _based(self, formats: tuple[SectionFormat, ...]) -> _Base:
        """Take formats as the reference; what is known of others stays so if only quantizers have changed."""
        base = self._base
        if base is not None and all(
            form.coefficients is before.coefficients for form, before in zip(formats, base.formats, strict=True)
        ):
            return replace(base, formats=formats)
        deviation = self._deviation(formats, None)
        return _Base(formats, deviation, _largest(deviation, self._windows), {})

    def _deviation(self, formats: Sequence[SectionFormat], base: _Base | None) -> Array:
        """Deviation of the impulse response due to the coefficients, updated from that of `base`."""
        response = np.zeros(1, dtype=np.float32) if base is None else base.deviation
        for k, (estimate, form) in enumerate(zip(self._estimates, formats, strict=True)):
            before = None if base is None else base.formats[k].coefficients
            for name, (integer, frac) in form.coefficients.items():
                start = estimate.ideal[name]
                if before is not None:
                    if before[name] == (integer, frac):
                        continue
                    start = before[name][0] * 2.0 ** -before[name][1]
                response = response + (integer * 2.0**-frac - start) * estimate.slopes[name]
        return response

    def _is_stable(self, choice: Choice) -> bool:
        return self.size(choice) < math.inf

    def size(self, choice: Choice) -> float:
        """Estimated size of the input stage and the sections, infinite if rounded coefficients are unstable."""
        return self._inputs[choice.input_stage].size + sum(size for size, _ in self._built_sections(choice))

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
        section = self._build(self._rows[k], replace(form, ranges=ranges, x=x), name)
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
            section = self._build(self._rows[k], replace(form, x=unknown_range(frac)), name)
            for node, bits in section.stated_fracs.items():
                low, high = self._estimates[k].limits_of(node, form.fracs)
                ranges[node] = math.floor(low * 2.0**bits), math.ceil(high * 2.0**bits)
            self._ranges[key] = ranges
        return self._ranges[key]


def _kind(integer: int) -> int | None:
    """Return the value of a coefficient that takes no multiplication, 0 or a power of two; None for all others."""
    return None if abs(integer) & (abs(integer) - 1) else integer


@dataclass(frozen=True, eq=False)
class _Estimate:
    """Double-precision estimates for a section.

    Attributes
    ----------
    ideal : dict of str to float
        Coefficients by name.
    slopes : dict of str to array
        Change of the filter's impulse response for a unit change of each coefficient; long ones as sums of neighbouring
        samples.
    gains : dict of str to float
        Largest centred error at the filter's output for each quantizer, if it rounds to integers.
    limits : dict of str to tuple of float
        Smallest and largest value of every node with a stated range, without quantizers.
    spreads : dict of str to dict of str to float
        Largest centred error at every such node for each of the section's quantizers, if it rounds to integers.
    optional : tuple of str
        Names in `gains` of the quantizers that are optional.
    products : tuple of str
        Those of them that are products.
    """

    ideal: dict[str, float]
    slopes: dict[str, Array]
    gains: dict[str, float]
    limits: dict[str, tuple[float, float]]
    spreads: dict[str, dict[str, float]]
    optional: tuple[str, ...]
    products: tuple[str, ...]

    def rounding(self, fracs: Mapping[str, int]) -> float:
        """Error at the filter's output of quantizers that keep so many fraction bits."""
        error = sum(self.gains.get(name, 0.0) * 2.0**-frac for name, frac in fracs.items())
        if self.products and all(name in fracs for name in self.products):
            grain = max(fracs[name] for name in (*self.products, "v"))  # of the total, whose bits v drops
            error -= self.gains.get("v", 0.0) * 2.0**-grain
            if len(self.products) % 2:  # half a unit is left of what would centre them
                error += self.gains[self.products[0]] * 2.0 ** -fracs[self.products[0]]
        return error

    def limits_of(self, node: str, fracs: Mapping[str, int]) -> tuple[float, float]:
        """Limits of a node with quantizers: they can make a nonnegative node negative, which adds a sign bit."""
        low, high = self.limits[node]
        spread = sum(self.spreads[node].get(name, 0.0) * 2.0**-frac for name, frac in fracs.items())
        return low - spread, high + spread


def _estimates(rows: Sequence[Sequence[float]], realization: str, windows: Sequence[Window]) -> list[_Estimate]:
    sos = np.array(rows, dtype=np.float64)
    impulse = np.zeros(estimated_length(sos))
    impulse[0] = 1.0
    through = [sosfilt(sos[:k], impulse) if k else impulse for k in range(len(rows))]
    behind = [sosfilt(sos[k + 1 :], impulse) if k + 1 < len(rows) else impulse for k in range(len(rows))]
    others = [sosfilt(np.delete(sos, k, axis=0), impulse) if len(rows) > 1 else impulse for k in range(len(rows))]
    result = []
    for k, row in enumerate(rows):
        section = _exact(row, realization)
        model = linear_model(section.graph)
        poles = _floats(model.denominator)
        names = {i: section.graph.nodes[i].name for i in model.bounds}
        quantizers = [source for source in model.sources if source.kept is not None]
        result.append(
            _Estimate(
                ideal={name: integer * 2.0**-frac for name, (integer, frac) in section.coefficients.items()},
                slopes={name: _slope(row, realization, section, name, others[k]) for name in section.coefficients},
                gains={s.name: _gain(s, model.output, poles, behind[k]) for s in quantizers},
                limits={
                    name: _limits(_filtered(model.sources[0].numerators[i], poles, through[k]), windows)
                    for i, name in names.items()
                },
                spreads={name: {s.name: _gain(s, i, poles, impulse) for s in quantizers} for i, name in names.items()},
                optional=section.optional_quantizers,
                products=tuple(name for name in _products(section) if name in {s.name for s in quantizers}),
            )
        )
    return _added_up(result)


def _products(section: Section) -> tuple[str, ...]:
    """Names of the products whose quantizers are optional."""
    return tuple(n.name for n in section.graph.nodes if n.op is Op.SCALE and n.name in section.optional_quantizers)


def _added_up(estimates: Sequence[_Estimate]) -> list[_Estimate]:
    """Replace slopes that are much longer than `_ENOUGH` by sums of neighbours, as long as these have the same sign."""
    slopes = [slope for estimate in estimates for slope in estimate.slopes.values()]
    step = 1
    while len(slopes[0]) >= 2 * step * _ENOUGH and all(
        np.abs(_sums(slope, 2 * step)).sum() >= (1 - _LOST) * np.abs(slope).sum() for slope in slopes
    ):
        step *= 2
    return [
        replace(estimate, slopes={name: _single(_sums(slope, step)) for name, slope in estimate.slopes.items()})
        for estimate in estimates
    ]


def _single(values: Array) -> Array:
    """Cut values to single precision if they are many."""
    return values.astype(np.float32) if len(values) > 2 * _ENOUGH else values


def _sums(values: Array, step: int) -> Array:
    return values if step == 1 else np.add.reduceat(values, np.arange(0, len(values), step))


def _gain(quantizer: Source, node: int, poles: Sequence[float], behind: Array) -> float:
    """Largest error through a node of a quantizer to integers: half a unit for FLOOR (centred), one for TRUNCATE."""
    unit = 1.0 if quantizer.low < 0 else 0.5
    return unit * float(np.abs(_filtered(quantizer.numerators[node], poles, behind)).sum())


def _exact(
    row: Sequence[float], realization: str, coefficients: Mapping[str, tuple[int, int]] | None = None
) -> Section:
    """Build a section with exact coefficients, except for those given, in which every quantizer drops bits."""
    build = realization_of(realization).build
    # An operand has bits to drop only if its terms have fraction bits: those of the input, too, as b0's has no others.
    formats = SectionFormat(coefficient_bits=_EXACT_BITS, coefficients=coefficients or {}, x=unknown_range(1))
    section = build(row, formats, "section")
    fracs = dict.fromkeys(quantizers(section.graph), 1) | dict.fromkeys(section.optional_quantizers, 0)
    fracs |= dict.fromkeys(_products(section), 2)  # more than v keeps, which would drop nothing otherwise
    return build(row, replace(formats, fracs=fracs), "section")


def _slope(row: Sequence[float], realization: str, section: Section, name: str, others: Array) -> Array:
    """Impulse response of the derivative of a section by a coefficient, filtered by all other sections."""
    integer, frac = section.coefficients[name]
    shift = max(0, 30 - abs(integer).bit_length())
    step = max(1, abs(integer) << shift >> 24)
    moved = (integer << shift) + step, frac + shift
    try:
        moved_to = _exact(row, realization, {name: moved})
    except ShortfallError:
        moved_to = _exact(row, realization, {name: (moved[0] - 2 * step, moved[1])})
        step = -step
    (b, a), (changed_b, changed_a) = transfer_function(section.graph), transfer_function(moved_to.graph)
    delta = step * Fraction(2) ** -moved[1]
    terms = [
        (above - below) / delta
        for above, below in zip_longest(_product(changed_b, a), _product(b, changed_a), fillvalue=Fraction(0))
    ]
    return _filtered((1,), _floats(changed_a), _filtered(terms, _floats(a), others))


def _bits_below(error: float, share: float) -> int:
    """Fraction bits that bring `error` below `share`."""
    return math.ceil(math.log2(error / share)) if error else 0


def _product(a: Sequence[Fraction], b: Sequence[Fraction]) -> list[Fraction]:
    result = [Fraction(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            result[i + j] += x * y
    return result


def _floats(values: Sequence[Fraction | int]) -> list[float]:
    return [float(value) for value in values]


def _filtered(numerator: Sequence[Fraction | int], denominator: Sequence[float], values: Array) -> Array:
    return lfilter(_floats(numerator), denominator, values)


def _limits(response: Array, windows: Sequence[Window]) -> tuple[float, float]:
    """Smallest and largest value of a response to inputs that stay within a window from reset on."""
    smallest = largest = 0.0
    for ends in windows:
        low, high = response * ends[0], response * ends[1]
        smallest = min(smallest, float(np.minimum(low, high).cumsum().min()))
        largest = max(largest, float(np.maximum(low, high).cumsum().max()))
    return smallest, largest


def _largest(response: Array, windows: Sequence[Window]) -> float:
    """Largest magnitude of a response to inputs that stay within a window from reset on."""
    low, high = windows[0]  # of several, all give the same
    if low > 0 or high < 0:
        return max(map(abs, _limits(response, windows)))
    # With zero between its ends, the worst input never brings the output back: whole sums are enough.
    magnitudes, total = float(np.abs(response).sum()), float(response.sum())
    above, below = (magnitudes + total) / 2, (magnitudes - total) / 2
    return max(above * high - below * low, below * high - above * low)
