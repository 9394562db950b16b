"""Rules about a stage of the kind auto, and about limits of stages that are given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import prod
from typing import Any, NamedTuple

from sosmith.gen.chain.automatic.limits import KEYS, LIMITS, SPAN, Limits, read_limits
from sosmith.gen.specification.choices import AUTO, MAX_DOWNSAMPLING
from sosmith.gen.specification.values import UnfitError, literal


class Place(NamedTuple):
    """A stage as far as limits have to know it: its rate is that of its samples, in Hz."""

    name: str
    kind: str
    rate: Fraction
    factor: int
    rises: bool


def check_kinds(kinds: Sequence[str]) -> None:
    """Check that at most one stage is of the kind auto.

    Raises
    ------
    UnfitError
        If there are several.
    """
    for k, kind in enumerate(kinds):
        if kind == AUTO and AUTO in kinds[:k]:
            raise UnfitError(
                "another kind beside a stage auto, of which there is one at most",
                literal(kind),
                where=f"stage[{k}].kind",
                later=True,
            )


def check_factor(factor: int, where: str) -> None:
    """Check that stages can decimate by a factor together.

    Raises
    ------
    UnfitError
        If it has a prime that is too large.
    """
    rest, divisor = factor, 2
    while divisor * divisor <= rest:
        if rest % divisor:
            divisor += 1
        else:
            rest //= divisor
    if rest > MAX_DOWNSAMPLING:
        raise UnfitError(
            f"a product of factors up to {MAX_DOWNSAMPLING}, by which stages can decimate",
            literal(factor),
            where=where,
        )


def limits_in(tree: Mapping[str, Any], places: Sequence[Place]) -> tuple[Limits | None, tuple[int, int] | None]:
    """Return what is asked by a stage auto, or by the table for that, and of which stages.

    Parameters
    ----------
    tree : mapping
        The specification.
    places : sequence of Place
        Its stages.

    Returns
    -------
    Limits or None
        None without either.
    tuple of int or None
        Number of the first stage, and of the one behind the last; None for all.

    Raises
    ------
    UnfitError
        If there cannot be any, or one breaks a rule.
    """
    for k, place in enumerate(places):
        if place.kind != AUTO:
            continue
        if LIMITS in tree:
            raise UnfitError("left out beside a stage auto, which has its own", "given", where=LIMITS)
        table = {key: tree["stage"][k][key] for key in KEYS if key in tree["stage"][k]}
        limits = read_limits(table, f"stage[{k}]", place.rate, place.factor)
        return limits, (k, k + 1) if len(places) > 1 else None
    if LIMITS not in tree:
        return None, None
    table = tree[LIMITS]
    if not isinstance(table, Mapping):
        raise UnfitError("a table", literal(table), where=LIMITS)
    span = _span(table, [place.name for place in places])
    own = places[slice(*span)] if span is not None else places
    factor = prod(place.factor for place in own)
    if factor == 1 or any(place.rises for place in own):
        raise UnfitError(
            "left out unless the stages decimate, and none of them interpolates", "given", where=LIMITS, later=True
        )
    values = {key: value for key, value in table.items() if key not in SPAN}
    return read_limits(values, LIMITS, own[0].rate, factor), span


def _span(table: Mapping[str, Any], names: Sequence[str]) -> tuple[int, int] | None:
    """Return the number of the first stage that limits hold of, and of the one behind the last; None for all."""
    if not set(SPAN) & table.keys():
        return None
    numbers = []
    for key, default in zip(SPAN, (names[0], names[-1]), strict=True):
        name = table.get(key, default)
        if name not in names:
            raise UnfitError(f"the name of a stage: {', '.join(names)}", literal(name), where=f"{LIMITS}.{key}")
        numbers.append(names.index(name))
    first, last = numbers
    if first > last:
        raise UnfitError(
            f"the name of a stage from {names[first]} on", literal(names[last]), where=f"{LIMITS}.{SPAN[1]}"
        )
    return first, last + 1
