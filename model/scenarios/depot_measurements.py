"""Measurements taken by hand in the depot, as a scenario file describes them, for the calibration's store."""

from __future__ import annotations

import datetime
from dataclasses import dataclass

import numpy as np

from sosmith.model.calibration.fit import COLUMNS
from sosmith.model.calibration.measurement_files import DATE_COLUMN
from sosmith.model.random_streams import streams
from sosmith.model.scenarios.file import ScenarioFile

DIGITS = 6
"""Decimals that are written."""


@dataclass(frozen=True)
class DepotMeasurement:
    """One row.

    Attributes
    ----------
    clearance_mm : float
        Read from the micrometer.
    voltage_V : float
        Of the inductive sensor, read from a voltmeter.
    temperature_C : float
        Shown by the thermocouple.
    date : str
        Day as in 2024-03-01.
    """

    clearance_mm: float
    voltage_V: float  # noqa: N815 - the name of the store's column, with the unit
    temperature_C: float  # noqa: N815
    date: str


def measurements_of(scenario: ScenarioFile, seed: int) -> tuple[DepotMeasurement, ...]:
    """Take the measurements of the table ``[calibration]``: each day, temperature, clearance and repetition.

    A voltmeter averages over many periods of the mains, so that hum and broadband noise do not reach it. What is left
    is the sensor's state of the day, and the scatter of the single measurement: by default of the recorded clearance,
    as the error term of the paper's equation 1 has it, or else of the clearance that the sensor sees.

    Parameters
    ----------
    scenario : ScenarioFile
    seed : int
        0 or more; with the same seed, the sensor is the one of the traces.

    Raises
    ------
    SpecificationError
        If the file has no table ``[calibration]``.
    """
    table = scenario.document.calibration
    if table is None:
        raise scenario.refuse("calibration must be a table with the depot's measurements, not missing")
    inductive, thermometer = scenario.sensors.inductive, scenario.sensors.thermometer
    temperature, true, _ = (
        grid.ravel() for grid in np.meshgrid(table.temperatures, table.clearances, range(table.repeats), indexing="ij")
    )
    rows = []
    for day in table.days:
        state = inductive.state(day, streams(seed, "life of the sensor"))
        scatter = streams(seed, "depot")(f"scatter of day {day!r}").normal(0.0, table.scatter, len(true))
        in_clearance = table.scatter_in == "clearance"
        # A micrometer shows no less than contact.
        recorded = np.maximum(true + scatter, 0.0) if in_clearance else true
        seen = true if in_clearance else true + scatter
        voltage = inductive.steady_voltage(seen, temperature, state)
        date = (scenario.document.start + datetime.timedelta(days=int(day))).isoformat()
        columns = (recorded, voltage, thermometer.steady(temperature))
        rows += [
            DepotMeasurement(round(d, DIGITS), round(V, DIGITS), round(T, DIGITS), date)
            for d, V, T in zip(*(column.tolist() for column in columns), strict=True)
        ]
    return tuple(rows)


def measurements_csv(rows: tuple[DepotMeasurement, ...]) -> str:
    """Text of a CSV file that `sosmith calibrate add` takes."""
    lines = [",".join((*COLUMNS, DATE_COLUMN))]
    lines += [f"{row.clearance_mm!r},{row.voltage_V!r},{row.temperature_C!r},{row.date}" for row in rows]
    return "\n".join(lines) + "\n"
