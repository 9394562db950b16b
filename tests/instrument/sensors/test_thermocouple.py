"""Type K thermocouple: NIST's tables, the stated error of the inverse, seams, cold junction, refusals."""

from __future__ import annotations

import re

import numpy as np
import pytest

from sosmith.instrument.sensors.thermocouple import (
    EMF_RANGE,
    TEMPERATURE_RANGE,
    loop_emf,
    thermocouple_emf,
    thermocouple_temperature,
)
from sosmith.model.errors import SpecificationError


@pytest.mark.parametrize(
    ("temperature", "emf"),
    [
        (20, "0.798120"),
        (25, "1.000242"),
        (60, "2.436472"),
        (98, "4.013463"),
        (100, "4.09623"),
        (200, "8.138473"),
    ],
)
def test_reference_values_to_their_last_digit(temperature: float, emf: str) -> None:
    digits = len(emf.partition(".")[2])
    assert f"{thermocouple_emf(temperature):.{digits}f}" == emf


def test_table_of_nist() -> None:
    # Tabulated emfs in mV of NIST Standard Reference Database 60, type K.
    table = {-270: -6.458, -250: -6.404, -200: -5.891, -100: -3.554, -50: -1.889, 0: 0.0, 10: 0.397, 50: 2.023}
    table |= {150: 6.138, 300: 12.209, 500: 20.644, 800: 33.275, 1000: 41.276, 1200: 48.838, 1372: 54.886}
    np.testing.assert_array_equal(thermocouple_emf(list(table)).round(3), list(table.values()))


def test_seebeck_coefficient() -> None:
    t = np.array([20.0, 60.0, 98.0])
    slope = 1000 * (thermocouple_emf(t + 0.001) - thermocouple_emf(t - 0.001)) / 0.002  # uV per degC
    np.testing.assert_allclose(slope, [40.33, 41.42, 41.40], rtol=0, atol=0.005)


INVERSE_ERROR = {(-200.0, 0.0): (-0.02, 0.04), (0.0, 500.0): (-0.05, 0.04), (500.0, 1372.0): (-0.05, 0.06)}
"""Lowest and highest error in degC of the inverse polynomials by temperature range in degC, as NIST states it."""


@pytest.mark.parametrize(
    ("ends", "extremes"),
    [
        ((-200.0, 0.0), "-0.0185 0.0405"),
        ((0.0, 500.0), "-0.0467 0.0339"),
        ((500.0, 1372.0), "-0.0459 0.0535"),
    ],
)
def test_inverse_keeps_the_error_that_nist_states(ends: tuple[float, float], extremes: str) -> None:
    t = np.linspace(*ends, 200_001)
    emf = thermocouple_emf(t)
    inside = (emf >= EMF_RANGE[0]) & (emf <= EMF_RANGE[1])  # the table's ends are rounded to 1 uV
    assert inside.mean() > 0.999
    error = thermocouple_temperature(emf[inside]) - t[inside]
    low, high = INVERSE_ERROR[ends]
    assert low <= error.min().round(2) < error.max().round(2) <= high  # NIST rounds to two digits
    # The polynomials are nearly equiripple: a slip in any digit that matters shifts an extreme.
    assert f"{error.min():.4f} {error.max():.4f}" == extremes


def test_inverse_error_of_the_instruments_range() -> None:
    t = np.linspace(0.0, 200.0, 200_001)
    error = thermocouple_temperature(thermocouple_emf(t)) - t
    assert f"{error.min():.4f} {error.max():.4f}" == "-0.0467 0.0339"


def test_seams() -> None:
    assert abs(thermocouple_emf(0.0)) < 2.5e-9  # as far as the coefficients' 12 digits let it be 0
    np.testing.assert_allclose(thermocouple_emf([-1e-9, 1e-9]), 0.0, atol=2.5e-9)
    np.testing.assert_allclose(thermocouple_temperature([-1e-9, 0.0, 1e-9]), 0.0, atol=1e-7)
    below, above = thermocouple_temperature([20.644 - 1e-9, 20.644])
    assert above - below == pytest.approx(-0.0331, abs=1e-4)  # a step of NIST's own polynomials
    assert np.all(np.diff(thermocouple_emf(np.linspace(*TEMPERATURE_RANGE, 100_001))) > 0)


def test_cold_junction() -> None:
    t = np.linspace(-50.0, 400.0, 901)
    assert loop_emf(25.0, 25.0) == 0.0
    assert loop_emf(100.0, 25.0) == pytest.approx(4.09623 - 1.000242, abs=1e-6)
    for cold in (-20.0, 0.0, 25.0, 60.0):
        np.testing.assert_allclose(
            thermocouple_temperature(loop_emf(t, cold) + thermocouple_emf(cold)), t, rtol=0, atol=0.05
        )
    # A cold junction believed 1 degC too warm shows up as the ratio of the Seebeck coefficients at both ends.
    measured = loop_emf(98.0, 25.0)
    warm, right = (thermocouple_temperature(measured + thermocouple_emf(cold)) for cold in (26.0, 25.0))
    assert warm - right == pytest.approx(40.5 / 41.4, abs=0.01)


def test_shapes_and_types() -> None:
    assert thermocouple_emf(20).shape == ()
    grid = np.array([[-100, 0], [20, 500]])
    assert thermocouple_emf(grid).shape == (2, 2)
    np.testing.assert_allclose(thermocouple_temperature(thermocouple_emf(grid)), grid, rtol=0, atol=0.05)


def test_refusals() -> None:
    for call, message in (
        (lambda: thermocouple_emf(1400.0), "temperature must be -270 to 1372 degC, not 1400"),
        (lambda: thermocouple_emf([20.0, -271.0]), "temperature must be -270 to 1372 degC, not -271"),
        (lambda: thermocouple_emf(np.nan), "temperature must be -270 to 1372 degC, not nan"),
        (lambda: thermocouple_temperature(55.0), "emf must be -5.891 to 54.886 mV, not 55"),
        (lambda: thermocouple_temperature(-6.0), "emf must be -5.891 to 54.886 mV, not -6"),
    ):
        with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
            call()
