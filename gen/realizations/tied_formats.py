"""Sections that share hardware have the same formats: which they are, and how a step of one becomes one of all.

Two sections can share hardware if they have the same structure with the same formats
(`sosmith.hdl.plan.sharing.sharing`). A bit that is dropped in one of them saves something once it is dropped in all: so
fraction bits of quantizers are the same in each, and constants of the same name have the same fraction bits, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from sosmith.gen.realizations.direct_form import Row, common_feedback
from sosmith.gen.realizations.kept_formats import Choice
from sosmith.gen.realizations.registry import Section, realization_of
from sosmith.gen.realizations.section_format import SectionFormat, unknown_range
from sosmith.gen.realizations.tied_row import TiedRow
from sosmith.gen.realizations.transposed import common_exponent
from sosmith.gen.specification.realizations import DELTA
from sosmith.hdl.plan.sharing.sections import merged
from sosmith.model.errors import ShortfallError

_BITS = 24
"""Significant bits of the coefficients when structures are compared."""

NONE_ALIKE = (
    "the multiplexed architecture must have two sections with the same operations, one behind the other, and has none: "
    "another realization may have some, and parallel takes every one"
)
"""What is said of filters whose sections cannot share hardware."""

Group = tuple[int, ...]
"""Numbers of sections of the same structure."""

Ideals = Sequence[Mapping[str, float]]
"""Ideal coefficients of each section by name."""


def groups_of(parts: Sequence[Any], realization: str) -> tuple[Group, ...]:
    """Return the sections by their structure, in the order of the first ones.

    A section that cannot be built with any number of bits is a group of its own.
    """
    build, form = realization_of(realization).build, SectionFormat(x=unknown_range(0), coefficient_bits=_BITS)
    groups: list[list[int]] = []
    stages: list[Section | None] = []
    for number, part in enumerate(parts):
        try:
            stages.append(build(part, form, f"section{number}"))
        except ShortfallError:
            stages.append(None)
        group = next((each for each in groups if _share([stages[k] for k in (*each, number)])), None)
        if group is None:
            groups.append([number])
        else:
            group.append(number)
    return tuple(map(tuple, groups))


def _share(stages: Sequence[Section | None]) -> bool:
    """Whether sections can share hardware; those that cannot be built do not."""
    built = [stage for stage in stages if stage is not None]
    return len(built) == len(stages) and merged(built) is not None


def check_that_some_share(parts: Sequence[Any], realization: str) -> None:
    """Check that two sections may have the same structure, before their formats are known.

    Raises
    ------
    ShortfallError
        If none have.
    """
    if all(len(group) < 2 for group in groups_of(parts, realization)):
        raise ShortfallError(NONE_ALIKE)


def standing_together(rows: Sequence[Row], realization: str) -> tuple[TiedRow, ...]:
    """Return the rows of a cascade with those of the same structure one behind the other, in the order of the first.

    What decides on the structure beside the row is the same for all of them: error feedback, and what is between the
    states of the delta operator.
    """
    terms = realization_of(realization).terms
    plain = [TiedRow.of(row, feedback=(0, 0), delta_exponent=0) for row in rows]
    together: list[TiedRow] = []
    for group in groups_of(plain, realization):
        own = [rows[k] for k in group]
        feedback = None if terms.feedback_order is None else common_feedback(own, terms.feedback_order)
        exponent = common_exponent(own) if terms is DELTA else None
        together += [TiedRow.of(row, feedback=feedback, delta_exponent=exponent) for row in own]
    return tuple(together)


def with_the_most(fracs: list[dict[str, int]], groups: Sequence[Group]) -> list[dict[str, int]]:
    """Return fraction bits of each section's quantizers: of a group, for all of them the most that one of them has."""
    tied = [*fracs]
    for group in groups:
        for k in group:
            tied[k] = {name: max(fracs[other].get(name, 0) for other in group) for name in fracs[k]}
    return tied


def tied_start(groups: Sequence[Group], ideals: Ideals, choice: Choice) -> Choice:
    """Return formats with the most fraction bits of any section of a group for all of them."""
    fracs = with_the_most([dict(form.fracs) for form in choice.formats], groups)
    for group in groups:
        own = [choice.formats[k] for k in group]
        longest: dict[str, int] = {}
        for form in own:
            for name, (_, frac) in form.coefficients.items():
                longest[name] = max(frac, longest.get(name, frac))
        for k, form in zip(group, own, strict=True):
            choice = choice.with_format(k, replace(_rounded(form, ideals[k], longest), fracs=fracs[k]))
    return choice


def tied_step(groups: Sequence[Group], ideals: Ideals, before: Choice, after: Choice) -> Choice | None:
    """Return a step with all sections of a group changed like the one that it changes; None if that is not possible.

    Where a coefficient has fewer fraction bits, the others of its name are rounded to as many. One that moves next to
    what it was, with the same fraction bits, moves alone.
    """
    for group in groups:
        changed = [k for k in group if after.formats[k] is not before.formats[k]]
        if len(changed) != 1:
            continue  # several change at once only where coefficients move
        (leader,) = changed
        old, new = before.formats[leader], after.formats[leader]
        shorter = {name: frac for name, (_, frac) in new.coefficients.items() if frac < old.coefficients[name][1]}
        for k in group:
            if k == leader:
                continue
            form = _rounded(after.formats[k], ideals[k], shorter)
            if not all(integer for integer, _ in form.coefficients.values()):
                return None
            after = after.with_format(k, form if new.fracs is old.fracs else replace(form, fracs=_changed(form, new)))
    return after


def _changed(form: SectionFormat, other: SectionFormat) -> dict[str, int]:
    """Return the fraction bits of another section's quantizers, where a section may have them."""
    return {**{name: frac for name, frac in form.fracs.items() if name not in other.fracs}, **other.fracs}


def _rounded(form: SectionFormat, ideal: Mapping[str, float], fracs: dict[str, int]) -> SectionFormat:
    """Return a format whose coefficients are the nearest to the ideal ones with so many fraction bits."""
    shorter = {name: frac for name, frac in fracs.items() if name in form.coefficients}
    nearest = {name: (round(ideal[name] * 2.0**frac), frac) for name, frac in shorter.items()}
    return replace(form, coefficients={**form.coefficients, **nearest}) if nearest else form
