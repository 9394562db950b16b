"""Windowed spectra by Welch's method: density, amplitude, and confidence interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import signal, stats

from sosmith.instrument.spectrum.settings import SpectrumSettings
from sosmith.model.errors import SpecificationError

Array = npt.NDArray[np.float64]

SEGMENTS = 8
"""Default number of segments, without overlap, that a signal is divided into: 15 averages at 50 % overlap."""

MIN_SEGMENT = 16
"""Smallest number of samples in a segment."""

FINER = 8
"""Amplitudes are also known at an eighth of the frequency step: a sine wave between two of these loses 0.3 % at most
(1.2 % with the window boxcar), where one between two of the steps loses up to 15 % (36 %)."""

_TRENDS = {"linear": 1, "constant": 0, "none": None}
"""Degrees of the trends of the settings."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Spectrum:
    """Spectrum of a signal in a unit U; all arrays have shape (n,).

    Attributes
    ----------
    frequency : ndarray
        Hz, even steps from 0 to half the sample rate.
    density : ndarray
        One-sided power spectral density, U**2/Hz; 0 at zero frequency if a mean or a line was subtracted. The sum
        over a band times `step` is the mean square in the band.
    sides : ndarray of int
        2 where the density includes a negative frequency, 1 at zero and at half the sample rate.
    amplitude : ndarray
        Amplitude of a sine wave at that frequency, U; at half the sample rate, that of samples of alternating sign;
        at zero frequency, the mean.
    fine_amplitude : ndarray, shape (FINER (n - 1) + 1,) or one less
        The same at the frequencies ``k step / FINER``.
    leakage : ndarray
        Amplitude that a sine wave of amplitude 1 shows, at most, ``k step / FINER`` or more away from its frequency.
    detrended : ndarray
        Amplitude, at most, at those frequencies of what detrending leaves of waves of about a cycle in a segment.
    averages : int
        Number of segments.
    degrees_of_freedom : float
        Degrees of freedom of the chi-square distribution of a noise density, 2 for each independent segment.
    lower, upper : float
        Confidence limits of a noise density, as multiples of the estimate, at the confidence of the settings.
    """

    frequency: Array
    density: Array
    sides: npt.NDArray[np.int64]
    amplitude: Array
    fine_amplitude: Array
    leakage: Array
    detrended: Array
    averages: int
    degrees_of_freedom: float
    lower: float
    upper: float

    @property
    def step(self) -> float:
        """Spacing of the frequencies, Hz: the inverse of a segment's length."""
        return float(self.frequency[1])

    @property
    def rms(self) -> float:
        """Root mean square over all frequencies except zero, U."""
        return float(np.sqrt(np.sum(self.density[1:]) * self.step))


def segment_length(count: int, sample_rate: float, settings: SpectrumSettings) -> int:
    """Count the samples of a segment of a signal of `count` samples.

    Raises
    ------
    SpecificationError
        If there are too few, or more than in the signal.
    """
    if settings.segment is None:
        return max(count // SEGMENTS, MIN_SEGMENT)
    length = round(settings.segment * sample_rate)
    if not MIN_SEGMENT <= length <= count:
        raise SpecificationError(
            f"segment must be {MIN_SEGMENT / sample_rate:.4g} to {count / sample_rate:.4g} s "
            f"({MIN_SEGMENT} to {count} samples), not {settings.segment:g} s"
        )
    return length


def spectrum(values: Array, sample_rate: float, settings: SpectrumSettings) -> Spectrum:
    """Estimate the spectrum of `values`, shape (n,), sampled at `sample_rate` in Hz.

    Welch's method (P. D. Welch, IEEE Trans. Audio Electroacoust. AU-15, 1967): the mean of the windowed periodograms
    of overlapping segments.

    Raises
    ------
    SpecificationError
        If the segment does not fit the signal.
    """
    length = segment_length(len(values), sample_rate, settings)
    overlap = min(int(settings.overlap * length), length - 1)
    window = signal.get_window(settings.window, length)
    detrend = _TRENDS[settings.detrend]
    common = {
        "fs": sample_rate,
        "window": window,
        "noverlap": overlap,
        "detrend": lambda segments: segments - trend(segments, detrend),
    }
    frequency, density = signal.welch(values, scaling="density", **common)
    if detrend is not None:
        density[0] = 0.0  # but for a residue
    _, fine = signal.welch(values, scaling="spectrum", nfft=FINER * length, **common)
    fine_amplitude = np.sqrt(_sides(len(fine), FINER * length) * fine)
    averages = 1 + (len(values) - length) // (length - overlap)
    freedom = degrees_of_freedom(window, length - overlap, averages)
    tail = (1 - settings.confidence) / 2
    return Spectrum(
        frequency=frequency,
        density=density,
        sides=_sides(len(frequency), length),
        amplitude=np.sqrt(_sides(len(frequency), length) * fine[::FINER]),
        fine_amplitude=fine_amplitude,
        leakage=_leakage(window),
        detrended=_detrended(values, window, length - overlap, detrend),
        averages=averages,
        degrees_of_freedom=freedom,
        lower=float(freedom / stats.chi2.ppf(1 - tail, freedom)),
        upper=float(freedom / stats.chi2.ppf(tail, freedom)),
    )


def _sides(count: int, length: int) -> npt.NDArray[np.int64]:
    sides = np.full(count, 2)
    sides[[0, -1] if length % 2 == 0 else [0]] = 1
    return sides


def _leakage(window: Array) -> Array:
    """Magnitude of the window's transform relative to its peak, at most, from each frequency on."""
    transform = np.abs(np.fft.rfft(window, FINER * len(window))) / np.sum(window)
    return np.maximum.accumulate(transform[::-1])[::-1]


def _detrended(values: Array, window: Array, step: int, degree: int | None) -> Array:
    """Amplitude, at most, from each frequency on, of what lines leave that were taken off segments and are not alike.

    A steady trend has one slope in all segments, and leaves nothing. Means and slopes that differ are those of waves of
    about a cycle in a segment, and what was taken off in vain is in the spectrum.
    """
    count = len(window)
    segments = np.lib.stride_tricks.sliding_window_view(values, count)[::step]
    lines = trend(segments, degree)
    slope, middle = (lines[:, -1] - lines[:, 0]) / (count - 1), (lines[:, -1] + lines[:, 0]) / 2
    middle = signal.detrend(middle)  # a steady trend moves it steadily
    time = np.arange(count) - (count - 1) / 2
    left = np.zeros(FINER * count // 2 + 1)
    for spread, shape in ((np.std(middle), np.ones(count)), (np.std(slope), time)):
        left += 2 * spread * np.abs(np.fft.rfft(window * shape, FINER * count)) / np.sum(window)
    return np.maximum.accumulate(left[::-1])[::-1]


def trend(segments: Array, degree: int | None, *, power: int = 2) -> Array:
    """Fit a constant or a line to each segment, shape (..., n), by least squares weighted by a power of a Hann window.

    A line that is fitted without weights takes a slope of up to 6 A / (pi k) from a sine wave with k cycles in the
    segment, and subtracting that leaves a line in the spectrum that is not in the signal. With weights that fall to
    zero, the slope of a sine wave falls with the power ``2 power + 1`` of k, next to nothing from four cycles on.
    A higher power takes more of the noise for a trend: fitted lines of white noise have a mean square of 2 / n of its
    own without weights, 3.3 / n with the first power, 6.5 / n with the second.

    Parameters
    ----------
    degree : int or None
        0 for a constant, 1 for a line; None for no trend, which is 0 throughout.
    power : int
        At least 0, which is no weights.

    Returns
    -------
    ndarray, shape (..., n)
    """
    if degree is None:
        return np.zeros_like(segments)
    count = segments.shape[-1]
    weights = signal.get_window("hann", count) ** power
    weights = weights / np.sum(weights)
    mean = np.sum(weights * segments, axis=-1, keepdims=True)
    if degree == 0:
        return np.broadcast_to(mean, segments.shape)
    time = np.arange(count) - np.sum(weights * np.arange(count))
    slope = np.sum(weights * time * segments, axis=-1, keepdims=True) / np.sum(weights * time**2)
    line: Array = mean + slope * time
    return line


def slow_rms(values: Array, length: int) -> float:
    """Rms, about the total mean, of the lines fitted to segments of `length` samples of `values`, shape (n,).

    This is the slow part of `values` that spectra of such segments cannot resolve and that detrending removes.
    """
    count = len(values) // length
    cut = (values - np.mean(values))[: count * length].reshape(count, length)
    return float(np.sqrt(np.mean(trend(cut, 1, power=1) ** 2)))


def degrees_of_freedom(window: Array, step: int, averages: int) -> float:
    """Equivalent degrees of freedom of a mean of `averages` periodograms, `step` samples apart.

    ``2 K / (1 + 2 sum_m (1 - m / K) rho_m**2)`` with ``rho_m`` the correlation of the window with itself, shifted by m
    steps (Welch 1967; D. B. Percival and A. T. Walden, Spectral Analysis for Physical Applications, 1993, eq. 292b).

    Examples
    --------
    Segments that do not overlap are independent, with two degrees of freedom each.

    >>> degrees_of_freedom(np.ones(8), 8, 5)
    10.0
    """
    length, energy = len(window), float(np.sum(window**2))
    variance = 1.0
    for m in range(1, averages):
        if m * step >= length:
            break
        rho = float(np.sum(window[m * step :] * window[: length - m * step])) / energy
        variance += 2 * (1 - m / averages) * rho**2
    return 2 * averages / variance
