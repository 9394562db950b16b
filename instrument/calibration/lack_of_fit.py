"""Whether residuals are pure scatter, or follow a curve that the fit misses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sosmith.model.arrays import Values

STRUCTURE = 3.5
"""Von Neumann's ratio of pure scatter is this many standard deviations below its mean once in 4,000 fits."""


@dataclass(frozen=True)
class LackOfFit:
    """Residuals split into what neighbours share and what they do not.

    Measurements that follow each other in voltage, or in temperature, are repetitions as far as the curve is concerned.
    The differences of neighbouring residuals therefore show the pure scatter, and von Neumann's ratio, the mean square
    of the differences over the variance of all residuals, is 2 on average. A curve that the fit misses lowers it.

    Attributes
    ----------
    along : str
        "voltage" or "temperature": the order in which the residuals are less like pure scatter.
    pure : float
        Pure scatter in mm rms, from the differences of neighbours.
    missed : float
        What the fit misses in mm rms: the rest of the residuals.
    score : float
        Standard deviations by which the ratio is below 2.
    """

    along: str
    pure: float
    missed: float
    score: float

    @property
    def structured(self) -> bool:
        """Whether the residuals follow a curve beyond doubt."""
        return self.score > STRUCTURE

    @property
    def warning(self) -> str:
        """A sentence if the residuals are structured, else empty."""
        if not self.structured:
            return ""
        return (
            f"the residuals follow a curve along the {self.along} of about {self.missed:.2g} mm rms that the fit "
            f"misses: neighbours differ by a scatter of {self.pure:.2g} mm rms only"
        )


def lack_of_fit(residual: Values, voltage: Values, temperature: Values) -> LackOfFit:
    """Judge residuals in mm, shape (n,) with n at least 4.

    von Neumann, Ann. Math. Stat. 12 (1941) 367: for n normal residuals, half the ratio has the mean 1 and the variance
    ``(n - 2) / (n**2 - 1)``.
    """
    found = [
        _along("voltage", residual[np.lexsort((temperature, voltage))]),
        _along("temperature", residual[np.lexsort((voltage, temperature))]),
    ]
    return max(found, key=lambda one: one.score)


def _along(name: str, residual: Values) -> LackOfFit:
    count = len(residual)
    off = residual - math.fsum(residual) / count
    variance = math.fsum(off**2) / (count - 1)
    pure = math.fsum(np.diff(residual) ** 2) / (2 * (count - 1))
    if not variance:
        return LackOfFit(name, 0.0, 0.0, 0.0)
    score = (1.0 - pure / variance) / math.sqrt((count - 2) / (count**2 - 1))
    return LackOfFit(name, math.sqrt(pure), math.sqrt(max(variance - pure, 0.0)), score)
