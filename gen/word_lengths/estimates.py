"""Double-precision estimates of a filter's errors: by coefficient, by quantizer, and the ranges of its nodes.

The gain to the output for a quantizer, the response of the derivative for a coefficient, so that errors of several
coefficients may cancel. They only guide the choice of word lengths; the result is proven afterwards.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sosmith.gen.proof.linear_model import Source, linear_model, quantizers, transfer_function
from sosmith.gen.realizations.part_responses import responses_around
from sosmith.gen.realizations.registry import Section, realization_of
from sosmith.gen.realizations.section_format import SectionFormat, unknown_range
from sosmith.model.arithmetic.recursive_filters import lfilter
from sosmith.model.dataflow.graph import Op
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


class Group(NamedTuple):
    """Products that are added up: the name of the quantizer of their sum, empty if there is none, and theirs."""

    total: str
    products: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Estimate:
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
    groups : tuple of Group
        Those of them that are products, by what they are added up to.
    """

    ideal: dict[str, float]
    slopes: dict[str, Array]
    gains: dict[str, float]
    limits: dict[str, tuple[float, float]]
    spreads: dict[str, dict[str, float]]
    optional: tuple[str, ...]
    groups: tuple[Group, ...]

    @property
    def products(self) -> tuple[str, ...]:
        """Names in `gains` of the products, which may be quantized but need not be."""
        return tuple(name for group in self.groups for name in group.products)

    def rounding(self, fracs: Mapping[str, int]) -> float:
        """Error at the filter's output of quantizers that keep so many fraction bits."""
        error = sum(self.gains.get(name, 0.0) * 2.0**-frac for name, frac in fracs.items())
        for total, products in self.groups:
            if not all(name in fracs for name in products):
                continue
            if total:
                grain = max(fracs.get(name, 0) for name in (*products, total))  # of the total, which drops its bits
                error -= self.gains.get(total, 0.0) * 2.0**-grain
            if len(products) % 2:  # half a unit is left of what would centre them
                error += self.gains[products[0]] * 2.0 ** -fracs[products[0]]
        return error

    def limits_of(self, node: str, fracs: Mapping[str, int]) -> tuple[float, float]:
        """Limits of a node with quantizers: they can make a nonnegative node negative, which adds a sign bit."""
        low, high = self.limits[node]
        spread = sum(self.spreads[node].get(name, 0.0) * 2.0**-frac for name, frac in fracs.items())
        return low - spread, high + spread


def estimates_of(parts: Sequence[Any], realization: str, windows: Sequence[Window]) -> list[Estimate]:
    """Estimate every stage of a filter.

    Parameters
    ----------
    parts : sequence
        What the realization makes its stages from, in their order: b0, b1, b2, 1, a1, a2 of each section of a cascade.
    realization : str
        Its name, known to `sosmith.gen.realizations.registry.realization_of`.
    windows : sequence of Window
        What the cascade's input keeps to; of several, one at a time.

    Raises
    ------
    ShortfallError
        If a section cannot be built, or its response does not decay in time.
    """
    around = responses_around(parts, realization)
    impulse = np.zeros(len(around[0].behind))
    impulse[0] = 1.0
    result = []
    for k, part in enumerate(parts):
        section = _exact(part, realization)
        model = linear_model(section.graph)
        poles = _floats(model.denominator)
        names = {i: section.graph.nodes[i].name for i in model.bounds}
        quantizers = [source for source in model.sources if source.kept is not None]
        result.append(
            Estimate(
                ideal={name: integer * 2.0**-frac for name, (integer, frac) in section.coefficients.items()},
                slopes={
                    name: _slope(part, realization, section, name, around[k].others) for name in section.coefficients
                },
                gains={s.name: _gain(s, model.output, poles, around[k].behind) for s in quantizers},
                limits={
                    name: _limits(_filtered(model.sources[0].numerators[i], poles, around[k].through), windows)
                    for i, name in names.items()
                },
                spreads={name: {s.name: _gain(s, i, poles, impulse) for s in quantizers} for i, name in names.items()},
                optional=section.optional_quantizers,
                groups=_groups(section, {s.name for s in quantizers}),
            )
        )
    return _added_up(result)


def largest_magnitude(response: Array, windows: Sequence[Window]) -> float:
    """Largest magnitude of a response to inputs that stay within a window from reset on."""
    low, high = windows[0]  # of several, all give the same
    if low > 0 or high < 0:
        return max(map(abs, _limits(response, windows)))
    # With zero between its ends, the worst input never brings the output back: whole sums are enough.
    magnitudes, total = float(np.abs(response).sum()), float(response.sum())
    above, below = (magnitudes + total) / 2, (magnitudes - total) / 2
    return max(above * high - below * low, below * high - above * low)


@dataclass(frozen=True, eq=False)
class _Base:
    """Reference formats, which others differ from in a few places, and their deviation and errors.

    `roundings` holds the errors of each section's quantizers, `error` that of all coefficients. `errors` holds those of
    the others that are known, by the sections and coefficients in which they differ.
    """

    formats: tuple[SectionFormat, ...]
    roundings: tuple[float, ...]
    deviation: Array
    error: float
    errors: dict[tuple[object, ...], float]


class FormatErrors:
    """Errors of the formats of a cascade, in output LSBs.

    A search asks for those of thousands of formats that differ in one quantizer or one coefficient from where it
    stands. What has not changed is not computed again: the errors of a section's quantizers, and the deviation of the
    impulse response that all coefficients cause together, which is updated by the slope of the one that has changed.

    Parameters
    ----------
    estimates : sequence of Estimate
        Estimates of each section.
    windows : sequence of Window
        What the cascade's input keeps to; of several, one at a time.
    """

    def __init__(self, estimates: Sequence[Estimate], windows: Sequence[Window]) -> None:
        self._estimates = estimates
        self._windows = windows
        self._base: _Base | None = None

    def refer_to(self, formats: tuple[SectionFormat, ...]) -> None:
        """Take formats as the reference; what is known of others stays so if only quantizers have changed."""
        base = self._base
        if base is not None and all(
            form.coefficients is before.coefficients for form, before in zip(formats, base.formats, strict=True)
        ):
            self._base = replace(base, formats=formats, roundings=self._roundings(formats))
            return
        deviation = self._deviation(formats, None)
        error = largest_magnitude(deviation, self._windows)
        self._base = _Base(formats, self._roundings(formats), deviation, error, {})

    def of_rounding(self, formats: tuple[SectionFormat, ...]) -> float:
        """Return the error of all quantizers."""
        return sum(self._roundings(formats))

    def of_coefficients(self, formats: tuple[SectionFormat, ...]) -> float:
        """Return the error of all coefficients."""
        base = self._base
        if base is None:
            return largest_magnitude(self._deviation(formats, None), self._windows)
        changed = tuple(
            (k, *form.coefficients.items())
            for k, (form, before) in enumerate(zip(formats, base.formats, strict=True))
            if form.coefficients is not before.coefficients
        )
        if not changed:
            return base.error
        if changed not in base.errors:
            base.errors[changed] = largest_magnitude(self._deviation(formats, base), self._windows)
        return base.errors[changed]

    def _roundings(self, formats: tuple[SectionFormat, ...]) -> tuple[float, ...]:
        """Return the error of the quantizers of each section."""
        base = self._base
        return tuple(
            base.roundings[k]
            if base is not None and form.fracs is base.formats[k].fracs
            else self._estimates[k].rounding(form.fracs)
            for k, form in enumerate(formats)
        )

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


def _products(section: Section) -> tuple[str, ...]:
    """Names of the products whose quantizers are optional."""
    return tuple(n.name for n in section.graph.nodes if n.op is Op.SCALE and n.name in section.optional_quantizers)


def _groups(section: Section, known: Collection[str]) -> tuple[Group, ...]:
    """Return the products among the quantizers that are `known`, by the quantizer that their sum goes to."""
    nodes, products = section.graph.nodes, [name for name in _products(section) if name in known]
    groups: list[Group] = []
    left = set(products)
    for total in (node for node in nodes if node.name in section.stated_fracs and node.name in known):
        pending, own = [*total.operands], set[str]()
        while pending:
            node = nodes[pending.pop()]
            if node.op is Op.SCALE:
                own.add(node.name)
            elif node.op is not Op.DELAY and node.name not in section.stated_fracs:
                pending += node.operands
        if own & left:
            groups.append(Group(total.name, tuple(name for name in products if name in own & left)))
            left -= own
    return (*groups, *([Group("", tuple(name for name in products if name in left))] if left else []))


def _added_up(estimates: Sequence[Estimate]) -> list[Estimate]:
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


def _exact(part: Any, realization: str, coefficients: Mapping[str, tuple[int, int]] | None = None) -> Section:
    """Build a section with exact coefficients, except for those given, in which every quantizer drops bits."""
    build = realization_of(realization).build
    # An operand has bits to drop only if its terms have fraction bits: those of the input, too, as b0's has no others.
    formats = SectionFormat(coefficient_bits=_EXACT_BITS, coefficients=coefficients or {}, x=unknown_range(1))
    section = build(part, formats, "section")
    fracs = dict.fromkeys(quantizers(section.graph), 1) | dict.fromkeys(section.optional_quantizers, 0)
    fracs |= dict.fromkeys(_products(section), 2)  # more than v keeps, which would drop nothing otherwise
    return build(part, replace(formats, fracs=fracs), "section")


def _slope(part: Any, realization: str, section: Section, name: str, others: Array) -> Array:
    """Impulse response of the derivative of a section by a coefficient, filtered by all other sections."""
    integer, frac = section.coefficients[name]
    shift = max(0, 30 - abs(integer).bit_length())
    step = max(1, abs(integer) << shift >> 24)
    moved = (integer << shift) + step, frac + shift
    try:
        moved_to = _exact(part, realization, {name: moved})
    except ShortfallError:
        moved_to = _exact(part, realization, {name: (moved[0] - 2 * step, moved[1])})
        step = -step
    (b, a), (changed_b, changed_a) = transfer_function(section.graph), transfer_function(moved_to.graph)
    delta = step * Fraction(2) ** -moved[1]
    terms = [
        (above - below) / delta
        for above, below in zip_longest(_product(changed_b, a), _product(b, changed_a), fillvalue=Fraction(0))
    ]
    return _filtered((1,), _floats(changed_a), _filtered(terms, _floats(a), others))


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
