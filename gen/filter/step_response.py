"""Step response of second-order sections: overshoot and settling time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sosmith.gen.filter.response import Array, poles
from sosmith.model.arithmetic.recursive_filters import dc_gain, sosfilt

MAX_SAMPLES = 1 << 20
"""Longest response that is computed; a filter that is slower than that has none."""

SETTLED = 0.01
"""Tolerance of the settling time as engineers quote it, as a fraction of the step."""

_STEP = np.ones(1)
"""A step."""

_PASSES = 0.1
"""Least share of the peak that the end of a response must be; below, a constant is in the stopband, not in the
passband."""


@dataclass(frozen=True, eq=False, kw_only=True)
class StepResponse:
    """Response to a unit step from rest.

    Attributes
    ----------
    sample_rate : float
        Samples per second.
    values : ndarray, shape (n,)
        Output at each sample from the step on, until nothing is left to come that `precision` could tell.
    final : float
        Where it ends: the gain at zero frequency.
    """

    sample_rate: float
    values: Array
    final: float

    @property
    def scale(self) -> float:
        """Magnitude of the final value, or of the peak where a constant does not pass."""
        peak = float(np.max(np.abs(self.values)))
        return abs(self.final) if abs(self.final) > _PASSES * peak else peak

    @property
    def passes_constants(self) -> bool:
        """Whether the response ends at a value that stands beside its peak, and is not what a stopband leaves."""
        return self.scale == abs(self.final)

    @property
    def overshoot(self) -> float | None:
        """How far the response goes beyond its final value, as a fraction of that; None where constants do not pass."""
        if not self.passes_constants:
            return None
        return max(0.0, float(np.max(self.values / self.final)) - 1.0)

    def samples_to(self, tolerance: float) -> int:
        """Return the samples from which on the response stays within `tolerance` times `scale` of its final value.

        Examples
        --------
        The average of two samples is right from the second on.

        >>> step_response(np.array([[0.5, 0.5, 0.0, 1.0, 0.0, 0.0]]), 100.0, 1e-6).samples_to(0.01)
        1
        """
        outside = np.flatnonzero(np.abs(self.values - self.final) > tolerance * self.scale)
        return int(outside[-1]) + 1 if len(outside) else 0


def step_response(sos: Array, sample_rate: float, precision: float, entering: Array = _STEP) -> StepResponse | None:
    """Compute the step response of a filter until it is within a thousandth of `precision` of its end.

    Parameters
    ----------
    sos : ndarray, shape (n_sections, 2 * (order + 1))
        Sections with scipy's signs.
    sample_rate : float
        Sampling frequency in Hz.
    precision : float
        Smallest tolerance that will be asked for, above 0.
    entering : ndarray, shape (n,)
        What enters the filter from the step on, and then 1: the step response of what is before it.

    Returns
    -------
    StepResponse or None
        None for a filter that is unstable, or that takes more than `MAX_SAMPLES`.
    """
    radius = max((math.hypot(pole.real, pole.imag) for pole in poles(sos).tolist()), default=0.0)
    if radius >= 1:
        return None
    # a pole of multiplicity m decays later than a single one: n**(m-1) r**n, for which the factor makes room
    decay = 0.0 if radius == 0 else math.log(precision / 1000) / math.log(radius)
    samples = 8 + (sos.shape[1] // 2 - 1) * len(sos) + math.ceil(1.5 * decay) + len(entering) - 1
    if samples > MAX_SAMPLES:
        return None
    step = np.append(entering, np.ones(samples - len(entering)))
    values = sosfilt(sos / sos[:, sos.shape[1] // 2, np.newaxis], step)
    final = dc_gain(sos)
    return StepResponse(sample_rate=sample_rate, values=values, final=final)
