"""Emulated sensors against the reference figures of equation 5a."""

from __future__ import annotations

import numpy as np
import pytest

from sosmith.model.polynomial import EQUATION_5A
from sosmith.model.sensors import VOLTAGE_NOISE, sensor_voltage


@pytest.mark.parametrize(
    ("temperature", "voltages"),
    [(20.0, (1.8656, 5.5601, 9.5353)), (60.0, (2.0152, 5.5570, 9.4636)), (98.0, (2.1430, 5.5543, 9.3974))],
)
def test_reference_voltages(temperature: float, voltages: tuple[float, ...]) -> None:
    # Equation 5a solved for V at 2, 5 and 10 mm, worked out independently of this package.
    np.testing.assert_allclose(sensor_voltage([2.0, 5.0, 10.0], temperature), voltages, rtol=0, atol=5e-5)


def test_inverse_of_equation_5a() -> None:
    d, T = np.meshgrid(np.linspace(1, 10, 50), np.linspace(20, 98, 40))
    np.testing.assert_allclose(EQUATION_5A(sensor_voltage(d, T), T), d, rtol=0, atol=1e-13)


def test_below_the_least_clearance_the_voltage_is_that_of_the_least() -> None:
    lowest = sensor_voltage(0.1, 20.0)
    assert lowest == sensor_voltage(0.3, 20.0)
    assert EQUATION_5A(lowest, 20.0) < EQUATION_5A(lowest + 0.01, 20.0)
    assert EQUATION_5A(lowest, 20.0) < EQUATION_5A(lowest - 0.01, 20.0)


def test_voltage_noise_follows_from_the_papers_tables() -> None:
    before = [
        0.02595,
        0.020736,
        0.024471,
        0.078376,
        0.081988,
        0.056695,
        0.01452,
        0.02922,
        0.027095,
        0.0226914,
    ]
    after = [
        0.015534,
        0.019077,
        0.021802,
        0.070238,
        0.078392,
        0.052738,
        0.004391,
        0.01114,
        0.027036,
        0.011554,
    ]
    V = sensor_voltage(np.arange(1.0, 11.0), 46.5)
    slope = (EQUATION_5A(V + 1e-6, 46.5) - EQUATION_5A(V - 1e-6, 46.5)) / 2e-6
    rms = np.sqrt(np.mean(((np.array(before) - np.array(after)) / slope) ** 2))
    assert rms == pytest.approx(VOLTAGE_NOISE, rel=0.06)
