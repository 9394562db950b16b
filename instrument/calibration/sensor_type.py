"""What is known of a sensor before it is measured: its type's curve, and how far a single sensor may lie from it."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, fields
from fractions import Fraction

import numpy as np

from sosmith.model.arrays import Values
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_4, EQUATION_5A, Polynomial

TERMS = ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0))
"""Powers of voltage and temperature in a type curve: those of the paper's equations 4 and 5a."""

DEVIATIONS = ("offset", "gain", "offset over temperature", "gain over temperature", "curvature")
"""Names of the deviations from a type curve, in their order."""

LEAST_ORDER, MOST_ORDER = 2, 8
"""Orders in the voltage of a type curve, and of the polynomial of a day at most."""

REFERENCE_VOLTAGE, REFERENCE_TEMPERATURE = 5.0, 20.0
"""Middle of the voltage's range in V, where the slope is taken, and reference temperature in degC."""


@dataclass(frozen=True, kw_only=True)
class SensorType:
    """A type of sensor: the prior of a Bayesian calibration.

    Tolerances are standard deviations. A tolerance of the voltage becomes one of the clearance by the slope of the
    curve at `REFERENCE_VOLTAGE` and `REFERENCE_TEMPERATURE`, in mm/V. The defaults are wide: three times narrower ones
    change the accuracy of the campaign's weeks by less than half a point.

    Attributes
    ----------
    name : str
        Name of the type.
    curve : tuple of float
        Coefficients of the type curve by `TERMS`, in mm, V and degC; rising in voltage at the reference point.
    offset : float
        Tolerance of the offset in V.
    gain : float
        Tolerance of the gain, as a ratio.
    offset_per_100_K, gain_per_100_K : float
        Tolerances of the temperature coefficients: V per 100 K, and ratio per 100 K.
    curvature : float
        Tolerance of the coefficient of V**2, as a ratio.
    offset_drift, gain_drift : float
        Standard deviations of the change from one day to the next: V, and ratio. A random walk, 0 or more.
    systematic : float
        Expected systematic error of a day in mm rms: a smooth function of the clearance that stays for a day. It is
        uncertain by `SYSTEMATIC_FACTOR`; the measurements of several days decide.
    correlation : float
        Correlation length in mm of that error.
    order : int
        Highest order in the voltage of the polynomial of a day with measurements of its own, `LEAST_ORDER` to
        `MOST_ORDER`. The hardware must have room for it.
    """

    name: str
    curve: tuple[float, float, float, float, float]
    offset: float = 0.3
    gain: float = 0.06
    offset_per_100_K: float = 0.6  # noqa: N815 - the unit
    gain_per_100_K: float = 0.10  # noqa: N815
    curvature: float = 0.15
    offset_drift: float = 0.01
    gain_drift: float = 0.001
    systematic: float = 0.1
    correlation: float = 2.0
    order: int = LEAST_ORDER

    def __post_init__(self) -> None:
        for field in fields(self)[2:-1]:
            value = getattr(self, field.name)
            least = 0.0 if field.name.endswith("_drift") else 1e-6
            if not least <= value <= 1e3:
                raise SpecificationError(f"{field.name} must be {least:g} to 1000, not {value:g}")
        if not LEAST_ORDER <= self.order <= MOST_ORDER:
            raise SpecificationError(f"order must be {LEAST_ORDER} to {MOST_ORDER}, not {self.order}")
        if len(self.curve) != len(TERMS) or not all(map(math.isfinite, self.curve)):
            raise SpecificationError(f"curve must be {len(TERMS)} finite numbers, not {list(self.curve)}")
        if not self.slope > 0:
            raise SpecificationError(f"curve must rise with the voltage, not have the slope {self.slope:g} mm/V")

    @property
    def slope(self) -> float:
        """Slope of the curve in mm/V at the reference point."""
        _, c_v, _, c_vt, c_vv = self.curve
        return c_v + c_vt * REFERENCE_TEMPERATURE + 2 * c_vv * REFERENCE_VOLTAGE

    @property
    def deviations(self) -> tuple[dict[tuple[int, int], Fraction], ...]:
        """What one standard deviation of each tolerance adds to the curve: coefficients by powers of V and T.

        In the order offset, gain, their temperature coefficients, curvature.
        """
        slope, hot = Fraction(self.slope), Fraction(1, 100)
        cold = -Fraction(REFERENCE_TEMPERATURE) * hot
        offset, gain = slope * Fraction(self.offset), slope * Fraction(self.gain)
        offset_hot, gain_hot = slope * Fraction(self.offset_per_100_K), slope * Fraction(self.gain_per_100_K)
        return (
            {(0, 0): offset},
            {(1, 0): gain},
            {(0, 0): offset_hot * cold, (0, 1): offset_hot * hot},
            {(1, 0): gain_hot * cold, (1, 1): gain_hot * hot},
            {(2, 0): Fraction(self.curve[-1]) * Fraction(self.curvature)},
        )

    @property
    def drifts(self) -> tuple[float, ...]:
        """Variance added in a day to each deviation, in units of its tolerance squared."""
        return (self.offset_drift / self.offset) ** 2, (self.gain_drift / self.gain) ** 2, 0.0, 0.0, 0.0

    def polynomial(self, deviations: tuple[float, ...] = ()) -> Polynomial:
        """Return the type curve plus these multiples of `deviations`; each coefficient is rounded to a double once."""
        total = {term: Fraction(value) for term, value in zip(TERMS, self.curve, strict=True)}
        for factor, deviation in zip(deviations, self.deviations, strict=bool(deviations)):
            for term, value in deviation.items():
                total[term] += Fraction(factor) * value
        rows = [[(0, 0), (0, 1)], [(1, 0), (1, 1)], [(2, 0)]]
        return Polynomial.from_numbers([[float(total[term]) for term in row] for row in rows])

    def columns(self, voltage: Values, temperature: Values) -> Values:
        """Return the clearance in mm that one standard deviation of each tolerance adds; shape (5, n)."""
        powers = {
            (0, 0): np.ones(len(voltage)),
            (1, 0): voltage,
            (0, 1): temperature,
            (1, 1): voltage * temperature,
            (2, 0): voltage * voltage,
        }
        return np.array(
            [
                sum((float(c) * powers[term] for term, c in one.items()), np.zeros(len(voltage)))
                for one in self.deviations
            ]
        )

    def known_variance(self, voltage: Values, temperature: Values, uncertainty: Values) -> Values:
        """Return the variance in mm**2 that stated uncertainties leave of a measured clearance; shape (n,).

        `uncertainty`, of shape (3, n), has those of clearance, voltage and temperature in mm, V and degC, 0 where none
        is stated. The slopes are those of the type curve.
        """
        _, c_v, c_t, c_vt, c_vv = self.curve
        of_voltage = c_v + c_vt * temperature + 2 * c_vv * voltage
        of_temperature = c_t + c_vt * voltage
        u_d, u_v, u_t = uncertainty
        return np.asarray(u_d**2 + (of_voltage * u_v) ** 2 + (of_temperature * u_t) ** 2)

    def json(self) -> str:
        """Return the definition as JSON, as the store keeps it."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> SensorType:
        """Return the type that `json` gave `text` for.

        Raises
        ------
        ValueError, TypeError
            If the text is of no type.
        """
        found = json.loads(text)
        return cls(**found | {"curve": tuple(found["curve"])})


SYSTEMATIC_FACTOR = 3.0
"""The day's systematic error is `SensorType.systematic`, times or divided by this: one standard deviation."""


def _of(name: str, polynomial: Polynomial) -> SensorType:
    (c, c_t), (c_v, c_vt), (c_vv,) = (tuple(map(float, row)) for row in polynomial.coefficients)
    return SensorType(name=name, curve=(c, c_v, c_t, c_vt, c_vv))


SENSOR_TYPES = {one.name: one for one in (_of("equation_5a", EQUATION_5A), _of("equation_4", EQUATION_4))}
"""Built-in types: the paper's two regressions of its inductive sensor."""

DEFAULT_TYPE = "equation_5a"
"""Type of a sensor of which nothing else is said."""
