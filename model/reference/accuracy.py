"""Measures of accuracy: the paper's percentage, error statistics, signal to quantization noise ratio."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values


@dataclass(frozen=True)
class ErrorStatistics:
    """Statistics of an error signal, in the unit of the signal.

    Attributes
    ----------
    max_abs : float
        Largest magnitude.
    rms : float
        Root mean square.
    mean : float
        Mean: the systematic error.
    worst : int
        Index of the first sample with the largest magnitude, in the flattened signal.
    """

    max_abs: float
    rms: float
    mean: float
    worst: int


def accuracy_percent(measured: Values, truth: Values, reading: npt.NDArray[np.bool_] | None = None) -> float:
    """Return the accuracy by equation 7 of the paper: 100 % minus the mean percentage error.

    The error of one reading is ``|measured - truth| / |truth|``. The percentages in the paper's tables
    1, 2 and 4 are not comparable: they omit the division and are 100 times the error in mm.

    Parameters
    ----------
    measured, truth : ndarray, shape (n,) or (n, channels)
        Measured and true values in the same unit.
    reading : ndarray of bool, shape as these, optional
        Samples to include; all by default.

    Returns
    -------
    float
        Accuracy in per cent; 100 for no error, negative if the mean error is above 100 %.

    Raises
    ------
    ValueError
        If the shapes differ, no sample is included, or an included true value is zero.
    """
    _check_same_shape("truth", truth, measured)
    if reading is not None:
        _check_same_shape("reading", reading, measured)
        measured, truth = measured[reading], truth[reading]
    if not len(truth):
        raise ValueError("reading must mark at least one sample, not none")
    if not truth.all():
        raise ValueError("truth must differ from zero at every reading, not be 0")
    return 100.0 - 100.0 * float(np.mean(np.abs(measured - truth) / np.abs(truth)))


def error_statistics(error: Values) -> ErrorStatistics:
    """Return the statistics of an error signal of any shape.

    Raises
    ------
    ValueError
        If `error` has no sample.
    """
    if not error.size:
        raise ValueError("error must have at least one sample, not none")
    magnitude = np.abs(error)
    worst = int(np.argmax(magnitude))
    return ErrorStatistics(
        max_abs=float(magnitude.max()),
        rms=math.sqrt(float(np.mean(error**2))),
        mean=float(np.mean(error)),
        worst=worst,
    )


def sqnr_db(reference: Values, error: Values) -> float | None:
    """Return the signal to quantization noise ratio in dB, ``10 log10(sum reference**2 / sum error**2)``.

    Returns
    -------
    float or None
        None where the ratio is not finite: no error, or a reference of zeros only. JSON has no infinity.

    Raises
    ------
    ValueError
        If the shapes differ.
    """
    _check_same_shape("error", error, reference)
    signal, noise = float(np.sum(reference**2)), float(np.sum(error**2))
    if signal == 0.0 or noise == 0.0:
        return None
    return 10.0 * (math.log10(signal) - math.log10(noise))


def _check_same_shape(name: str, array: npt.NDArray[np.generic], like: npt.NDArray[np.generic]) -> None:
    if array.shape != like.shape:
        raise ValueError(f"{name} must be of shape {like.shape}, not {array.shape}")
