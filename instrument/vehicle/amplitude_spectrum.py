"""Amplitude spectra of motions: how much of each frequency a record holds."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def amplitude_spectrum(values: Array, sample_rate: float) -> tuple[Array, Array]:
    """One-sided amplitude spectrum by the Fourier transform of the whole record, without a window.

    Parameters
    ----------
    values : ndarray, shape (n,) or (n, k)
        A motion, or several.
    sample_rate : float
        In Hz.

    Returns
    -------
    frequency : ndarray, shape (n // 2 + 1,)
        In Hz.
    amplitude : ndarray, shape (n // 2 + 1,) or (n // 2 + 1, k)
        Of the sine wave at each frequency, in the unit of `values`; at 0 Hz the mean's magnitude.
    """
    n = len(values)
    spectrum = np.fft.rfft(values, axis=0)
    amplitude = 2 / n * np.hypot(spectrum.real, spectrum.imag)
    amplitude[0] /= 2
    if n % 2 == 0:
        amplitude[-1] /= 2
    return sample_rate / n * np.arange(n // 2 + 1, dtype=np.float64), amplitude


def ripple(values: Array, sample_rate: float, frequency: float) -> float:
    """Amplitude at one frequency in Hz, up to half the sample rate, of a motion of shape (n,)."""
    n = len(values)
    angle = 2 * math.pi * frequency / sample_rate * np.arange(n)
    sides = 1 if frequency in (0, sample_rate / 2) else 2
    return sides / n * math.hypot(float(np.sum(np.cos(angle) * values)), float(np.sum(np.sin(angle) * values)))


def attenuation(delta: float) -> float:
    """Stop-band attenuation in dB for a ripple, -20 log10(delta); infinite for none."""
    return -20 * math.log10(delta) if delta > 0 else math.inf
