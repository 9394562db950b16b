"""Holds the gains that a chain claims against its limits, and chosen stages against what they were chosen for.

The limits stand in the table ``[limits]``, or in the one stage of the kind auto from which a program made the stages.
Nothing has to be known of how it chose: what is asked for follows from the claims, which are proven.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import prod
from typing import Any

from flint import arb, ctx, fmpq

from sosmith.verify.chain.chain_file import FoldingEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.specified.stated_specification import stated_number
from sosmith.verify.specified.words import with_fractions

_SPAN = ("first", "last")
_KEYS = ("passband_edge", "passband_loss", "stopband_loss", "stopband_edge")
_AUTO = "auto"
_CHOSEN = {"fir", "halfband", "cic", "iir"}
_PRECISION = 256


@dataclass(frozen=True)
class Limits:
    """Edges in Hz, and losses in dB below the largest gain in the pass band."""

    passband_edge: Fraction
    passband_loss: Fraction
    stopband_loss: Fraction
    stopband_edge: Fraction | None


def limits_of(tree: Mapping[str, Any]) -> Limits | None:
    """Return the limits of a specification of stages, if it has any."""
    table = tree.get("limits")
    if table is None:
        return None
    known = (*_KEYS, *_SPAN)
    require(set(table) <= set(known), f"the limits must have the keys {', '.join(known)}, not {', '.join(table)}")
    edge, passed, stopped = (stated_number(table[key]) for key in _KEYS[:3])
    return Limits(edge, passed, stopped, stated_number(table[_KEYS[3]]) if _KEYS[3] in table else None)


def span_of(tree: Mapping[str, Any]) -> tuple[int, int] | None:
    """Return the numbers of the first and the last stage that the limits of a specification hold of; None for all."""
    table, names = tree.get("limits", {}), [stage["name"] for stage in tree["stage"]]
    if not set(_SPAN) & set(table):
        return None
    return names.index(table.get("first", names[0])), names.index(table.get("last", names[-1]))


def check_limits(entries: Sequence[FoldingEntry], limits: Limits, rate: Fraction) -> None:
    """Check that the gains that are claimed are inside the limits; `rate` is that of the first samples, in Hz.

    Raises
    ------
    RejectedError
        If one is not, or there is no claim to hold against a limit.
    """
    require(
        len(entries) == 1 and entries[0].rise == 1, "a chain with limits must decimate, and no stage may interpolate"
    )
    (entry,) = entries
    kept, passing = entry.kept, entry.passing
    if kept is None or passing is None:
        raise RejectedError("a chain with limits must claim the gains in its pass band, and what aliases into it")
    stop = None if limits.stopband_edge is None else limits.stopband_edge / rate
    require(kept.stop == stop, f"the stop band must begin at {stop} of the sample rate, not {kept.stop}")
    least, most = kept.least.gain, kept.most.gain
    require(
        least > 0 and _within(most, least, -limits.passband_loss),
        f"gains in the pass band must differ by at most {float(limits.passband_loss):g} dB, "
        f"not be {float(least):.9g} to {float(most):.9g}",
    )
    for what, claim in (("what aliases into the pass band", passing), ("gains in the stop band", kept.stopped)):
        require(
            claim is None or _within(claim.gain, most, limits.stopband_loss),
            f"{what} must be {float(limits.stopband_loss):g} dB below {float(most):.9g}, "
            f"not {0 if claim is None else float(claim.gain):.6g}",
        )


def _within(gain: Fraction, reference: Fraction, loss: Fraction) -> bool:
    """Say whether a gain is proven to be at most a reference less a loss in dB."""
    with ctx.workprec(_PRECISION):
        return bool(_ball(gain) <= _ball(reference) * arb(10) ** (-_ball(loss) / 20))


def _ball(value: Fraction) -> arb:
    return arb(fmpq(value.numerator, value.denominator))


def is_automatic(tree: Mapping[str, Any]) -> bool:
    """Say whether a specification leaves the stages to the program that made them."""
    return any(stage.get("kind") == _AUTO for stage in tree["stage"])


def check_chosen(asked: Mapping[str, Any], own: Mapping[str, Any]) -> None:
    """Check that stages, and the limits that they are held against, are of what a stage auto asks for.

    Parameters
    ----------
    asked : mapping
        The specification with the stage auto.
    own : mapping
        That of the chain.

    Raises
    ------
    RejectedError
        If the limits, the decimation or anything else of the whole differ.
    """
    kinds = [stage["kind"] for stage in asked["stage"]]
    require(kinds.count(_AUTO) == 1, "there must be one stage auto, not several")
    k, others = kinds.index(_AUTO), len(kinds) - 1
    stage, end = asked["stage"][k], len(own["stage"]) - (others - k)
    chosen = own["stage"][k:end]
    require(len(chosen) >= 1, "there must be stages in the place of the stage auto")
    _same("the stages before those that were chosen", own["stage"][:k], asked["stage"][:k])
    _same("the stages behind those that were chosen", own["stage"][end:], asked["stage"][k + 1 :])
    span = {"first": chosen[0]["name"], "last": chosen[-1]["name"]} if others else {}
    _same("the limits", own.get("limits"), {key: stage[key] for key in _KEYS if key in stage} | span)
    factor = prod(each.get("decimate", 1) for each in chosen)
    require(factor == stage["decimate"], f"all stages must decimate by {stage['decimate']}, not {factor}")
    for each in chosen:
        filters = each["kind"] in _CHOSEN and "interpolate" not in each
        require(filters, f"stage {each['name']} must be a filter that was chosen, not of the kind {each['kind']}")
    for key in sorted({*asked, *own} - {"stage", "limits"}):
        _same(key, own.get(key), asked.get(key))


def _same(what: str, own: Any, asked: Any) -> None:
    same = with_fractions(own) == with_fractions(asked)
    require(same, f"{what} must be as the specification says, {asked}, not {own}")
