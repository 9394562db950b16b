"""The systematic error of a day as a Gaussian process over the clearance, by its values at a few nodes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property

import numpy as np

from sosmith.model.arithmetic.stacked_matrices import cholesky, product
from sosmith.model.arrays import Values

NODES_PER_LENGTH = 2
"""Nodes in one correlation length; cubic interpolation between them loses below 1 % of the standard deviation."""

BEYOND = 2.0
"""Correlation lengths that the nodes reach beyond the measurements, where nothing is left of what these told."""

_JITTER = 1e-9
"""Added to the variance of a node, against rounding."""


@dataclass(frozen=True)
class SystematicCurves:
    """Curves of unit standard deviation: squared exponential covariance ``exp(-(difference / correlation)**2 / 2)``.

    Attributes
    ----------
    low, high : float
        Clearances in mm that the measurements span.
    correlation : float
        Correlation length in mm.
    """

    low: float
    high: float
    correlation: float

    @property
    def spacing(self) -> float:
        """Distance of the nodes in mm."""
        return self.correlation / NODES_PER_LENGTH

    @cached_property
    def first(self) -> int:
        """Number of the first node, which is at ``first * spacing``."""
        return math.floor((self.low - BEYOND * self.correlation) / self.spacing) - 1

    @cached_property
    def count(self) -> int:
        """Number of nodes."""
        return math.ceil((self.high + BEYOND * self.correlation) / self.spacing) + 2 - self.first

    @cached_property
    def factor(self) -> Values:
        """Lower triangular factor of the covariance of the values at the nodes."""
        apart = np.abs(np.subtract.outer(np.arange(self.count), np.arange(self.count)))
        # The decimal module rounds the exponential correctly, so that it is the same everywhere.
        by_distance = np.array([float((-Decimal(k * k) / (2 * NODES_PER_LENGTH**2)).exp()) for k in range(self.count)])
        return cholesky(by_distance[apart] + _JITTER * np.eye(self.count))

    def columns(self, clearance: Values) -> Values:
        """Return the error at `clearance` (mm, shape (n,)) for each of the independent unit normal weights.

        Shape (count, n). Beyond the nodes, the value at the end counts.
        """
        position = np.clip(clearance / self.spacing - self.first, 1.0, self.count - 2.0)
        index = np.minimum(np.floor(position), self.count - 3.0)
        x = position - index
        # Keys's cubic convolution, a = -1/2
        weights = (
            ((-0.5 * x + 1.0) * x - 0.5) * x,
            (1.5 * x - 2.5) * x * x + 1.0,
            ((-1.5 * x + 2.0) * x + 0.5) * x,
            (0.5 * x - 0.5) * x * x,
        )
        rows, at = index.astype(np.int64), np.arange(len(clearance))
        between = np.zeros((self.count, len(clearance)))
        for k, weight in enumerate(weights, start=-1):
            between[rows + k, at] += weight
        return product(np.swapaxes(self.factor, 0, 1)[..., None], between[:, None])[:, 0]
