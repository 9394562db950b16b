"""Measures how long calibrations take to fit: `python -m benchmarks.calibration`.

Processor time of one fit by least squares, and of a robust one that tries all orders because none is good enough.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import time

import numpy as np

from sosmith.model.calibration.fit import Measurements, fit
from sosmith.model.calibration.polynomial import EQUATION_5A
from sosmith.model.errors import SpecificationError

SCATTER = 0.3
"""Standard deviation of the measured clearance in mm: least squares reach an adjusted r of 0.99, but not of 0.9999."""


def measurements(count: int) -> Measurements:
    """Emulate readings of an inductive sensor."""
    generator = np.random.default_rng(1)
    voltage = np.round(generator.uniform(0.2, 9.6, count), 4)
    temperature = np.round(generator.uniform(20, 98, count), 1)
    clearance = EQUATION_5A(voltage, temperature) + generator.normal(0, SCATTER, count)
    return Measurements(np.round(np.maximum(clearance, 0), 3), voltage, temperature)


def seconds(data: Measurements, required_r: float, *, robust: bool) -> float:
    """Return the processor time of one fit, found or not, in seconds."""
    start = time.process_time()
    with contextlib.suppress(SpecificationError):  # no polynomial is good enough
        fit(data, required_r, robust=robust)
    return time.process_time() - start


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
    }
    if options.json:
        print(json.dumps({"measurements": options.count, **figures}, indent=2))
        return
    print(f"{options.count:,} measurements, processor time:")
    print(f"  least squares, first order that is good enough   {figures['least_squares']:.2f} s")
    print(f"  robust, all orders                               {figures['robust_all_orders']:.2f} s")


if __name__ == "__main__":
    main()
