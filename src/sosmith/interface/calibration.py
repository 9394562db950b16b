"""A calibration polynomial fitted to reference measurements."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.gen.calibration.acceptance import REQUIRED_R
from sosmith.gen.calibration.fit import Fit, Measurements, fit, read_measurements, residuals
from sosmith.gen.facts.table import Table, View
from sosmith.gen.specification.toml_text import toml_text
from sosmith.instrument.calibration.calibration_tables import fit_facts
from sosmith.instrument.calibration.uncertainty import Uncertainty, of_polynomial
from sosmith.interface.quantity import Quantity
from sosmith.model.errors import SpecificationError


@dataclass(frozen=True, eq=False)
class Calibration(View):
    """The smallest polynomial of voltage and temperature that fits measured clearances to the required accuracy.

    Examples
    --------
    >>> import numpy as np, sosmith
    >>> voltage, temperature = np.meshgrid(np.linspace(0, 10, 8), np.linspace(20, 90, 5))
    >>> clearance = 1.2 + 0.4 * voltage + 0.06 * voltage**2 - 0.003 * temperature
    >>> calibration = sosmith.Calibration.fit(voltage, temperature, clearance, required_r=0.9999)
    >>> calibration.orders
    (2, 1)
    >>> calibration(5.0, 50.0).round(6).item()
    4.55
    >>> calibration.half_width(5.0, 50.0).item() < 0.001  # mm, 95 % interval of a reading
    True
    >>> spec = sosmith.Specification.example().replaced(calibration=calibration.table())
    """

    fitted: Fit = field(repr=False)
    """Exact coefficients as fractions, and the orders rejected before."""
    measurements: Measurements = field(repr=False)
    """The measurements that it is fitted to."""

    @classmethod
    def fit(
        cls,
        voltage: npt.ArrayLike,
        temperature: npt.ArrayLike,
        clearance: npt.ArrayLike,
        *,
        required_r: float = REQUIRED_R,
        robust: bool = False,
    ) -> Calibration:
        """Fit measurements: the orders are raised until the adjusted correlation coefficient is high enough.

        Parameters
        ----------
        voltage, temperature, clearance : array_like, all of the same shape
            In V, degC and mm; clearances must not be negative.
        required_r : float
            Required adjusted r, from 0 to below 1.
        robust : bool
            Give outliers less weight (Huber).

        Raises
        ------
        SpecificationError
            If the measurements do not determine a polynomial, or no polynomial is good enough.
        """
        if not 0 <= required_r < 1:
            raise SpecificationError(f"required_r must be 0 or more and less than 1, not {required_r:g}")
        try:
            d, v, T = (np.asarray(values, dtype=np.float64) for values in (clearance, voltage, temperature))
        except (TypeError, ValueError):
            raise SpecificationError("voltage, temperature and clearance must be numbers, not something else") from None
        if not d.shape == v.shape == T.shape:
            raise SpecificationError(
                f"voltage, temperature and clearance must have one shape, not {v.shape}, {T.shape} and {d.shape}"
            )
        try:
            measurements = Measurements(d.ravel(), v.ravel(), T.ravel())
        except ValueError as error:
            raise SpecificationError(str(error)) from None
        return cls(fit(measurements, required_r, robust=robust), measurements)

    @classmethod
    def load(cls, path: str | PathLike[str], *, required_r: float = REQUIRED_R, robust: bool = False) -> Calibration:
        """Fit the measurements of a CSV file with the columns clearance_mm, voltage_V and temperature_C.

        Parameters and errors are those of `fit`.
        """
        measurements = read_measurements(Path(fspath(path)))
        return cls.fit(
            measurements.voltage,
            measurements.temperature,
            measurements.clearance,
            required_r=required_r,
            robust=robust,
        )

    @property
    def orders(self) -> tuple[int, int]:
        """Highest powers of voltage and of temperature."""
        return self.fitted.orders

    @property
    def coefficients(self) -> list[list[float]]:
        """Coefficients ``a[i][j]`` of ``voltage**i * temperature**j``, in mm, V and degC."""
        return [[float(value) for value in row] for row in self.fitted.polynomial.coefficients]

    @property
    def adjusted_r(self) -> float:
        """Adjusted correlation coefficient."""
        return self.fitted.adjusted_r

    @property
    def residual(self) -> npt.NDArray[np.float64]:
        """Measured minus computed clearance in mm, one element per measurement."""
        return residuals(self.measurements, self.fitted.polynomial)

    @property
    def rms(self) -> Quantity:
        """Root mean square of `residual`."""
        return Quantity(self.fitted.rms, "mm")

    @cached_property
    def _uncertainty(self) -> Uncertainty:
        return of_polynomial(self.measurements, self.fitted)

    @property
    def warning(self) -> str:
        """A sentence if the residuals follow a curve that the polynomial misses, else empty."""
        return self._uncertainty.lack.warning

    def half_width(self, voltage: npt.ArrayLike, temperature: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return the half-width in mm of the 95 % interval of a reading's clearance; shapes are broadcast.

        It is that of the calibration alone: the standard error of the curve, and what the curve misses if the residuals
        follow a curve.
        """
        V, T = np.broadcast_arrays(np.asarray(voltage, dtype=np.float64), np.asarray(temperature, dtype=np.float64))
        return self._uncertainty.half_width(V.ravel(), T.ravel()).reshape(V.shape)

    @property
    def covered(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest measured "voltage" in V and "temperature" in degC."""
        return dict(zip(("voltage", "temperature"), self.fitted.covered, strict=True))

    def __call__(self, voltage: npt.ArrayLike, temperature: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return the clearance in mm; shapes are broadcast."""
        return self.fitted.polynomial(voltage, temperature)

    def table(self) -> dict[str, Any]:
        """Return the table ``[calibration]`` of a specification."""
        return {"coefficients": self.coefficients}

    def toml(self) -> str:
        """Return the table ``[calibration]`` as the text of a TOML file."""
        return toml_text({"calibration": self.table()})

    def tables(self) -> list[Table]:
        """Return its figures in words."""
        largest = float(abs(self.residual).max())
        facts = fit_facts(self.fitted, len(self.measurements.clearance), largest, self._uncertainty)
        return [Table("Calibration", facts)]

    def __repr__(self) -> str:
        m, n = self.orders
        return f"<sosmith.Calibration: orders {m} and {n}, adjusted r {self.adjusted_r:.4f}, rms {self.rms}>"
