"""A physical model of the inductive sensor: a coil before steel, its impedance demodulated.

Eddy currents in the steel oppose the coil's field, the more so the closer it is. Seen from the terminals, the coil has
the inductance ``L(x) = L_inf - dL exp(-x / x0)`` over the clearance x, in series with the resistance of its copper. An
alternating current of constant amplitude makes a voltage in proportion to the impedance's magnitude, and the
electronics rectifies it, subtracts a constant and amplifies.

Three things drift with the temperature: the copper's resistance; the ferrite's permeability and with it L_inf; and the
steel's resistivity, which weakens the eddy currents and with them dL. The last two bend the characteristic in opposite
ways, so that it turns about a clearance in the middle, as the paper's equation 5a does about 5 mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values

REFERENCE_TEMPERATURE = 20.0
"""Temperature in degC at which the parameters hold, the paper's reference."""

COPPER = 0.00393
"""Temperature coefficient of the resistance of annealed copper at 20 degC, 1/K (IEC 60028)."""

FIT_CLEARANCES = (1.5, 10.0)
"""Clearances in mm over which the fitted parameters were fitted.

From 1.5 mm, the least initial clearance that the paper allows; below 1.09 mm at 20 degC equation 5a has no positive
voltage.
"""

FIT_TEMPERATURES = (60.0, 98.0)
"""Temperatures in degC beside `REFERENCE_TEMPERATURE` to which the drift was fitted: within and end of equation 5a."""


@dataclass(frozen=True, kw_only=True)
class Coil:
    """Voltage in V of the sensor from clearance in mm and temperature in degC.

    The first five parameters are fixed. The others are the least-squares fit to equation 5a: `decay`, `gain` and
    `balance` to its curve at 20 degC (55 mV rms), the two drifts to its change until 60 and 98 degC (30 mV rms).

    Attributes
    ----------
    inductance : float
        L_inf in mH. Assumed; with the frequency it sets only the scale, which `gain` takes up.
    frequency : float
        Of the current in kHz. Assumed.
    quality : float
        ``omega L_inf / R`` at 20 degC. Assumed: usual values of such coils are 10 and more.
    depth : float
        dL / L_inf at 20 degC. Assumed: the clearances that were measured do not tell it apart from `gain`.
    copper : float
        Temperature coefficient of the resistance, 1/K.
    decay : float
        x0 in mm.
    gain : float
        V per ohm of impedance.
    balance : float
        Impedance in ohm that the electronics subtracts.
    inductance_drift, depth_drift : float
        Temperature coefficients of L_inf and dL, 1/K.
    """

    inductance: float = 1.0
    frequency: float = 10.0
    quality: float = 10.0
    depth: float = 0.2
    copper: float = COPPER
    decay: float = 8.6018
    gain: float = 1.25943
    balance: float = 51.7434
    inductance_drift: float = -1.18e-4
    depth_drift: float = -6.474e-4

    def impedance(self, clearance: npt.ArrayLike, temperature: npt.ArrayLike) -> Values:
        """Magnitude of the impedance in ohm."""
        warmer = np.asarray(temperature, dtype=np.float64) - REFERENCE_TEMPERATURE
        reactance = 2 * np.pi * self.frequency * self.inductance  # kHz times mH is ohm
        near = np.exp(-np.asarray(clearance, dtype=np.float64) / self.decay)
        relative = 1 + self.inductance_drift * warmer - self.depth * (1 + self.depth_drift * warmer) * near
        resistance = reactance / self.quality * (1 + self.copper * warmer)
        return np.hypot(reactance * relative, resistance)

    def __call__(self, clearance: npt.ArrayLike, temperature: npt.ArrayLike) -> Values:
        """Return the voltage in V at a clearance in mm and a temperature in degC, of their common shape."""
        return np.asarray(self.gain * (self.impedance(clearance, temperature) - self.balance))
