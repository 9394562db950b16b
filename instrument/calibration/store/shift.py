"""How far a sensor now reads from what its calibration before says."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from sosmith.gen.calibration.fit import Measurements, residuals
from sosmith.instrument.calibration.measurement_store import Version
from sosmith.instrument.calibration.uncertainty import SHARE
from sosmith.model.arrays import Values


@dataclass(frozen=True)
class Shift:
    """What measurements say of an earlier version.

    Attributes
    ----------
    version : int
        Its number.
    date : str
        Its date.
    count : int
        Measurements where it is calibrated.
    mean : float
        Readings by that version minus measured clearances, in mm: positive if the sensor now reads too much.
    half_width : float
        Half-width in mm of the 95 % interval of `mean`, from the scatter of these measurements alone; infinite for one.
    """

    version: int
    date: str
    count: int
    mean: float
    half_width: float

    @property
    def sentence(self) -> str:
        """The same in words."""
        way = "more" if self.mean > 0 else "less"
        return (
            f"the sensor reads {abs(self.mean):.3g} mm {way} than by version {self.version} of {self.date}, "
            f"±{self.half_width:.2g} mm"
        )


def where_calibrated(version: Version, known: Measurements, added: Measurements) -> Values:
    """Return for which added measurements a version, fitted to those known, holds.

    A version by the paper's rule holds between the voltages and temperatures that were measured. A Bayesian one goes on
    beyond them as its type does.
    """
    if version.method != "paper":
        return np.ones(len(added), dtype=np.bool_)
    limits = zip((added.voltage, added.temperature), known.covered, strict=True)
    return np.asarray(np.logical_and.reduce([(low <= values) & (values <= high) for values, (low, high) in limits]))


def shift_from(version: Version, known: Measurements, added: Measurements) -> Shift | None:
    """Return the shift of added measurements from a version; None if none of them is where it is calibrated.

    Parameters
    ----------
    version : Version
        The version, fitted to `known`.
    known, added : Measurements
        What was measured before, and what was added.
    """
    off = -residuals(added.of(where_calibrated(version, known, added)), version.polynomial)
    count = len(off)
    if not count:
        return None
    mean = math.fsum(off) / count
    half_width = math.inf
    if count > 1:
        deviation = math.sqrt(math.fsum((off - mean) ** 2) / (count - 1))
        half_width = float(special.stdtrit(count - 1, (1 + SHARE) / 2)) * deviation / math.sqrt(count)
    return Shift(version.number, version.date, count, mean, half_width)
