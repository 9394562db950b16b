"""What the state of wear over days tells, and what it misses: a part of `python -m benchmarks.days`.

One wheel, one reading a day, 0.05 mm of wear a day. Days err by 0.13 mm, as on the paper's bench without targets, or by
0.05 mm, as with two targets each morning.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sosmith.instrument.wear.state_space import DayReading, DayState, Happening, WearModel, filtered
from sosmith.model.arrays import Values

ERRORS = (0.13, 0.05)
"""Standard deviations of the error of a day in mm."""

SHARED = 0.1
"""Standard deviation in mm of what all readings share where the calibration errs, too: near the limit only."""

RATE, FIRST = 0.05, 2.5
"""Wear in mm a day, and clearance of the first day in mm."""

QUIET_DAYS, QUIET_RECORDS = 200, 40
"""Length and number of the records in which nothing happens, for each error of a day."""

FAULT_DAY, FAULT_DAYS, FAULT_RECORDS = 40, 10, 40
"""Day on which something happens, days within which it is to be told, and records of each kind."""

NEAR_DAYS, NEAR_RECORDS = 40, 200
"""Length and number of the records that end near the limit."""

OFFSETS = (-0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5)
"""How far the last day is past the limit, in mm."""

RISKS = (0.5, 0.2, 0.05, 0.01)


@dataclass(frozen=True)
class Kind:
    """Something that happens: a step of the readings in mm, and by what the rate is multiplied."""

    name: str
    step: float
    times: float
    what: Happening


KINDS = (
    Kind("re-profiled, 0.4 mm", -0.4, 1.0, Happening.JUMP),
    Kind("sensor replaced, reads 0.3 mm more", 0.3, 1.0, Happening.JUMP),
    Kind("rate doubled", 0.0, 2.0, Happening.RATE),
)


def _states(read: Values, error: float, shared: float = 0.0) -> list[DayState]:
    days = [DayReading(time=float(k), clearance=(d,), uncertainty=(error,)) for k, d in enumerate(read.tolist())]
    return filtered(days, WearModel(shared=shared))


def quiet(error: float, first: int, progress: Callable[[int], None]) -> dict[str, Any]:
    """Count what is told in records in which nothing happens, and intervals of the level that hold."""
    false, inside = 0, []
    true = FIRST + RATE * np.arange(QUIET_DAYS)
    for k in range(QUIET_RECORDS):
        states = _states(true + np.random.default_rng([first, k, 1]).normal(0, error, QUIET_DAYS), error)
        false += sum(len(state.told) for state in states)
        for state, clearance in list(zip(states, true.tolist(), strict=True))[::10]:
            low, high = state.interval(0.95)
            inside.append(low <= clearance <= high)
        progress(k)
    return {"error": error, "days": QUIET_DAYS * QUIET_RECORDS, "false": false, "inside": float(np.mean(inside))}


def after(kind: Kind, error: float, first: int) -> dict[str, Any]:
    """Count the records in which it is told in time, with the day by which half and nine tenths of these are."""
    late, sizes, count = [], [], FAULT_DAY + FAULT_DAYS + 1
    rate = np.where(np.arange(count) > FAULT_DAY, RATE * kind.times, RATE)
    true = FIRST + np.cumsum(rate) + kind.step * (np.arange(count) >= FAULT_DAY)
    for k in range(FAULT_RECORDS):
        states = _states(true + np.random.default_rng([first, k, 2]).normal(0, error, count), error)
        found = [one for state in states for one in state.told if one.at >= FAULT_DAY]
        if found:
            late.append(found[0].at - FAULT_DAY)
            sizes.append(found[0].event.what is kind.what)
    half, most = (float(np.quantile(late, q, method="inverted_cdf")) if late else None for q in (0.5, 0.9))
    return {
        "error": error,
        "kind": kind.name,
        "records": FAULT_RECORDS,
        "told": len(late),
        "named": int(sum(sizes)),
        "half": half,
        "most": most,
    }


def near_the_limit(error: float, first: int, shared: float = 0.0) -> list[dict[str, Any]]:
    """Return how often wear is called critical at some distances past the limit: by risks, and by the last reading."""
    past: dict[float, list[float]] = {offset: [] for offset in OFFSETS}
    read: dict[float, list[bool]] = {offset: [] for offset in OFFSETS}
    true = FIRST + RATE * np.arange(NEAR_DAYS)
    for k in range(NEAR_RECORDS):
        chance = np.random.default_rng([first, k, 3])
        values = true + chance.normal(0, error, NEAR_DAYS) + chance.normal(0, shared)
        state = _states(values, error, shared)[-1]
        for offset in OFFSETS:
            limit = float(true[-1]) - offset
            past[offset].append(state.beyond(limit))
            read[offset].append(bool(values[-1] >= limit))
    return [
        {
            "error": error,
            "shared": shared,
            "offset": offset,
            "reading": float(np.mean(read[offset])),
            "risks": {str(risk): float(np.mean(np.array(past[offset]) >= risk)) for risk in RISKS},
        }
        for offset in OFFSETS
    ]


def all_alarms(first: int, progress: Callable[[str, int, int], None]) -> dict[str, Any]:
    """Return all counts, with seeds from `first` on."""
    rows: dict[str, Any] = {"quiet": [], "happenings": [], "limit": []}
    for error in ERRORS:
        rows["quiet"].append(quiet(error, first, lambda k: progress("alarms: quiet", k, QUIET_RECORDS)))
        for kind in KINDS:
            progress(f"alarms: {kind.name}", 0, 0)
            rows["happenings"].append(after(kind, error, first))
        progress("alarms: near the limit", 0, 0)
        for shared in (0.0, SHARED):
            rows["limit"] += near_the_limit(error, first, shared)
    return rows
