"""The calibration polynomial of two variables, ``d = sum a[i][j] V**i T**j``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values


@dataclass(frozen=True)
class Polynomial:
    """Clearance as a polynomial in voltage and temperature (equation 1 of the paper).

    Attributes
    ----------
    coefficients : tuple of tuple of Fraction
        ``coefficients[i][j]`` belongs to ``V**i * T**j``, in mm / (V**i degC**j) for the paper's sensors. Rows may
        differ in length; missing coefficients are zero. A polynomial in V alone has one coefficient per row.

    Raises
    ------
    ValueError
        If there is no row, or a row has no coefficient.
    TypeError
        If a coefficient is not a Fraction.
    """

    coefficients: tuple[tuple[Fraction, ...], ...]

    def __post_init__(self) -> None:
        if not self.coefficients:
            raise ValueError("coefficients must have at least one row, not none")
        for index, row in enumerate(self.coefficients):
            if not row:
                raise ValueError(f"coefficients[{index}] must have at least one coefficient, not none")
            for value in row:
                if not isinstance(value, Fraction):
                    raise TypeError(f"coefficients[{index}] must hold Fractions, not {value!r}")

    @classmethod
    def from_numbers(cls, rows: Sequence[Iterable[float | str | Fraction]]) -> Polynomial:
        """Return the polynomial with these `rows` of coefficients.

        A float means its exact binary value, a string its exact decimal value.
        """
        return cls(tuple(tuple(Fraction(value) for value in row) for row in rows))

    @property
    def orders(self) -> tuple[int, int]:
        """Highest powers (m, n) of the first and the second variable."""
        return len(self.coefficients) - 1, max(map(len, self.coefficients)) - 1

    def __call__(self, V: npt.ArrayLike, T: npt.ArrayLike = 0.0) -> Values:
        """Evaluate in double precision by Horner's rule, in `T` for each row, then in `V`.

        Parameters
        ----------
        V, T : array_like
            Values of the variables; their shapes must broadcast.

        Returns
        -------
        ndarray
            Values of the polynomial, of the broadcast shape.
        """
        v, t = np.broadcast_arrays(np.asarray(V, dtype=np.float64), np.asarray(T, dtype=np.float64))
        result = np.zeros(v.shape)
        for row in reversed(self.coefficients):
            inner = np.zeros(t.shape)
            for value in reversed(row):
                inner = inner * t + float(value)
            result = result * v + inner
        return result

    def exact(self, V: Fraction, T: Fraction = Fraction(0)) -> Fraction:
        """Evaluate exactly at one point."""
        return sum(
            (value * V**i * T**j for i, row in enumerate(self.coefficients) for j, value in enumerate(row)),
            Fraction(0),
        )


EQUATION_4 = Polynomial.from_numbers([["1.373", "-0.005041"], ["0.2082", "0.002771"], ["0.06928"]])
"""The paper's earlier regression, over 19.8 to 73 degC: clearance in mm from volts and degrees Celsius."""

EQUATION_5A = Polynomial.from_numbers([["1.16", "-0.0036"], ["0.3672", "0.0006618"], ["0.05812"]])
"""The paper's regression over 19.8 to 98 degC: clearance in mm from volts and degrees Celsius."""
