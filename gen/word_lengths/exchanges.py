"""Exchanges sections of a trimmed cascade where that makes it smaller.

The order that `sosmith.gen.word_lengths.ordering` finds has a small rounding error with equal formats. Trimmed formats
differ from section to section, and so does what a bit costs: a section whose words are long anyway can stand where its
error counts little. Two sections at a time are exchanged, their formats trimmed further, and the smallest result taken,
until no exchange makes it smaller::

    1 2 3 --> 2 1 3, 3 2 1, 1 3 2 --> the smallest of the four --> its exchanges --> ..

In the order that this ends with, formats are searched from the start, too.

Sizes are estimates, as in the search itself; the proof decides (`sosmith.gen.word_lengths.quantize.prove`).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

from sosmith.gen.realizations.kept_formats import Choice, kept_or_made
from sosmith.gen.realizations.registry import realization_of
from sosmith.gen.word_lengths.quantize import Plan

_MOST = 4
"""Sections up to which any two are exchanged: of more, there are too many pairs, and each takes another trimming."""

_MOST_WORK = 1 << 20
"""Samples of all coefficients' responses together up to which sections are exchanged: some seconds in all."""


def in_better_order(trimmed: Plan) -> Plan:
    """Return the plan with its sections in the order that is smallest, as far as exchanges lead to it.

    Only where each bit of a word takes hardware of its own, and where sections have formats of their own.

    Parameters
    ----------
    trimmed : Plan
        A plan with trimmed formats.
    """
    if not may_be_ordered(trimmed):
        return trimmed
    assert trimmed.search is not None
    key = "order", trimmed.search.key, trimmed.start, float(trimmed.allowed), trimmed.output
    order: list[int] = kept_or_made(key, lambda: _best_order(trimmed), list, list)
    if order == sorted(order):
        return trimmed
    ways = [_ordered(trimmed, order).trimmed(), _ordered(trimmed, order).started_anew().trimmed()]
    best = min(ways, key=lambda way: way.size)
    return replace(best, otherwise=trimmed) if best.size < trimmed.size else trimmed


def may_be_ordered(planned: Plan) -> bool:
    """Whether `in_better_order` looks at other orders of a plan's sections."""
    objective, search = planned.objective, planned.search
    if search is None or planned.start is None or not realization_of(planned.realization).cascade:
        return False
    several = 1 < len(planned.start.formats) <= _MOST
    return several and objective.floors_products and not objective.tied and search.work <= _MOST_WORK


def _best_order(trimmed: Plan) -> list[int]:
    """Return the indices of the sections in the best order that exchanges lead to."""
    assert trimmed.start is not None
    best, least = [*range(len(trimmed.start.formats))], trimmed.size
    planned, tried = trimmed, {tuple(best)}
    while True:
        others = [order for order in _exchanged(best) if tuple(order) not in tried]
        tried |= set(map(tuple, others))
        plans = [_ordered(planned, [best.index(k) for k in order]).merely_trimmed() for order in others]
        smallest = min(range(len(plans)), key=lambda at: plans[at].size, default=None)
        if smallest is None or plans[smallest].size >= least:
            return best
        best, planned, least = others[smallest], plans[smallest], plans[smallest].size


def _exchanged(order: list[int]) -> list[list[int]]:
    """Return the orders that differ in two places."""
    count = len(order)
    return [
        [order[b if k == a else a if k == b else k] for k in range(count)] for a, b in combinations(range(count), 2)
    ]


def _ordered(planned: Plan, order: list[int]) -> Plan:
    """Return a trimmed plan with the sections in another order, each with the formats that it had."""
    assert planned.ideal is not None
    assert planned.start is not None
    formats = Choice(planned.start.input_stage, tuple(planned.start.formats[k] for k in order))
    return planned.with_rows(tuple(planned.ideal.rows[k] for k in order), formats)
