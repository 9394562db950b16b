"""The golden chain against the same sums written out sample by sample."""

from fractions import Fraction

import numpy as np
import pytest
from scipy import signal

from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.model.reference.golden import calibrated, filtered

VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
TEMPERATURE = Port.from_range("temperature", 12, Fraction(-32), Fraction(96), unit="degC")
AUDIO = Port.from_range("audio", 16, Fraction(-1), Fraction(1), signed=True)
CLEARANCE = Port.from_range("clearance", 16, Fraction(0), Fraction(16), unit="mm")

EQUATION_5A = Polynomial.from_numbers([[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]])
"""The paper's calibration, in mm of V and degC."""


def test_calibration_is_the_polynomial_of_the_physical_values() -> None:
    codes = np.array([[0, 0], [32768, 2624], [65535, 4095]])
    expected = []
    for voltage_code, temperature_code in codes.tolist():
        v, t = voltage_code * 10 / 65536, -32 + temperature_code / 32
        expected.append(1.16 - 0.0036 * t + 0.3672 * v + 0.0006618 * v * t + 0.05812 * v**2)
    assert expected[1] == pytest.approx(4.43445, abs=1e-12)  # 5 V and 50 degC by hand
    assert calibrated(codes, (VOLTAGE, TEMPERATURE), EQUATION_5A) == pytest.approx(expected, rel=1e-14)


def test_without_a_calibration_the_input_is_the_quantity() -> None:
    codes = np.array([[-32768], [0], [16384]])
    assert calibrated(codes, (AUDIO,), None).tolist() == [-1.0, 0.0, 0.5]


def test_the_filter_starts_from_rest_and_follows_its_difference_equation() -> None:
    sos = signal.butter(3, 0.2, output="sos")
    values = np.random.default_rng(8).uniform(-0.5, 0.5, 200)
    expected = values.tolist()
    for b0, b1, b2, _, a1, a2 in sos.tolist():
        x1 = x2 = y1 = y2 = 0.0
        result = []
        for x in expected:
            y = b0 * x + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2
            x1, x2, y1, y2 = x, x1, y, y1
            result.append(y)
        expected = result
    assert filtered(values, sos, AUDIO) == pytest.approx(expected, abs=1e-14)


def test_without_a_filter_only_the_range_acts() -> None:
    values = np.array([-0.5, 0.0, 7.25, 15.9999, 99.0])
    assert filtered(values, None, CLEARANCE).tolist() == [0.0, 0.0, 7.25, 16 - 16 / 65536, 16 - 16 / 65536]


def test_saturation_comes_after_the_filter_and_leaves_its_state_alone() -> None:
    """An overshoot of the filter is cut off at the output, and what follows is as if it had not been."""
    sos = signal.butter(5, 0.1, output="sos")
    step = np.full(200, 0.99)
    result = filtered(step, sos, AUDIO)
    free = signal.sosfilt(sos, step)
    assert free.max() > 1
    assert result.max() == 1 - 1 / 32768
    inside = free <= 1 - 1 / 32768
    assert (result[inside] == free[inside]).all()
