"""Emulated sensors: what the paper's inductive sensor and thermocouple show at a given clearance."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sosmith.model.polynomial import EQUATION_5A
from sosmith.model.port import Values

VOLTAGE_NOISE = 0.01
"""Broadband noise of the inductive sensor's voltage, V rms.

From the paper: its errors before (table 1) and after (table 4) the low-pass filter differ by 8.8 um rms.
Divided by the slope of equation 5a at each of the ten clearances (46.5 degC), this is 10.5 mV.
"""

TEMPERATURE_NOISE = 0.1
"""Broadband noise of the thermocouple channel, degC rms.

Assumed: about 4 uV at the 41.4 uV/degC of a type K thermocouple near 60 degC (ITS-90), after the
averaging of a slow channel. It moves equation 5a by less than 0.4 um, well below the voltage's noise.
"""


def sensor_voltage(clearance: npt.ArrayLike, temperature: npt.ArrayLike) -> Values:
    """Voltage of the inductive sensor in V, without noise.

    Equation 5a of the paper solved for V, the root on its rising branch (positive for every clearance
    that the paper measured). Where the clearance is below the least one that equation 5a can take at
    that temperature, the voltage of that least one.

    Parameters
    ----------
    clearance : array_like
        Clearance in mm.
    temperature : array_like
        Temperature in degC.
    """
    c, b, a = (_row(index, temperature) for index in range(3))
    discriminant = b * b - 4 * a * (c - np.asarray(clearance, dtype=np.float64))
    return np.asarray((np.sqrt(np.maximum(discriminant, 0.0)) - b) / (2 * a))


def _row(index: int, temperature: npt.ArrayLike) -> Values:
    row = [float(value) for value in EQUATION_5A.coefficients[index]]
    return np.asarray(np.polynomial.polynomial.polyval(np.asarray(temperature, dtype=np.float64), row))
