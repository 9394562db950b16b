"""Slips: found against a version and against the type, and nothing else taken for one."""

from dataclasses import replace

import numpy as np
import pytest
from tests.instrument.calibration.bayesian import TRUE, TYPE, measured, version_of

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.measurement_store import Version
from sosmith.instrument.calibration.store.surprise import surprise_of

NOTHING = measured(1, 12).of(np.zeros(12, dtype=bool))
SLIPS = {
    "inches": ("clearance_mm must be in millimetres, not in inches", {"clearance": lambda m: m.clearance / 25.4}),
    "centimetres": (
        "clearance_mm must be in millimetres, not in centimetres",
        {"clearance": lambda m: m.clearance / 10},
    ),
    "Fahrenheit": (
        "temperature_C must be in degC, not in degrees Fahrenheit",
        {"temperature": lambda m: m.temperature * 1.8 + 32},
    ),
    "swapped": (
        "clearance_mm and voltage_V must be in their own columns, not swapped",
        {"clearance": lambda m: m.voltage, "voltage": lambda m: m.clearance},
    ),
}


def with_slip(right: Measurements, slip: str) -> Measurements:
    return replace(right, **{name: change(right) for name, change in SLIPS[slip][1].items()})


@pytest.fixture(scope="module")
def known() -> Measurements:
    return measured(3, 30, scatter=0.02)


@pytest.fixture(scope="module")
def version(known: Measurements) -> Version:
    return version_of(known)


@pytest.mark.parametrize("slip", ["inches", "centimetres", "swapped"])
def test_a_slip_is_found_against_a_version(known: Measurements, version: Version, slip: str) -> None:
    right = measured(1, 12, scatter=0.02, seed=2)
    assert not surprise_of(right, known, version, TYPE)
    found = surprise_of(with_slip(right, slip), known, version, TYPE)
    assert found.startswith(f"{SLIPS[slip][0]}: the rms residual against version 3 is ")
    assert found.endswith(" mm with that undone")


@pytest.mark.parametrize("slip", ["inches", "centimetres", "swapped"])
def test_a_slip_is_found_though_the_day_errs_by_more_than_the_version(
    known: Measurements, version: Version, slip: str
) -> None:
    """The version is known to 0.02 mm rms, and the right file is off it by 0.11 mm: that is the error of its day."""
    right = measured(1, 12, scatter=0.02, seed=2)
    right = replace(right, clearance=right.clearance + 0.11)
    assert not surprise_of(right, known, version, TYPE)
    assert surprise_of(with_slip(right, slip), known, version, TYPE).startswith(SLIPS[slip][0])


def test_degrees_fahrenheit_are_found_where_the_temperature_counts(known: Measurements, version: Version) -> None:
    cold = measured(1, 12, scatter=0.02, seed=2)
    T = cold.temperature / 3 + 15
    cold = replace(cold, temperature=T, clearance=TRUE(cold.voltage, T))
    found = surprise_of(with_slip(cold, "Fahrenheit"), known, version, TYPE)
    assert found.startswith(SLIPS["Fahrenheit"][0])


@pytest.mark.parametrize("slip", ["inches", "centimetres"])
def test_a_slip_of_a_first_file_is_found_against_the_type(slip: str) -> None:
    right = measured(1, 12)
    assert not surprise_of(right, NOTHING, None, TYPE)
    found = surprise_of(with_slip(right, slip), NOTHING, None, TYPE)
    assert found.startswith(f"{SLIPS[slip][0]}: the rms residual against the type equation_5a is ")
    assert not surprise_of(with_slip(right, slip), NOTHING, None, None)  # nothing is known
    assert not surprise_of(with_slip(right, slip).of(np.arange(12) < 3), NOTHING, None, TYPE)  # too few rows


def test_rows_that_no_slip_explains_are_those_of_another_sensor(known: Measurements, version: Version) -> None:
    right = measured(1, 12, scatter=0.02, seed=2)
    found = surprise_of(replace(right, clearance=16.0 - right.clearance), known, version, TYPE)
    assert found.startswith("the measurements must be those of this sensor, not ")
    assert found.endswith(" times as far as two sensors of the type equation_5a are apart")
    assert not surprise_of(replace(right, clearance=16.0 - right.clearance), known, version, None)


def test_neither_drift_nor_a_step_nor_another_sensor_of_the_type_is_a_slip(
    known: Measurements, version: Version
) -> None:
    generator = np.random.default_rng(7)
    right = measured(1, 12, scatter=0.02, seed=2)
    for step in (0.1, -0.3, 1.0, -1.0):
        assert not surprise_of(replace(right, voltage=right.voltage + step), known, version, TYPE)
    for seed in range(40):
        curve = TYPE.polynomial(tuple(generator.normal(0, 1, 5).tolist()))
        other = measured(1, 12, scatter=0.02, seed=seed, curve=curve)
        assert not surprise_of(other, known, version, TYPE)
        assert not surprise_of(other, NOTHING, None, TYPE)
