"""Depot measurements: generated from a scenario file, stored, and fitted again each day."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

import numpy as np

from sosmith.gen.calibration.fit import COLUMNS, Fit, Measurements, fit
from sosmith.instrument.calibration.measurement_store import open_store
from sosmith.instrument.calibration.self_updating import Calibration, Method, add
from sosmith.instrument.scenarios.depot_measurements import DepotMeasurement, measurements_csv, measurements_of
from sosmith.instrument.scenarios.file import ScenarioFile
from sosmith.model.text_files import write_files


def into_store(
    scenario: ScenarioFile, seed: int, folder: Path, sensor: str, method: Method = "paper"
) -> list[Calibration]:
    """Add the measurements of each day as a separate file; return the calibration after each day."""
    folder.mkdir(parents=True, exist_ok=True)
    store = folder / "measurements.sqlite"
    store.unlink(missing_ok=True)
    made = []
    with open_store(store, create=True) as opened:
        for date, rows in groupby(measurements_of(scenario, seed), key=lambda row: row.date):
            (path,) = write_files(folder, {f"depot-{date}.csv": measurements_csv(tuple(rows))})
            addition = add(opened, sensor, path, date, method=method)
            if addition.file.refusals or addition.calibration is None:
                raise RuntimeError(f"{path}: {addition.shortfall or addition.file.refusals[0].reason}")
            made.append(addition.calibration)
    return made


def fitted(rows: tuple[DepotMeasurement, ...]) -> Fit:
    """Fit the measurements of all days at once, as the store does after the last day."""
    clearance, voltage, temperature = (np.array([getattr(row, name) for row in rows]) for name in COLUMNS)
    return fit(Measurements(clearance=clearance, voltage=voltage, temperature=temperature, source="the depot"))
