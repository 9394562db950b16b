"""Rules about a stage of the kind auto, and about limits beside stages that are given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from sosmith.gen.chain.automatic.limits import KEYS, LIMITS, Limits, read_limits
from sosmith.gen.specification.choices import AUTO, MAX_DOWNSAMPLING
from sosmith.gen.specification.values import UnfitError, literal


def check_kinds(kinds: Sequence[str]) -> None:
    """Check that a stage auto is the only one.

    Raises
    ------
    UnfitError
        If there are others.
    """
    for k, kind in enumerate(kinds):
        if kind == AUTO and len(kinds) > 1:
            raise UnfitError(
                "another kind beside other stages, as the limits of a stage auto are those of the whole chain",
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


def limits_in(tree: Mapping[str, Any], rate: Fraction, factor: int, *, rises: bool) -> Limits | None:
    """Return what is asked of the whole: by a stage auto, or by the table for that; None without either.

    Parameters
    ----------
    tree : mapping
        The specification.
    rate : Fraction
        Of the samples, in Hz.
    factor : int
        By how much all stages decimate.
    rises : bool
        Whether any interpolates.

    Raises
    ------
    UnfitError
        If there cannot be any, or one breaks a rule.
    """
    first = tree["stage"][0]
    if first["kind"] == AUTO:
        if LIMITS in tree:
            raise UnfitError("left out beside a stage auto, which has its own", "given", where=LIMITS)
        return read_limits({key: first[key] for key in KEYS if key in first}, "stage[0]", rate, factor)
    if LIMITS not in tree:
        return None
    if not isinstance(tree[LIMITS], Mapping):
        raise UnfitError("a table", literal(tree[LIMITS]), where=LIMITS)
    if factor == 1 or rises:
        raise UnfitError(
            "left out unless the stages decimate, and none of them interpolates", "given", where=LIMITS, later=True
        )
    return read_limits(tree[LIMITS], LIMITS, rate, factor)
