"""Measures how often intervals hold for sensors unlike their type: `python -m benchmarks.calibration_coverage`.

Each case emulates ten days of a sensor of the type equation 5a with one thing wrong, and calibrates it for the last of
these days and for the day after. Printed are the shares of true clearances inside their 95 % intervals, on both days,
the mean half-width, and the share of sensors that were warned of.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
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
        V = np.minimum(V, case.rail)
        if day < DAYS:
            measured = np.maximum(d[:EACH] + chance.normal(0, case.scatter, EACH), 0.0)
            columns.append([measured, V[:EACH], T[:EACH], np.full(EACH, FIRST_DAY + day)])
        if day >= DAYS - 1:
            inside = slice(EACH, None)
            readings.append((V[inside], T[inside], d[inside]))
    clearance, voltage, temperature, days = np.concatenate(columns, axis=1)
    return Measurements(clearance, voltage, temperature, "emulated", tuple(days.astype(int).tolist())), readings


def run(case: Case, seeds: range) -> tuple[list[float], list[float], float]:
    """Return coverage and mean half-width in mm on the last day and the day after, and the share warned of."""
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
        warned += told
    return [float(np.mean(one)) for one in inside], [float(np.mean(one)) for one in widths], warned / len(seeds)


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
        inside, widths, warned = run(case, seeds)
        cells = [f"{100 * a:.1f} | {b:.3f}" for a, b in zip(inside, widths, strict=True)]
        print(f"| {case.name} | {' | '.join(cells)} | {100 * warned:.0f} % |", flush=True)


if __name__ == "__main__":
    main()
