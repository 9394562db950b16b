"""Measurements of the depot: rows, scatter where it is said to be, the sensor's state, and the store's format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.instrument.scenarios.scenario_texts import CALIBRATION, PLAIN

from sosmith.gen.calibration.fit import fit, read_measurements
from sosmith.instrument.calibration.store.measurement_files import read_measurement_file
from sosmith.instrument.scenarios.depot_measurements import DepotMeasurement, measurements_csv, measurements_of
from sosmith.instrument.scenarios.file import load_scenario
from sosmith.instrument.sensors.inductive_sensor import sensor_voltage
from sosmith.model.arithmetic.random_streams import streams
from sosmith.model.errors import SpecificationError

EXAMPLES = Path(__file__).parents[3] / "examples" / "scenarios"
ADJUSTED_R = {"bench_43_50": 0.9853, "bench_92_96": 0.9852}
"""Adjusted r of the paper's equations 4 and 5a."""


def rows(folder: Path, calibration: str, seed: int = 1, sensors: str = "") -> tuple[DepotMeasurement, ...]:
    path = folder / "day.toml"
    path.write_text(PLAIN.replace("noise = 0.01", f"noise = 0.01\n{sensors}") + calibration, encoding="utf-8")
    return measurements_of(load_scenario(path), seed)


def columns(measured: tuple[DepotMeasurement, ...]) -> tuple[np.typing.NDArray[np.float64], ...]:
    values = np.array([(row.clearance_mm, row.voltage_V, row.temperature_C) for row in measured])
    return values[:, 0], values[:, 1], values[:, 2]


def test_every_day_temperature_clearance_and_repetition(tmp_path: Path) -> None:
    measured = rows(tmp_path, CALIBRATION)
    assert len(measured) == 3 * 3 * 2 * 4
    assert [row.date for row in measured[::24]] == ["2024-01-01", "2024-01-02", "2024-01-03"]
    assert measured == rows(tmp_path, CALIBRATION)
    assert measured != rows(tmp_path, CALIBRATION, seed=2)
    # A further day does not shift the others.
    more = rows(tmp_path, CALIBRATION.replace("[0, 1, 2.5]", "[1, 2.5]"))
    assert more == measured[24:]


def test_scatter_of_the_recorded_clearance(tmp_path: Path) -> None:
    many = CALIBRATION.replace("repeats = 4", "repeats = 300")
    d, V, T = columns(rows(tmp_path, many))
    true = np.tile(np.repeat([2.0, 5.0, 8.0], 300), 6)
    assert np.std(d - true) == pytest.approx(0.3, rel=0.05)
    assert T[[0, -1]] == pytest.approx([20, 60], abs=0.05)
    np.testing.assert_allclose(V, sensor_voltage(true, np.tile(np.repeat([20.0, 60.0], 900), 3)), atol=1e-6)


def test_scatter_of_what_the_sensor_sees(tmp_path: Path) -> None:
    many = CALIBRATION.replace("repeats = 4", 'repeats = 300\nscatter_in = "voltage"')
    d, V, _ = columns(rows(tmp_path, many))
    true = np.tile(np.repeat([2.0, 5.0, 8.0], 300), 6)
    np.testing.assert_array_equal(d, true)
    ideal = sensor_voltage(true, np.tile(np.repeat([20.0, 60.0], 900), 3))
    at_five = (V - ideal)[true == 5.0]
    assert np.std(at_five) == pytest.approx(0.3 / 1.04, rel=0.05)


def test_no_clearance_below_contact(tmp_path: Path) -> None:
    wild = CALIBRATION.replace("[2, 5, 8]", "[0.1]").replace("repeats = 4", "repeats = 50")
    d, _, _ = columns(rows(tmp_path, wild))
    assert d.min() == 0.0
    assert np.mean(d == 0.0) == pytest.approx(0.37, abs=0.1)


def test_the_sensor_is_the_one_of_the_traces(tmp_path: Path) -> None:
    aged = "ageing = { offset_per_day = 0.1 }\nsystematic_error = { rms = 0.2 }"
    measured = rows(tmp_path, CALIBRATION, sensors=aged)
    scenario = load_scenario(tmp_path / "day.toml")
    # With the seed of a trace, the systematic error of a day is that of the trace.
    state = scenario.sensors.inductive.state(1.0, streams(1, "life of the sensor"))
    expected = sensor_voltage(2.0 + state.error(np.array([2.0])), 20.0) + 0.1
    assert measured[24].voltage_V == pytest.approx(float(expected[0]), abs=1e-6)


def test_without_a_table_there_is_nothing_to_measure(tmp_path: Path) -> None:
    with pytest.raises(
        SpecificationError,
        match=r"day.toml: calibration must be a table with the depot's measurements, not missing$",
    ):
        rows(tmp_path, "")


@pytest.mark.parametrize("name", sorted(ADJUSTED_R))
def test_the_store_takes_the_rows_and_the_scatter_is_of_the_papers_size(tmp_path: Path, name: str) -> None:
    path = tmp_path / "measurements.csv"
    measured = measurements_of(load_scenario(EXAMPLES / f"{name}.toml"), 1)
    path.write_text(measurements_csv(measured), encoding="utf-8")
    file = read_measurement_file(path, "2024-01-01")
    assert file.refusals == ()
    assert len(file.readings) == len(measured)
    assert file.readings[-1].date == measured[-1].date
    plain = tmp_path / "plain.csv"
    plain.write_text("\n".join(line.rpartition(",")[0] for line in path.read_text().splitlines()), encoding="utf-8")
    fitted = fit(read_measurements(plain))
    # The scatter is spread over the recorded clearances as well, so that r comes out a little above the paper's.
    assert fitted.adjusted_r == pytest.approx(ADJUSTED_R[name], abs=0.004)
    assert fitted.orders == (2, 1)
