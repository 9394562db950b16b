"""Emulated measurements taken by hand in the depot, as described in a scenario file, for the measurement store."""

from __future__ import annotations

import datetime
from dataclasses import dataclass

import numpy as np

from sosmith.gen.calibration.fit import COLUMNS, DATE_COLUMN
from sosmith.instrument.scenarios.file import ScenarioFile
from sosmith.model.arithmetic.random_streams import streams

DIGITS = 6
"""Number of decimals written."""


@dataclass(frozen=True)
class DepotMeasurement:
    """One measurement.

    Attributes
    ----------
    clearance_mm : float
        Micrometer reading.
    voltage_V : float
        Voltmeter reading at the inductive sensor.
    temperature_C : float
        Reading of the thermocouple channel.
    date : str
        Date such as 2024-03-01.
    """

    clearance_mm: float
    voltage_V: float  # noqa: N815 - the name of the store's column, with the unit
    temperature_C: float  # noqa: N815
    date: str


def measurements_of(scenario: ScenarioFile, seed: int) -> tuple[DepotMeasurement, ...]:
    """Generate the measurements of the table ``[calibration]``, for each day, temperature, clearance and repetition.

    A voltmeter averages over many mains periods, so hum and broadband noise do not appear. What remains is the
    state of the sensor on that day and the scatter of each measurement: by default in the recorded clearance, like the
    error term in the paper's equation 1, otherwise in the clearance at the sensor.

    Parameters
    ----------
    scenario : ScenarioFile
        The scenario.
    seed : int
        Seed, 0 or more; with the seed of a trace, the sensor is the same as in the trace.

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
        # A micrometer cannot read less than contact.
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
    """Return the measurements as CSV text for `sosmith calibrate add`."""
    lines = [",".join((*COLUMNS, DATE_COLUMN))]
    lines += [f"{row.clearance_mm!r},{row.voltage_V!r},{row.temperature_C!r},{row.date}" for row in rows]
    return "\n".join(lines) + "\n"
