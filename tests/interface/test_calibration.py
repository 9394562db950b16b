"""Calibrations from Python: from arrays and files, into a specification."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import sosmith
from sosmith import Calibration, SpecificationError

MARCH = Path(__file__).parents[2] / "examples" / "measurements" / "march.csv"


def test_a_file_and_its_columns_give_the_same() -> None:
    loaded = Calibration.load(MARCH)
    table = np.genfromtxt(MARCH, delimiter=",", names=True, dtype=None, encoding="utf-8")
    fitted = Calibration.fit(table["voltage_V"], table["temperature_C"], table["clearance_mm"])
    assert fitted.coefficients == loaded.coefficients
    assert fitted.rms == pytest.approx(np.sqrt(np.mean(fitted.residual**2)))
    assert fitted.rms.unit == "mm"
    assert fitted.covered["voltage"] == (table["voltage_V"].min(), table["voltage_V"].max())
    assert np.allclose(
        table["clearance_mm"] - fitted(table["voltage_V"], table["temperature_C"]), fitted.residual, atol=1e-12
    )


def test_the_table_goes_into_a_specification() -> None:
    calibration = Calibration.load(MARCH)
    spec = sosmith.Specification.example().replaced(calibration=calibration.table())
    assert spec.checked.calibration is not None
    assert (
        spec.checked.calibration.coefficients == calibration.fitted.polynomial.coefficients
        or [[float(value) for value in row] for row in spec.checked.calibration.coefficients or ()]
        == calibration.coefficients
    )
    assert tomllib.loads(calibration.toml()) == {"calibration": calibration.table()}


def test_a_calibration_says_what_it_is_worth() -> None:
    line, curve = Calibration.load(MARCH), Calibration.load(MARCH, required_r=0.999)
    assert re.fullmatch(r"the residuals follow a curve along the voltage of about 0\.3\d* mm rms .*", line.warning)
    assert curve.warning == ""
    V, T = np.meshgrid([2.0, 5.0, 8.0], [30.0, 60.0])
    assert curve.half_width(V, T).shape == (2, 3)
    assert curve.half_width(V, T).max() < 0.03
    assert line.half_width(V, T).min() > 0.5
    assert "95 % interval of a reading" in curve._repr_html_()


@pytest.mark.parametrize(
    ("voltage", "temperature", "clearance", "options", "message"),
    [
        ([1.0], [1.0], [1.0], {}, "measurements must hold at least 4 measurements for a linear regression, not 1"),
        ([1.0], [1.0, 2.0], [1.0], {}, r"voltage, temperature and clearance must have one shape, not \(1,\), .*"),
        (["a"], [1.0], [1.0], {}, "voltage, temperature and clearance must be numbers, not something else"),
        ([np.nan], [1.0], [1.0], {}, "voltage must be finite, not nan"),
        ([1.0], [1.0], [1.0], {"required_r": 1.0}, "required_r must be 0 or more and less than 1, not 1"),
    ],
)
def test_measurements_that_do_not_fit(
    voltage: list[float], temperature: list[float], clearance: list[float], options: dict[str, float], message: str
) -> None:
    with pytest.raises(SpecificationError, match=f"^{message}$"):
        Calibration.fit(voltage, temperature, clearance, **options)  # type: ignore[arg-type]


def test_notebooks_get_a_table() -> None:
    assert Calibration.load(MARCH)._repr_html_().startswith("<table><caption>Calibration</caption>")
