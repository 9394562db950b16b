"""Whether plans of `sosmith calibrate advise` bring what they promise: a part of `python -m benchmarks.days`.

Each case is a sensor of the type equation 5a, measured on some days before; the plan for the next day is carried out,
and the intervals of the fit to all of it are held against what was wished.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from benchmarks.calibration_coverage import FIRST_DAY, TYPE, Case, _error

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.advice import advise
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.uncertainty import of_posterior
from sosmith.model.arrays import Values

CLEARANCES, TEMPERATURES = (2.0, 4.0, 6.0), (20.0,)
"""Readings that matter: clearances in mm, and the depot's temperature in degC."""

MOST = 60
"""Most measurements of a day."""

CASES = tuple(
    (days, scatter, within, order)
    for days in (5, 10)
    for scatter, within in ((0.1, 0.12), (0.3, 0.2), (0.3, 0.25), (0.02, 0.08))
    for order in (2, 6)
)
"""Days before, scatter of a measurement in mm, wished half-width in mm, and highest order of a day's polynomial."""

EACH, PER_DAY = 4, 20
"""Sensors of each case, and measurements of each day before."""


def one_case(days: int, scatter: float, within: float, order: int, seed: int) -> dict[str, Any]:
    """Plan a day, carry it out, and return what was promised and what came."""
    chance = np.random.default_rng([seed, days, int(1000 * scatter), int(1000 * within)])
    kind, case = replace(TYPE, order=order), Case("planned", scatter=scatter)
    z = chance.normal(size=5)
    rows: list[Values] = []
    for day in range(days):
        z = z + chance.normal(size=5) * np.sqrt(kind.drifts)
        V, T = chance.uniform(0.5, 9.5, PER_DAY), chance.uniform(20.0, 95.0, PER_DAY)
        rows.append(_measured(chance, case, z, V, T, day))
    known = _as_measurements(rows)
    today = FIRST_DAY + days
    made = bayesian_fit(known, kind, today, DEFAULT_RANGES)
    plan = advise(made, DEFAULT_RANGES, CLEARANCES, TEMPERATURES, within=within, most=MOST)
    found = {"days": days, "scatter": scatter, "within": within, "order": order, "seed": seed}
    found |= {"count": plan.count, "reached": plan.reached}
    if not plan.reached or not plan.count:
        return found
    d, T = (np.repeat([one[k] for one in plan.plan], [one[2] for one in plan.plan]) for k in range(2))
    curve = kind.polynomial(made.posterior.deviations)
    grid = np.linspace(0.0, 10.0, 2001)
    V = np.array([np.interp(one, np.maximum.accumulate(curve(grid, t)), grid) for one, t in zip(d, T, strict=True)])
    z = z + chance.normal(size=5) * np.sqrt(kind.drifts)
    every = _as_measurements([*rows, _measured(chance, case, z, V, T, days)])
    after = bayesian_fit(every, kind, today, DEFAULT_RANGES)
    at = np.array([np.interp(one, np.maximum.accumulate(after.fit.polynomial(grid, 20.0)), grid) for one in CLEARANCES])
    half = of_posterior(every, after).half_width(at, np.full(len(at), 20.0))
    return found | {"promised": max(plan.after), "got": float(half.max()), "met": bool(half.max() <= within)}


def _measured(chance: np.random.Generator, case: Case, z: Values, V: Values, T: Values, day: int) -> Values:
    clear = TYPE.polynomial(tuple(z.tolist()))(V, T)
    d = np.maximum(clear + _error(chance, case, clear) + chance.normal(0, case.scatter, len(V)), 0.0)
    return np.array([d, V, T, np.full(len(V), FIRST_DAY + day)])


def _as_measurements(rows: list[Values]) -> Measurements:
    d, V, T, days = np.concatenate(rows, axis=1)
    return Measurements(d, V, T, "emulated", tuple(days.astype(int).tolist()))
