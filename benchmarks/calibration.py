"""Measures how long calibrations take to fit: `python -m benchmarks.calibration`.

Processor time of one fit by least squares, of a robust one that tries all orders because none is good enough, and of a
Bayesian calibration over many days, with what it says it is worth.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import time

import numpy as np

from sosmith.gen.calibration.fit import Measurements, fit
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.bayesian_fit import bayesian_fit
from sosmith.instrument.calibration.fit_quality import assess_posterior
from sosmith.instrument.calibration.sensor_type import DEFAULT_TYPE, SENSOR_TYPES
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A

SCATTER = 0.3
"""Standard deviation of the measured clearance in mm: least squares reach an adjusted r of 0.99, but not of 0.9999."""


DAYS = 300
"""Days over which the measurements of the Bayesian calibration are spread."""


def measurements(count: int) -> Measurements:
    """Emulate readings of an inductive sensor, about equally many on each day."""
    generator = np.random.default_rng(1)
    voltage = np.round(generator.uniform(0.2, 9.6, count), 4)
    temperature = np.round(generator.uniform(20, 98, count), 1)
    clearance = EQUATION_5A(voltage, temperature) + generator.normal(0, SCATTER, count)
    days = tuple(np.sort(np.arange(count) % DAYS).tolist())
    return Measurements(np.round(np.maximum(clearance, 0), 3), voltage, temperature, days=days)


def seconds(data: Measurements, required_r: float, *, robust: bool) -> float:
    """Return the processor time of one fit, found or not, in seconds."""
    start = time.process_time()
    with contextlib.suppress(SpecificationError):  # no polynomial is good enough
        fit(data, required_r, robust=robust)
    return time.process_time() - start


def bayesian_seconds(data: Measurements) -> dict[str, float]:
    """Return the processor times of a Bayesian calibration and of its intervals and cross-validation, in seconds."""
    start = time.process_time()
    made = bayesian_fit(data, SENSOR_TYPES[DEFAULT_TYPE], DAYS, DEFAULT_RANGES)
    fitted = time.process_time()
    found = assess_posterior(data, made)
    assert found.uncertainty.over_days is not None
    assert found.uncertainty.limits[0] > 0
    return {"bayes": fitted - start, "bayes_worth": time.process_time() - fitted}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=10_000, help="number of measurements")
    parser.add_argument("--json", action="store_true", help="print JSON, in seconds")
    options = parser.parse_args()
    data = measurements(options.count)
    figures = {
        "least_squares": seconds(data, 0.99, robust=False),
        "robust_all_orders": seconds(data, 0.9999, robust=True),
        **bayesian_seconds(data),
    }
    if options.json:
        print(json.dumps({"measurements": options.count, **figures}, indent=2))
        return
    print(f"{options.count:,} measurements, processor time:")
    print(f"  least squares, first order that is good enough   {figures['least_squares']:.2f} s")
    print(f"  robust, all orders                               {figures['robust_all_orders']:.2f} s")
    print(f"  bayes, over {DAYS} days                             {figures['bayes']:.2f} s")
    print(f"  its intervals and its cross-validation           {figures['bayes_worth']:.2f} s")


if __name__ == "__main__":
    main()
