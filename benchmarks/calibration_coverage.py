"""Measures how often intervals hold for sensors unlike their type: `python -m benchmarks.calibration_coverage`.

Each case emulates ten days of a sensor of the type equation 5a with one thing wrong, and calibrates it for the last of
these days and for the day after. Printed are the shares of true clearances inside their 95 % intervals, on both days,
the mean half-width, and how many sensors were warned of, by the fit or by an alarm of their health.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.health.monitoring import health_of
from sosmith.instrument.calibration.sensor_type import DEFAULT_TYPE, SENSOR_TYPES
from sosmith.instrument.calibration.uncertainty import SHARE, of_posterior
from sosmith.model.arrays import Values

DAYS, EACH, READINGS = 10, 25, 40
"""Days of measurements, measurements of each, and readings whose intervals are checked on each of two days."""

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
    Case("voltage steps by +0.3 V", step=0.3),
    Case("thermometer reads 10 K more", thermometer=10.0),
    Case("rail at 6 V", rail=6.0),
)


def _error(chance: np.random.Generator, case: Case, clearance: Values) -> Values:
    """Draw the error of one day at these clearances."""
    apart = np.subtract.outer(clearance, clearance) / case.correlation
    covariance = np.exp(-(apart**2) / 2) + 1e-9 * np.eye(len(clearance))
    return case.systematic * (np.linalg.cholesky(covariance) @ chance.normal(size=len(clearance)))


def _sensor(case: Case, seed: int) -> tuple[Measurements, list[tuple[Values, Values, Values]]]:
    """Emulate a sensor: its measurements, and voltages, temperatures and true clearances of readings on two days."""
    chance = np.random.default_rng(seed)
    z = chance.normal(size=5) if case.typical else np.zeros(5)
    columns, readings = [], []
    for day in range(DAYS + 1):
        z = z + chance.normal(size=5) * np.sqrt(TYPE.drifts)
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
        if day >= DAYS - 1:
            inside = slice(EACH, None)
            readings.append((V[inside], T[inside], d[inside]))
    clearance, voltage, temperature, days = np.concatenate(columns, axis=1)
    return Measurements(clearance, voltage, temperature, "emulated", tuple(days.astype(int).tolist())), readings


def run(case: Case, seeds: range) -> dict[str, Any]:
    """Return shares inside and mean half-widths in mm, on the last day and the day after, and the share warned of."""
    inside, widths, warned = [[], []], [[], []], 0
    for seed in seeds:
        measurements, readings = _sensor(case, seed)
        told = False
        for k, (V, T, d) in enumerate(readings):
            made = bayesian_fit(measurements, TYPE, FIRST_DAY + DAYS - 1 + k, DEFAULT_RANGES)
            held = made.rails.hold(V)
            worth = of_posterior(measurements, made)
            half = worth.half_width(V[held], T[held])
            inside[k] += (np.abs(made.fit.polynomial(V[held], T[held]) - d[held]) <= half).tolist()
            widths[k] += half.tolist()
            told = told or bool(made.surprise or made.doubts or made.rails.found or worth.lack.structured)
        alarms = health_of(measurements, TYPE, made.rails.ends).alarms
        warned += told or bool(alarms)
    shares, halves = ([round(float(np.mean(one)), 4) for one in both] for both in (inside, widths))
    return {"case": case.name, "inside": shares, "half_width": halves, "warned": warned, "count": len(seeds)}


def all_sensors(seeds: range, progress: Callable[[str, int, int], None]) -> list[dict[str, Any]]:
    """Return the figures of all cases."""
    found = []
    for k, case in enumerate(CASES):
        progress(f"coverage: {case.name}", k, len(CASES))
        found.append(run(case, seeds))
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="sensors of each case")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.seeds)
    print(f"| sensor | its last day, % inside {100 * SHARE:.0f} % | ± mm | day after | ± mm | warned of |")
    print("|---|---|---|---|---|---|")
    for case in CASES:
        print(f"| {' | '.join(row_of(run(case, seeds)))} |", flush=True)


def row_of(one: dict[str, Any]) -> list[str]:
    """Return the cells of a case."""
    cells = [f"{100 * a:.1f} | {b:.3f}" for a, b in zip(one["inside"], one["half_width"], strict=True)]
    return [one["case"], *cells, f"{one['warned']} of {one['count']}"]


if __name__ == "__main__":
    main()
