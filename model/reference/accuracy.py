"""Measures of accuracy: the paper's percentage, error statistics, signal to quantization noise ratio."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values

_BLOCK = 1 << 20


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
    share = np.subtract(measured, truth)
    share /= truth
    return 100.0 - 100.0 * float(np.mean(np.abs(share, out=share)))


def error_statistics(error: Values) -> ErrorStatistics:
    """Return the statistics of an error signal of any shape.

    Raises
    ------
    ValueError
        If `error` has no sample.
    """
    if not error.size:
        raise ValueError("error must have at least one sample, not none")
    flat = error.reshape(-1)
    worst = max((int(np.argmax(flat)), int(np.argmin(flat))), key=lambda k: (abs(flat[k]), -k))
    return ErrorStatistics(
        max_abs=float(abs(flat[worst])),
        rms=math.sqrt(sum_of_squares(error) / error.size),
        mean=float(np.mean(error)),
        worst=worst,
    )


def peak(values: Values) -> float:
    """Return the largest magnitude of values of any shape, without an array of all magnitudes."""
    return float(max(np.max(values), -np.min(values)))


def sum_of_squares(values: Values) -> float:
    """Return the sum of the squares of values of any shape, of a block at a time."""
    flat = values.reshape(-1)
    return math.fsum(float(np.sum(flat[k : k + _BLOCK] ** 2)) for k in range(0, len(flat), _BLOCK))


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
    signal, noise = sum_of_squares(reference), sum_of_squares(error)
    if signal == 0.0 or noise == 0.0:
        return None
    return 10.0 * (math.log10(signal) - math.log10(noise))


def _check_same_shape(name: str, array: npt.NDArray[np.generic], like: npt.NDArray[np.generic]) -> None:
    if array.shape != like.shape:
        raise ValueError(f"{name} must be of shape {like.shape}, not {array.shape}")
