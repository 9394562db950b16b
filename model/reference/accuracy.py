"""Measures of accuracy: the paper's percentage, statistics of an error, signal to error ratio."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Values


@dataclass(frozen=True)
class ErrorStatistics:
    """Statistics of an error signal, all in its own unit.

    Attributes
    ----------
    max_abs : float
        Largest magnitude.
    rms : float
        Root mean square.
    mean : float
        Mean, the systematic part.
    worst : int
        Index of the first sample with the largest magnitude, in the order of the flattened signal.
    """

    max_abs: float
    rms: float
    mean: float
    worst: int


def accuracy_percent(measured: Values, truth: Values, reading: npt.NDArray[np.bool_] | None = None) -> float:
    """Accuracy by equation 7 of the paper: 100 % minus the mean percentage error.

    The error of one reading is ``|measured - truth| / |truth|``. The percentages printed in the paper's
    tables 1, 2 and 4 are not comparable: they leave out the division and are 100 times the error in mm.

    Parameters
    ----------
    measured, truth : ndarray, shape (n,) or (n, channels)
        Measured and true values in the same unit.
    reading : ndarray of bool, shape as these, optional
        The samples that count; without it all of them.

    Returns
    -------
    float
        Per cent; 100 without any error, negative if the mean error is above 100 %.

    Raises
    ------
    ValueError
        If the shapes differ, no sample counts, or the true value of one that counts is zero.
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
    """Statistics of the error signal `error` of any shape.

    Raises
    ------
    ValueError
        If it has no sample.
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
    """Signal to quantization noise ratio in dB, ``10 log10(sum reference**2 / sum error**2)``.

    Returns
    -------
    float or None
        None where the ratio is not finite: no error at all, or a reference of nothing but zeros.
        JSON has no infinity.

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
