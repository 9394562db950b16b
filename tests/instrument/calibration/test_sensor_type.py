"""Types of sensors: what their tolerances do to the clearance, and where they come from."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sosmith.instrument.calibration.sensor_type import SENSOR_TYPES, SensorType
from sosmith.instrument.calibration.sensor_type_file import sensor_type_named
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_4, EQUATION_5A

TYPE = SENSOR_TYPES["equation_5a"]


def test_the_built_in_curves_are_the_papers_regressions() -> None:
    V, T = np.meshgrid(np.linspace(0, 10, 5), [20.0, 98.0])
    for kind, equation in zip(SENSOR_TYPES.values(), (EQUATION_5A, EQUATION_4), strict=True):
        assert np.array_equal(kind.polynomial()(V, T), equation(V, T))


def test_a_tolerance_of_the_voltage_is_one_of_the_clearance_by_the_slope() -> None:
    h = 1e-6
    slope = float((EQUATION_5A(5.0 + h, 20.0) - EQUATION_5A(5.0 - h, 20.0)) / (2 * h))
    V, T = np.array([2.0, 8.0]), np.array([20.0, 70.0])
    expected = [
        [0.3 * slope] * 2,
        [0.06 * slope * 2.0, 0.06 * slope * 8.0],
        [0.0, 0.6 * slope * 0.5],
        [0.0, 0.10 * slope * 8.0 * 0.5],
        [0.15 * 0.05812 * 4.0, 0.15 * 0.05812 * 64.0],
    ]
    assert TYPE.columns(V, T) == pytest.approx(np.array(expected), abs=1e-9)


def test_deviations_add_to_the_curve() -> None:
    deviations = (0.5, -1.0, 2.0, 0.3, -0.7)
    V, T = np.array([0.5, 5.0, 9.0]), np.array([20.0, 50.0, 98.0])
    expected = EQUATION_5A(V, T) + np.array(deviations) @ TYPE.columns(V, T)
    assert TYPE.polynomial(deviations)(V, T) == pytest.approx(expected, rel=1e-12)


def test_a_type_survives_the_store() -> None:
    own = replace(TYPE, name="own", gain=0.02, systematic=0.3)
    assert SensorType.from_json(own.json()) == own


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gain": 0.0}, "gain must be 1e-06 to 1000, not 0"),
        ({"offset_drift": -1.0}, "offset_drift must be 0 to 1000, not -1"),
        ({"curve": (1.0, 2.0)}, "curve must be 5 finite numbers, not [1.0, 2.0]"),
        ({"curve": (10.0, -1.0, 0.0, 0.0, 0.0)}, "curve must rise with the voltage, not have the slope -1 mm/V"),
    ],
)
def test_impossible_types_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(SpecificationError) as refused:
        replace(TYPE, **changes)
    assert str(refused.value) == message


def test_a_type_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text('name = "own"\ncurve = [1, 0.3, 0, 0, 0.06]\nsystematic = 0.2\n')
    assert sensor_type_named(str(path)) == SensorType(name="own", curve=(1.0, 0.3, 0.0, 0.0, 0.06), systematic=0.2)
    path.write_text('name = "own"\ncurve = [10, -1, 0, 0, 0]\n')
    with pytest.raises(SpecificationError, match=r"own\.toml: curve must rise with the voltage, not have the slope -1"):
        sensor_type_named(str(path))
    path.write_text('name = "own"\ncurve = [1, 0.3, 0, 0, 0.06]\ngian = 0.1\n')
    with pytest.raises(SpecificationError, match="gian"):
        sensor_type_named(str(path))
