"""From a clearance that a core has computed back to the voltage that it was computed from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.instrument.calibration.acceptance import Range
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial

_POINTS = 1001
"""Voltages at which it is looked at whether the clearance rises."""

_BISECTIONS = 60
"""Steps of the inversion, beyond the precision of a double."""


@dataclass(frozen=True)
class ReadBack:
    """The calibration that is active in a core, to be undone.

    Attributes
    ----------
    polynomial : Polynomial
        Clearance in mm as a polynomial of voltage in V and temperature in degC.
    gain : float
        Gain of the filter behind it at zero frequency.
    voltages : tuple of float
        Lowest and highest voltage of the input.
    bound : float
        Proven bound of the error of a result, in mm.
    """

    polynomial: Polynomial
    gain: float
    voltages: Range
    bound: float

    def voltage(self, result: float, temperature: float) -> tuple[float, float]:
        """Return the steady voltage in V of a steady result in mm, and V per mm there.

        At a wrong temperature, the voltage is wrong, too, but the result is still that of both together.

        Raises
        ------
        ShortfallError
            If the clearance does not rise with the voltage everywhere in the range, which two voltages may share then;
            or if no voltage of the range has this result.
        """
        V = np.linspace(*self.voltages, _POINTS)
        curve = self.gain * self.polynomial(V, temperature)
        rises = np.diff(curve) > 0
        if not rises.all():
            place = float(V[int(np.argmin(rises))])
            raise ShortfallError(
                "the active calibration must rise with the voltage, for the voltage to follow from the clearance, not "
                f"fall at {place:.3g} V"
            )
        low, high = float(curve[0]), float(curve[-1])
        if not low <= result <= high:
            raise ShortfallError(f"the result must be {low:.4g} to {high:.4g} mm by the calibration, not {result:.4g}")
        below, above = self.voltages
        for _ in range(_BISECTIONS):
            middle = (below + above) / 2
            if self.gain * float(self.polynomial(middle, temperature)) < result:
                below = middle
            else:
                above = middle
        step = (self.voltages[1] - self.voltages[0]) / _POINTS
        ends = np.clip([below - step, below + step], *self.voltages)
        rise = self.gain * np.diff(self.polynomial(ends, temperature))[0] / np.diff(ends)[0]
        return below, float(1 / rise)
