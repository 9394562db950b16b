"""The keys of stages that are new, or get another kind or form, such that they can be designed if any such can."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sosmith import ChainSpecification
from sosmith.studio.completion import BY_MASK, BY_ORDER, FREEDOM, GIVEN, LOSSES, ORDER, completed, short

RATES = ("decimate", "interpolate")
"""Keys of a stage that changes the rate, of which it has one."""

_LOSSES = {"passband_loss": 0.1, "stopband_loss": 60.0}
"""Losses of a new stage, in dB."""

_MOST = {"cic": 64, "iir": 1024, "fir": 64, "halfband": 64, "auto": 4096}
"""Largest factors by which the kinds change the rate; those of the first two are powers of two."""

_OF_ALL = ("name", "kind", "protect")
"""What a stage keeps when it gets another kind."""

Table = Mapping[str, Any]


def rates(stages: Sequence[Table], rate: float) -> list[tuple[float, float]]:
    """Return samples per second that enter each stage, and that leave it, as far as its keys are numbers.

    Parameters
    ----------
    stages : sequence of mapping
        Tables of the stages.
    rate : float
        Samples per second that enter the first one.

    Examples
    --------
    >>> rates([{"decimate": 4}, {"kind": "gain"}, {"interpolate": 2}], 8000.0)
    [(8000.0, 2000.0), (2000.0, 2000.0), (2000.0, 4000.0)]
    """
    found = []
    for stage in stages:
        before = rate
        rate = rate * _factor(stage, "interpolate") / _factor(stage, "decimate")
        found.append((before, rate))
    return found


def fresh(kind: str, earlier: Sequence[Table], later: Sequence[Table], rate: float, own: Table) -> dict[str, Any]:
    """Return the keys of a stage of a kind, between others.

    Its edges are those of the chain where these suit its rate. A new one decimates where all later edges are left in
    place, and `own` may have a factor already.
    """
    before = rates(earlier, rate)[-1][1] if earlier else rate
    known = min(
        (edge for stage in (*earlier, *later) for edge in _edges_of(stage, "passband_edge", "cutoff")), default=0.0
    )
    keys = ChainSpecification.kinds()[kind]
    factors = {key: own[key] for key in RATES if key in keys and _suits(kind, own.get(key))}
    if not factors:
        rises = any(_factor(stage, "interpolate") > 1 for stage in (*earlier, *later))
        most = 1.0 if rises else min(_room(later, before), before / known / 2.5 if known else 64.0)
        factors = _factors(kind, [factor for factor in (4, 2) if factor < most])
    factor = max(factors.values(), default=1)
    at = before * factors.get("interpolate", 1)
    usual, widest = (at / 10, at * 0.35) if factor == 1 else (at * min(0.1, 0.3 / factor), at * 0.3 / factor)
    edge = min(max(known or usual, at / 20 / factor), widest)
    match kind:
        case "polynomial":
            return {"coefficients": [[0.0], [1.0]]}
        case "gain":
            return {"factor": 1.0}
        case "iir":
            cutoff = min(known or usual, at / factor / 5 if factor > 1 else widest)
            return {"family": "butterworth", "order": ORDER, "cutoff": short(cutoff), **factors}
        case "fir":
            stop = min(2 * edge, (edge + at / 2) / 2) if factor == 1 else at / factor - edge
            return {"passband_edge": short(edge), "stopband_edge": short(stop), **_LOSSES, **factors}
        case "halfband":
            return {"passband_edge": short(min(edge, at / 5)), **_LOSSES, **factors}
        case "cic":
            return {"order": 3, **factors}
    return {"decimate": factor, "passband_edge": short(before / factor / 4), **_LOSSES}


def _room(later: Sequence[Table], before: float) -> float:
    """Return by how much the rate before some stages can go down, such that all their edges still fit in."""
    room = 64.0
    for stage, ends in zip(later, rates(later, before), strict=True):
        for edge in _edges_of(stage):
            room = min(room, max(ends) / (4 if stage.get("kind") == "halfband" else 2) / edge)
    return room


def _factors(kind: str, down: Sequence[int]) -> dict[str, int]:
    """Return by how much a new stage changes the rate, where it can go down by these factors."""
    if kind == "cic":
        return {"decimate": down[0]} if down else {"interpolate": 2}
    if kind == "halfband":
        return {"decimate": 2} if down else {}
    return {"decimate": 16} if kind == "auto" else {}


def completed_stage(stages: Sequence[Table], k: int, rate: float, named: Sequence[str]) -> dict[str, Any]:
    """Return the changes that make the table of stage `k` complete: None for a key that has to go.

    Parameters
    ----------
    stages : sequence of mapping
        All tables as they are, with what was changed.
    k : int
    rate : float
        Samples per second of the chain.
    named : sequence of str
        Keys of the stage that were changed.
    """
    table, kind = stages[k], stages[k].get("kind")
    if kind not in ChainSpecification.kinds():
        return {}  # the specification says which there are
    if "kind" in named:
        return _of_kind(stages, k, rate)
    changes: dict[str, Any] = {
        other: None for key, other in (RATES, RATES[::-1]) if key in named and key in table and other in table
    }
    if kind not in {"iir", "fir"}:
        return changes
    if set(named) & set(GIVEN) & set(table):
        others = {*BY_ORDER, *BY_MASK, *LOSSES, *GIVEN, "family", "band", "method", FREEDOM} - set(named)
        return changes | {key: None for key in table if key in others}
    if kind == "fir" and set(named) & {"family", "band"} and not set(BY_MASK) & set(table):
        made = fresh(kind, stages[:k], stages[k + 1 :], rate, table)
        changes |= {key: value for key, value in made.items() if key not in table}
        changes |= {key: None for key in GIVEN if key in table}
    seen = {key: value for key, value in {**table, **changes}.items() if value is not None and key != "kind"}
    seen["kind"] = seen.pop("band", "lowpass")
    return changes | completed(seen, max(rates(stages, rate)[k]), ["kind" if key == "band" else key for key in named])


def _of_kind(stages: Sequence[Table], k: int, rate: float) -> dict[str, Any]:
    """Return the changes to a stage that was given another kind: what means the same of both stays."""
    table, kind = stages[k], stages[k]["kind"]
    known = ChainSpecification.kinds()[kind]
    made = fresh(kind, stages[:k], stages[k + 1 :], rate, table)
    if isinstance(edge := table.get("passband_edge", table.get("cutoff")), int | float) and "passband_edge" in made:
        made = fresh(kind, [*stages[:k], {"passband_edge": edge}], stages[k + 1 :], rate, table)
    stays = {key for key in (*_OF_ALL, *made.keys() & LOSSES.keys()) if key in known}
    return {key: None for key in table if key not in stays and key not in made} | {
        key: value for key, value in made.items() if key not in table or key not in stays
    }


def _factor(stage: Table, key: str) -> int:
    factor = stage.get(key)
    return factor if isinstance(factor, int) and 1 < factor <= max(_MOST.values()) else 1


def _suits(kind: str, factor: Any) -> bool:
    """Whether a stage of a kind can change the rate by a factor."""
    if not isinstance(factor, int) or not 2 <= factor <= _MOST.get(kind, 1):
        return False
    return kind not in {"cic", "iir"} or not factor & (factor - 1)


def _edges_of(stage: Table, *keys: str) -> list[float]:
    """Return the edges in Hz that a stage states, as far as they are numbers."""
    given = [stage.get(key) for key in keys or (*BY_MASK, "cutoff")]
    flat = [edge for value in given for edge in (value if isinstance(value, list) else [value])]
    return [float(edge) for edge in flat if isinstance(edge, int | float) and 0 < edge < 1e300]
