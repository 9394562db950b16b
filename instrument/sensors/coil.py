"""A physical model of the inductive sensor: a coil facing steel, with a demodulator of its impedance.

Eddy currents in the steel oppose the coil's field, more strongly at a smaller clearance. At its terminals the coil has
the inductance ``L(x) = L_inf - dL exp(-x / x0)`` at the clearance x, in series with its copper resistance. An
alternating current of constant amplitude gives a voltage proportional to the magnitude of the impedance; the
electronics rectifies it, subtracts a constant and amplifies.

Three quantities drift with temperature: the resistance of the copper; the permeability of the ferrite, and with it
L_inf; and the resistivity of the steel, which weakens the eddy currents, and with them dL. The last two tilt the
characteristic in opposite directions, so that it pivots about a medium clearance, as equation 5a of the paper does
about 5 mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.model.arithmetic.elementary import exp
from sosmith.model.arrays import Values

REFERENCE_TEMPERATURE = 20.0
"""Temperature in degC at which the parameters hold: the paper's reference temperature."""

COPPER = 0.00393
"""Temperature coefficient of the resistance of annealed copper at 20 degC, 1/K (IEC 60028)."""


@dataclass(frozen=True, kw_only=True)
class Coil:
    """The coil sensor: voltage in V from clearance in mm and temperature in degC.

    The first five parameters are fixed. The others were fitted to equation 5a by least squares: `decay`, `gain` and
    `balance` to its curve at 20 degC (55 mV rms), the two drifts to its change up to 60 and 98 degC (30 mV rms).

    Attributes
    ----------
    inductance : float
        L_inf in mH. Assumed; with the frequency it only sets the scale, which `gain` compensates.
    frequency : float
        Frequency of the current in kHz. Assumed.
    quality : float
        ``omega L_inf / R`` at 20 degC. Assumed: such coils usually have 10 or more.
    depth : float
        dL / L_inf at 20 degC. Assumed: over the measured clearances it cannot be separated from `gain`.
    copper : float
        Temperature coefficient of the resistance, 1/K.
    decay : float
        x0 in mm.
    gain : float
        Gain of the electronics in V per ohm of impedance.
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
        """Return the magnitude of the impedance in ohm."""
        warmer = np.asarray(temperature, dtype=np.float64) - REFERENCE_TEMPERATURE
        reactance = 2 * np.pi * self.frequency * self.inductance  # kHz times mH is ohm
        near = exp(-np.asarray(clearance, dtype=np.float64) / self.decay)
        relative = 1 + self.inductance_drift * warmer - self.depth * (1 + self.depth_drift * warmer) * near
        resistance = reactance / self.quality * (1 + self.copper * warmer)
        return np.hypot(reactance * relative, resistance)

    def __call__(self, clearance: npt.ArrayLike, temperature: npt.ArrayLike) -> Values:
        """Return the voltage in V at a clearance in mm and a temperature in degC, of the broadcast shape."""
        return np.asarray(self.gain * (self.impedance(clearance, temperature) - self.balance))
