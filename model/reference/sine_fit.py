"""Distortion and noise of a sine: what is left of a signal when the sine that fits it best is taken away."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values

LEAST_PERIODS = 4
"""Periods of the sine below which nothing is measured."""


@dataclass(frozen=True)
class SineFit:
    """A sine in a signal.

    Attributes
    ----------
    amplitude : float
        Amplitude of the sine that fits best, in the unit of the signal.
    thd_n_db : float or None
        Total harmonic distortion and noise in dB; None if nothing is left beside the sine, or there is none.
    """

    amplitude: float
    thd_n_db: float | None


def sine_fit(values: npt.NDArray[np.number], frequency: float, sample_rate: float) -> SineFit | None:
    """Fit ``a cos(2 pi f t) + b sin(2 pi f t) + c`` by least squares, and measure what it leaves.

    This is the three-parameter fit of IEEE Std 1057. THD+N is the effective value of the residue over that of the
    sine, ``20 log10(rms(values - fit) / (sqrt(a**2 + b**2) / sqrt(2)))``: the inverse of SINAD of IEEE Std 1241, from
    zero to half the sample rate without a weighting.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The signal, integer codes or numbers; computed in double precision.
    frequency : float
        Frequency of the sine in Hz.
    sample_rate : float
        Samples per second.

    Returns
    -------
    SineFit or None
        None for fewer than `LEAST_PERIODS` periods, or fewer than 16 samples.
    """
    if len(values) < 16 or len(values) * frequency < LEAST_PERIODS * sample_rate:
        return None
    signal = values.astype(np.float64)
    phase = 2 * np.pi * (np.arange(len(signal)) * (frequency / sample_rate) % 1.0)
    basis = np.stack([np.cos(phase), np.sin(phase), np.ones(len(signal))], axis=1)
    weights: Values = np.linalg.lstsq(basis, signal, rcond=None)[0]
    signal -= basis @ weights
    amplitude, left = math.hypot(float(weights[0]), float(weights[1])), float(np.sqrt(np.mean(signal**2)))
    return SineFit(amplitude, 20 * math.log10(left * math.sqrt(2) / amplitude) if left and amplitude else None)
