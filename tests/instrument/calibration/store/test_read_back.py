"""From a clearance back to its voltage."""

import numpy as np
import pytest

from sosmith.instrument.calibration.store.read_back import ReadBack
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import EQUATION_5A, Polynomial

RANGE = (0.0, 10.0)


@pytest.mark.parametrize("voltage", [0.0, 0.01, 3.3, 9.99, 10.0])
@pytest.mark.parametrize(("gain", "temperature"), [(1.0, 21.0), (0.98, -5.0), (1.02, 98.0)])
def test_the_voltage_of_a_result_comes_back(voltage: float, gain: float, temperature: float) -> None:
    result = gain * float(EQUATION_5A(voltage, temperature))
    found, slope = ReadBack(EQUATION_5A, gain, RANGE, 0.0).voltage(result, temperature)
    assert found == pytest.approx(voltage, abs=1e-9)
    near = np.clip([voltage - 1e-4, voltage + 1e-4], *RANGE)
    rise = gain * np.diff(EQUATION_5A(near, temperature))[0] / np.diff(near)[0]
    assert slope == pytest.approx(1 / rise, rel=3e-3)


def test_what_has_no_voltage_or_two_is_refused() -> None:
    with pytest.raises(ShortfallError, match=r"^the result must be 1\.084 to 10\.71 mm by the calibration, not 11$"):
        ReadBack(EQUATION_5A, 1.0, RANGE, 0.0).voltage(11.0, 21.0)
    bent = Polynomial.from_numbers([[1.0], [-1.0], [0.25]])
    message = (
        "^the active calibration must rise with the voltage, for the voltage to follow from the clearance, not fall at "
        "0 V$"
    )
    with pytest.raises(ShortfallError, match=message):
        ReadBack(bent, 1.0, RANGE, 0.0).voltage(2.0, 21.0)
