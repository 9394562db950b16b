"""What the state of wear over days tells, and what it misses: a part of `python -m benchmarks.days`.

One reading a day, 0.05 mm of wear a day; one wheel, or both of an axle with the sum of their clearances known to
0.03 mm. Days err by 0.13 mm, as on the paper's bench without targets, or by 0.05 mm, as with two targets each morning.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from sosmith.instrument.wear.state_space import DayReading, DayState, Happening, WearModel, filtered
from sosmith.model.arrays import Values

ERRORS = (0.13, 0.05)
"""Standard deviations of the error of a day in mm."""

SUM_KNOWN_TO = 0.03
"""Standard deviation in mm of the known sum of both clearances, new each day."""

SHARED = 0.1
"""Standard deviation in mm of what all readings share where the calibration errs, too: near the limit only."""

RATE, FIRST = 0.05, (2.5, 2.9)
"""Wear in mm a day, and clearances of both wheels on the first day in mm."""

QUIET_DAYS, QUIET_RECORDS = 200, 40
"""Length and number of the records in which nothing happens, for each error of a day."""

FAULT_DAY, FAULT_DAYS, FAULT_RECORDS = 40, 10, 40
"""Day on which something happens, days within which it is to be told, and records of each kind."""

ALLOWED = 1 / 1000
"""False alarms a day that are allowed."""

NEAR_DAYS, NEAR_RECORDS = 40, 200
"""Length and number of the records that end near the limit."""

OFFSETS = (-0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5)
"""How far the last day is past the limit, in mm."""

RISKS = (0.5, 0.2, 0.05, 0.01)


@dataclass(frozen=True)
class Kind:
    """Something that happens to the first wheel: a step in mm, of the wheel or of its sensor, or the rate, times."""

    name: str
    step: float
    times: float
    what: Happening

    def wear(self, days: Values) -> Values:
        """Return by how much the clearance differs from what it would be without, in mm."""
        late = np.maximum(days - FAULT_DAY, 0.0)
        step = 0.0 if self.what is Happening.SENSOR else self.step
        return np.asarray(step * (days >= FAULT_DAY) + (self.times - 1.0) * RATE * late)

    def reading(self, days: Values) -> Values:
        """Return by how much the readings differ, in mm."""
        own = self.step if self.what is Happening.SENSOR else 0.0
        return np.asarray(self.wear(days) + own * (days >= FAULT_DAY))


KINDS = (
    Kind("re-profiled, 0.4 mm", -0.4, 1.0, Happening.JUMP),
    Kind("sensor replaced, reads 0.3 mm more", 0.3, 1.0, Happening.SENSOR),
    Kind("rate doubled", 0.0, 2.0, Happening.RATE),
)
QUIET = Kind("nothing", 0.0, 1.0, Happening.OFF)


def states_of(kind: Kind, days: int, error: float, chance: np.random.Generator, *, axle: bool) -> list[DayState]:
    """Follow a wheel, or an axle with its known sum, to which something happens."""
    at = np.arange(days, dtype=np.float64)
    wheels = 1 + axle
    true = np.add.outer(FIRST[:wheels], RATE * at)
    read = true + chance.normal(0, error, true.shape)
    read[0] += kind.reading(at)
    total = true.sum(axis=0) + kind.wear(at) + chance.normal(0, SUM_KNOWN_TO, days)
    record = [
        DayReading(
            time=float(k),
            clearance=tuple(read[:, k].tolist()),
            uncertainty=(error,) * wheels,
            total=float(total[k]) if axle else None,
            total_uncertainty=SUM_KNOWN_TO,
        )
        for k in range(days)
    ]
    return filtered(record, WearModel())


def quiet(error: float, axle: bool, number: int, first: int) -> dict[str, Any]:
    """Count what is told in a record in which nothing happens, and intervals of the level that hold."""
    states = states_of(QUIET, QUIET_DAYS, error, np.random.default_rng([first, number, 1]), axle=axle)
    inside = []
    for k in range(0, QUIET_DAYS, 10):
        low, high = states[k].interval(0.95)
        inside.append(low <= FIRST[0] + RATE * k <= high)
    return {"days": QUIET_DAYS, "false": sum(len(state.told) for state in states), "inside": float(np.mean(inside))}


def after(kind: Kind, error: float, axle: bool, number: int, first: int) -> dict[str, Any]:
    """Return on which day after it is told, and whether it is named; None if it is not in time."""
    chance = np.random.default_rng([first, number, 2])
    states = states_of(kind, FAULT_DAY + FAULT_DAYS + 1, error, chance, axle=axle)
    found = [one for state in states for one in state.told if one.at >= FAULT_DAY]
    if not found:
        return {"late": None, "named": False}
    what = kind.what if axle or kind.what is not Happening.SENSOR else Happening.JUMP
    return {"late": found[0].at - FAULT_DAY, "named": found[0].event.what is what and found[0].event.wheel == 0}


def possible(kind: Kind, error: float, *, axle: bool) -> float:
    """Return a bound on the share that any test can tell in time at `ALLOWED` false alarms a day.

    In so many days, a test raises a false alarm with a probability of at most their number times `ALLOWED`; of all
    tests of that size, the one by Neyman and Pearson tells most. It knows what happens, by how much and when; only
    levels and rates of the wheels it has to learn from the readings. A real test knows none of it, and tells less.
    """
    days = np.arange(FAULT_DAY + FAULT_DAYS + 1, dtype=np.float64)
    none, line = np.zeros_like(days), [np.ones_like(days), days]
    signal = [kind.reading(days) / error]
    unknown = [[one / error] for one in line]
    if axle:
        signal += [none, kind.wear(days) / SUM_KNOWN_TO]
        unknown = [[one / error, none, one / SUM_KNOWN_TO] for one in line]
        unknown += [[none, one / error, one / SUM_KNOWN_TO] for one in line]
    v, x = np.concatenate(signal), np.array([np.concatenate(one) for one in unknown]).T
    left = v - x @ np.linalg.lstsq(x, v, rcond=None)[0]
    return float(special.ndtr(np.linalg.norm(left) + special.ndtri(ALLOWED * (FAULT_DAYS + 1))))


def near_the_limit(error: float, first: int, shared: float = 0.0) -> list[dict[str, Any]]:
    """Return how often wear is called critical at some distances past the limit: by risks, and by the last reading."""
    past: dict[float, list[float]] = {offset: [] for offset in OFFSETS}
    read: dict[float, list[bool]] = {offset: [] for offset in OFFSETS}
    true = FIRST[0] + RATE * np.arange(NEAR_DAYS)
    model = WearModel(shared=shared)
    for k in range(NEAR_RECORDS):
        chance = np.random.default_rng([first, k, 3])
        values = true + chance.normal(0, error, NEAR_DAYS) + chance.normal(0, shared)
        days = [DayReading(time=float(n), clearance=(d,), uncertainty=(error,)) for n, d in enumerate(values.tolist())]
        state = filtered(days, model)[-1]
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


# With days of 0.05 mm one wheel alone is enough.
Step = tuple[str, float, float, int]
"""What is counted, error of a day in mm, what readings share in mm or 1 for an axle, and the number of the record."""


def steps() -> list[Step]:
    """Return the records that are followed, each by itself."""
    found: list[Step] = []
    for error in ERRORS:
        for axle in (0.0, 1.0)[: 2 if error == ERRORS[0] else 1]:
            found += [("quiet", error, axle, k) for k in range(QUIET_RECORDS)]
            found += [(kind.name, error, axle, k) for kind in KINDS for k in range(FAULT_RECORDS)]
        found += [("limit", error, shared, 0) for shared in (0.0, SHARED)]
    return found


def one_step(step: Step, first: int) -> Any:
    """Follow one record, with seeds from `first` on."""
    what, error, second, number = step
    if what == "limit":
        return near_the_limit(error, first, second)
    if what == "quiet":
        return quiet(error, second > 0, number, first)
    kind = next(one for one in KINDS if one.name == what)
    return after(kind, error, second > 0, number, first)


def summed(results: dict[Step, Any]) -> dict[str, Any]:
    """Return all counts."""
    rows: dict[str, Any] = {"quiet": [], "happenings": [], "limit": []}
    for error in ERRORS:
        for axle in (False, True)[: 2 if error == ERRORS[0] else 1]:
            own = {"error": error, "axle": axle}
            some = [results["quiet", error, float(axle), k] for k in range(QUIET_RECORDS)]
            days, false = (sum(one[key] for one in some) for key in ("days", "false"))
            inside = float(np.mean([one["inside"] for one in some]))
            rows["quiet"].append(own | {"days": days, "false": false, "inside": inside})
            for kind in KINDS:
                each = [results[kind.name, error, float(axle), k] for k in range(FAULT_RECORDS)]
                late = [one["late"] for one in each if one["late"] is not None]
                half, most = (float(np.quantile(late, q, method="inverted_cdf")) if late else None for q in (0.5, 0.9))
                row = own | {"kind": kind.name, "records": len(each), "told": len(late), "half": half, "most": most}
                row |= {"named": sum(one["named"] for one in each)}
                rows["happenings"].append(row | {"possible": round(possible(kind, error, axle=axle), 5)})
        for shared in (0.0, SHARED):
            rows["limit"] += results["limit", error, shared, 0]
    return rows
