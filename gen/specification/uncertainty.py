"""What a specification says about the uncertainty of the instrument, and of its calibration's coefficients.

These are the tables ``[uncertainty]`` and ``[calibration.uncertainty]``; the hardware does not depend on them.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from sosmith.gen.specification.values import UnfitError

if TYPE_CHECKING:
    from sosmith.gen.specification.schema import CalibrationTable

Rows = tuple[tuple[Fraction, ...], ...]
Pair = tuple[Fraction, Fraction]


@dataclass(frozen=True, kw_only=True)
class UncertaintySpec:
    """What is known of the instrument's errors; None for what is not stated.

    Attributes
    ----------
    noise : Fraction or None
        Broadband noise of the voltage in V rms.
    temperature : Fraction or None
        Standard uncertainty of the indicated temperature in degC: thermocouple, cold junction and their converter.
    voltage : Fraction or None
        Limits of error of the voltage's converter in V: the error is at most this, up or down.
    clearance_rate : Fraction or None
        Fastest change of the clearance that is to be followed, in the output's unit per second, up or down.
    motion : tuple of (Fraction, Fraction)
        Motion that is not wanted in the clearance: frequency in Hz and amplitude in the output's unit.
    """

    noise: Fraction | None
    temperature: Fraction | None
    voltage: Fraction | None
    clearance_rate: Fraction | None
    motion: tuple[Pair, ...]


@dataclass(frozen=True, kw_only=True)
class CoefficientsSpec:
    """What the coefficients of a calibration are worth, as `sosmith calibrate export` writes it.

    Attributes
    ----------
    covariance : tuple of tuple of Fraction
        Covariance of the coefficients, row by row of the table: n rows of n numbers.
    freedom, systematic_freedom : Fraction or None
        Degrees of freedom; None for infinitely many.
    systematic : Fraction
        Standard uncertainty of what no coefficient has, in the output's unit.
    voltage, temperature : tuple of Fraction
        Lowest and highest that the calibration was made at, in V and degC.
    """

    covariance: Rows
    freedom: Fraction | None
    systematic: Fraction
    systematic_freedom: Fraction | None
    voltage: Pair
    temperature: Pair


def check_coefficients(table: CalibrationTable) -> None:
    """Check that the covariance fits the coefficients.

    Raises
    ------
    UnfitError
        If there are no coefficients, or it is no covariance of so many numbers.
    """
    if table.uncertainty is None:
        return
    where = "calibration.uncertainty"
    if table.coefficients is None:
        raise UnfitError("left out with data, whose own uncertainty counts", "given", where=where)
    count = sum(map(len, table.coefficients))
    rows = table.uncertainty.covariance
    if len(rows) != count or any(len(row) != count for row in rows):
        shape = f"{len(rows)} of {', '.join(sorted({str(len(row)) for row in rows}))}"
        raise UnfitError(
            f"{count} rows of {count} numbers, one for each coefficient", shape, where=f"{where}.covariance"
        )
    for i in range(count):
        for j in range(i + 1):
            if rows[i][j] != rows[j][i] or rows[i][j] ** 2 > rows[i][i] * rows[j][j] or rows[i][i] < 0:
                raise UnfitError(
                    "symmetric, with no correlation above 1",
                    f"{float(rows[i][j]):g} and {float(rows[j][i]):g} at [{i}][{j}] and [{j}][{i}]",
                    where=f"{where}.covariance",
                )
