"""Type K thermocouple by ITS-90: emf from temperature, temperature from emf, cold junction compensation.

Emfs are in mV, temperatures in degC. The coefficients are those of NIST Monograph 175 (Standard Reference Database 60),
compared digit by digit with five public copies. No package is used for them: of the two on PyPI,
thermocouples_reference dates from 2014, and thermocouple-its90 handles single numbers only, without numpy. Both solve
for the temperature by iteration, whereas an instrument uses NIST's inverse polynomials.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sosmith.model.arithmetic.elementary import exp
from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError

TEMPERATURE_RANGE = (-270.0, 1372.0)
"""Temperatures in degC at which the emf is defined."""

EMF_RANGE = (-5.891, 54.886)
"""Range in mV of the inverse polynomials: -200 to 1372 degC, rounded to 1 uV as NIST states it."""

_BELOW_ZERO = (
    0.0,
    0.394501280250e-01,
    0.236223735980e-04,
    -0.328589067840e-06,
    -0.499048287770e-08,
    -0.675090591730e-10,
    -0.574103274280e-12,
    -0.310888728940e-14,
    -0.104516093650e-16,
    -0.198892668780e-19,
    -0.163226974860e-22,
)
_ABOVE_ZERO = (
    -0.176004136860e-01,
    0.389212049750e-01,
    0.185587700320e-04,
    -0.994575928740e-07,
    0.318409457190e-09,
    -0.560728448890e-12,
    0.560750590590e-15,
    -0.320207200030e-18,
    0.971511471520e-22,
    -0.121047212750e-25,
)
_BUMP = (0.118597600000e00, -0.118343200000e-03, 0.126968600000e03)
"""a0 in mV, a1 in 1/degC**2 and a2 in degC of the term a0 exp(a1 (t - a2)**2), used from 0 degC upward."""

_INVERSE = (
    (
        0.0,
        2.5173462e01,
        -1.1662878,
        -1.0833638,
        -8.9773540e-01,
        -3.7342377e-01,
        -8.6632643e-02,
        -1.0450598e-02,
        -5.1920577e-04,
    ),
    (
        0.0,
        2.508355e01,
        7.860106e-02,
        -2.503131e-01,
        8.315270e-02,
        -1.228034e-02,
        9.804036e-04,
        -4.413030e-05,
        1.057734e-06,
        -1.052755e-08,
    ),
    (-1.318058e02, 4.830222e01, -1.646031, 5.464731e-02, -9.650715e-04, 8.802193e-06, -3.110810e-08),
)
_INVERSE_FROM = (0.0, 20.644)
"""Lower limits in mV of the second and the third inverse polynomial."""


def thermocouple_emf(temperature: npt.ArrayLike) -> Values:
    """Return the emf in mV with the cold junction at 0 degC: the reference function of ITS-90.

    Parameters
    ----------
    temperature : array_like
        Temperature in degC, within `TEMPERATURE_RANGE`.

    Raises
    ------
    SpecificationError
        If a temperature is outside that range or is NaN.
    """
    t = _within("temperature", temperature, TEMPERATURE_RANGE, "degC")
    polyval = np.polynomial.polynomial.polyval
    a0, a1, a2 = _BUMP
    below, above = np.minimum(t, 0.0), np.maximum(t, 0.0)  # each branch within its own range, to avoid overflow
    return np.where(t < 0, polyval(below, _BELOW_ZERO), polyval(above, _ABOVE_ZERO) + a0 * exp(a1 * (above - a2) ** 2))


def thermocouple_temperature(emf: npt.ArrayLike) -> Values:
    """Return the temperature in degC for an emf with the cold junction at 0 degC: NIST's inverse polynomials.

    They differ from the exact inverse of `thermocouple_emf` by -0.05 to 0.06 degC at most, as NIST states it.

    Parameters
    ----------
    emf : array_like
        Emf in mV, within `EMF_RANGE`.

    Raises
    ------
    SpecificationError
        If an emf is outside that range or is NaN.
    """
    e = _within("emf", emf, EMF_RANGE, "mV")
    polyval = np.polynomial.polynomial.polyval
    first, second = _INVERSE_FROM
    pieces = [polyval(e, coefficients) for coefficients in _INVERSE]
    return np.asarray(np.select([e < first, e < second], pieces[:2], pieces[2]))


def loop_emf(temperature: npt.ArrayLike, cold_junction: npt.ArrayLike) -> Values:
    """Return the emf in mV at the terminals, E(temperature) - E(cold junction); both temperatures in degC.

    Raises
    ------
    SpecificationError
        As for `thermocouple_emf`.
    """
    return np.asarray(thermocouple_emf(temperature) - thermocouple_emf(cold_junction))


def _within(name: str, values: npt.ArrayLike, limits: tuple[float, float], unit: str) -> Values:
    array = np.asarray(values, dtype=np.float64)
    wrong = array[~((array >= limits[0]) & (array <= limits[1]))]
    if wrong.size:
        raise SpecificationError(f"{name} must be {limits[0]:g} to {limits[1]:g} {unit}, not {wrong.flat[0]:g}")
    return array
