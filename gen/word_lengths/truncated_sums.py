"""Spends what a proof leaves of the error allowed on truncated sums.

Where products by constants are made of sums (`sosmith.model.sections.truncated_products`), each bit that these drop is
an adder less. Formats are trimmed with whole products; then, for each product, the fraction bits that its sums keep are
chosen together, for the most adder bits that what is left of the error pays for, and proven.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from sosmith.gen.realizations.kept_formats import Choice
from sosmith.gen.realizations.registry import Section
from sosmith.gen.word_lengths.search import Search
from sosmith.model.sections.direct_form import DirectForm1
from sosmith.model.sections.truncated_products import mean_error, saved_bits, truncation_error

_MOST_BELOW = 10
"""Fraction bits below those of a product up to which its sums may keep some: more save next to nothing."""


class _Way(NamedTuple):
    """Fraction bits that the sums of one product keep, None for all; adder bits saved, and the error in output LSBs."""

    section: int
    label: str
    sums: int | None
    saved: int
    error: float


class _Taken(NamedTuple):
    """Ways of several products, the adder bits that they save, and their error."""

    saved: int
    error: float
    ways: tuple[_Way, ...]


def with_truncated_sums(search: Search, choice: Choice, sections: Iterable[Section], left: float) -> Choice | None:
    """Return formats whose sums drop bits at an estimated error of at most `left` output LSBs; None if none can.

    Parameters
    ----------
    search : Search
        What has chosen the formats.
    choice : Choice
        Formats that are proven.
    sections : iterable of Section
        The sections as they are proven.
    left : float
        What is left of the error allowed, in output LSBs.
    """
    if left <= 0:
        return None
    best = [_Taken(0, 0.0, ())]
    for ways in _products(search, sections):
        best = _pareto(
            _Taken(taken.saved + way.saved, taken.error + way.error, (*taken.ways, way))
            for taken in best
            for way in ways
            if taken.error + way.error <= left
        )
    most = best[-1]
    if not most.saved:
        return None
    for way in most.ways:
        if way.sums is not None:
            form = choice.formats[way.section]
            choice = choice.with_format(way.section, form.with_frac(way.label, way.sums))
    return choice


def _products(search: Search, sections: Iterable[Section]) -> Iterator[list[_Way]]:
    """Yield the ways to make each product that drops bits."""
    for k, section in enumerate(sections):
        if not isinstance(section, DirectForm1):
            continue
        for product in section.products:
            if product.floored is None:
                continue
            operand = section.kept_frac(product)
            ways = [_Way(k, product.sums_label, None, 0, 0.0)]
            for below in range(_MOST_BELOW):
                constant = operand, product.coefficient, product.frac, product.floored + below
                saved = saved_bits(*constant)
                if not saved:
                    break
                spread = truncation_error(*constant) + 2 * abs(mean_error(*constant))  # no constant centres it
                error = search.gain(k, product.label) * float(spread)
                ways.append(_Way(k, product.sums_label, product.floored + below, saved, error))
            yield ways


def _pareto(all_taken: Iterable[_Taken]) -> list[_Taken]:
    """Return those that no other beats, with a smaller error first; the last one saves most."""
    best: list[_Taken] = []
    for taken in sorted(all_taken, key=lambda each: (each.error, -each.saved)):
        if not best or taken.saved > best[-1].saved:
            best.append(taken)
    return best
