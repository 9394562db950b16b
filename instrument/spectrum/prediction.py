"""Predicts the error at a filter's output from its response and the spectra of wanted signal and disturbance."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import signal

from sosmith.gen.filter.design import Filter
from sosmith.instrument.spectrum.spectra import Array, Spectrum


@dataclass(frozen=True, eq=False, kw_only=True)
class Content:
    """Spectra of the wanted part and the disturbance of one signal.

    Attributes
    ----------
    name : str
        File and signal.
    wanted : Spectrum or None
        Spectrum of the part to pass; None for motion, which is all disturbance.
    disturbance : Spectrum
        Spectrum of the part to suppress.
    has_truth : bool
        Whether a true signal separated the two, rather than frequency.
    slow : float
        Rms of the disturbance below the resolution of the spectra, which counts as passed.
    """

    name: str
    wanted: Spectrum | None
    disturbance: Spectrum
    has_truth: bool
    slow: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Error at the filter's output, from its response and the spectra of one signal, in the signal's unit.

    Attributes
    ----------
    name : str
        File and signal.
    wanted : float
        Rms change of the wanted signal by the filter, apart from the delay at zero frequency.
    disturbance : float
        Rms of the remaining disturbance.
    slow : float
        Rms of the disturbance below the resolution of the spectra, assumed to pass unchanged.
    unfiltered : float
        Rms of the disturbance before the filter.
    """

    name: str
    wanted: float
    disturbance: float
    slow: float
    unfiltered: float

    @property
    def rms(self) -> float:
        """Rms of all three errors, assumed to be uncorrelated."""
        return math.hypot(self.wanted, self.disturbance, self.slow)


def told_apart(name: str, measured: Spectrum, passband: float) -> Content:
    """Content of a measured signal without truth: wanted up to `passband` in Hz, disturbance above."""
    below = measured.frequency <= passband
    wanted = replace(measured, density=np.where(below, measured.density, 0.0))
    disturbance = replace(measured, density=np.where(below, 0.0, measured.density))
    return Content(name=name, wanted=wanted, disturbance=disturbance, has_truth=False)


def band_rms(spectrum: Spectrum, first: int, last: int | None = None) -> float:
    """Rms over the frequencies with indices from `first` up to but excluding `last`; zero frequency is left out."""
    return float(np.sqrt(np.sum(spectrum.density[max(first, 1) : last]) * spectrum.step))


def response(made: Filter, frequency: Array) -> npt.NDArray[np.complex128]:
    """Frequency response of a filter at `frequency` in Hz, shape (n,)."""
    _, values = signal.sosfreqz(made.sos, worN=2 * np.pi * frequency / made.sample_rate)
    return np.asarray(values, dtype=np.complex128)


def predict(content: Content, made: Filter, delay: float) -> Prediction:
    """Integrate the filtered spectra; the wanted signal at the output is compared with itself delayed by `delay`."""

    def rms(spectrum: Spectrum | None, delayed: bool) -> float:
        if spectrum is None:
            return 0.0
        gain = response(made, spectrum.frequency)
        if delayed:
            gain = gain * np.exp(2j * np.pi * spectrum.frequency * delay) - 1
        return band_rms(replace(spectrum, density=spectrum.density * np.abs(gain) ** 2), 0)

    return Prediction(
        name=content.name,
        wanted=rms(content.wanted, delayed=True),
        disturbance=rms(content.disturbance, delayed=False),
        slow=content.slow,
        unfiltered=content.disturbance.rms,
    )
