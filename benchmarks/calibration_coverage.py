"""Measures how often intervals hold for sensors unlike their type: `python -m benchmarks.calibration_coverage`.

Each case emulates ten days of a sensor of the type equation 5a with one thing wrong, and calibrates it for the last of
these days and for the day after. Printed are the shares of true clearances inside their 95 % intervals, on both days,
the mean half-width, and how many sensors were warned of, by the fit or by an alarm of their health.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import BayesianFit, bayesian_fit
from sosmith.instrument.calibration.health.charts import WARNING_LIMIT
from sosmith.instrument.calibration.health.monitoring import health_of
from sosmith.instrument.calibration.sensor_type import DEFAULT_TYPE, SENSOR_TYPES
from sosmith.instrument.calibration.uncertainty import SHARE, of_posterior
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError

DAYS, EACH, READINGS, AFTER = 10, 25, 40, 5
"""Days of measurements, measurements of each, readings whose intervals are checked on a day, and days drawn for the one
after the last."""

ENOUGH = 0.92
"""Share of a sensor's intervals on a day that hold, below which a warning is wanted."""

Reading = tuple[Values, Values, Values]
"""Voltages in V, temperatures in degC and true clearances in mm."""

FIRST_SEED, SEEDS = 7001, 20
"""Seeds that nothing was chosen by."""

TYPE = SENSOR_TYPES[DEFAULT_TYPE]
FIRST_DAY = 738000


@dataclass(frozen=True)
class Case:
    """A sensor that is not as its type.

    Attributes
    ----------
    name : str
    scatter, systematic : float
        Of a measurement and of a day, in mm rms.
    correlation : float
        Correlation length of the error of a day in mm.
    gain : float
        Ratio of the sensor's gain to that of the type.
    lasting : float
        Amplitude in mm of an S-shaped curve over the clearance that stays.
    step : float
        Step of the voltage in V on the last day of measurements, which stays.
    thermometer : float
        How far the thermometer reads too high from that day on, in K.
    rail : float
        Voltage in V at which the sensor saturates.
    typical : bool
        Whether the sensor has deviations of its own, with the type's tolerances; else it is the type's curve.
    """

    name: str
    scatter: float = 0.3
    systematic: float = 0.12
    correlation: float = 2.0
    gain: float = 1.0
    lasting: float = 0.0
    step: float = 0.0
    thermometer: float = 0.0
    rail: float = 10.0
    typical: bool = True


CASES = (
    Case("as its type"),
    Case("error of a day over 0.5 mm", correlation=0.5),
    Case("error of a day over 1 mm", correlation=1.0),
    Case("error of a day an offset", correlation=1e3),
    Case("gain -20 %", gain=0.8, typical=False),
    Case("gain -15 %", gain=0.85, typical=False),
    Case("gain +15 %", gain=1.15, typical=False),
    Case("gain +20 %", gain=1.2, typical=False),
    Case("S-curve of 0.5 mm", lasting=0.5),
    Case("S-curve of 1 mm", lasting=1.0),
    Case("scatter times 3", scatter=0.9),
    Case("errors of days times 3", systematic=0.36),
    Case("voltage steps by -1 V", step=-1.0),
    Case("voltage steps by +1 V", step=1.0),
    Case("voltage steps by -0.3 V", step=-0.3),
    Case("voltage steps by +0.3 V", step=0.3),
    Case("thermometer reads 10 K more", thermometer=10.0),
    Case("rail at 6 V", rail=6.0),
)


def _error(chance: np.random.Generator, case: Case, clearance: Values) -> Values:
    """Draw the error of one day at these clearances."""
    apart = np.subtract.outer(clearance, clearance) / case.correlation
    covariance = np.exp(-(apart**2) / 2) + 1e-9 * np.eye(len(clearance))
    return case.systematic * (np.linalg.cholesky(covariance) @ chance.normal(size=len(clearance)))


def _sensor(case: Case, seed: int) -> tuple[Measurements, list[list[Reading]]]:
    """Emulate a sensor: its measurements, and readings on the last day of these and on days that may come after it."""
    chance = np.random.default_rng(seed)
    z = chance.normal(size=5) if case.typical else np.zeros(5)
    columns, last, after = list[list[Values]](), list[Reading](), list[Reading]()
    for day in range(DAYS + AFTER):
        if day <= DAYS:  # each of the days after is the day after the last one, drawn anew
            before = z
        z = before + chance.normal(size=5) * np.sqrt(TYPE.drifts)
        count = EACH + READINGS
        V, T = chance.uniform(0.5, 9.5, count), chance.uniform(20.0, 95.0, count)
        d = TYPE.polynomial(tuple(z.tolist()))(V * case.gain, T)
        d = d + case.lasting * np.sin(2 * np.pi * d / 10.0)
        d = d + _error(chance, case, d)
        late = day >= DAYS - 1
        V, T = np.minimum(np.maximum(V + case.step * late, 0.0), case.rail), T + case.thermometer * late
        if day < DAYS:
            measured = np.maximum(d[:EACH] + chance.normal(0, case.scatter, EACH), 0.0)
            columns.append([measured, V[:EACH], T[:EACH], np.full(EACH, FIRST_DAY + day)])
        inside = slice(EACH, None)
        if day >= DAYS - 1:
            (last if day < DAYS else after).append((V[inside], T[inside], d[inside]))
    clearance, voltage, temperature, days = np.concatenate(columns, axis=1)
    return Measurements(clearance, voltage, temperature, "emulated", tuple(days.astype(int).tolist())), [last, after]


def one_sensor(case: Case, seed: int) -> dict[str, Any]:
    """Return shares inside and mean half-widths in mm, on the last day and the day after, and whether it is warned of.

    A sensor that is not calibrated at all, because most of its measurements fit no sensor of the type, is warned of.
    """
    measurements, readings = _sensor(case, seed)
    last_day = FIRST_DAY + DAYS - 1
    try:
        made = bayesian_fit(measurements, TYPE, last_day, DEFAULT_RANGES)
    except SpecificationError:
        return {"inside": None, "half_width": None, "warned": True, "step": False, "beyond": [0, 0]} | {
            "possible": False,
            "noticed": False,
        }
    inside, widths = list[float](), list[float]()
    for days, one in zip(readings, (made, _day_after(made, last_day + 1)), strict=True):
        V, T, d = (np.concatenate(values) for values in zip(*days, strict=True))
        held = one.rails.hold(V)
        half = of_posterior(measurements, one).half_width(V[held], T[held])
        inside.append(float(np.mean(np.abs(one.fit.polynomial(V[held], T[held]) - d[held]) <= half)))
        widths.append(float(half.mean()))
    lack = of_posterior(measurements, made).lack.structured
    told = bool(made.surprise or made.doubts or made.rails.found or lack or made.step)
    health = health_of(measurements, TYPE, made.rails.ends)
    told = told or bool(health.alarms) or health.notice is not None
    step = made.step is not None and made.step.told
    offsets = health.innovations.offset[health.first :]
    beyond = [int(np.count_nonzero(np.abs(offsets) >= WARNING_LIMIT)), len(offsets)]
    found = {"inside": inside, "half_width": widths, "warned": told, "step": step, "beyond": beyond}
    return found | {"possible": made.step is not None, "noticed": health.notice is not None}


def _day_after(made: BayesianFit, date: int) -> BayesianFit:
    """Return the calibration for a day without measurements, as a fit of all measurements for that day gives it."""
    known = made.posterior
    later = made.model.posterior(known.scatters, known.curves, date)
    step = None if made.step is None else made.step.on(made.model, later, date)
    made = replace(made, posterior=later, plain=True, step=step)
    return replace(made, fit=replace(made.fit, polynomial=TYPE.polynomial(made.averaged.deviations)))


def summed(case: Case, found: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of a case; silent are sensors whose intervals hold too little on a day, without a warning."""
    fitted = [one for one in found if one["inside"] is not None]
    columns = {key: np.array([one[key] for one in fitted]) for key in ("inside", "half_width")}
    inside, half = (np.round(columns[key].mean(axis=0), 4).tolist() for key in ("inside", "half_width"))
    errors = np.round(columns["inside"].std(axis=0, ddof=1) / np.sqrt(len(fitted)), 4).tolist()
    return {
        "case": case.name,
        "inside": inside,
        "inside_error": errors,
        "half_width": half,
        "warned": sum(one["warned"] for one in found),
        "step": sum(one["step"] for one in found),
        "possible": sum(one["possible"] for one in found),
        "noticed": sum(one["noticed"] for one in found),
        "beyond": np.sum([one["beyond"] for one in found], axis=0).tolist(),
        "silent": sum(min(one["inside"]) < ENOUGH and not one["warned"] for one in fitted),
        "refused": len(found) - len(fitted),
        "count": len(found),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="sensors of each case")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.seeds)
    print(f"| {HEADER} |")
    print(f"|{'---|' * len(HEADER.split(' | '))}")
    for case in CASES:
        print(f"| {' | '.join(row_of(summed(case, [one_sensor(case, seed) for seed in seeds])))} |", flush=True)


HEADER = (
    f"sensor | its last day, % inside {100 * SHARE:.0f} % | ± mm | day after, % | ± mm | warned of | step told | "
    "possible | noticed | silent"
)
"""Of the table."""


def row_of(one: dict[str, Any]) -> list[str]:
    """Return the cells of a case."""
    columns = zip(one["inside"], one["inside_error"], one["half_width"], strict=True)
    cells = [f"{100 * a:.1f} +- {100 * e:.1f} | {b:.3f}" for a, e, b in columns]
    counts = [str(one[key]) for key in ("step", "possible", "noticed", "silent")]
    return [one["case"], *cells, f"{one['warned']} of {one['count']}", *counts]


if __name__ == "__main__":
    main()
