"""Emulated measurements, for tests of the regression and of what is built on it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sosmith.gen.calibration.fit import COLUMNS, Measurements
from sosmith.model.polynomial import EQUATION_5A, Polynomial


def readings(
    count: int, scatter: float = 0.05, seed: int = 1, polynomial: Polynomial = EQUATION_5A
) -> list[tuple[float, float, float]]:
    """Clearance in mm, voltage in V and temperature in degC, as instruments of few digits show them."""
    generator = np.random.default_rng(seed)
    V = np.round(generator.uniform(0.2, 9.6, count), 4)
    T = np.round(generator.uniform(20, 98, count), 1)
    d = np.round(np.maximum(polynomial(V, T) + generator.normal(0, scatter, count), 0), 3)
    return list(zip(d.tolist(), V.tolist(), T.tolist(), strict=True))


def as_arrays(rows: list[tuple[float, float, float]]) -> Measurements:
    """Arrays of `rows`."""
    return Measurements(*np.array(rows).T)


def write_csv(path: Path, rows: list[tuple[float, float, float]]) -> Path:
    """Write `rows` under the header of the contract."""
    path.write_text("\n".join([",".join(COLUMNS), *(",".join(map(str, row)) for row in rows), ""]))
    return path
